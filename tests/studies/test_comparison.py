"""Cases at equal terms: known answers, intervals against peers, equal weights, honest failures."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy import stats

import drillctl
from drillctl.ensemble.cases import mean_interval
from drillctl.ensemble.draws import EQUAL_TO, drawn_lanes, equalising_shift, run_draws, start_up
from drillctl.ensemble.parameters import draw
from drillctl.errors import InputError
from drillctl.simulation.batch import prepare, trace
from drillctl.studies.compare.compute import ALONE, COMPARED, case_designs, compare
from tests.alike import TIMES, same

HOLDS = {
    "comparison of cases": "J1 of the weight-on-bit law; a case against itself; "
    "`scipy.stats.bootstrap`; weight from traces; maps and responses those of "
    "`map` and `simulate`",
}

SHIPPED = "pi-vs-dynamic-wob-140kn"
PAPER = "monteiro-trindade-140kn"
A1, A2 = "bit_rock.a1_factor", "bit_rock.a2_factor"
WEIGHT = "operating_point.weight_on_bit"
LAW = {"weight_on_bit.law": "navarro-lopez-suarez"}
SHORT = {"simulation.duration": "20 s"}


def following(design, gain, **more):
    return design.replace({**LAW, "weight_on_bit.gain": f"{gain} kN*s/rad", **more})


@pytest.fixture(scope="module")
def shipped():
    return compare(drillctl.load(SHIPPED), realizations=40)


@pytest.fixture(scope="module")
def paper():
    return drillctl.load(PAPER, **{"controller.kp": 200.0, "controller.ki": 100.0})


@pytest.fixture(scope="module")
def short(paper):
    return paper.replace(SHORT)


# --- known answers -----------------------------------------------------------------------------


@pytest.mark.parametrize(("gain", "j1"), [(2, 75.68), (4, 22.15), (6, 12.40)])
def test_dynamic_weight_without_limits_at_the_nominal_rock(paper, gain, j1):
    narrow = {"distribution": "normal", "cov": 1e-9}
    design = paper.replace({"uncertain": {A1: narrow}})
    result = compare({"constant": design, "moving": following(design, gain)}, realizations=2)
    assert result.cases[1].distribution("j1")["mean"] == pytest.approx(j1, abs=0.02)
    assert result.paired["moving"]["j1"].value == pytest.approx(
        j1 - result.baseline.distribution("j1")["mean"], abs=0.02
    )


def test_each_gain_of_the_shipped_design_is_better_than_the_one_before(shipped):
    names = [case.name for case in shipped.cases]
    assert names == ["constant weight", "2 kN s/rad", "4 kN s/rad", "6 kN s/rad"]
    ends = [shipped.paired[name]["j1"].interval for name in names[1:]]
    assert ends[0][1] < 0.0
    assert ends[1][1] < ends[0][0]
    assert ends[2][1] < ends[1][0]
    assert shipped.cases[0].share(30.0).hits == 0
    assert shipped.cases[3].share(30.0).hits == 40


def test_a_draw_is_the_run_that_simulate_gives(shipped):
    case, number = shipped.cases[2], 7
    values = {path: drillctl.units.SI(drawn[number]) for path, drawn in case.drawn.items()}
    run = drillctl.simulate(case.design.replace({**values, "simulation.engine": "batch"}))
    for name in ("j1", "stuck_time", "peak_pipe_torque", "mean_weight_on_bit", "rop_proxy"):
        assert case.measures[name][number] == pytest.approx(getattr(run.measures, name), rel=1e-9)


# --- common draws ------------------------------------------------------------------------------


def test_a_case_against_itself_differs_by_exactly_nothing(paper):
    result = compare({"one": paper, "same": paper.replace({})}, realizations=15)
    for name, found in result.paired["same"].items():
        if found.draws:
            assert (found.value, found.interval) == (0.0, (0.0, 0.0)), name
    assert result.paired["same"]["j1"].draws == 15


def test_more_realizations_begin_with_the_same_runs(shipped):
    more = compare(drillctl.load(SHIPPED), realizations=60)
    for few, many in zip(shipped.cases, more.cases, strict=True):
        assert few.step == many.step
        for name in COMPARED:
            assert few.measures[name].tobytes() == many.measures[name][:40].tobytes()


def test_all_cases_have_the_same_draws_and_pairing_pays(shipped):
    base, other = shipped.cases[0], shipped.cases[1]
    for path, values in base.drawn.items():
        assert values.tobytes() == other.drawn[path].tobytes()
    together = np.std(base.measures["j1"] - other.measures["j1"])
    apart = np.hypot(np.std(base.measures["j1"]), np.std(other.measures["j1"]))
    assert together < 0.75 * apart


def test_a_drawn_value_without_mean_is_drawn_about_each_cases_own(short):
    about = {"distribution": "lognormal", "cov": 0.02}
    design = short.replace({"uncertain": {WEIGHT: about}})
    result = compare({"a": design, "b": design.replace({WEIGHT: "120 kN"})}, realizations=5)
    a, b = (case.drawn[WEIGHT] for case in result.cases)
    assert b / a == pytest.approx(np.full(5, 120 / 140), rel=1e-12)


def test_seeds_make_the_difference(short):
    a, b = (compare(short, realizations=3, seed=seed).cases[0] for seed in (1, 2))
    assert not np.array_equal(a.measures["j1"], b.measures["j1"])


# --- distributions, shares, intervals ----------------------------------------------------------


def test_distributions_are_those_of_the_draws(shipped):
    case = shipped.cases[2]
    values, found = case.measures["j1"], case.distribution("j1")
    assert found["mean"] == values.mean()
    assert found["std"] == np.std(values, ddof=1)
    assert [found[key] for key in ("p05", "p50", "p95")] == np.quantile(
        values, [0.05, 0.5, 0.95]
    ).tolist()
    assert found["defined"] == 40


def test_undefined_measures_are_counted_not_averaged(shipped):
    case = shipped.cases[0]  # sticks to the end: it never settles
    assert case.distribution("settling_time") == {
        "mean": None, "std": None, "p05": None, "p50": None, "p95": None, "defined": 0,
    }  # fmt: skip
    assert shipped.paired["6 kN s/rad"]["settling_time"] == (None, None, 0)
    assert shipped.summary()["paired"]["6 kN s/rad"]["settling_time"] == {
        "difference": None, "interval_95": None, "pairs": 0,
    }  # fmt: skip


@pytest.mark.parametrize("count", [25, 200])
def test_bootstrap_against_scipy(count):
    values = np.random.default_rng(3).lognormal(0.0, 1.0, count)  # skewed: all of BCa matters
    peer = stats.bootstrap((values,), np.mean, n_resamples=40_000, method="BCa", rng=1)
    low, high = mean_interval(values, seed=0)
    width = peer.confidence_interval.high - peer.confidence_interval.low
    assert abs(low - peer.confidence_interval.low) < 0.05 * width
    assert abs(high - peer.confidence_interval.high) < 0.05 * width
    # Not the plain percentiles: they lie lower by more than that.
    plain = stats.bootstrap((values,), np.mean, n_resamples=40_000, method="percentile", rng=1)
    if count == 25:
        assert high - plain.confidence_interval.high > 0.1 * width


def test_bootstrap_at_the_edges():
    assert mean_interval(np.array([1.0]), 0) is None
    assert mean_interval(np.full(9, 0.1), 0) == (0.1, 0.1)
    one, other = (mean_interval(np.arange(30.0) ** 2, seed) for seed in (1, 2))
    assert one == mean_interval(np.arange(30.0) ** 2, 1)
    assert one != other


def test_bootstrap_covers_as_often_as_it_says():
    generator = np.random.default_rng(8)
    inside = 0
    for seed in range(200):
        low, high = mean_interval(generator.normal(3.0, 1.0, 60), seed)
        inside += low <= 3.0 <= high
    assert 180 <= inside <= 198


# --- failures ----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def half_impossible(short):
    wide = {"distribution": "uniform", "min": 0.1, "max": 0.9}
    return compare(short.replace({"uncertain": {A2: wide}}), realizations=60)


def test_impossible_draws_are_failed_counted_and_under_no_level(half_impossible):
    (case,) = half_impossible.cases
    (failure,) = case.failures
    failed = np.isnan(case.measures["j1"])
    assert 0 < failure.count == failed.sum() < 60
    assert "a2_factor" in failure.reason
    told = half_impossible.summary()["cases"][ALONE]
    assert told["statuses"]["failed"] == failure.count
    assert told["failures"][0]["count"] == failure.count
    assert told["measures"]["j1"]["defined"] == 60 - failure.count
    share = case.share(1e9)
    assert share.hits == 60 - failure.count
    assert share.value == share.hits / 60
    json.dumps(half_impossible.summary(), allow_nan=False)


def test_a_run_that_breaks_down_is_counted_with_its_reason(short, monkeypatch):
    from drillctl.ensemble import draws as drawn_runs

    def broken(lanes, prepared):
        batch = original(lanes, prepared)
        for values in batch.measures.values():
            values[2] = np.nan
        batch.status[2] = 5
        return batch

    original = drawn_runs.measured
    monkeypatch.setattr(drawn_runs, "measured", broken)
    (case,) = compare(short, realizations=4).cases
    assert [(f.reason, f.count) for f in case.failures] == [("no finite answer", 1)]
    assert case.distribution("j1")["defined"] == 3


def test_pairs_need_both(half_impossible, short):
    wide = {"distribution": "uniform", "min": 0.1, "max": 0.9}
    design = short.replace({"uncertain": {A2: wide}})
    coulomb = design.replace({A1: 0.5})  # possible at more draws
    result = compare({"a": coulomb, "b": design}, realizations=60)
    counts = [case.distribution("j1")["defined"] for case in result.cases]
    assert counts[1] < counts[0]
    assert result.paired["b"]["j1"].draws == counts[1]


# --- weight ------------------------------------------------------------------------------------


def test_weight_after_the_start_against_the_trace(paper):
    design = following(paper, 2)
    drawn = drawn_lanes(design, draw(design, 8, seed=3))
    runs = run_draws(drawn, 8)
    lanes = drawn.groups[0].lanes
    time, signals = trace(lanes, prepare(lanes, design.tables.simulation), 0.02)
    late = time >= 20.0 - 1e-9
    weight = lanes.weight.weight(np.abs(signals["bit_speed"][late]))
    expected = np.trapezoid(weight, time[late], axis=0) / 80.0
    assert runs.measures["mean_weight_after_start"] == pytest.approx(expected, rel=1e-6)
    # It is another figure than that of the whole run.
    assert np.abs(runs.measures["mean_weight_on_bit"] / expected - 1.0).max() > 2e-3


def test_a_constant_weight_is_its_own_mean(shipped):
    assert np.all(shipped.cases[0].measures["mean_weight_after_start"] == 140e3)
    assert shipped.weight_from == 20.0
    assert start_up(10.0) == 2.0


@pytest.mark.parametrize("seed", [1, 2012])
def test_mean_weights_are_made_equal(seed):
    design = drillctl.load(SHIPPED)
    free = compare(design, realizations=40, seed=seed)
    equal = compare(design, realizations=40, seed=seed, equal_mean_weight=True)
    for case in equal.cases:
        mean = case.distribution("mean_weight_after_start")["mean"]
        assert mean == pytest.approx(140e3, rel=EQUAL_TO)
    assert EQUAL_TO == 2e-3
    before = free.cases[1].distribution("mean_weight_after_start")["mean"]
    assert abs(before / 140e3 - 1.0) > EQUAL_TO  # there was something to be done
    assert equal.cases[0].weight_shift == 0.0
    assert equal.cases[1].weight_shift > 0.0


def test_a_shifted_case_is_the_design_at_the_shifted_weight():
    design = drillctl.load(SHIPPED)
    case = compare(design, realizations=10, equal_mean_weight=True).cases[1]
    weight = drillctl.units.SI(140e3 + case.weight_shift)
    moved = case.design.replace({WEIGHT: weight, "compare.cases": []})
    again = compare(moved, realizations=10, equal_mean_weight=False)
    assert again.cases[0].measures["j1"] == pytest.approx(case.measures["j1"], rel=1e-9)


def test_limits_that_forbid_the_weight_are_told(paper):
    low = {"weight_on_bit.maximum": "140.1 kN", "weight_on_bit.minimum": "0 kN"}
    design = following(paper, 2, **low)
    with pytest.raises(InputError, match="cannot have a mean weight of 140 kN"):
        equalising_shift(drawn_lanes(design, draw(design, 10, seed=1)), 10)


# --- cases -------------------------------------------------------------------------------------


def with_cases(design, *cases):
    return design.replace({"compare.cases": list(cases)})


def test_a_design_without_cases_is_its_only_one(short):
    assert case_designs(short) == {ALONE: short}
    result = compare(short, realizations=2)
    assert [case.name for case in result.cases] == [ALONE]
    assert result.summary()["paired"] == {}


def test_values_may_be_dotted_or_in_tables(short):
    dotted = {"weight_on_bit.gain": "2 kN*s/rad", **LAW}
    nested = {"weight_on_bit": {"law": LAW["weight_on_bit.law"], "gain": "2 kN*s/rad"}}
    design = with_cases(short, {"name": "a", "set": dotted}, {"name": "b", "set": nested})
    a, b = case_designs(design).values()
    assert a == b == following(design, 2)


STARTED = {"start.kind": "rest"}


@pytest.mark.parametrize(
    ("cases", "message"),
    [
        ([{"name": "a", "set": {"weight_on_bit.gian": 1}}],
         "compare.cases 'a': weight_on_bit"),
        ([{"name": "a", "set": {"controler.kp": 1}}],
         "compare.cases 'a': controler: unknown key; did you mean 'controller'"),
        ([{"name": "a", "set": {"controller.kp": "soft"}}], "compare.cases 'a': controller.kp"),
        ([{"name": "a"}, {"name": "a"}], "two cases are called 'a'"),
        ([{"set": {}}], "compare.cases.1.name: is missing"),
        ([{"name": " "}], "a name must hold more than blanks"),
        ([{"name": "a", "values": {}}], "unknown key"),
        ("a", "compare.cases: got 'a'; it must be a list"),
        ([{"name": "a", "set": 3}], "it must be a table"),
        ([{"name": "a"}, {"name": "b", "set": STARTED}], "'b': start: cases are compared from"),
        ([{"name": "a"}, {"name": "b", "set": {"simulation.duration": "30 s"}}],
         "'b': simulation.duration: cases are compared over the same run"),
        ([{"name": "a"}, {"name": "b", "set": {"simulation.j1_from": "3 s"}}],
         "'b': simulation.j1_from: cases"),
        ([{"name": "a"}, {"name": "b", "set": {"uncertain.bit_rock.a1_factor.cov": 0.1,
          "uncertain.bit_rock.a1_factor.distribution": "normal"}}],
         "'b': uncertain: the first case draws"),
        ([{"name": "a"}, {"name": "b", "set": {"bit_rock.law": "coulomb", "bit_rock.a": 0.05}}],
         "'b': uncertain: the first case draws"),
    ],
)  # fmt: skip
def test_bad_cases_are_told_with_file_name_and_key(short, cases, message):
    with pytest.raises(InputError) as caught:
        compare(with_cases(short, *cases) if isinstance(cases, list) else
                short.replace({"compare.cases": cases}), realizations=1)  # fmt: skip
    assert message in str(caught.value)
    assert str(caught.value).startswith(short.origin)


def test_a_value_that_is_drawn_cannot_be_a_cases_own(short):
    fixed = {"distribution": "normal", "mean": "140 kN", "cov": 0.01}
    design = short.replace({"uncertain": {WEIGHT: fixed}})
    cases = with_cases(design, {"name": "a"}, {"name": "b", "set": {WEIGHT: "120 kN"}})
    with pytest.raises(InputError, match=r"'b': operating_point\.weight_on_bit: is drawn"):
        compare(cases)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"realizations": 0}, "uncertainty.realizations: 0 is not allowed"),
        ({"realizations": 10**9}, "uncertainty.realizations: 1,000,000,000 cells need about"),
        ({"realizations": 2.5}, "2.5 is not a whole number"),
        ({"seed": -1}, "uncertainty.seed: -1 is not allowed"),
        ({"equal_mean_weight": 3}, "compare.equal_mean_weight: got 3; it must be true or false"),
    ],
)
def test_bad_settings_are_told(short, options, message):
    with pytest.raises(InputError) as caught:
        compare(short, **options)
    assert message in str(caught.value)


def test_no_case_at_all():
    with pytest.raises(InputError, match="at least one case"):
        compare({})


# --- saved -------------------------------------------------------------------------------------


def test_there_and_back_and_run_again(shipped, tmp_path):
    back = drillctl.open(shipped.save(tmp_path / "run"))
    same(shipped, back)
    assert back.summary() == shipped.summary()
    same(shipped, compare(back.design), TIMES)


def test_failures_and_odd_names_come_back(half_impossible, short, tmp_path):
    same(half_impossible, drillctl.open(half_impossible.save(tmp_path / "one")))
    cases = {"a/b: Ω": short, "c": short.replace({"controller.kp": 300.0})}
    result = compare(cases, realizations=3)
    same(result, drillctl.open(result.save(tmp_path / "two")))
    assert [case.name for case in result.cases] == list(cases)


def test_cases_given_one_by_one_are_another_run_than_the_designs_own(short, tmp_path):
    alone = compare(short, realizations=2)
    two = compare({ALONE: alone.design, "b": short.replace({"controller.kp": 9.0})},
                  realizations=2)  # fmt: skip
    alone.save(tmp_path / "run")
    with pytest.raises(InputError, match="another design or other settings"):
        two.save(tmp_path / "run")


def test_data_is_labelled(shipped):
    data = shipped.data
    assert (data.sizes["case"], data.sizes["realization"]) == (4, 40)
    assert list(data["case"].values) == [case.name for case in shipped.cases]
    assert data["mean_weight_on_bit"].units == "N"
    ours = {name for name in data.data_vars if not name.startswith(("nominal.", "audit."))}
    assert set(COMPARED) | {f"drawn.{A1}", f"drawn.{A2}", "status"} == ours
    assert data["j1"].dims == data[f"drawn.{A1}"].dims == ("case", "realization")
    assert all("units" in data[name].attrs for name in (*COMPARED, f"drawn.{A1}"))


# --- the audit ---------------------------------------------------------------------------------


def test_draws_of_every_case_are_audited_with_its_shifted_weight(paper):
    design = paper.replace({
        "map.audit_cells": 3, "map.levels": [50.0, 100.0], "compare.maps": False,
        f"uncertain.{WEIGHT}": {"distribution": "normal", "cov": 0.01}, **SHORT,
    })  # fmt: skip
    cases = {"constant": design, "following": following(design, 4)}
    result = compare(cases, realizations=4, equal_mean_weight=True)
    for case in result.cases:
        audit = case.audit
        assert len(audit.cells) == 2  # three cells over two cases, in full
        assert audit.verdict == "ok"
        assert audit.worst < 1e-3
        for name in ("j1", "mean_weight_on_bit", "peak_top_torque"):
            np.testing.assert_array_equal(audit.batch[name], case.measures[name][audit.cells])
            assert {one.name: one for one in audit.compared}[name].worst < 1e-2
        assert case.summary(result.levels)["audit"] == audit.summary()
    assert result.cases[1].weight_shift > 1e3  # without it the audit would be of other rigs
