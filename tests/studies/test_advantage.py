"""PI against PI with dynamic weight on bit: optima, equalities, pairs, crossings."""

from __future__ import annotations

import json
import types

import numpy as np
import pytest

import drillctl
from drillctl import plots, units
from drillctl.cli import run
from drillctl.ensemble.cases import percentile_estimate, resampled_crossing
from drillctl.ensemble.draws import drawn_lanes
from drillctl.ensemble.parameters import draw
from drillctl.errors import InputError
from drillctl.progress import SILENT
from drillctl.rig.weight_on_bit import ConstantWeight, FollowingSpeed, ObservedWeight, RealWeight
from drillctl.store.tables import NOTHING, write_csv
from drillctl.store.tables import number as tables_number
from drillctl.studies.advantage import STUDY
from drillctl.studies.advantage import compute as delays_module
from drillctl.studies.advantage.cases import (
    CONSTANT,
    DELAY,
    GAIN,
    IDEAL,
    KI,
    KP,
    MEAN,
    NOMINAL,
    REAL,
    ROP,
    Optimum,
    fresh_draws,
    fresh_shift,
    measured,
    optimum,
    optimum_beside,
    policies,
)
from drillctl.studies.advantage.compute import advantage, chart, delay_curve
from drillctl.studies.compare.compute import compare
from drillctl.studies.tune.search import search
from tests.alike import rows_of, same

HOLDS = {
    "constant against dynamic weight, each tuned": "a weight that may not follow is the constant "
    "one to the bit; equal means by runs of `compare`; the search itself; crossing delays by "
    "hand; the shipped case (slow)",
}

SHIPPED = "pi-vs-pi-dynamic-wob"
SMALL = {
    "tune.realizations": 50,
    "advantage.realizations": 60,
    "advantage.sweep_realizations": 30,
    "advantage.region_points": 5,
    "advantage.region_realizations": 40,
    "advantage.weights": ["130 kN", "140 kN"],
    "advantage.speeds": ["100 rpm"],
    "advantage.delays": ["0 s", "0.1 s", "0.5 s"],
}


@pytest.fixture(scope="module")
def design():
    return drillctl.load(SHIPPED, **SMALL)


@pytest.fixture(scope="module")
def result(design):
    return advantage(design)


# --- what is compared --------------------------------------------------------------------------


def test_policies_differ_in_the_law_of_the_weight_alone(design):
    constant, ideal, real = policies(design)
    assert [p.name for p in (constant, ideal, real)] == [CONSTANT, IDEAL, REAL]
    laws = [type(p.design.weight_on_bit) for p in (constant, ideal, real)]
    assert laws == [ConstantWeight, FollowingSpeed, RealWeight]
    assert (real.design.weight_on_bit.hoist, real.design.weight_on_bit.rate) == (0.5, 50e3)
    assert ideal.design.weight_on_bit.least == real.design.weight_on_bit.least == 42e3
    assert [t.path for t in ideal.tuned] == [KP, KI, GAIN]
    assert ideal.tuned[2].high == 10e3


def test_a_design_that_says_nothing_gets_a_stated_path():
    _, ideal, real = policies(drillctl.load("monteiro-trindade-140kn"))
    assert isinstance(ideal.design.weight_on_bit, FollowingSpeed)
    law = real.design.weight_on_bit
    assert (law.delay, law.hoist) == (0.2, 0.5)


def test_an_observer_is_compared_with_the_speed_itself(design):
    observer = {"advantage.set": {"weight_on_bit.law": "surface-observer",
                                  "weight_on_bit.path.hoist_lag": "0.5 s"}}  # fmt: skip
    _, ideal, real = policies(drillctl.load("monteiro-trindade-140kn", **observer))
    assert isinstance(ideal.design.weight_on_bit, FollowingSpeed)
    assert isinstance(real.design.weight_on_bit, ObservedWeight)


