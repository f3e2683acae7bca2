"""Figures of the loop: what they draw, where the marks stand, and what they refuse."""

from __future__ import annotations

import dataclasses
import subprocess
import sys

import matplotlib as mpl
import numpy as np
import pytest
from looks import drawn, legend, named
from matplotlib.figure import Figure
from matplotlib.patches import Circle

import drillctl
from drillctl import plots
from drillctl.errors import InputError
from drillctl.linear import (
    drive_impedance,
    ends_of,
    frequency_response,
    gain_boundary,
    loop,
    root_locus,
)
from drillctl.linear.loop_margins import pole_grid
from drillctl.plots.loop_gains import mirrored
from drillctl.plots.loop_shape import turns_about_critical
from drillctl.studies import Axis
from drillctl.studies.loop.compute import loop_pictures
from drillctl.studies.loop_mapping.compute import QUANTITIES, loop_map

NAME = "monteiro-trindade-140kn"
FREQUENCIES = np.geomspace(0.02, 5.0, 200)


@pytest.fixture(scope="module")
def design():
    return drillctl.load(NAME)


@pytest.fixture(scope="module")
def bistable():
    return drillctl.load("navarro-lopez-2dof-bistable")


def cut(design):
    """Analysis, and the open loop on a grid that resolves its poles."""
    found = loop(design)
    frequency = pole_grid(ends_of(design.string), found.poles) / (2.0 * np.pi)
    slope = found.operating_point.slope
    return found, frequency_response(design, frequency, "open_loop", slope=slope)


@pytest.fixture(scope="module")
def analysed(design):
    return cut(design)


@pytest.fixture(scope="module")
def gains_map(design):
    axes = (
        Axis("controller.kp", "N*m*s/rad", np.linspace(100.0, 900.0, 9)),
        Axis("controller.ki", "N*m/rad", np.linspace(0.0, 300.0, 7)),
    )
    return loop_map(design, axes)


@pytest.fixture(scope="module")
def boundary(design):
    return gain_boundary(design)


def texts(ax):
    return " ".join(text.get_text() for text in ax.texts)


# --- bode and mobility -----------------------------------------------------------------------


def test_bode_compares_models(design):
    both = [frequency_response(design, FREQUENCIES, model=m) for m in ("finite-elements", "wave")]
    figure = plots.bode(both)
    magnitude, phase = figure.axes
    assert drawn(figure)
    lines = magnitude.get_lines()
    assert len(lines) == len(phase.get_lines()) == 4
    assert len({line.get_linestyle() for line in lines}) == 4
    assert lines[0].get_linewidth() > lines[2].get_linewidth()
    assert legend(magnitude)[2] == "String without control (continuum): top torque to top speed"
    level = 20.0 * np.log10(np.abs(both[1].between("top_torque", "bit_speed")))
    np.testing.assert_array_equal(lines[3].get_ydata(), level)
    assert magnitude.get_ylabel() == "magnitude (dB re 1 rad/s/(N m))"


def test_bode_of_any_signal(design):
    closed = frequency_response(design, FREQUENCIES, "closed_loop")
    magnitude, phase = plots.bode(closed).axes
    assert magnitude.get_ylabel() == "magnitude (dB)"
    assert legend(magnitude) == ["set speed to top speed", "set speed to bit speed"]
    assert magnitude.get_title(loc="left") == "Bode plot: string with its drive"
    magnitude, phase = plots.bode(closed, source="bit_torque", targets=["twist"]).axes
    assert magnitude.get_ylabel() == "magnitude (dB re 1 rad/(N m))"
    assert len(phase.get_lines()) == 1


def test_bode_refuses(design):
    plant = frequency_response(design, FREQUENCIES)
    closed = frequency_response(design, FREQUENCIES, "closed_loop")
    with pytest.raises(InputError, match="bit_speed"):
        plots.bode(plant, targets=["bit_sped"])
    with pytest.raises(InputError, match="no signal 'set_speed'"):
        plots.bode(plant, source="set_speed")
    with pytest.raises(InputError, match="several units"):
        plots.bode([plant, closed])
    with pytest.raises(InputError, match="several units"):
        plots.bode(plant, targets=["top_speed", "twist"])
    with pytest.raises(InputError, match="nothing to draw"):
        plots.bode([])
    with pytest.raises(InputError, match="one output"):
        plots.bode(plant, targets=[])


