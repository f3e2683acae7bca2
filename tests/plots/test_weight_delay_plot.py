"""The picture of a weight on bit against its delay."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure

import drillctl
from drillctl import plots
from drillctl.errors import InputError
from drillctl.studies import weight_delay

SMOOTH = {"controller.kp": 625.0, "controller.ki": 125.0}


@pytest.fixture(scope="module")
def result():
    design = drillctl.load("dynamic-wob-delay-140kn", **SMOOTH)
    return weight_delay(design, [0.0, 2e3, 6e3], [0.0, 0.1, 0.5, 1.0], 6)


def test_panels_show_means_bands_and_shares(result):
    figure = plots.weight_delay(result)
    left, right = figure.axes
    assert left.get_xlabel() == right.get_xlabel() == "total delay of the bit speed (s)"
    assert "J1 (s)" in left.get_ylabel()
    line = next(x for x in left.get_lines() if x.get_label().startswith("6 kN s/rad"))
    np.testing.assert_allclose(line.get_xdata(), result.delays)
    np.testing.assert_allclose(line.get_ydata(), [one.j1.value for one in result.benefits[2]])
    constant = next(x for x in left.get_lines() if x.get_label() == "constant weight")
    assert constant.get_ydata()[0] == result.baseline.j1.value
    band = left.collections[0].get_paths()[0].vertices
    low, high = result.benefits[1][3].j1.interval
    assert np.isclose(band[band[:, 0] == 1.0][:, 1], high).any()
    assert np.isclose(band[band[:, 0] == 1.0][:, 1], low).any()
    shares = right.containers[1]
    np.testing.assert_allclose(
        shares.lines[0].get_ydata(), [one.ended.value for one in result.benefits[2]]
    )
    # Set apart a little, lest bars hide each other.
    places = np.sqrt(shares.lines[0].get_xdata())
    np.testing.assert_allclose(places, np.sqrt(result.delays), atol=0.02)
    ends = [segment[:, 1] for segment in shares.lines[2][0].get_segments()]
    np.testing.assert_allclose(ends, [one.ended.interval for one in result.benefits[2]], atol=1e-12)
    figure.savefig("/dev/null", format="png", dpi=20)


def test_the_harmful_delay_is_marked_on_the_level_of_the_constant_weight(result):
    left, _ = plots.weight_delay(result).axes
    marks = [tuple(np.ravel(c.lines[0].get_xydata())) for c in left.containers]
    expected = [(result.limits[i].harmful_from.at, result.baseline.j1.value) for i in (1, 2)]
    np.testing.assert_allclose(marks, expected)
    told = f"harmful from {result.limits[2].harmful_from.at:.2f} s"
    assert any(told in x.get_label() for x in left.get_lines())


def test_units_of_the_field_and_axes_of_others(result):
    figure = Figure()
    axes = figure.subplots(1, 2)
    assert plots.weight_delay(result, ax=axes, system="field") is figure
    assert any("klbf/rpm" in str(x.get_label()) for x in axes[0].get_lines())
    with pytest.raises(InputError, match="needs 2 axes"):
        plots.weight_delay(result, ax=axes[:1])


def test_a_single_delay_can_be_drawn():
    design = drillctl.load("dynamic-wob-delay-140kn", **{"simulation.duration": "10 s"})
    for delay in (0.0, 0.3):
        found = weight_delay(design, [6e3], [delay], 1)
        figure = plots.weight_delay(found)
        figure.savefig("/dev/null", format="png", dpi=20)
        assert not found.limits[0].harmful_from.at
        assert any("not harmful up to" in x.get_label() for x in figure.axes[0].get_lines())