def test_a_weight_that_may_not_follow_is_the_constant_weight_to_the_bit(design):
    still = design.replace({"advantage.largest_gain": units.SI(0.0)})
    found, again = advantage(still), advantage(still)
    own, other = found.summary(), again.summary()
    del own["total_seconds"], other["total_seconds"]
    assert own == other  # a run again is the same run
    for case in found.cases:
        for name, values in found.baseline.measures.items():
            np.testing.assert_array_equal(case.measures[name], values)
        assert case.gains == found.baseline.gains
        assert case.objective_less == (0.0, (0.0, 0.0), None)
        assert case.shift == 0.0
    for one in (found.chart.figures["advantage"], found.chart.figures["advantage_high"]):
        np.testing.assert_array_equal(one, 0.0)
    np.testing.assert_array_equal(found.delay.anew.advantage, 0.0)
    assert found.delay.kept.zero.at == 0.0
    first = found.regions[0]
    for one in found.regions[1:]:
        np.testing.assert_array_equal(one.j1, first.j1)


def test_no_gain_of_the_weight_is_the_constant_weight(design):
    constant, ideal, real = policies(design)
    draws, gains = fresh_draws(design), np.array([630.0, 145.0])
    expected = draws.run(constant.with_gains(gains)).measures["j1"]
    for policy in (ideal, real):
        found = draws.run(policy.with_gains(np.append(gains, 0.0))).measures["j1"]
        # Another step, chosen for a law that may move: the accuracy of the engine between them.
        np.testing.assert_allclose(found, expected, rtol=2e-3)


# --- optima ------------------------------------------------------------------------------------


def test_an_optimum_is_no_worse_than_that_of_a_search(design):
    constant, ideal, _ = policies(design)
    for policy, own in ((constant, 2), (ideal, 3)):
        ranges = {
            t.path: {"min": _as_written(t, t.low), "max": _as_written(t, t.high)}
            for t in policy.tuned
        }
        asked = policy.design.replace({"tune.parameters": ranges})
        expected = search(asked)
        found = optimum(policy, 50)
        assert len(found.values) == own
        # The search compares smoothed quantiles, of 60 draws here: a share of a second apart.
        assert found.value == pytest.approx(expected.value, rel=0.05)


def _as_written(tuned, value):
    return f"{value} {tuned.unit}" if tuned.path == GAIN else value


def test_the_cell_of_the_map_at_the_designs_own_point_is_tuned_like_the_table(design, result):
    i, j = 1, 0
    assert result.chart.weights[i] == design.tables.operating_point.weight_on_bit
    assert result.chart.speeds[j] == design.speed
    values = result.chart.figures["objective"][:, i, j]
    table = [result.baseline, result.case(IDEAL, NOMINAL.name), result.case(REAL, NOMINAL.name)]
    # 30 draws of the tuning against 50.
    np.testing.assert_allclose(values, [one.objective.value for one in table], rtol=0.15)
    front = result.front.figures["objective"]
    np.testing.assert_array_equal(front[:, :, 0], result.chart.figures["objective"][:, :, j])


def test_known_gains_are_never_lost(design):
    _, _, real = policies(design)
    late = real.at(DELAY, 2.0)
    constant = optimum(policies(design).constant, 60)
    start = np.append(constant.values, 0.0)
    assert optimum(late, 60, [start]).value <= constant.value * (1.0 + 2e-3)


def test_gains_that_are_known_do_not_hide_better_ones_elsewhere():
    # 3 s late: a valley at some 2.7 kN s/rad, far from the constant weight's gains.
    compared = policies(drillctl.load(SHIPPED))
    constant = Optimum(np.array([632.3, 146.7]), 18.43, ())
    found = optimum_beside(compared.real.at(DELAY, 3.0), 1000, constant)
    assert found.value < 17.0
    assert found.values[2] > 2e3


def test_gains_on_a_bound_are_told(result):
    case = result.case(IDEAL, NOMINAL.name)
    assert set(case.at_bounds) == {KP, KI, GAIN}
    assert case.gains[KP] == pytest.approx(1000.0)
    assert result.baseline.at_bounds == ()


# --- the table ---------------------------------------------------------------------------------