@pytest.mark.parametrize("which", ["design", "bistable"])
def test_mobility_in_rpm_per_kilonewton_metre(which, request):
    design = request.getfixturevalue(which)
    plant = frequency_response(design, FREQUENCIES)
    closed = frequency_response(design, FREQUENCIES, "closed_loop")
    figure = plots.mobility([plant, closed])
    bit, top = figure.axes
    assert drawn(figure)
    assert (len(bit.get_lines()), len(top.get_lines())) == (2, 1)
    assert legend(bit) == ["String without control", "String with its drive"]
    assert bit.get_ylabel() == "mobility at the bit (rpm/(kN m))"
    assert top.get_xlabel() == "frequency (Hz)"
    at_bit = np.abs(closed.between("bit_torque", "bit_speed")) * 30e3 / np.pi
    at_top = np.abs(plant.between("top_torque", "top_speed")) * 30e3 / np.pi
    np.testing.assert_allclose(bit.get_lines()[1].get_ydata(), at_bit)
    np.testing.assert_allclose(top.get_lines()[0].get_ydata(), at_top)


def test_mobility_with_drive_only_has_one_panel(design):
    closed = frequency_response(design, FREQUENCIES, "closed_loop")
    assert len(plots.mobility(closed).axes) == 1
    without = dataclasses.replace(closed, inputs=("set_speed", "other"))
    with pytest.raises(InputError, match="bit_torque"):
        plots.mobility(without)


# --- impedance -------------------------------------------------------------------------------


def test_impedance_over_that_of_the_pipe(design):
    soft = drive_impedance(design, FREQUENCIES, "design")
    stiff = drive_impedance(design.replace({"controller.kp": 15e3}), FREQUENCIES, "stiff")
    figure = plots.drive_impedance([soft, stiff], marks={"stick-slip": 0.1275})
    above, below = figure.axes
    assert drawn(figure)
    assert legend(above) == ["design", "stiff"]
    np.testing.assert_array_equal(
        named(above, "stiff").get_ydata(), np.abs(stiff.impedance) / stiff.pipe
    )
    np.testing.assert_array_equal(named(below, "design").get_ydata(), np.abs(soft.reflection))
    assert [1.0, 1.0] in [list(line.get_ydata()) for line in above.get_lines()]
    assert [0.1275, 0.1275] in [list(line.get_xdata()) for line in below.get_lines()]
    assert "stick-slip\n0.128 Hz" in texts(below)
    assert below.get_ylim() == (0.0, 1.05)
    assert "Hz" in below.get_xlabel()
    assert texts(plots.drive_impedance(soft, marks=(0.25,)).axes[1]) == "0.25 Hz"
    with pytest.raises(InputError, match="more than 0 Hz"):
        plots.drive_impedance(soft, marks={"bad": 0.0})


# --- the loop at the top ---------------------------------------------------------------------


def test_nyquist_about_the_critical_point(analysed):
    found, response = analysed
    figure = plots.nyquist(response, analysis=found)
    (ax,) = figure.axes
    assert drawn(figure)
    transfer = response.between("speed_error", "top_speed")
    heavy = named(ax, "L, f > 0")
    np.testing.assert_array_equal(heavy.get_xdata(), transfer.real[: len(heavy.get_xdata())])
    np.testing.assert_array_equal(named(ax, "conjugate (f < 0)").get_ydata(), -transfer.imag)
    (disk,) = (p for p in ax.patches if isinstance(p, Circle))
    alpha = found.margins.disk
    left, right = disk.center[0] - disk.radius, disk.center[0] + disk.radius
    assert left == pytest.approx(-(2.0 + alpha) / (2.0 - alpha))
    assert right == pytest.approx(-(2.0 - alpha) / (2.0 + alpha))
    # The curve touches the disk and does not enter it.
    clear = np.abs(transfer - disk.center[0]).min() / disk.radius
    assert 1.0 - 1e-9 < clear < 1.01
    assert named(ax, "-1").get_xdata() == [-1.0]
    assert "outside the picture once, up to |L| = 8.7e+02" in texts(ax)
    assert "61 in the open loop, 0 in the closed loop, stable" in texts(ax)
    assert "61 times counter-clockwise" in texts(ax)


