"""Pictures of tuned gains show the numbers of the result."""

import dataclasses

import numpy as np
import pytest
from matplotlib.figure import Figure

import drillctl
from drillctl import plots
from drillctl.errors import InputError
from drillctl.studies.tune.compute import tune

PAPER = "monteiro-trindade-140kn"
SMALL = {"realizations": 24, "starts": 1, "certificate": {"realizations": 60, "audit": 0}}


@pytest.fixture(scope="module")
def found():
    bounds = {"controller.kp": {"min": 600, "max": 660}, "controller.ki": {"min": 120, "max": 170}}
    design = drillctl.load(PAPER, tune={"parameters": bounds, "probability": 0.9, **SMALL})
    return tune(design)


def lines_of(ax):
    return [line.get_xydata() for line in ax.get_lines()]


def test_a_row_for_the_tuned_gains_and_each_baseline(found):
    figure = plots.tune_baselines(found)
    left, right = figure.axes
    names = [one.name for one in found.baselines]
    assert [label.get_text() for label in left.get_yticklabels()] == ["tuned", *names]
    points = {float(xy[0, 1]): float(xy[0, 0]) for xy in lines_of(right) if len(xy) == 1}
    rows = [found.certificate.runs, *(one.runs for one in found.baselines)]
    assert points == {float(k): runs.probability for k, runs in enumerate(rows)}
    medians = {float(xy[0, 1]): float(xy[0, 0]) for xy in lines_of(left) if len(xy) == 1}
    assert medians == {float(k): runs.quantiles["q50"] for k, runs in enumerate(rows)}
    ends = [xy for xy in lines_of(right) if len(xy) == 2 and xy[0, 1] == xy[1, 1] == 0.0]
    assert tuple(ends[0][:, 0]) == found.certificate.runs.interval
    assert "fresh realizations" in figure.get_supxlabel()


def test_baselines_that_do_not_apply_have_no_row_and_infinite_ones_no_bar(found):
    lost = dataclasses.replace(found.baselines[0], runs=None, reason="not here")
    endless = dataclasses.replace(
        found.baselines[1].runs, j1=np.full(60, np.inf), value=float("inf")
    )
    never = dataclasses.replace(found.baselines[1], runs=endless)
    result = dataclasses.replace(found, baselines=(lost, never))
    left, _ = plots.tune_baselines(result).axes
    assert [label.get_text() for label in left.get_yticklabels()] == ["tuned", never.name]
    assert not [xy for xy in lines_of(left) if len(xy) == 1 and xy[0, 1] == 1.0]


def test_the_neighbourhood_shows_optimum_tolerance_and_contour(found):
    figure = plots.tune_neighbourhood(found)
    ax = figure.axes[0]
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("Kp (N m s)", "Ki (N m)")
    kp, ki = found.certificate.tolerances
    bars = [xy for xy in lines_of(ax) if len(xy) == 2]
    np.testing.assert_allclose(bars[0], [[kp.low, ki.value], [kp.high, ki.value]])
    np.testing.assert_allclose(bars[1], [[kp.value, ki.low], [kp.value, ki.high]])
    star = lines_of(ax)[-1][0]
    np.testing.assert_allclose(star, found.tuning.values)
    mesh = ax.collections[0].get_array()
    np.testing.assert_array_equal(mesh, found.certificate.neighbourhood.probability.T)
    assert len(ax.collections) == 2  # the contour of what is required


def test_a_bound_that_ends_the_drift_is_an_arrow(found):
    kp, ki = found.certificate.tolerances
    kp = dataclasses.replace(kp, low_at_bound=True, high_at_bound=False)
    certificate = dataclasses.replace(found.certificate, tolerances=(kp, ki))
    ax = plots.tune_neighbourhood(dataclasses.replace(found, certificate=certificate)).axes[0]
    markers = [line.get_marker() for line in ax.get_lines() if len(line.get_xydata()) == 1]
    assert markers[:2] == ["<", "|"]


def test_one_parameter_is_a_curve():
    values = {"controller.law": "soft-torque", "simulation.accuracy": "fast"}
    table = {"parameters": {"controller.share": {"min": 0.3, "max": 0.9}}, **SMALL}
    result = tune(drillctl.load(PAPER, **values, tune=table))
    own = Figure()
    ax = own.add_subplot()
    assert plots.tune_neighbourhood(result, ax=ax) is own
    about = result.certificate.neighbourhood
    curve = lines_of(ax)[0]
    np.testing.assert_array_equal(curve[:, 0], about.axes[0].values)
    np.testing.assert_array_equal(curve[:, 1], about.probability)


def test_panels_that_are_too_few_are_refused(found):
    with pytest.raises(InputError, match="needs 2 axes"):
        plots.tune_baselines(found, ax=[Figure().add_subplot()])