def test_cases_are_those_of_a_comparison(design, result):
    case = result.case(REAL, ROP.name)
    constant, _, real = policies(design)
    other = real.shifted(case.shift).with_gains(np.array(list(case.gains.values())))
    gains = [result.baseline.gains[path] for path in (KP, KI)]
    small = {"compare.maps": False}
    compared = compare(
        {"constant": constant.with_gains(np.array(gains)).replace(small),
         "other": other.replace(small)},
        60, design.tables.advantage.seed,
    )  # fmt: skip
    for name in ("j1", "mean_weight_after_start", "peak_pipe_torque"):
        np.testing.assert_allclose(
            compared.cases[1].measures[name], case.measures[name], rtol=1e-9, err_msg=name
        )
    expected = compared.paired["other"]["j1"]
    found = case.difference(result.baseline, "j1", result.seed)
    assert found.value == pytest.approx(expected.value, rel=1e-9)
    assert found.interval == pytest.approx(expected.interval, rel=1e-9)


@pytest.mark.parametrize("policy", [IDEAL, REAL])
def test_what_is_told_to_be_equal_is(result, policy):
    weight = "mean_weight_after_start"
    own = result.baseline
    assert result.case(policy, NOMINAL.name).shift == 0.0
    mean = result.case(policy, MEAN.name)
    assert mean.mean(weight) == pytest.approx(own.mean(weight), rel=2e-3)
    rop = result.case(policy, ROP.name)
    assert rop.mean("rop_proxy") == pytest.approx(own.mean("rop_proxy"), rel=2e-3)
    assert rop.shift < -1e3  # it turns faster in the mean, and needs less weight


def test_the_dynamic_weight_dominates_at_equal_mean_weight(result):
    assert result.verdict.interval[1] < 0.0
    mean = result.case(IDEAL, MEAN.name).difference(result.baseline, "j1", result.seed)
    assert mean.interval[1] < 0.0


def test_differences_of_the_objective_are_of_resampled_pairs(design, result):
    case, own = result.case(IDEAL, NOMINAL.name), result.baseline
    apart = np.quantile(case.measures["j1"], 0.95) - np.quantile(own.measures["j1"], 0.95)
    assert case.objective_less.value == pytest.approx(apart, rel=1e-9)
    random = np.random.default_rng(1)
    again = []
    for _ in range(2000):
        chosen = random.integers(60, size=60)
        again.append(
            np.quantile(case.measures["j1"][chosen], 0.95)
            - np.quantile(own.measures["j1"][chosen], 0.95)
        )
    expected = np.quantile(again, [0.025, 0.975])
    np.testing.assert_allclose(case.objective_less.interval, expected, rtol=0.1)


def test_shares_and_their_differences(result):
    case, own = result.case(REAL, NOMINAL.name), result.baseline
    level = 15.0
    hits = case.measures["j1"] <= level
    assert case.share(level).value == hits.mean()
    expected = hits.mean() - (own.measures["j1"] <= level).mean()
    assert case.share_difference(own, level, 1).value == pytest.approx(expected)


def test_tuning_and_measuring_meet_other_draws(design):
    table = design.tables
    assert table.advantage.seed != table.tune.seed
    one, other = (draw(design, 60, seed).values for seed in (table.tune.seed, table.advantage.seed))
    for path, values in one.items():
        assert not np.isin(values, other[path]).any()


# --- regions, map, delays ----------------------------------------------------------------------


def test_areas_are_shares_of_the_window(result):
    for one in result.regions:
        assert (one.kp[0], one.kp[-1], one.ki[-1]) == (0.0, 1000.0, 500.0)
        share = (one.j1 <= 30.0).mean(axis=-1)
        assert one.areas[30.0]["p95"].value == (share >= 0.95).mean()
        assert one.areas[30.0]["p05"].value == (share >= 0.05).mean()
        assert one.nominal_area(30.0) == (one.nominal <= 30.0).mean()
    sizes = [one.areas[30.0]["p95"].value for one in result.regions]
    assert sizes[1] > sizes[0]


def test_a_cell_of_the_map_by_itself(design, result):
    found = chart(policies(design), [130e3], [100 * units.RPM], fresh_draws(design), SILENT)
    for k in range(3):
        expected = result.chart.figures["objective"][k, 0, 0]
        assert found.figures["objective"][k, 0, 0] == pytest.approx(expected, rel=0.1)


