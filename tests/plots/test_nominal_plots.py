"""Pictures of cases without draws: what is drawn are their maps and their motions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from looks import drawn, legend
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch

import drillctl
from drillctl.errors import InputError
from drillctl.plots import compared_regions, compared_responses
from drillctl.plots.comparison import _rings
from drillctl.plots.style import COLOURS
from drillctl.studies.compare.compute import compare
from drillctl.units import RPM

KN = 1000.0
KP, KI, WEIGHT = "controller.kp", "controller.ki", "operating_point.weight_on_bit"
FIXED_TORQUE = {"controller.law": "constant-torque", "controller.torque": "7 kN*m"}


@pytest.fixture(scope="module")
def design():
    axes = [
        {"path": KP, "min": 100, "max": 900, "points": 9},
        {"path": WEIGHT, "min": "80 kN", "max": "140 kN", "points": 4},
    ]
    settings = {"title": "A title", "map.axes": axes, "map.levels": [12, 15]}
    gains = {KP: 200.0, KI: 100.0, "simulation.duration": "30 s"}
    return drillctl.load("monteiro-trindade-140kn", **settings, **gains)


@pytest.fixture(scope="module")
def result(design):
    law = {"weight_on_bit.law": "navarro-lopez-suarez", "weight_on_bit.gain": "4 kN*s/rad"}
    cases = {
        "constant": design, "moving": design.replace({**law, KP: 300.0}),
        "torque": design.replace(FIXED_TORQUE),
    }  # fmt: skip
    return compare(cases, realizations=2)


def regions(result, **options):
    (ax,) = drawn(compared_regions(result, **options))
    patches = [patch for patch in ax.patches if isinstance(patch, PathPatch)]
    return ax, patches, legend(ax)


# --- regions -----------------------------------------------------------------------------------


def test_outlines_are_those_of_the_regions(result):
    ax, patches, labels = regions(result, level=15.0)
    for case, patch in zip(result.cases[:2], patches[:2], strict=True):
        region = case.region(15.0)
        corners = patch.get_path().vertices
        # Kp as it is, the weight in kN.
        low_kp, low, high_kp, high = region.polygons.bounds
        expected = [low_kp, low / KN, high_kp, high / KN]
        assert [*corners.min(axis=0), *corners.max(axis=0)] == pytest.approx(expected)
        assert patch.get_edgecolor()[:3] == pytest.approx(_rgb(result.cases.index(case)))
    share = [result.cases[number].region(15.0).area_fraction for number in range(2)]
    assert 0.0 < share[0] < share[1]
    assert labels[:3] == [
        f"constant ({share[0]:.1%} of the cells)", f"moving ({share[1]:.1%} of the cells)",
        "torque (no map)",
    ]  # fmt: skip
    assert not len(patches[2].get_path().vertices)
    assert ax.get_xlabel() == "Kp (N m s)"
    assert ax.get_ylabel() == "weight on bit (kN)"
    assert ax.get_title(loc="left") == "Region of J1 at or under 15 s, by case\nA title"
    assert ax.get_xlim() == (100.0, 900.0)
    assert ax.get_ylim() == pytest.approx((80.0, 140.0))


def test_outlines_are_told_apart_without_colour(result):
    _, patches, _ = regions(result)
    assert len({str(patch.get_linestyle()) for patch in patches}) == 3
    widths = [patch.get_linewidth() for patch in patches]
    assert widths == sorted(widths, reverse=True)
    assert widths[0] > widths[-1]


def test_the_lowest_level_unless_told(result):
    ax, _, labels = regions(result)
    assert "under 12 s" in ax.get_title(loc="left")
    assert f"({result.cases[0].region(12.0).area_fraction:.1%} of" in labels[0]


def test_an_empty_region_is_in_the_legend(result):
    _, patches, labels = regions(result, level=1e-3)
    assert labels[0] == "constant (0.0% of the cells)"
    assert not len(patches[0].get_path().vertices)


def test_cases_are_marked_where_they_are(result):
    ax, _, _ = regions(result)
    (marks,) = ax.lines
    assert marks.get_xydata().tolist() == [[200.0, 140.0], [300.0, 140.0]]
    twice = replace(result, cases=(*result.cases, result.baseline))
    (marks,) = regions(twice)[0].lines
    assert marks.get_xydata().tolist() == [[200.0, 140.0], [300.0, 140.0]]


def test_field_units(result):
    ax, patches, _ = regions(result, level=15.0, system="field")
    assert "klbf" in ax.get_ylabel()
    bounds = result.cases[0].region(15.0).polygons.bounds
    corners = patches[0].get_path().vertices
    assert corners[:, 1].max() == pytest.approx(bounds[3] / 4448.2216)
    assert ax.get_ylim()[1] == pytest.approx(140e3 / 4448.2216)


def test_a_hole_is_not_filled(result):
    """A cell above the level inside the region, as a white spot in it."""
    spoilt = result.cases[1].nominal.map
    kept = spoilt.j1.copy()
    try:
        spoilt.j1[:] = 1.0
        spoilt.j1[4, 1] = 100.0
        _, patches, _ = regions(result, level=15.0)
        (patch,) = (p for p in patches if p.get_edgecolor()[:3] == pytest.approx(_rgb(1)))
        border, hole = patch.get_path().to_polygons()
        assert _signed(border) == pytest.approx(800.0 * 60.0)
        # Of the other sense, about the cell at Kp 500 and 100 kN.
        assert -200.0 * 40.0 < _signed(hole) < 0.0
        assert (hole.min(axis=0) + hole.max(axis=0)) / 2 == pytest.approx([500.0, 100.0])
    finally:
        spoilt.j1[:] = kept


def test_border_and_hole_run_in_opposite_senses():
    square = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)])
    for hole in (0.25 + 0.5 * square, (0.25 + 0.5 * square)[::-1]):
        border, inner = _rings(shapely.Polygon(square, [hole]))
        assert _signed(border) == pytest.approx(1.0)
        assert _signed(inner) == pytest.approx(-0.25)


@pytest.mark.parametrize("level", [0.0, -3.0, float("nan"), float("inf")])
def test_a_level_is_a_positive_number(result, level):
    with pytest.raises(InputError, match="a positive number of seconds"):
        compared_regions(result, level=level)


def test_no_case_with_a_map(design):
    without = compare(design.replace({"compare.maps": False}), realizations=2)
    with pytest.raises(InputError, match=r"no case has a map: as designed: compare\.maps is false"):
        compared_regions(without)


# --- responses ---------------------------------------------------------------------------------


def test_lines_are_the_responses(result):
    panels = drawn(compared_responses(result))
    assert [panel.get_ylabel() for panel in panels] == [
        "bit speed (rpm)", "WOB (kN)", "top torque (kN m)",
    ]  # fmt: skip
    scales = {"bit_speed": RPM, "weight_on_bit": KN, "top_torque": KN}
    for panel, (name, scale) in zip(panels, scales.items(), strict=True):
        for number, (case, line) in enumerate(zip(result.cases, panel.lines, strict=True)):
            run = case.nominal.response
            assert np.allclose(line.get_xdata(), run.time)
            assert np.allclose(line.get_ydata(), run.signals[name] / scale)
            assert line.get_color() == COLOURS[number]
    assert len({line.get_linestyle() for line in panels[0].lines}) == 3
    widths = [line.get_linewidth() for line in panels[1].lines]
    assert widths[0] > widths[1] > widths[2]
    assert panels[2].get_xlabel() == "time (s)"
    assert panels[0].get_xlim() == panels[2].get_xlim() == (0.0, 30.0)
    j1 = result.baseline.nominal.response.measures.j1
    assert legend(panels[2])[0] == f"constant (J1 {j1:.1f} s)"


def test_field_units_of_responses(result):
    panels = drawn(compared_responses(result, system="field"))
    assert "klbf" in panels[1].get_ylabel()
    weight = result.cases[1].nominal.response.signals["weight_on_bit"]
    assert np.allclose(panels[1].lines[1].get_ydata(), weight / 4448.2216)


# --- both --------------------------------------------------------------------------------------


@pytest.mark.parametrize("picture", [compared_regions, compared_responses])
def test_equal_means_and_origin_are_told(design, result, picture):
    text = picture(replace(result, equal_mean_weight=True))._supxlabel.get_text()
    assert "Nominal weights shifted for equal means." in text
    assert "String reconstructed." in text
    assert "shifted" not in picture(result)._supxlabel.get_text()


def test_given_axes_are_used(result):
    ax = Figure().add_subplot()
    assert compared_regions(result, ax=ax) is ax.figure
    assert ax.has_data()
    panels = Figure().subplots(3)
    assert compared_responses(result, ax=panels) is panels[0].figure
    assert all(panel.has_data() for panel in panels)
    with pytest.raises(InputError, match="needs 3 axes, got 1"):
        compared_responses(result, ax=[ax])


def _rgb(number):
    text = COLOURS[number].lstrip("#")
    return tuple(int(text[k : k + 2], 16) / 255 for k in (0, 2, 4))


def _signed(ring):
    x, y = ring[:, 0], ring[:, 1]
    return 0.5 * float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))
