"""Figures of maps and runs: what they show, in which units, and of what they warn."""

from __future__ import annotations

import warnings

import matplotlib as mpl
import numpy as np
import pytest
from looks import drawn, legend, named
from matplotlib.figure import Figure

import drillctl
from drillctl.ensemble.audit import Audit, unaudited
from drillctl.errors import InputError
from drillctl.plots import stability_map, sweep_line, time_response
from drillctl.plots.style import axis_label
from drillctl.simulation.measures import BATCH_MEASURES, STATUSES
from drillctl.studies import Axis, Sweep, responses
from drillctl.studies.map import pictures as map_pictures

OK, FAILED = STATUSES.index("ok"), STATUSES.index("failed")
NOBODY = unaudited()


@pytest.fixture(scope="module")
def design():
    return drillctl.load(
        "monteiro-trindade-140kn", **{"simulation.duration": "10 s", "title": "A title"}
    )


KP = Axis("controller.kp", "N*m*s/rad", np.linspace(0.0, 1000.0, 6))
WEIGHT = Axis("operating_point.weight_on_bit", "N", np.linspace(100e3, 200e3, 5))
LEVELS = (20.0, 30.0, 40.0)


def of_j1(cells, batch, reference):
    return Audit(cells, {"j1": batch}, {"j1": reference})


def made(design, j1, axes=(KP, WEIGHT), audit=NOBODY, levels=LEVELS):
    """A sweep with these values of J1; NaN stands for a failed cell."""
    j1 = np.asarray(j1, dtype=float)
    measures = {name: j1.copy() for name in BATCH_MEASURES}
    status = np.where(np.isnan(j1), FAILED, OK).astype(np.int8)
    return Sweep(design, axes, levels, measures, status, audit, 0.02, 16, 0.1, {})


@pytest.fixture
def field():
    """J1 from 12 s at (200 N m s, 125 kN) upward."""
    x = (KP.values - 200.0) / 100.0
    y = (WEIGHT.values - 125e3) / 25e3
    return 12.0 + np.add.outer(x**2, 3.0 * y**2)


def contour_levels(ax):
    sets = [c for c in ax.collections if hasattr(c, "levels")]
    return [float(level) for c in sets for level in c.levels]


# --- maps ------------------------------------------------------------------------------------


def test_map_labels_units_and_levels(design, field):
    figure = stability_map(made(design, field))
    ax, bar = figure.axes
    assert drawn(figure)
    assert ax.get_xlabel() == "Kp (N m s)"
    assert ax.get_ylabel() == "weight on bit (kN)"
    assert bar.get_ylabel() == "J1 (s)"
    assert ax.get_title(loc="left") == "J1 with its levels\nA title"
    assert contour_levels(ax) == [20.0, 30.0, 40.0]
    assert ax.get_ylim() == pytest.approx((87.5, 212.5))
    texts = {text.get_text() for text in ax.texts}
    assert {"20", "30"} <= texts


def test_colours_stop_at_twice_the_highest_level(design, field):
    ax = stability_map(made(design, field)).axes[0]
    assert ax.collections[0].get_clim() == (0.0, 80.0)
    np.testing.assert_array_equal(ax.collections[0].get_array(), field.T)


def test_field_units(design, field):
    ax = stability_map(made(design, field), system="field").axes[0]
    assert ax.get_ylabel() == "weight on bit (klbf)"
    assert named(ax, "minimum 12.00 s").get_ydata()[0] == pytest.approx(28.1, abs=0.01)


def test_minimum_is_marked(design, field):
    star = named(stability_map(made(design, field)).axes[0], "minimum 12.00 s")
    assert star.get_xdata().tolist() == [200.0]
    assert star.get_ydata().tolist() == [125.0]