def test_kept_gains_turn_to_harm_and_gains_tuned_anew_do_not(result):
    kept, anew = result.delay.kept, result.delay.anew
    assert kept.advantage[0] > 0.0 > kept.high[-1]
    low, high = kept.zero.interval
    assert 0.0 < low <= kept.zero.at <= high < 0.5
    np.testing.assert_array_equal(kept.gains, np.broadcast_to(kept.gains[0], kept.gains.shape))
    # Ten steps in the step of the grid where it vanishes.
    assert np.diff(kept.delays).min() < 0.05
    assert kept.delays.size == 3 + 9
    np.testing.assert_array_equal(anew.delays, result.delay.delays)
    assert (anew.advantage > 0.0).all()
    assert anew.zero.at is None
    assert anew.zero.interval[1] is None


def test_what_small_steps_carry_over_the_end_of_a_step_is_followed(design, monkeypatch):
    """A valley that is found from nearby gains alone: left at 0.5 s, it really ends at 1.3 s."""
    constant = Optimum(np.array([600.0, 100.0, 0.0]), 10.0, ())
    near = Optimum(np.array([500.0, 200.0, 0.0]), 1.0, ())

    def objective(policy, gains):
        delay = policy.design.tables.weight_on_bit.path.delay
        return 10.0 if gains[0] == 600.0 else 1.0 + 7.0 * delay  # 10 at 1.286 s

    def beside(policy, realizations, fallback, starts):
        delay = policy.design.tables.weight_on_bit.path.delay
        gains = np.array([500.0, 200.0, delay])
        close = any(abs(start[2] - delay) < 0.15 and start[0] == 500.0 for start in starts)
        value = objective(policy, gains)
        return Optimum(gains, value, ()) if close and value < 10.0 else fallback

    monkeypatch.setattr(delays_module, "optimum_beside", beside)
    monkeypatch.setattr(
        delays_module,
        "_objectives",
        lambda policy, gains, draws, delay: np.full(
            3, objective(delays_module._late(policy, delay), gains)
        ),
    )
    late = design.replace({"advantage.delays": ["0 s", "0.1 s", "0.5 s", "1 s", "1.5 s"]})
    compared = policies(late)
    ends = types.SimpleNamespace(constant=constant, ideal=near, real=near)
    found = delays_module._tuned_anew(compared.real, ends, None, 10.0, SILENT)
    assert sorted(d for d in found if found[d][0][0] == 600.0) == pytest.approx([1.3, 1.4, 1.5])
    assert {0.5, 1.0} <= set(found)
    assert sorted(found)[-6:] == pytest.approx([1.0, 1.1, 1.2, 1.3, 1.4, 1.5])


def test_a_crossing_is_where_the_margin_first_is_not_positive():
    delays = np.array([0.0, 1.0, 2.0, 3.0])
    margin = np.array([3.0, 1.0, -1.0, 2.0])
    shifted = margin[:, None] + np.linspace(-0.5, 0.5, 1001)
    found = resampled_crossing(delays, -np.column_stack([margin, shifted]))
    assert found.at == 1.5
    low, high = found.interval
    assert (low, high) == pytest.approx((1.2625, 1.7375), abs=2e-3)
    assert found.within == 1.0
    never = resampled_crossing(delays, -np.ones((4, 11)))
    assert never == (None, (None, None), 0.0)
    margins = np.column_stack([margin, *[margin] * 30, *[np.ones(4)] * 10])
    some = resampled_crossing(delays, -margins)
    assert some.interval == (1.5, None)
    assert some.within == 0.75


def test_an_estimate_without_an_answer():
    assert percentile_estimate(np.array([np.inf, 1.0, 1.0]))[:2] == (None, None)
    assert percentile_estimate(np.array([1.0, 1.0, np.inf]))[:2] == (1.0, None)
    assert not percentile_estimate(np.array([1.0, -1.0, 3.0])).excludes_zero
    assert percentile_estimate(np.array([1.0, 0.5, 3.0])).excludes_zero


def test_a_failed_draw_counts_as_infinite(design):
    gains = np.array([630.0, 145.0])
    found = measured(policies(design).constant.with_gains(gains), fresh_draws(design))
    found.runs.measures["j1"][:10] = np.nan
    assert np.isinf(found.j1[:10]).all()
    assert np.isinf(found.value)
    assert found.estimate[:2] == (None, None)


# --- results and input -------------------------------------------------------------------------


