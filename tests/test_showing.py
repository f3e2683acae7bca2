"""How results show themselves, whatever study they are of."""

from __future__ import annotations

import pytest

import drillctl
from drillctl.errors import InputError

DESIGN = "monteiro-trindade-140kn"


@pytest.fixture(scope="module")
def modes():
    return drillctl.modes(drillctl.load(DESIGN))


def test_ten_lines_and_the_units_of_the_design():
    field = drillctl.load(DESIGN, units="field")
    lines = repr(drillctl.loop(field)).splitlines()
    assert len(lines) == 10
    assert lines[0] == "LoopAnalysis: Monteiro & Trindade 2012, 140 kN"
    assert any("klbf ft" in line for line in lines)
    assert lines[-1] == "and 2 more rows: .summary(), .plot()"


def test_a_picture_is_asked_for_by_its_name(modes):
    first, other = modes.plot(), modes.plot("friction")
    assert [ax.get_xlabel() for ax in first.axes] != [ax.get_xlabel() for ax in other.axes]
    with pytest.raises(InputError, match="no picture 'bod'; did you mean 'bode'"):
        modes.plot("bod")


def test_a_table_of_arrays_that_share_their_dimensions(modes):
    found = modes.to_dataframe("free_free_mode")
    assert list(found.columns) == ["free_free_frequency", "free_free_damping_ratio"]
    assert found.attrs["units"]["free_free_frequency"] == "Hz"
    with pytest.raises(InputError, match="no arrays over mode; there are: free_free_mode"):
        modes.to_dataframe("mode")


def test_what_has_neither_picture_nor_array_says_so():
    law = drillctl.export(drillctl.load(DESIGN))
    for ask in (law.plot, law.to_dataframe):
        with pytest.raises(InputError, match="a result of export has no"):
            ask()
    assert "proportional gain" in law._repr_html_()
    assert "<img" not in law._repr_html_()


def test_titles_of_a_user_are_no_markup():
    law = drillctl.export(drillctl.load(DESIGN, title="<b>& 'x'"))
    assert "<b>" not in law._repr_html_()
    assert "&lt;b&gt;&amp;" in law._repr_html_()


def test_a_number_that_the_design_leaves_open_is_not_named():
    """As those of active damping, which follow from the string."""
    values = {"simulation.duration": "5 s", "drillstring.sections.pipe.elements": 4}
    design = drillctl.load(DESIGN, controller={"law": "active-damping"}, **values)
    run = drillctl.simulate(design, "batch")
    paths = ("controller.spring", "controller.damper")
    assert drillctl.plots.time_response(run, paths=paths).axes[0].get_title(loc="left") == (
        f"J1 {run.measures.j1:.1f} s: active-damping"
    )