def test_audit_is_marked_and_judged(design, field):
    cells = np.array([0, 11])
    fine = of_j1(cells, field.ravel()[cells], field.ravel()[cells] * 1.001)
    figure = stability_map(made(design, field, audit=fine))
    ring = named(figure.axes[0], "audited with the reference solver")
    assert ring.get_xdata().tolist() == [0.0, 400.0]
    assert ring.get_ydata().tolist() == [100.0, 125.0]
    assert "audit: ok (2 cells, worst 1.0e-03 relative in J1)" in figure.get_supxlabel()
    bad = of_j1(cells, field.ravel()[cells], np.array([np.nan, np.nan]))
    assert (
        "audit: check (2 cells, none finished"
        in stability_map(made(design, field, audit=bad)).get_supxlabel()
    )


def test_caption_tells_how_it_was_computed(design, field):
    figure = stability_map(made(design, field))
    assert figure.get_supxlabel().endswith("10 s, step 20 ms, 16 modes; audit: none")
    assert "audited" not in " ".join(legend(figure.axes[0]))


def test_reconstructed_strings_say_so(field):
    known = drillctl.load("monteiro-trindade-140kn", status="measured")
    guessed = drillctl.load("monteiro-trindade-140kn", status="reconstructed")
    assert "reconstructed" not in stability_map(made(known, field)).get_supxlabel()
    assert "String reconstructed" in stability_map(made(guessed, field)).get_supxlabel()


def test_failed_cells_are_crossed_out(design, field):
    field[1, 2] = field[4, 0] = np.nan
    figure = stability_map(made(design, field))
    assert drawn(figure)
    crosses = named(figure.axes[0], "failed")
    assert crosses.get_xdata().tolist() == [200.0, 800.0]
    assert crosses.get_ydata().tolist() == [150.0, 100.0]
    assert "failed" in legend(figure.axes[0])
    shown = np.ma.getmaskarray(figure.axes[0].collections[0].get_array())
    assert shown.reshape(5, 6)[2, 1]


def test_a_map_that_failed_altogether(design, field):
    figure = stability_map(made(design, np.full_like(field, np.nan)))
    assert drawn(figure)
    assert legend(figure.axes[0]) == ["failed"]


@pytest.mark.parametrize("levels", [(1.0,), (500.0,), (1.0, 500.0)])
def test_levels_off_the_map_are_not_drawn(design, field, levels):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure = stability_map(made(design, field, levels=levels))
    assert drawn(figure)
    assert contour_levels(figure.axes[0]) == []


def test_map_takes_two_parameters(design, field):
    with pytest.raises(InputError, match="2 parameters, the result has 1"):
        stability_map(made(design, field[:, 0], axes=(KP,)))
    third = Axis("controller.ki", "N*m/rad", np.array([0.0, 1.0]))
    with pytest.raises(InputError, match="2 parameters, the result has 3"):
        stability_map(made(design, np.ones((6, 5, 2)), axes=(KP, WEIGHT, third)))


def test_maps_are_drawn_on_given_axes(design, field):
    own = Figure()
    left, right = own.subplots(1, 2)
    assert stability_map(made(design, field), left) is own
    assert sweep_line(made(design, field[:, 0], axes=(KP,)), right) is own
    assert left.collections
    assert right.get_lines()


def test_labels_of_other_parameters():
    length = Axis("drillstring.sections.pipe.length", "m", np.array([1000.0, 2000.0]))
    assert axis_label(length, "si")[1] == "drillstring.sections.pipe.length (m)"
    values, label = axis_label(length, "field")
    assert label.endswith("(ft)")
    np.testing.assert_allclose(values, [3280.84, 6561.68], rtol=1e-6)
    assert axis_label(Axis("bit_rock.a1_factor", "", np.ones(2)), "si")[1] == "bit_rock.a1_factor"
    speed = Axis("operating_point.speed", "rad/s", np.array([np.pi]))
    assert axis_label(speed, "si")[1] == "set speed (rpm)"
    assert axis_label(speed, "si")[0][0] == pytest.approx(30.0)


# --- one parameter ---------------------------------------------------------------------------