def test_saved_and_read_back(result, tmp_path):
    back = drillctl.open(result.save(tmp_path / "run"))
    assert back.summary() == result.summary() == json.loads(json.dumps(result.summary()))
    same(back, result)


def test_a_finished_run_is_shown_again(result, tmp_path, capsys):
    folder = result.save(tmp_path / "run")
    names = ["advantage", str(folder / "design.toml"), "--out", str(folder)]
    assert run(names) == 0
    shown = " ".join(capsys.readouterr().out.split())
    kept = result.delay.kept.zero
    assert f"no advantage from {kept.at:.3f} s" in shown
    assert f"{result.baseline.gains[KP]:.1f}" in shown
    assert "on a bound of the search" in shown
    assert run([*names, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert {key: answer[key] for key in result.summary()} == result.summary()
    assert set(answer) - set(result.summary()) == {"warnings"}


def test_tables_hold_the_figures(result, tmp_path):
    rows = {}
    for table in STUDY.tables(result):
        write_csv(table, tmp_path)
        rows[table.name] = rows_of(tmp_path / f"{table.name}.csv")
    kept = [float(row["advantage (s)"]) for row in rows["delays"] if row["gains"] == "ideal path"]
    np.testing.assert_array_equal(kept, result.delay.kept.advantage)
    values = [float(row["objective (s)"]) for row in rows["map"]]
    np.testing.assert_array_equal(values, result.chart.figures["objective"].ravel())
    for row, case in zip(rows["cases"], result.cases, strict=True):
        assert row["case"] == case.name
        assert float(row["objective_high (s)"]) == case.objective.interval[1]
        assert float(row["peak_top_torque (N*m)"]) == case.mean("peak_top_torque")
        apart = case.difference(result.baseline, "j1", result.seed)
        assert row["j1_difference (s)"] == ("" if case is result.baseline else str(apart.value))
    for name, count in (("cases", 7), ("shares", 7 * 5), ("areas", 3 * 4), ("front", 3 * 2)):
        assert len(rows[name]) == count, name


def test_tables_are_read_in_the_units_of_people(result):
    tables = {table.name: table for table in STUDY.tables(result)}
    heads, cells = tables["cases"].heads("si"), tables["cases"].texts("si")
    ideal = dict(zip(heads, cells[1], strict=True))
    case = result.cases[1]
    assert ideal["K_w (kN s/rad)"] == f"{case.gains[GAIN] / 1e3:.4g}"
    low, high = (tables_number(end, 4) for end in case.objective.interval)
    assert ideal[f"{result.objective} (s)"].endswith(f"({low} to {high})")
    assert dict(zip(heads, cells[0], strict=True))["less constant weight (s)"] == NOTHING


def test_pictures_show_the_figures(result):
    front = plots.advantage_front(result).axes[0]
    for k, line in enumerate(front.containers):
        np.testing.assert_allclose(
            line.lines[0].get_ydata(), result.front.figures["objective"][k, :, 0]
        )
    panels = plots.advantage_map(result).axes
    mesh = panels[1].collections[0].get_array()
    np.testing.assert_allclose(np.ravel(mesh), result.chart.figures["advantage"][2].ravel())
    (delays,) = plots.advantage_delay(result).axes
    lines = {line.get_label().split(":")[0]: line for line in delays.get_lines()}
    kept = lines["gains of the ideal path"]
    np.testing.assert_allclose(kept.get_ydata(), result.delay.kept.advantage)
    cases = plots.advantage_cases(result)
    assert [t.get_text() for t in cases.axes[0].get_yticklabels()] == [c.name for c in result.cases]
    cases.savefig("/dev/null", format="png", dpi=20)


@pytest.mark.parametrize(
    ("name", "values", "message"),
    [
        (SHIPPED, {"advantage.set": {"weight_on_bit.law": "stick-slip-alarm"}},
         "does not follow the bit speed; allowed: navarro-lopez-suarez"),
        (SHIPPED, {"advantage.weights": ["70 kN"]}, "advantage.weights: .*70 kN"),
        (SHIPPED, {"advantage.weights": ["190 kN"]}, "advantage.weights: .*190 kN"),
        (SHIPPED, {"advantage.delays": []}, "advantage.delays: is empty"),
        (SHIPPED, {"advantage.realizations": 1}, "realizations: 1 is not allowed"),
        (SHIPPED, {"advantage.material": 2.0}, "material: 2.0 is not allowed"),
        (SHIPPED, {"advantage.largest_gains": 1.0}, "did you mean 'largest_gain'"),
        (SHIPPED, {"advantage.set": {"weight_on_bit.gain": "1 kN*s/rad"}}, "the study runs over"),
        (SHIPPED, {"advantage.set": {"weight_on_bit.minimum": "150 kN"}}, "outside the limits"),
        (SHIPPED, {"advantage.set": {"weight_on_bit.lag": "1 s"}}, "advantage.set: .*lag"),
        ("monteiro-trindade-140kn",
         {"tune.parameters": {"controller.kp": {"min": 0.0, "max": 9.0}}},
         "controller.ki has no bounds"),
        (SHIPPED, {"tune.weights.effort": 1.0}, "effort of the drive is not measured"),
    ],
)  # fmt: skip
def test_what_cannot_be_compared_is_refused(name, values, message):
    with pytest.raises(InputError, match=message):
        advantage(drillctl.load(name, **values))


def test_what_the_study_does_not_take_is_left_out_and_told(design):
    soft = policies(design.replace({"controller.law": "soft-torque"}))
    assert {one.design.tables.controller.law for one in soft} == {"pi"}
    drawn = drillctl.load("uncertain-string-140kn")
    left = policies(drawn).constant.design.tables.uncertain
    assert set(drawn.tables.uncertain) - set(left) == {"operating_point.weight_on_bit"}


def test_equal_shift_at_the_edge_of_the_table_is_extrapolated(design):
    heavy = policies(design.replace({"operating_point.weight_on_bit": "160 kN"})).ideal
    shifted = heavy.shifted(2e3)
    assert shifted.design.weight_on_bit.nominal == 162e3
    drawn_lanes(shifted.design.replace({GAIN: units.SI(4e3)}), draw(shifted.design, 2, 1))


def test_terms_that_cannot_be_met_are_told(design):
    # The weight may not go lower by more than half a kilonewton; the terms ask for three.
    narrow = design.replace({"advantage.set.weight_on_bit.minimum": "139.5 kN"})
    constant, ideal, _ = policies(narrow)
    ground = measured(constant.with_gains(np.array([632.0, 147.0])), fresh_draws(narrow))
    hard = ideal.with_gains(np.array([1000.0, 500.0, 10e3]))
    shift, off = fresh_shift(ideal, ROP, hard, ground)
    assert shift == pytest.approx(-500.0)
    assert off > 2e-3
    assert fresh_shift(ideal, NOMINAL, hard, ground) == (0.0, 0.0)


@pytest.mark.slow
def test_the_shipped_design():
    """With the gain of the weight free the optimum dominates; the real path has its crossing."""
    design = drillctl.load(
        SHIPPED, **{"advantage.weights": ["140 kN"], "advantage.speeds": ["100 rpm"]}
    )
    found = advantage(design)
    assert found.verdict.value < 0.0
    assert found.verdict.interval[1] < 0.0
    for policy in (IDEAL, REAL):
        for terms in (NOMINAL, MEAN, ROP):
            case = found.case(policy, terms.name)
            assert case.objective_less.excludes_zero
            assert case.difference(found.baseline, "j1", found.seed).interval[1] < 0.0
    low, high = found.delay.kept.zero.interval
    assert low <= found.delay.kept.zero.at <= high
    assert high - low < 0.05
    # Tuned for its delay it holds out far longer; to the longest, in some resamples.
    ends = found.delay.anew.material.interval[0]
    assert ends is None or ends > 1.0
    assert (found.delay.anew.low[found.delay.anew.delays <= 1.0] > 0.0).all()


def test_delays_are_those_of_the_design(design):
    compared = policies(design.replace({"advantage.delays": ["0.5 s"]}))
    ends = [optimum(policy, 20) for policy in compared]
    found = delay_curve(
        compared, type("Found", (), dict(zip(("constant", "ideal", "real"), ends, strict=True))),
        fresh_draws(design), SILENT,
    )  # fmt: skip
    late = compared.real.at(DELAY, 0.5).with_gains(ends[1].values)
    assert found.kept.objective[0] == measured(late, fresh_draws(design)).value
