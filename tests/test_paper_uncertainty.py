"""The source paper's Fig. 6 and its statements 4 and 5, on the shipped designs."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy import stats

import drillctl
from drillctl.design import axis_tables
from drillctl.studies.uncertainty.compute import uncertainty

HOLDS = {
    "the paper's Fig. 6": "statements 4 and 5; independently computed areas and best gains",
}

KP, KI = "controller.kp", "controller.ki"


@pytest.fixture(scope="module")
def fig6():
    """The shipped design: 10 realizations, as the paper had."""
    return uncertainty(drillctl.load("monteiro-trindade-fig6"), audit_cells=2)


def test_the_shipped_design_is_that_of_the_paper(fig6):
    assert [(a.path, a.values[0], a.values[-1], len(a)) for a in fig6.axes] == [
        (KP, 400.0, 800.0, 41), (KI, 0.0, 200.0, 41)
    ]  # fmt: skip
    assert fig6.levels == (20.0, 30.0, 40.0, 50.0)
    assert fig6.realizations == 10
    assert fig6.design.tables.operating_point.weight_on_bit == 140e3
    assert set(fig6.drawn) == {"bit_rock.a1_factor", "bit_rock.a2_factor"}
    assert fig6.audit.verdict == "ok"
    many = drillctl.load("monteiro-trindade-fig6-10000")
    assert many.tables.uncertainty.realizations == 10_000
    assert many.tables.uncertain == fig6.design.tables.uncertain
    assert axis_tables(many) == axis_tables(fig6.design)


def test_statement_4_uncertainty_shrinks_the_usable_region(fig6):
    for level in fig6.levels:
        found = fig6.maps[level]
        nominal = fig6.nominal_regions[level].mask
        always = found.region(0.95)
        assert always.sum() < 0.75 * nominal.sum()
        assert (always & nominal).sum() >= 0.95 * always.sum()  # inside it, not beside
        assert found.ever.sum() > nominal.sum()  # the envelope reaches beyond it


def test_statement_5_the_best_gains_stay_the_best(fig6):
    i, j = np.meshgrid(*(a.values for a in fig6.axes), indexing="ij")
    paper = (i >= 600) & (i <= 650) & (j >= 100) & (j <= 150)
    # Each realization by itself: its best cell is there or a step or two beside.
    for level in (30.0, 40.0):
        probability = fig6.maps[level].probability
        assert probability[paper].mean() > 0.85
        assert probability[paper].mean() > 3.0 * probability.mean()
    mean = fig6.mean()
    assert mean[paper].mean() < 0.5 * mean.mean()
    best = fig6.at(fig6.best("mean").cell)
    assert 600 <= best[KP] <= 650
    assert 100 <= best[KI] <= 165


@pytest.fixture(scope="module")
def many():
    return uncertainty(drillctl.load("monteiro-trindade-fig6"), realizations=4 * 256, audit_cells=0)


@pytest.fixture(scope="module")
def quarters(many):
    """The same by 256 draws: what the figures of so many draws scatter like."""
    return [
        dataclasses.replace(
            many,
            measures={"j1": many.j1[rows]},
            status=many.status[rows],
            drawn={path: values[rows] for path, values in many.drawn.items()},
        )
        for rows in (slice(k, k + 256) for k in range(0, 1024, 256))
    ]


def within_sampling_error(figures, low, high):
    """Whether another figure of 256 draws may well lie between two values (95 %)."""
    spread = np.std(figures, ddof=1) * np.sqrt(1.0 + 1.0 / len(figures))
    half = stats.t(len(figures) - 1).ppf(0.975) * spread
    return np.mean(figures) - half <= high and np.mean(figures) + half >= low


@pytest.mark.slow
def test_areas_of_256_draws(many, quarters):
    """Independently computed shares of the window."""
    areas = many.areas[40.0]
    assert many.nominal_regions[40.0].area_fraction == pytest.approx(0.28, abs=0.01)
    assert areas[0.95].value == pytest.approx(0.035, abs=0.015)
    assert areas[0.05].value == pytest.approx(0.53, abs=0.05)
    for probability, expected in ((0.95, 0.035), (0.05, 0.53)):
        figures = [one.areas[40.0][probability].value for one in quarters]
        assert within_sampling_error(figures, expected, expected)


@pytest.mark.slow
def test_best_gains_of_256_draws(many, quarters):
    here = np.ravel_multi_index((23, 29), (41, 41))  # (630, 145)
    for name, low, high in (("mean", 17.6, 18.0), ("q95", 18.6, 18.7)):
        found = many.best(name)
        assert many.at(found.cell) == {KP: 630.0, KI: 145.0}
        assert found.alike[here]
        assert within_sampling_error([one.best(name).value for one in quarters], low, high)


@pytest.mark.slow
def test_the_quantile_is_a_sharp_ridge(many):
    quantile = many.quantile(0.95)
    row = [quantile[k, 29] for k in (22, 23, 24)]
    assert row[1] < row[0]
    assert row[1] < row[2]


@pytest.mark.slow
def test_probabilities_of_256_draws(many):
    counts = many.probability(33.0).counts
    for kp, ki, expected in ((620, 140, 0.996), (600, 110, 0.75)):
        theirs, ours = round(256 * expected), int(counts[(kp - 400) // 10, ki // 5])
        table = [[theirs, 256 - theirs], [ours, 1024 - ours]]
        assert stats.fisher_exact(table).pvalue > 0.05


@pytest.mark.slow
def test_counts_of_the_fast_scheme_are_those_of_the_fine_one():
    """Probabilities of both schemes at the same draws, over a coarse map of the window."""
    axes = [
        {"path": KP, "min": 400, "max": 800, "points": 9},
        {"path": KI, "min": 0, "max": 200, "points": 9},
    ]
    design = drillctl.load("monteiro-trindade-fig6", **{"map.axes": axes})
    fast, fine = (
        uncertainty(design.replace({"simulation.accuracy": accuracy}), realizations=500,
                    audit_cells=0)
        for accuracy in ("fast", "fine")
    )  # fmt: skip
    for level in fast.levels:
        apart = fast.maps[level].probability - fine.maps[level].probability
        assert np.abs(apart).max() <= 0.01