def test_line_shows_levels_and_audit(design, field):
    values = field[:, 1]
    audit = of_j1(np.array([1, 3]), values[[1, 3]], np.array([12.5, 16.5]))
    figure = sweep_line(made(design, values, axes=(KP,), audit=audit))
    (ax,) = figure.axes
    assert drawn(figure)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("Kp (N m s)", "J1 (s)")
    np.testing.assert_array_equal(named(ax, "batch engine").get_ydata(), values)
    assert named(ax, "reference solver").get_ydata().tolist() == [12.5, 16.5]
    assert named(ax, "reference solver").get_xdata().tolist() == [200.0, 600.0]
    dashed = [line.get_ydata()[0] for line in ax.get_lines() if line.get_linestyle() == "--"]
    assert dashed == list(LEVELS)
    assert [text.get_text() for text in ax.texts] == ["20", "30", "40"]
    assert "audit: check" in figure.get_supxlabel()


def test_line_with_failed_cells(design, field):
    values = field[:, 1].copy()
    values[2] = np.nan
    assert drawn(sweep_line(made(design, values, axes=(KP,))))
    assert drawn(sweep_line(made(design, np.full(6, np.nan), axes=(KP,))))


def test_line_takes_one_parameter(design, field):
    with pytest.raises(InputError, match="1 parameter, the result has 2"):
        sweep_line(made(design, field))


# --- time responses --------------------------------------------------------------------------


@pytest.fixture(scope="module")
def runs(design):
    return [
        drillctl.simulate(design, engine="batch", **{"controller.kp": kp}) for kp in (100.0, 600.0)
    ]


def test_one_response(runs):
    figure = time_response(runs[0])
    (ax,) = figure.axes
    assert drawn(figure)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("time (s)", "speed (rpm)")
    np.testing.assert_allclose(
        named(ax, "bit").get_ydata(), runs[0].signals["bit_speed"] * 30.0 / np.pi
    )
    np.testing.assert_allclose(named(ax, "set speed").get_ydata(), 100.0)
    assert ax.get_title(loc="left").startswith(f"J1 {runs[0].measures.j1:.1f} s: Kp 100")
    assert ax.get_xlim() == (0.0, 10.0)
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == ["bit stuck", "bit", "top drive", "set speed"]


def test_the_stuck_bit_is_shaded(runs):
    stuck = runs[0].signals["stuck"] > 0.5
    assert 0.0 < stuck.mean() < 1.0
    (shade,) = time_response(runs[0]).axes[0].collections
    left = min(path.vertices[:, 0].min() for path in shade.get_paths())
    right = max(path.vertices[:, 0].max() for path in shade.get_paths())
    assert left == pytest.approx(runs[0].time[stuck].min())
    assert right == pytest.approx(runs[0].time[stuck].max())


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_a_panel_each(runs, count):
    figure = time_response([*runs, *runs][:count])
    assert drawn(figure)
    assert sum(ax.get_visible() for ax in figure.axes) == count


def test_no_run_is_nothing_to_draw(design):
    lost = made(design, np.full((6, 5), np.nan))
    assert [picture.name for picture in map_pictures(lost)] == ["map"]
    with pytest.raises(InputError, match="nothing to draw"):
        time_response(responses(lost))


def test_as_many_axes_as_runs(runs):
    own = Figure()
    axes = list(own.subplots(1, 2))
    assert time_response(runs, axes) is own
    with pytest.raises(InputError, match="2 axes"):
        time_response(runs, axes[:1])


def test_responses_of_a_map(design):
    ki = Axis("controller.ki", "N*m/rad", np.linspace(0.0, 500.0, 3))
    result = drillctl.sweep(design, axes=(KP, ki), audit_cells=0)
    found = responses(result)
    j1 = [run.measures.j1 for run in found]
    assert j1 == sorted(set(j1))
    assert j1[0] == result.minimum[0]
    assert set(j1) <= set(result.j1.ravel())
    assert drawn(time_response(found))


def test_the_smallest_j1_may_be_zero(design):
    assert len(responses(made(design, np.zeros((6, 5))))) == 1


# --- settings ----------------------------------------------------------------------------------


def test_settings_are_left_alone(design, field):
    before = dict(mpl.rcParams)
    drawn(stability_map(made(design, field)))
    assert dict(mpl.rcParams) == before
