"""Pictures of a comparison: what is drawn is what was found."""

from __future__ import annotations

import numpy as np
import pytest
from looks import drawn, legend
from matplotlib.figure import Figure

import drillctl
from drillctl.ensemble.audit import unaudited
from drillctl.errors import InputError
from drillctl.plots import j1_against_weight, j1_distributions, paired_differences
from drillctl.plots.comparison import UNBEATEN, _unbeaten
from drillctl.studies.compare.compute import COMPARED, ComparedCase, Comparison, Nominal

COUNT = 30


@pytest.fixture(scope="module")
def design():
    return drillctl.load("monteiro-trindade-140kn", **{"title": "A title"})


def case(design, name, shift, failed=0):
    """A case whose every measure is 10 to 39, more by a shift; the first draws failed."""
    values = np.arange(COUNT) + 10.0 + shift
    values[:failed] = np.nan
    measures = {measure: values.copy() for measure in COMPARED}
    measures["settling_time"][:] = np.nan
    measures["time_outside_table"][:] = 0.0
    measures["mean_weight_after_start"] = 140e3 + 1e3 * values
    status = np.where(np.isnan(values), 5, 0).astype(np.int8)
    return ComparedCase(
        name=name, design=design, drawn={"bit_rock.a1_factor": np.ones(COUNT)},
        measures=measures, status=status, failures=(), weight_shift=0.0, step=0.02, modes=9,
        nominal=Nominal(None, "not asked", None), audit=unaudited("draw"),
    )  # fmt: skip


def made(design, *cases, **changes):
    values = {
        "design": design, "cases": cases, "realizations": COUNT, "seed": 3,
        "levels": (15.0, 30.0), "weight_from": 20.0, "equal_mean_weight": False,
        "total_seconds": 1.0,
    }  # fmt: skip
    return Comparison(**(values | changes))


@pytest.fixture
def result(design):
    return made(design, case(design, "one", 0.0), case(design, "two", -4.0, failed=6))


def told(figure):
    """The axes, and the texts of the figure in one."""
    (ax,) = drawn(figure)
    texts = [*(t.get_text() for t in ax.texts), ax.get_xlabel(), ax.get_title(loc="left")]
    return ax, "\n".join([*texts, *legend(ax), figure.get_supxlabel()])


def test_curves_end_where_draws_failed(result):
    ax, text = told(j1_distributions(result))
    curves = {line.get_label(): line.get_ydata()[-1] for line in ax.lines[:1]}
    assert curves == {"one": 1.0}
    two = next(line for line in ax.lines if line.get_label() == "two (6 failed)")
    assert two.get_ydata()[-1] == pytest.approx(24 / 30)
    assert two.get_xdata()[-1] == 35.0
    # At 20.5 s the curve stands at the share of the draws under it.
    height = two.get_ydata()[np.searchsorted(two.get_xdata(), 20.5) - 1]
    assert height == pytest.approx((two.get_xdata()[1:] <= 20.5).sum() / 30)
    levels = [line.get_xdata()[0] for line in ax.lines if len(line.get_xdata()) == 2]
    assert levels == [15.0, 30.0]
    assert "30 draws of bit_rock.a1_factor, the same for all cases (seed 3)" in text
    assert "String reconstructed" in text
    assert "A title" in text


def test_differences_stand_at_their_share_of_the_baseline(result):
    ax, text = told(paired_differences(result))
    labels = [label.get_text() for label in ax.get_yticklabels()]
    assert labels[0] == "J1"
    assert "settling time" not in labels
    assert "Zero or undefined in a case: settling time, time outside table." in text
    points = ax.containers[0].lines[0].get_xdata()
    # Of the baseline's mean over the pairs: draws 6 to 29.
    base = result.baseline.measures["j1"][6:].mean()
    assert points[0] == pytest.approx(-4.0 / base * 100)
    assert "% of its mean" in text


def test_intervals_are_drawn(design):
    noisy = case(design, "two", -4.0)
    noisy.measures["j1"][:] += np.random.default_rng(1).normal(0.0, 2.0, COUNT)
    result = made(design, case(design, "one", 0.0), noisy)
    ax, _ = told(paired_differences(result))
    bars = ax.containers[0].lines[2][0].get_segments()
    low, high = bars[0][:, 0]
    base = result.baseline.measures["j1"].mean()
    assert (low, high) == pytest.approx(
        tuple(100 * end / base for end in result.paired["two"]["j1"].interval)
    )


