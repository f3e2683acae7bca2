"""Statistics of J1, and what is added to them."""

import numpy as np
import pytest

import drillctl
from drillctl.studies.tune.problem import (
    PRICE,
    Objective,
    objective_of,
    rank_weights,
    smooth_weights,
)
from drillctl.studies.tune.settings import TuneTable

J1 = np.random.default_rng(3).lognormal(3.0, 0.4, 97)


def statistic(kind, quantile=0.95):
    return float(np.sort(J1) @ rank_weights(kind, quantile, len(J1)))


def test_statistics_are_their_definitions():
    assert statistic("mean") == pytest.approx(J1.mean())
    assert statistic("worst") == J1.max()
    for level in (0.5, 0.9, 0.95):
        assert statistic("quantile", level) == pytest.approx(np.quantile(J1, level), rel=1e-12)
    # The mean of the largest 4.85 of 97 values.
    largest = np.sort(J1)[::-1]
    beyond = 0.05 * 97
    assert statistic("cvar") == pytest.approx(
        (largest[:4].sum() + (beyond - 4) * largest[4]) / beyond, rel=1e-12
    )
    # Rockafellar & Uryasev: the least over c of c + mean of what lies above c over 1 - q.
    above = min(c + np.maximum(J1 - c, 0).mean() / 0.05 for c in J1)
    assert statistic("cvar") == pytest.approx(above, rel=1e-12)


@pytest.mark.parametrize("kind", ["mean", "quantile", "cvar", "worst"])
@pytest.mark.parametrize("count", [1, 2, 7, 500])
def test_weights_sum_to_one(kind, count):
    for make in (rank_weights, smooth_weights):
        weights = make(kind, 0.95, count)
        assert weights.sum() == pytest.approx(1.0)
        assert (weights >= 0.0).all()


def test_a_smooth_quantile_is_near_and_lets_no_outlier_in():
    many = np.sort(np.random.default_rng(4).lognormal(3.0, 0.2, 1000))
    smooth = many @ smooth_weights("quantile", 0.95, 1000)
    assert smooth == pytest.approx(np.quantile(many, 0.95), rel=5e-3)
    many[-20:] = 1e6
    assert many @ smooth_weights("quantile", 0.95, 1000) == smooth


def test_other_measures_and_limits_are_added():
    design = drillctl.load(
        "monteiro-trindade-140kn",
        tune={
            "objective": "mean",
            "weights": {"effort": 2.0, "peak_top_torque": 3.0, "lost_weight": 10.0},
            "constraints": {"peak_top_torque": "12 kN*m", "mean_weight_on_bit": "139 kN"},
        },
    )
    objective = objective_of(design)
    assert objective.static == pytest.approx(11900.0)
    measures = {
        "j1": np.array([10.0, 20.0]), "effort": np.array([1190.0, 1190.0]),
        "peak_top_torque": np.array([11900.0, 13090.0]),
        "mean_weight_on_bit": np.array([130e3, 136e3]),
    }  # fmt: skip
    assert set(objective.needs) == set(measures)
    value = 15.0 + 2.0 * 0.1 + 3.0 * 1.05 + 10.0 * (1 - 133 / 140)
    assert objective.value(measures) == pytest.approx(value)
    missed = objective.violations(measures)
    assert missed["peak_top_torque"] == pytest.approx((11900 + 0.95 * 1190) / 12e3 - 1)
    assert missed["mean_weight_on_bit"] == pytest.approx(1 - 133 / 139)
    assert objective.merit(measures) == pytest.approx(value + PRICE * sum(missed.values()))


def test_runs_without_an_answer_count_as_infinite():
    j1 = np.append(np.linspace(10.0, 20.0, 99), np.inf)
    found = {
        kind: float(Objective(TuneTable(objective=kind), 1.0, 1.0).value({"j1": j1}))
        for kind in ("mean", "quantile", "worst")
    }
    assert np.isinf(found["mean"])
    assert np.isinf(found["worst"])
    assert found["quantile"] == pytest.approx(np.quantile(j1, 0.95))