def test_nyquist_of_an_unstable_loop():
    found, response = cut(drillctl.load("monteiro-trindade-160kn"))
    (ax,) = plots.nyquist(response, analysis=found).axes
    assert not any(isinstance(p, Circle) for p in ax.patches)
    assert "61 in the open loop, 2 in the closed loop, not stable" in texts(ax)
    assert "59 times" in texts(ax)
    assert "unstable poles" not in texts(plots.nyquist(response).axes[0])


def test_resonance_loops_of_the_study_are_round(analysed):
    found, response = analysed
    corner = np.pi / 30.0

    def turns(ax):
        """Turns of the curve between points that are seen apart."""
        line = named(ax, "L, f > 0")
        step = np.diff(line.get_xdata() + 1j * line.get_ydata())
        seen = np.abs(step) > 0.03
        both = seen[1:] & seen[:-1]
        return np.abs(np.angle(step[1:] / step[:-1]))[both]

    assert turns(plots.nyquist(response, analysis=found).axes[0]).max() > 2.0 * corner
    drawn = next(p for p in loop_pictures(found) if p.name == "nyquist").draw("si")
    assert turns(drawn.axes[0]).max() < corner


def test_a_single_frequency_is_a_point_without_an_arrow(design):
    one = frequency_response(design, [0.2], "open_loop")
    assert drawn(plots.nyquist(one))


def test_turns_need_enough_frequencies():
    angle = np.linspace(0.0, 3.0 * np.pi, 400)
    assert turns_about_critical(-1.0 + np.exp(1j * angle), 0) == 3
    assert turns_about_critical(-1.0 + np.exp(1j * angle), 2) == 2
    assert turns_about_critical(-1.0 + np.exp(1j * angle), 1) is None
    # Whole turns by chance, of steps that may as well have gone the other way round.
    assert turns_about_critical(-1.0 + np.exp(0.8j * np.pi * np.arange(6)), 0) is None


def test_coarse_response_tells_no_turns(design, analysed):
    found, _ = analysed
    slope = found.operating_point.slope
    coarse = frequency_response(design, FREQUENCIES, "open_loop", slope=slope)
    assert "unstable poles" not in texts(plots.nyquist(coarse, analysis=found).axes[0])


def test_turns_that_the_poles_contradict_are_not_told(analysed):
    found, response = analysed
    low = response.frequency_hz < 1.0
    part = dataclasses.replace(
        response, frequency_hz=response.frequency_hz[low], response=response.response[low]
    )
    transfer = part.between("speed_error", "top_speed")
    assert turns_about_critical(transfer, 1) == 5
    assert "unstable poles" not in texts(plots.nyquist(part, analysis=found).axes[0])


def test_nichols_has_the_critical_point_in_the_middle(analysed):
    found, response = analysed
    figure = plots.nichols(response, analysis=found)
    (ax,) = figure.axes
    assert drawn(figure)
    assert ax.get_xlim() == (-360.0, 0.0)
    assert "(deg)" in ax.get_xlabel()
    assert "(dB)" in ax.get_ylabel()
    assert named(ax, "-1").get_xdata() == [-180.0]
    x, y = named(ax, "L, f > 0").get_data()
    back = 10.0 ** (y / 20.0) * np.exp(1j * np.radians(x))
    transfer = response.between("speed_error", "top_speed")[: len(x)]
    same = np.isfinite(x)
    assert same.mean() > 0.99
    np.testing.assert_allclose(back[same], transfer[same], rtol=1e-9)
    assert "disk margin 0.103" in legend(ax)
    assert {"|S| 1.4", "|S| 2", "|S| 4"} <= {t.get_text() for t in ax.texts}
    assert "outside the picture 30 times" in texts(ax)


def test_contours_of_sensitivity_are_where_they_say(analysed):
    (ax,) = plots.nichols(analysed[1]).axes
    lines = next(c for c in ax.collections if hasattr(c, "levels"))
    for level, path in zip(lines.levels, lines.get_paths(), strict=True):
        x, y = path.vertices.T
        plane = 10.0 ** (y / 20.0) * np.exp(1j * np.radians(x))
        np.testing.assert_allclose(np.abs(1.0 + plane), level, rtol=2e-3)