def test_j1_against_weight(result):
    ax, text = told(j1_against_weight(result))
    means = [c.lines[0].get_xydata()[0] for c in ax.containers]
    for mean, found in zip(means, result.cases, strict=True):
        # Over draws 6 to 29 in both cases: the others failed in one of them.
        weight, j1 = found.measures["mean_weight_after_start"][6:], found.measures["j1"][6:]
        assert mean == pytest.approx((weight.mean() / 1e3, j1.mean()))
    assert "means over the 24 draws defined in all" in text
    dots = [line for line in ax.lines if line.get_marker() == "."]
    assert [int(np.isfinite(line.get_ydata()).sum()) for line in dots] == [30, 24]
    assert "mean WOB after 20 s (kN)" in text
    _, text = told(j1_against_weight(result, system="field"))
    assert "(klbf)" in text


def test_no_case_is_called_unbeaten_where_weights_were_made_equal(design):
    cases = case(design, "one", 0.0), case(design, "two", 4.0)
    assert "unbeaten in both" in told(j1_against_weight(made(design, *cases)))[1]
    equal = made(design, *cases, equal_mean_weight=True)
    assert "unbeaten" not in told(j1_against_weight(equal))[1]


def ringed(ax):
    (found,) = (line for line in ax.lines if line.get_label() == UNBEATEN)
    return found.get_xydata().tolist()


def test_the_unbeaten_are_ringed(design):
    light, heavy, worse = (case(design, name, shift) for name, shift in
                           (("light", 0.0), ("heavy", 4.0), ("worse", 8.0)))  # fmt: skip
    worse.measures["mean_weight_after_start"][:] = 142e3
    result = made(design, light, heavy, worse)
    ax, text = told(j1_against_weight(result))
    means = [
        [one.measures["mean_weight_after_start"].mean() / 1e3, one.measures["j1"].mean()]
        for one in result.cases
    ]
    assert np.allclose(ringed(ax), means[:2])
    assert "no other case has less J1 and more weight" in text
    assert legend(ax) == ["light", "heavy", "worse", UNBEATEN]


def test_one_that_beats_all_is_ringed_alone(design):
    best = case(design, "best", -5.0)
    best.measures["mean_weight_after_start"][:] = 200e3
    ax, _ = told(j1_against_weight(made(design, case(design, "one", 0.0), best)))
    assert np.allclose(ringed(ax), [[200.0, 19.5]])


def test_a_case_is_not_the_better_for_failing_at_the_worst(design):
    """Over its own draws the second has less J1 and would beat the first."""
    one, two = case(design, "one", 0.0), case(design, "two", 1.0)
    for found in (one, two):
        found.measures["mean_weight_after_start"][:] = 140e3
    two.measures["j1"][20:] = np.nan
    assert np.nanmean(two.measures["j1"]) < one.measures["j1"].mean()
    ax, _ = told(j1_against_weight(made(design, one, two)))
    assert np.allclose(ringed(ax), [[140.0, one.measures["j1"][:20].mean()]])


def test_no_draw_in_common_is_no_mean(design):
    one, two = case(design, "one", 0.0), case(design, "two", 0.0)
    one.measures["j1"][:15] = np.nan
    two.measures["j1"][15:] = np.nan
    figure = j1_against_weight(made(design, one, two))
    (ax,) = drawn(figure)
    assert not ax.containers
    assert "means over the 0 draws" in figure._supxlabel.get_text()


def test_the_unbeaten():
    points = [(1.0, 1.0), (2.0, 3.0), (1.5, 4.0), (3.0, 5.0)]
    assert _unbeaten(points) == [(1.0, 1.0), (2.0, 3.0), (3.0, 5.0)]


def test_equal_means_are_told(design):
    result = made(design, case(design, "one", 0.0), equal_mean_weight=True)
    for picture in (j1_distributions, j1_against_weight):
        text = told(picture(result))[1]
        assert "Nominal weights shifted for equal means." in text
        assert max(map(len, text.splitlines())) <= 110


def test_one_case_has_no_differences(design):
    with pytest.raises(InputError, match="two cases or more"):
        paired_differences(made(design, case(design, "one", 0.0)))


def test_a_case_that_failed_altogether_can_be_drawn(design):
    result = made(design, case(design, "one", 0.0), case(design, "two", 0.0, failed=COUNT))
    assert "two (30 failed)" in told(j1_distributions(result))[1]
    ax, text = told(j1_against_weight(result))
    assert len(ax.containers) == 1  # the other still has its mean, over all draws
    assert "means over the draws" in text
    told(paired_differences(result))


@pytest.mark.parametrize("picture", [j1_distributions, paired_differences, j1_against_weight])
def test_given_axes_are_used(result, picture):
    ax = Figure().add_subplot()
    assert picture(result, ax=ax) is ax.figure
    assert ax.has_data()
