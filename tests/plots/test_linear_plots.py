"""Figures of the linear side and of the friction law: what they draw, and on what."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from looks import drawn, legend, named
from matplotlib.figure import Figure

import drillctl
from drillctl.errors import InputError
from drillctl.linear import frequency_response, modes
from drillctl.plots import bode, friction_curves, mode_shapes
from drillctl.plots.plant import _curve

DESIGN = "monteiro-trindade-140kn"


@pytest.fixture(scope="module")
def design():
    return drillctl.load(DESIGN)


def test_mode_shapes_stand_along_depth_downward(design):
    result = modes(design)
    figure = mode_shapes(result)
    assert drawn(figure)
    angle, torque, held, _ = figure.axes
    assert angle.get_ylim() == (3000.0, 0.0)
    assert angle.get_ylabel() == "depth (m)"
    np.testing.assert_array_equal(angle.get_lines()[1].get_xdata(), result.free_free[1].shape)
    np.testing.assert_array_equal(held.get_lines()[0].get_ydata(), result.node_depth)
    assert legend(torque) == ["rigid body", "0.1806 Hz", "0.5916 Hz", "1.096 Hz"]


def test_lumped_strings_are_drawn_over_their_nodes():
    figure = mode_shapes(modes(drillctl.load("navarro-lopez-4dof")))
    assert drawn(figure)
    angle, torque = figure.axes[:2]
    assert angle.get_ylim() == (3.0, 0.0)
    assert angle.get_ylabel() == "node, 0 = top drive"
    labels = legend(torque)
    assert labels[1] == "0.01588 Hz, overdamped"
    assert "damping 25.5 %" in labels[2]


def test_bode_shows_the_first_resonance(design):
    frequency = np.linspace(0.02, 0.5, 481)
    figure = bode(frequency_response(design.string, frequency))
    assert drawn(figure)
    magnitude, phase = figure.axes
    for line in magnitude.get_lines():
        assert line.get_xdata()[np.argmax(line.get_ydata())] == pytest.approx(0.1806, abs=1e-3)
    top = magnitude.get_lines()[0]
    assert top.get_xdata()[np.argmin(top.get_ydata())] == pytest.approx(0.1275, abs=1e-3)
    assert "Hz" in phase.get_xlabel()
    assert "dB" in magnitude.get_ylabel()


def test_phase_has_gaps_where_it_wraps():
    rig = drillctl.load(DESIGN, **{"drillstring.modal_damping": 0.02})
    phase = bode(frequency_response(rig.string)).axes[1]
    values = phase.get_lines()[1].get_ydata()
    assert np.isnan(values).any()
    assert np.nanmax(np.abs(np.diff(values))) < 270.0


def test_friction_curve_holds_the_set_at_rest(design):
    figure = friction_curves(design)
    assert drawn(figure)
    ax = figure.axes[0]
    labels = legend(ax)
    assert labels[:5] == ["160 kN", "140 kN", "120 kN", "100 kN", "80 kN"]
    speed, torque = named(ax, "140 kN").get_data()
    at_rest = torque[speed == 0.0]
    assert (at_rest.min(), at_rest.max()) == pytest.approx((-11.9, 11.9))
    assert (torque[speed < 0.0] < 0.0).all()
    assert (torque[speed > 0.0] > 0.0).all()
    assert (speed[0], speed[-1]) == (-20.0, 250.0)
    assert np.interp(100.0, speed[speed > 0], torque[speed > 0]) == pytest.approx(6.600, abs=1e-3)


@pytest.mark.parametrize(
    ("name", "torque"), [(DESIGN, 6.5999), ("monteiro-trindade-120kn", 5.6527)]
)
def test_operating_point_is_marked(name, torque):
    ax = friction_curves(drillctl.load(name)).axes[0]
    marker = next(line for line in ax.get_lines() if line.get_marker() == "o")
    assert marker.get_xdata() == pytest.approx([100.0])
    assert marker.get_ydata() == pytest.approx([torque], abs=1e-4)


def test_friction_between_rows_and_without_a_table(design):
    between = friction_curves(design.replace({"operating_point.weight_on_bit": "130 kN"}))
    assert named(between.axes[0], "130 kN").get_linestyle() == "-"
    assert named(between.axes[0], "140 kN").get_linestyle() == "--"
    one = friction_curves(drillctl.load("navarro-lopez-2dof")).axes[0]
    assert len(one.get_legend().get_texts()) == 2
    # Bit radius .155575 m, coefficient .8, 97.347 kN
    assert named(one, "97.35 kN").get_ydata().max() == pytest.approx(12.116, abs=1e-3)


class Peaked(NamedTuple):
    """A law whose static torque exceeds the torque it slips at."""

    def static_torque(self, weight):
        return 2.0 * weight

    def torque_and_slope(self, weight, speed, exp):
        return weight, 0.0


def test_static_peak_is_drawn_where_the_law_jumps():
    speed, torque = _curve(Peaked(), 3e3, 100.0)
    assert list(torque[speed == 0.0]) == pytest.approx([-3e3, -6e3, 6e3, 3e3])
    assert set(torque[speed != 0.0]) == {-3e3, 3e3}


def test_axes_given_are_drawn_on_and_their_figure_returned(design):
    own = Figure()
    single = own.add_subplot()
    assert friction_curves(design, ax=single) is own
    assert single.get_lines()
    panels = Figure().subfigures(1, 2)[0].subplots(2, 1)
    assert bode(frequency_response(design.string, [0.1, 1.0]), ax=panels) is panels[0].figure.figure
    assert all(panel.get_lines() for panel in panels)
    with pytest.raises(InputError, match="needs 4 axes, got 2"):
        mode_shapes(modes(design), ax=panels)
