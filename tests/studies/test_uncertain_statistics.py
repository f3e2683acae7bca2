"""Probabilities, areas, best cells and intervals, on realizations made up for the purpose."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from drillctl.design.uncertain_tables import UntilTable
from drillctl.ensemble import probability as area_module
from drillctl.ensemble.cases import share_interval, share_intervals
from drillctl.ensemble.probability import (
    INNER,
    OUTER,
    Scatter,
    called,
    needed,
    probability_map,
    region_areas,
)
from drillctl.errors import InputError
from drillctl.studies.uncertainty.best import (
    Exceedance,
    Mean,
    Quantile,
    TailMean,
    best_cells,
    quantile_interval,
)
from drillctl.studies.uncertainty.best import values_of as values_of_all
from drillctl.studies.uncertainty.result import convergence, level_of, look, schedule

HOLDS = {
    "intervals under uncertainty": "the binomial law, exactly, n 10 to 10,000; coverage of areas, "
    "quantiles and best cells on made-up draws",
}

ALONE = Scatter(1)
NONE = np.zeros((1, 1), dtype=bool)


def field(count, cells=60, seed=1, own=0.3):
    """J1 of a map: cells get worse along it, a draw moves all of them and each a little."""
    random = np.random.default_rng(seed)
    common, alone = random.normal(size=(count, 1)), random.normal(size=(count, cells))
    return np.linspace(10.0, 50.0, cells) + 5.0 * (common + own * alone)


def truth(level, cells=60, own=0.3):
    return stats.norm(np.linspace(10.0, 50.0, cells), 5.0 * np.hypot(1.0, own)).cdf(level)


# --- intervals of probabilities ----------------------------------------------------------------


@pytest.mark.parametrize("total", [10, 11, 30, 100, 256, 1000, 3000, 10_000])
def test_intervals_hold_the_probability_as_often_as_they_say(total):
    """By the binomial law, exactly: no simulation, no tolerance."""
    hits = np.arange(total + 1)
    grid = np.concatenate([np.linspace(1e-4, 0.9999, 181), [0.05, 0.5, 0.95, 1e-6, 1 - 1e-6]])
    for confidence in (0.95, 0.99, 1.0 - 0.05 / 1681):
        low, high = share_intervals(hits, total, confidence)
        for p in grid:
            holds = (low <= p) & (p <= high)
            missed = stats.binom.pmf(hits[~holds], total, p).sum()
            assert missed <= 1.0 - confidence, (p, confidence)


def test_intervals_are_those_of_scipy():
    for hits, total in ((0, 7), (3, 7), (7, 7), (950, 1000), (1, 10_000)):
        found = stats.binomtest(hits, total).proportion_ci(0.95, method="exact")
        assert share_interval(hits, total) == pytest.approx((found.low, found.high), abs=1e-10)


@pytest.mark.parametrize(
    ("probability", "total", "least"),
    [(0.95, 10, 10), (0.95, 20, 19), (0.95, 10_000, 9500), (0.05, 10, 1), (0.05, 20, 1),
     (0.05, 10_000, 500), (0.5, 7, 4), (1.0, 9, 9)],
)  # fmt: skip
def test_a_share_is_counted_and_not_rounded(probability, total, least):
    assert needed(probability, total) == least


# --- probability maps --------------------------------------------------------------------------


def test_counts_and_regions():
    j1 = np.array([[1.0, 5.0, 9.0], [2.0, 6.0, np.nan], [3.0, 7.0, 9.0], [4.0, 5.0, 9.0]])
    found = probability_map(j1, 5.0, ALONE)
    assert found.counts.tolist() == [4, 2, 0]
    assert found.probability.tolist() == [1.0, 0.5, 0.0]
    assert found.region(0.95).tolist() == [True, False, False]
    assert found.region(0.5).tolist() == [True, True, False]
    assert (found.always.tolist(), found.ever.tolist()) == (
        [True, False, False], [True, True, False]
    )  # fmt: skip


def test_simultaneous_intervals_hold_everywhere_at_once():
    level, missed, trials = 30.0, 0, 200
    p = truth(level)
    for seed in range(trials):
        low, high = probability_map(field(100, seed=seed), level, ALONE).simultaneous
        missed += bool(((p < low) | (p > high)).any())
    assert missed <= 0.05 * trials


def test_intervals_of_replicates_are_of_their_scatter():
    j1 = field(80)
    found = probability_map(j1, 30.0, Scatter(8))
    cell = 30
    each = np.array([(j1[k::8, cell] <= 30.0).mean() for k in range(8)])
    half = stats.t(7).ppf(0.975) * each.std(ddof=1) / np.sqrt(8)
    low, high = found.interval
    assert (low[cell], high[cell]) == pytest.approx((each.mean() - half, each.mean() + half))
    # Where all replicates agree, they tell nothing: the exact interval stands in.
    exact = share_intervals(found.counts, 80)
    assert (found.counts[0], low[0], high[0]) == (80, exact[0][0], 1.0)
    assert low[0] < 1.0


# --- areas -------------------------------------------------------------------------------------


@pytest.fixture
def few_resamples(monkeypatch):
    monkeypatch.setattr(area_module, "RESAMPLES", 400)


@pytest.mark.parametrize("probability", [INNER, 0.5, OUTER])
@pytest.mark.parametrize("count", [16, 64, 400])
def test_intervals_hold_the_area(probability, count, few_resamples):
    level, trials = 30.0, 60
    area = float((truth(level) >= probability).mean())
    held = 0
    for seed in range(trials):
        j1 = field(count, seed=seed)
        (found,) = region_areas(j1, [(probability_map(j1, level, ALONE), probability)], ALONE, seed)
        low, high = found.interval
        held += low <= area <= high
        assert low <= found.value <= high
    # 54 of 60 would happen by chance to one in a hundred of intervals that hold 95 %.
    assert held >= 54


def test_areas_of_cells_that_cannot_change_are_counted(few_resamples):
    j1 = np.tile(np.array([1.0, 1.0, 9.0, 9.0, 9.0]), (500, 1))
    j1[::2, 1] = 9.0
    (found,) = region_areas(j1, [(probability_map(j1, 5.0, ALONE), INNER)], ALONE, 0)
    assert found.value == 0.2
    assert found.interval == (0.2, 0.2)


def test_areas_of_replicates_by_leaving_one_out():
    j1 = field(160)
    scatter = Scatter(8)
    found = probability_map(j1, 30.0, scatter)
    (area,) = region_areas(j1, [(found, 0.5)], scatter, 0)
    without = []
    for k in range(8):
        rows = np.arange(160) % 8 != k
        without.append(((j1[rows] <= 30.0).mean(axis=0) >= 0.5).mean())
    spread = np.sqrt(7 / 8 * np.sum((without - np.mean(without)) ** 2))
    half = stats.t(7).ppf(0.975) * spread
    low, high = area.interval
    assert low <= max(area.value - half, 0.0)
    assert high >= min(area.value + half, 1.0)
    assert high - low < 0.5


def test_areas_have_the_same_bits_again():
    j1 = field(100)
    asked = [(probability_map(j1, level, ALONE), INNER) for level in (20.0, 30.0)]
    one, again = (region_areas(j1, asked, ALONE, 3) for _ in range(2))
    assert one == again
    # And each level the same as by itself.
    assert region_areas(j1, asked[1:], ALONE, 3) == one[1:]


def test_convergence_ends_at_all_realizations():
    j1 = field(100)
    found = convergence(j1, (20.0, 30.0), ALONE, 1)
    assert found.counts == (16, 32, 64, 100)
    whole = region_areas(j1, [(probability_map(j1, 30.0, ALONE), INNER)], ALONE, 1)[0]
    assert found.areas[30.0][-1] == whole


# --- stopping ----------------------------------------------------------------------------------


def test_looks_are_fixed_beforehand():
    assert schedule(256, 2000) == (256, 512, 1024, 2000)
    assert schedule(256, 2048) == (256, 512, 1024, 2048)
    assert schedule(256, 100) == (100,)


def test_looks_share_the_error():
    j1, table = field(300, cells=600), UntilTable(level=30.0, half_width=0.05)
    one = look(j1, table, 30.0, 1, ALONE, 1)
    fourth = look(j1, table, 30.0, 4, ALONE, 1)
    assert (one.confidence, fourth.confidence) == (0.95, 0.9875)
    assert fourth.interval[0] <= one.interval[0] <= one.interval[1] <= fourth.interval[1]
    assert fourth.interval != one.interval


def test_enough_is_on_either_side():
    one = look(field(300), UntilTable(level=30.0), 30.0, 1, ALONE, 1)
    widest = max(one.area - one.interval[0], one.interval[1] - one.area)
    assert one.enough(widest)
    assert not one.enough(widest * 0.999)


def test_the_level_is_one_of_the_map():
    assert level_of(UntilTable(), (20.0, 40.0)) == 40.0
    with pytest.raises(InputError, match=r"30 is no level of the map; allowed: 20, 40"):
        level_of(UntilTable(level=30.0), (20.0, 40.0))


# --- best cells --------------------------------------------------------------------------------


def valley(count=400, cells=21, seed=1):
    """J1 that is least in the middle, with a tail that is least one cell to the right."""
    random = np.random.default_rng(seed)
    at = np.arange(cells) - cells // 2
    common = random.gamma(2.0, 1.0, size=(count, 1))
    return 15.0 + 0.3 * at**2 + common * (1.0 + 0.1 * (at - 2.0) ** 2)


def values_of(objective, j1, censored):
    return values_of_all([objective], j1, censored)[objective.name]


def best(objective, j1, censored, scatter, seed):
    found = values_of_all([objective], j1, censored)
    (one,) = best_cells([objective], found, j1, censored, scatter, seed).values()
    if isinstance(one, InputError):
        raise one
    return one


def none(j1):
    return np.zeros(j1.shape, dtype=bool)


@pytest.mark.parametrize("objective", [Mean(), Quantile(), TailMean(), Exceedance(20.0)])
def test_the_best_cell_is_the_smallest(objective):
    j1 = valley()
    found = best(objective, j1, none(j1), ALONE, 0)
    values = values_of(objective, j1, none(j1)).values
    assert found.cell == np.argmin(values)
    told = 1.0 - found.value if isinstance(objective, Exceedance) else found.value
    assert told == pytest.approx(values.min(), abs=1e-12)
    low, high = found.interval
    assert low <= found.value <= high
    assert found.alike[found.cell]
    assert found.alike.sum() < 8  # draws are common: neighbours are told apart


def test_objectives_are_what_they_are_called():
    j1 = valley()
    column = j1[:, :1]
    ordered = np.sort(column, axis=0)
    assert Mean().values(ordered) == pytest.approx(column.mean())
    q = Quantile().values(ordered)[0]
    assert (column <= q).mean() >= 0.95 > (column < q).mean()
    worst = ordered[380:, 0]
    assert TailMean().values(ordered)[0] == pytest.approx(worst.mean(), rel=1e-3)
    assert Exceedance(20.0).values(ordered)[0] == (column > 20.0).mean()
    assert [one.name for one in (Mean(), Quantile(), TailMean(), Exceedance(40.0))] == [
        "mean", "q95", "cvar95", "probability_40"
    ]  # fmt: skip
    assert called("probability_40") == "largest P(J1 ≤ 40 s)"
    assert called("q95") == "least 95 % quantile of J1"


@pytest.mark.parametrize("objective", [Mean(), Quantile(), TailMean(), Exceedance(20.0)])
def test_influence_tells_the_scatter_of_an_objective(objective):
    found, told = [], []
    for seed in range(300):
        j1 = valley(400, 5, seed)[:, :1]
        ordered = np.sort(j1, axis=0)
        found.append(objective.values(ordered)[0])
        told.append(ALONE.standard_error(objective.influence(j1, ordered))[0])
    # The sparsity that a quantile's error follows from is a little too large in a convex tail.
    most = 1.3 if isinstance(objective, Quantile) else 1.15
    assert 0.87 < np.mean(told) / np.std(found) < most


def test_common_draws_tell_neighbours_apart_that_intervals_alone_do_not():
    j1 = valley()
    shuffled = np.column_stack(
        [np.random.default_rng(k).permutation(c) for k, c in enumerate(j1.T)]
    )
    paired = best(Mean(), j1, none(j1), ALONE, 0).alike.sum()
    apart = best(Mean(), shuffled, none(j1), ALONE, 0).alike.sum()
    assert paired < apart


def test_the_truly_best_cell_is_among_those_alike():
    lost, trials = 0, 600
    for seed in range(trials):
        random = np.random.default_rng(seed)
        j1 = random.normal(20.0, 2.0, size=(200, 12))  # each is as good as any
        lost += not best(Mean(), j1, none(j1), ALONE, 0).alike[0]
    # More would be lost by chance to one in a thousand of sets that hold the best with 95 %.
    assert lost <= stats.binom.ppf(0.999, trials, 0.05)


def test_too_few_draws_say_so():
    j1 = valley(40)
    for objective in (Quantile(), TailMean()):
        found = best(objective, j1, none(j1), ALONE, 0)
        assert found.alike is None
    assert best(TailMean(), j1, none(j1), ALONE, 0).interval == (None, None)
    assert best(Quantile(), j1, none(j1), ALONE, 0).interval[1] is None


@pytest.mark.parametrize("count", [20, 100, 1000])
def test_intervals_of_quantiles_hold_them(count):
    """By the binomial law: the k-th smallest is under the quantile if k or more draws are."""
    low, high = quantile_interval(np.arange(1.0, count + 1.0), 0.95)
    under = 1.0 - stats.binom.cdf(high - 1, count, 0.95) if high is not None else 0.0
    over = stats.binom.cdf(low - 1, count, 0.95) if low is not None else 0.0
    assert under + over <= 0.05
    assert (high is None) == (count < 72)  # the largest of fewer is under it too often


# --- lanes that were stopped -------------------------------------------------------------------


def stopped(j1, level):
    """The same with lanes stopped just above a level."""
    censored = j1 > level
    return np.where(censored, level + 0.01 * (1.0 + j1 / j1.max()), j1), censored


def test_what_stopped_lanes_do_not_enter_is_the_same():
    j1 = valley()
    short, censored = stopped(j1, 30.0)
    assert censored.any()
    for objective in (Mean(), Quantile(), TailMean(), Exceedance(30.0), Exceedance(20.0)):
        whole = values_of(objective, j1, none(j1))
        some = values_of(objective, short, censored)
        assert (some.values[some.certain] == whole.values[some.certain]).all()
        assert (some.values <= whole.values + 1e-12).all()  # a lower bound everywhere
        assert some.certain[10]
    assert values_of(Exceedance(30.0), short, censored).certain.all()
    assert not values_of(Mean(), short, censored).certain.all()


def test_the_best_cell_is_certain_though_others_were_stopped():
    j1 = valley()
    short, censored = stopped(j1, 40.0)
    assert censored.any()
    for objective in (Mean(), Quantile()):
        whole, some = (
            best(objective, j1, none(j1), ALONE, 0),
            best(objective, short, censored, ALONE, 0),
        )
        assert (some.cell, some.value, some.interval) == (whole.cell, whole.value, whole.interval)
        assert some.alike is None


def test_what_is_not_known_is_refused_by_name():
    j1 = valley()
    short, censored = stopped(j1, 17.0)
    for objective in (Mean(), Quantile(), TailMean()):
        with pytest.raises(InputError, match=f"{objective.name}: lanes were stopped .* --full"):
            best(objective, short, censored, ALONE, 0)


def test_cells_with_failed_lanes_are_not_the_best():
    j1 = valley()
    j1[0, 10] = np.nan
    assert best(Mean(), j1, none(j1), ALONE, 0).cell != 10
    j1[0] = np.nan
    with pytest.raises(InputError, match="every cell has failed lanes"):
        best(Mean(), j1, none(j1), ALONE, 0)


def test_replicates_keep_together_when_some_draws_fail():
    chosen = np.ones(80, dtype=bool)
    chosen[[3, 11, 40]] = False
    scatter = Scatter(8).of(chosen)
    rows = scatter.rows(77)
    numbers = np.flatnonzero(chosen)
    for k, own in enumerate(rows):
        assert (numbers[own] % 8 == k).all()
    assert sum(map(len, rows)) == 77
    assert Scatter(8).of(np.ones(8, dtype=bool)).numbers is None