def test_sensitivity_marks_its_peak(analysed):
    found, response = analysed
    figure = plots.sensitivity(response, analysis=found)
    (ax,) = figure.axes
    assert drawn(figure)
    mark = named(ax, "largest |S|: 10.02 at 0.123 Hz")
    assert mark.get_ydata() == [found.margins.peak_sensitivity]
    assert mark.get_xdata() == [found.margins.peak_sensitivity_hz]
    sensitive, rest = named(ax, "|S|").get_ydata(), named(ax, "|T|").get_ydata()
    transfer = response.between("speed_error", "top_speed")
    np.testing.assert_allclose(sensitive, np.abs(1.0 / (1.0 + transfer)))
    np.testing.assert_allclose(rest, np.abs(transfer / (1.0 + transfer)))
    alone = named(plots.sensitivity(response).axes[0], "largest")
    assert alone.get_ydata()[0] == sensitive.max() == pytest.approx(10.024, abs=1e-3)


@pytest.mark.parametrize("picture", [plots.nyquist, plots.nichols, plots.sensitivity])
def test_what_is_no_such_loop_is_refused(picture, design, bistable, analysed):
    found, _ = analysed
    with pytest.raises(InputError, match="speed_error"):
        picture(frequency_response(design, FREQUENCIES))
    with pytest.raises(InputError, match="does not react"):
        picture(frequency_response(bistable, FREQUENCIES, "open_loop"))
    with pytest.raises(InputError, match="not that of the analysed loop"):
        picture(frequency_response(design, FREQUENCIES, "open_loop"), analysis=found)


# --- maps ------------------------------------------------------------------------------------


@pytest.mark.parametrize("quantity", list(QUANTITIES))
def test_map_draws_each_quantity(gains_map, quantity):
    figure = plots.loop_map(gains_map, quantity)
    ax, bar = figure.axes
    assert drawn(figure)
    mesh = ax.collections[0].get_array()
    expected = gains_map.values[quantity].T
    np.testing.assert_array_equal(np.ma.filled(mesh, np.nan).reshape(expected.shape), expected)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("Kp (N m s)", "Ki (N m)")
    unit = QUANTITIES[quantity][0]
    assert unit == "1" or bar.get_ylabel().endswith(")")
    assert "stability boundary, D* = D" in legend(ax)
    assert named(ax, "the design").get_xdata() == [625.0]
    assert named(ax, "the design").get_ydata() == [125.0]
    assert "grey" in figure.get_supxlabel()


def test_grey_is_told_by_its_reason(gains_map):
    slope, margin = gains_map.values["slope"], gains_map.values["slope_margin"]
    unstable = dataclasses.replace(
        gains_map, values=gains_map.values | {"slope_margin": np.nan * margin}
    )
    assert (
        "unstable without any slope too, or no steady drilling"
        in (plots.loop_map(unstable).get_supxlabel())
    ) == bool(np.isnan(slope).any())
    turning = {"slope": np.nan_to_num(slope), "slope_margin": np.nan * margin}
    told = plots.loop_map(
        dataclasses.replace(unstable, values=gains_map.values | turning)
    ).get_supxlabel()
    assert told.endswith("grey: unstable without any slope too")


def test_map_of_margins_and_the_boundary(gains_map, boundary):
    figure = plots.loop_map(gains_map, boundary=boundary)
    ax, bar = figure.axes
    assert drawn(figure)
    assert bar.get_ylabel() == "slope margin D* (N m s)"
    margin, at = gains_map.best
    star = named(ax, f"largest D*: {margin:.4g} N m s")
    assert (star.get_xdata()[0], star.get_ydata()[0]) == tuple(at.values())
    outline = named(ax, "stable gains, closed form")
    left, low, right, high = boundary.region.bounds
    assert (outline.get_xdata().min(), outline.get_xdata().max()) == (left, right)
    assert (outline.get_ydata().min(), outline.get_ydata().max()) == (low, high)
    heavy = next(c for c in ax.collections if list(getattr(c, "levels", [])) == [0.0])
    x = heavy.get_paths()[0].vertices[:, 0]
    assert x.min() == pytest.approx(left, abs=30.0)  # cells are 100 wide
    assert x.max() == pytest.approx(right, abs=30.0)


def test_limits_leave_the_stable_cells_legible(gains_map):
    def limits(quantity):
        return plots.loop_map(gains_map, quantity).axes[0].collections[0].get_clim()

    low, high = limits("spectral_abscissa")
    assert low == -high
    low, high = limits("low_damping")
    assert low == -high
    assert high < 0.5
    assert limits("peak_sensitivity")[0] == 1.0
    assert 10.0 <= limits("peak_sensitivity")[1] < 30.0


def test_map_of_other_parameters(bistable, boundary):
    axes = (
        Axis("operating_point.weight_on_bit", "N", np.linspace(80e3, 120e3, 5)),
        Axis("controller.torque", "N*m", np.linspace(7e3, 12e3, 6)),
    )
    result = loop_map(bistable, axes)
    figure = plots.loop_map(result, "spectral_abscissa")
    assert drawn(figure)
    assert figure.axes[0].get_xlabel() == "weight on bit (kN)"
    field = plots.loop_map(result, "spectral_abscissa", system="field")
    assert field.axes[0].get_xlabel() == "weight on bit (klbf)"
    same = plots.loop_map(result)  # one margin in all cells
    assert drawn(same)
    low, high = same.axes[0].collections[0].get_clim()
    assert (low, high) == pytest.approx((0.9 * 327.0863 - 0.1, 1.1 * 327.0863 + 0.1), rel=1e-6)
    assert "largest" not in " ".join(legend(same.axes[0]))
    with pytest.raises(InputError, match="boundary of gains does not fit"):
        plots.loop_map(result, boundary=boundary)


def test_map_refuses(design, gains_map):
    with pytest.raises(InputError, match="did you mean 'slope_margin'"):
        plots.loop_map(gains_map, "slope_margn")
    line = loop_map(design, gains_map.axes[:1], ("slope_margin",))
    with pytest.raises(InputError, match="2 parameters, the result has 1"):
        plots.loop_map(line)


def test_boundary_is_drawn_with_its_region(design, boundary):
    figure = plots.gain_boundary([boundary, gain_boundary(design, model="wave")])
    ax, bar = figure.axes
    assert drawn(figure)
    (curve,) = ax.collections
    assert len(curve.get_segments()) == sum(len(b.kp) - 1 for b in boundary.branches)
    frequency = curve.get_array()
    assert frequency[-1] == pytest.approx(boundary.branches[-1].omega[-1] / (2.0 * np.pi), rel=1e-2)
    (region,) = ax.patches
    box = region.get_path().get_extents()
    assert (box.x0, box.y0, box.x1, box.y1) == pytest.approx(boundary.region.bounds)
    assert "continuum" in legend(ax)
    assert named(ax, "gains of the design").get_xdata() == [625.0]
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("Kp (N m s)", "Ki (N m)")
    assert (ax.get_xlim(), ax.get_ylim()) == boundary.window
    assert "(Hz)" in bar.get_ylabel()
    assert "290.1 N m s" in figure.get_supxlabel()
    with pytest.raises(InputError, match="nothing to draw"):
        plots.gain_boundary([])


def test_boundary_without_branches(bistable):
    figure = plots.gain_boundary(gain_boundary(bistable))
    assert drawn(figure)
    assert legend(figure.axes[0]) == ["stable gains"]
    nothing = plots.gain_boundary(gain_boundary(bistable, slope=1e4))
    assert drawn(nothing)
    assert "no stable gains within the picture" in legend(nothing.axes[0])


# --- root locus ------------------------------------------------------------------------------


def test_root_locus_tracks(design):
    result = root_locus(design, "controller.ki", np.linspace(5.0, 400.0, 80))
    figure = plots.root_locus(result)
    ax, bar = figure.axes
    assert drawn(figure)
    assert bar.get_ylabel() == "Ki (N m)"
    assert ax.get_xlabel().startswith("real part (1/s)")
    assert ax.get_ylabel() == "frequency (Hz)"
    tracks = mirrored(result.poles)
    assert len(ax.collections) == tracks.shape[1] < result.poles.shape[1]
    start = named(ax, "first value")
    np.testing.assert_allclose(start.get_xdata(), tracks[0].real)
    np.testing.assert_allclose(start.get_ydata(), tracks[0].imag / (2.0 * np.pi))
    corners = ax.collections[0].get_segments()[-1]
    expected = np.column_stack([tracks[-2:, 0].real, tracks[-2:, 0].imag / (2.0 * np.pi)])
    np.testing.assert_allclose(corners, expected)
    # Every pole of the upper half is on a track.
    for pole in result.poles[-1][result.poles[-1].imag >= 0.0]:
        assert np.abs(named(ax, "last value").get_xdata() - pole.real).min() < 1e-12
    low, high = ax.get_ylim()
    assert low < 0.0 < high < 1.0
    assert "tracks outside the window" in figure.get_supxlabel()
    colours = ax.collections[0].get_array()
    assert (colours[0], colours[-1]) == pytest.approx((7.5, 397.5))


def test_crossings_are_the_boundary_of_the_gains(design, boundary):
    result = root_locus(design, "controller.ki", np.linspace(5.0, 400.0, 80))
    ax = plots.root_locus(result).axes[0]
    found = sorted(float(text.get_text()) for text in ax.texts)
    ring = boundary.region.intersection(_line_at(625.0)).bounds
    assert found == pytest.approx([ring[1], ring[3]], rel=5e-3)


def _line_at(kp):
    import shapely

    return shapely.LineString([(kp, 0.0), (kp, 500.0)])


def test_root_locus_in_the_units_of_the_rig(bistable):
    result = root_locus(bistable, "controller.torque", np.linspace(9.3e3, 12e3, 20))
    figure = plots.root_locus(result)
    assert drawn(figure)
    ax, bar = figure.axes
    assert bar.get_ylabel() == "torque (kN m)"
    assert ax.collections[0].get_clim() == pytest.approx((9.3, 12.0))
    assert plots.root_locus(result, system="field").axes[1].get_ylabel().endswith("(klbf ft)")
    empty = dataclasses.replace(result, poles=np.full((20, 2), complex(np.nan, np.nan)))
    with pytest.raises(InputError, match="no poles"):
        plots.root_locus(empty)


# --- axes and pyplot -------------------------------------------------------------------------


def test_axes_given_are_drawn_on(design, analysed, gains_map, boundary):
    _, response = analysed
    locus = root_locus(design, "controller.ki", np.linspace(50.0, 100.0, 5))
    for picture, argument in (
        (plots.nyquist, response),
        (plots.nichols, response),
        (plots.sensitivity, response),
        (plots.loop_map, gains_map),
        (plots.gain_boundary, boundary),
        (plots.root_locus, locus),
    ):
        own = Figure()
        ax = own.add_subplot()
        assert picture(argument, ax=ax) is own
        assert ax.get_lines() or ax.collections
    plant = frequency_response(design, FREQUENCIES)
    for picture, argument in (
        (plots.mobility, plant),
        (plots.drive_impedance, drive_impedance(design, FREQUENCIES)),
    ):
        own = Figure()
        assert picture(argument, ax=own.subplots(2, 1)) is own
        with pytest.raises(InputError, match="needs 2 axes, got 1"):
            picture(argument, ax=[Figure().add_subplot()])


def test_no_pyplot_and_no_settings(design, analysed, gains_map, boundary):
    before = dict(mpl.rcParams)
    plots.nyquist(analysed[1], analysis=analysed[0])
    plots.loop_map(gains_map, boundary=boundary)
    assert dict(mpl.rcParams) == before
    code = (
        "import sys, drillctl; from drillctl import linear, plots;"
        f"d = drillctl.load({NAME!r});"
        "plots.nichols(linear.frequency_response(d, [0.1, 0.2], 'open_loop'));"
        "plots.gain_boundary(linear.gain_boundary(d));"
        "plots.root_locus(linear.root_locus(d, 'controller.ki', [50.0, 60.0]));"
        "plots.friction_curves(d);"
        "short = {'simulation.duration': '1 s', 'simulation.j1_from': '0 s'};"
        "plots.time_response(drillctl.simulate(d.replace(short), engine='batch'));"
        "sys.exit('matplotlib.pyplot' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
