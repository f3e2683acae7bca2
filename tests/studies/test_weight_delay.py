"""A weight on bit that follows the bit speed against its delay: runs, differences, limits."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import drillctl
from drillctl import units
from drillctl.design.validation import validated
from drillctl.ensemble.cases import Runs, crossing, first_not_negative, share_interval
from drillctl.errors import InputError
from drillctl.rig.weight_on_bit import FollowingSpeed, ObservedWeight, RealWeight
from drillctl.simulation.measures import STATUSES
from drillctl.studies import weight_delay
from drillctl.studies.compare.compute import compare
from drillctl.studies.delay.compute import following_design, lasting
from tests.alike import same

HOLDS = {
    "weight on bit against its delay": "runs of `simulate`, in both engines; differences and "
    "intervals of `compare`; limits by hand",
}

SHIPPED = "dynamic-wob-delay-140kn"
SMOOTH = {"controller.kp": 625.0, "controller.ki": 125.0}
GAINS, DELAYS, DRAWS = (0.0, 2e3, 6e3), (0.0, 0.1, 0.5, 1.0), 12
LAW = {
    "weight_on_bit.law": "navarro-lopez-suarez",
    "weight_on_bit.minimum": "42 kN",
    "weight_on_bit.maximum": "182 kN",
    "weight_on_bit.path.hoist_lag": "0.5 s",
}
SHORT = {"simulation.duration": "10 s"}


@pytest.fixture(scope="module")
def design():
    return drillctl.load(SHIPPED, **SMOOTH)


@pytest.fixture(scope="module")
def result(design):
    return weight_delay(design, GAINS, DELAYS, DRAWS)


@pytest.fixture(scope="module")
def short(design):
    return design.replace(SHORT)


def late(design, gain, delay):
    values = {"weight_on_bit.gain": units.SI(gain), "weight_on_bit.path.delay": units.SI(delay)}
    return design.replace({**LAW, **values})


# --- runs --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("i", "k"), [(1, 0), (1, 2), (2, 1), (2, 3)])
def test_a_run_is_the_one_that_simulate_gives(result, design, i, k):
    number = 5
    drawn = {path: units.SI(values[number]) for path, values in result.drawn.items()}
    alone = late(design, GAINS[i], DELAYS[k]).replace({**drawn, "simulation.engine": "batch"})
    run = drillctl.simulate(alone)
    for name in ("j1", "peak_bit_speed", "peak_pipe_torque", "mean_weight_on_bit"):
        expected = getattr(run.measures, name)
        assert result.measures[name][i, k, number] == pytest.approx(expected, rel=1e-9), name
    assert STATUSES[result.status[i, k, number]] == run.status


@pytest.mark.slow
@pytest.mark.parametrize(("i", "k"), [(1, 0), (2, 2), (2, 3)])
def test_a_run_is_that_of_the_reference_solver(result, design, i, k):
    drawn = {path: units.SI(values[5]) for path, values in result.drawn.items()}
    run = drillctl.simulate(late(design, GAINS[i], DELAYS[k]).replace(drawn))
    for name in ("j1", "peak_bit_speed", "peak_pipe_torque"):
        expected = getattr(run.measures, name)
        assert result.measures[name][i, k, 5] == pytest.approx(expected, rel=5e-3), name
    assert STATUSES[result.status[i, k, 5]] == run.status


def test_differences_are_those_of_a_comparison(result, design):
    small = {"uncertainty.realizations": DRAWS, "compare.maps": False}
    constant = design.replace(small)
    other = late(constant, GAINS[2], DELAYS[2])
    compared = compare({"constant": constant, "late": other})
    found, expected = result.benefits[2][2], compared.paired["late"]["j1"]
    assert found.difference.value == pytest.approx(expected.value, rel=1e-9)
    assert found.difference.interval == pytest.approx(expected.interval, rel=1e-9)
    assert found.difference.draws == DRAWS
    case = compared.cases[1]
    assert found.j1.value == pytest.approx(case.distribution("j1")["mean"], rel=1e-9)
    assert found.mean_weight == pytest.approx(
        case.distribution("mean_weight_after_start")["mean"], rel=1e-9
    )
    np.testing.assert_allclose(
        result.constant.measures["j1"], compared.baseline.measures["j1"], rtol=1e-9
    )


def test_a_gain_of_zero_is_the_constant_weight_at_any_delay(result):
    for one in result.benefits[0]:
        assert one.difference == (0.0, (0.0, 0.0), DRAWS)
        assert one.j1 == result.baseline.j1
        assert one.mean_weight == pytest.approx(140e3, rel=1e-12)
    assert result.limits[0].harmful_from.at is None


def test_other_delays_and_gains_change_nothing(result, design):
    fewer = weight_delay(design, GAINS[2:], DELAYS[1:3], DRAWS)
    for name, values in fewer.measures.items():
        np.testing.assert_array_equal(values[0], result.measures[name][2, 1:3], name)
    np.testing.assert_allclose(
        fewer.constant.measures["j1"], result.constant.measures["j1"], rtol=1e-9
    )


def test_order_of_gains_and_delays_does_not_matter(short):
    found = weight_delay(short, ["2 kN*s/rad"], ["0.5 s", 0.1, "100 ms"], 2)
    assert found.delays.tolist() == [0.1, 0.5]
    assert found.gains.tolist() == [2000.0]


def test_without_lags_no_delay_is_the_ideal_law(short):
    ideal = short.replace({"weight_delay.set.weight_on_bit.path.hoist_lag": "0 s"})
    following = following_design(ideal)
    assert isinstance(following.weight_on_bit, FollowingSpeed)
    found = weight_delay(ideal, [6e3], [0.0, 0.5], 3)
    drawn = {path: units.SI(values[2]) for path, values in found.drawn.items()}
    for k, kind in enumerate((FollowingSpeed, RealWeight)):
        alone = late(ideal, 6e3, found.delays[k]).replace({"weight_on_bit.path.hoist_lag": "0 s"})
        assert type(alone.weight_on_bit) is kind
        run = drillctl.simulate(alone.replace({**drawn, "simulation.engine": "batch"}))
        j1 = found.measures["j1"][0, k, 2]
        assert j1 == pytest.approx(run.measures.j1, rel=1e-9)


def test_draws_of_the_string_are_run_one_by_one(short):
    inertia = {"distribution": "uniform", "min": "300 kg*m^2", "max": "500 kg*m^2"}
    design = short.replace({"uncertain": {"bha.inertia": inertia}})
    found = weight_delay(design, [6e3], [0.0, 0.5], 2)
    for k, delay in enumerate((0.0, 0.5)):
        drawn = {path: units.SI(values[1]) for path, values in found.drawn.items()}
        alone = late(design, 6e3, delay).replace({**drawn, "simulation.engine": "batch"})
        expected = drillctl.simulate(alone).measures.j1
        assert found.measures["j1"][0, k, 1] == pytest.approx(expected, rel=1e-9)


def test_impossible_draws_are_counted_and_have_not_ended(short):
    wide = {"distribution": "uniform", "min": 0.1, "max": 0.9}
    design = short.replace({"uncertain.bit_rock.a2_factor": wide})
    found = weight_delay(design, [6e3], [0.1, 0.5], 20)
    (failure,) = found.failures
    assert 0 < failure.count < 20
    one = found.benefits[0][0]
    assert one.difference.draws == 20 - failure.count
    assert one.ended.hits <= one.difference.draws
    assert one.ended.value == one.ended.hits / 20
    assert found.summary()["failures"][0]["count"] == failure.count
    # The same draws at every delay, each in its place.
    failed = np.isnan(found.measures["j1"][0])
    assert failed.sum(axis=1).tolist() == [failure.count] * 2
    np.testing.assert_array_equal(failed[0], failed[1])
    later = weight_delay(design, [6e3], [0.5], 20)
    np.testing.assert_array_equal(later.measures["j1"][0, 0], found.measures["j1"][0, 1])


# --- what is told ------------------------------------------------------------------------------


def test_delay_turns_a_smooth_rig_to_stick_slip(result):
    # Kp 625, Ki 125: smooth at a constant weight, smoother with one that follows at once, harmed
    # by one that follows late.
    first, *_, last = result.benefits[2]
    assert first.difference.interval[1] < 0.0 < last.difference.interval[0]
    assert first.ended.value == 1.0
    assert last.ended.value < 0.3
    harmful = result.limits[2].harmful_from
    assert 0.1 < harmful.interval[0] <= harmful.at <= harmful.interval[1] < 0.5
    limits = result.limits[2]
    assert (limits.ends_at.delay, limits.ends_before.delay) == (0.1, 0.5)


def test_shares_have_their_intervals(result):
    one = result.benefits[2][2]
    ended = result.ended[2, 2]
    assert one.ended.hits == ended.sum()
    assert one.ended.interval == share_interval(int(ended.sum()), DRAWS)
    assert one.peak_bit_speed == pytest.approx(result.measures["peak_bit_speed"][2, 2].mean())


def test_ended_is_neither_sticking_nor_stalled_nor_failed():
    found = Runs({}, np.arange(len(STATUSES), dtype=np.int8), None, None).ended
    assert [name for name, ended in zip(STATUSES, found, strict=True) if ended] == [
        "ok", "not_settled", "censored",
    ]  # fmt: skip


def test_data_is_labelled(result):
    data = result.data
    assert data["j1"].sizes == {"gain": 3, "delay": 4, "realization": DRAWS}
    assert data["delay"].attrs["units"] == "s"
    picked = data["difference"].sel(gain=6e3, delay=0.5)
    assert float(picked) == result.benefits[2][2].difference.value
    high = data["difference_high"].sel(gain=6e3, delay=0.5)
    assert float(high) == result.benefits[2][2].difference.interval[1]


def test_saved_and_read_back(result, tmp_path):
    back = drillctl.open(result.save(tmp_path / "run"))
    assert back.summary() == result.summary() == json.loads(json.dumps(result.summary()))
    same(back, result)


def test_the_numbers_of_the_page_are_those_of_the_shipped_design():
    page = (Path(__file__).parents[2] / "docs" / "weight-on-bit.md").read_text(encoding="utf-8")
    (row,) = weight_delay(drillctl.load(SHIPPED), [6e3], [0.0, 0.1, 0.2]).benefits
    told = [
        f"{one.difference.value:+.1f} ({one.difference.interval[0]:.1f} to "
        f"{one.difference.interval[1]:.1f})"
        for one in row
    ]
    assert f"| 6 | {' | '.join(told)} |" in page
    low, high = (100.0 * end for end in row[1].ended.interval)
    share = f"{100.0 * row[1].ended.value:.1f} % ({low:.1f} to {high:.1f}) at 0.1 s"
    assert f"| 6 | 0.1 s | {share} |" in page


# --- limits ------------------------------------------------------------------------------------

AT = np.array([0.0, 1.0, 2.0, 4.0])


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([-3.0, -1.0, 1.0, 5.0], 1.5),
        ([-3.0, -1.0, -2.0, 2.0], 3.0),
        ([-3.0, 0.0, 1.0, 1.0], 1.0),
        ([-1.0, 1.0, -1.0, 1.0], 0.5),  # the first time counts
        ([0.5, -1.0, -1.0, -1.0], 0.0),
        ([-1.0, -1.0, -1.0, -1.0], None),
        ([-2.0, np.nan, 2.0, 3.0], 1.0),
        ([np.nan] * 4, None),
    ],
)
def test_where_a_difference_stops_being_negative(values, expected):
    assert first_not_negative(AT, np.array(values)) == expected


def test_interval_of_the_harmful_delay_is_where_the_bounds_cross():
    mean = np.array([-4.0, -2.0, 2.0, 6.0])
    found = crossing(AT, mean, mean - 3.0, mean + 1.0)
    assert found.at == 1.5
    assert found.interval == (1.25, 2.5)
    assert found.summary("delay") == {"delay": 1.5, "interval_95": [1.25, 2.5]}
    open_end = crossing(AT, mean - 6.0, mean - 9.0, mean - 5.0)
    assert (open_end.at, open_end.interval) == (4.0, (3.5, None))


@pytest.mark.parametrize(
    ("shares", "expected"),
    [
        ([1.0, 0.95, 0.9, 0.99], 2),  # what a longer delay brings back does not count
        ([0.94, 1.0, 1.0, 1.0], 0),
        ([1.0, 1.0, 1.0, 1.0], 4),
    ],
)
def test_stick_slip_ends_up_to_a_delay_and_at_all_shorter_ones(shares, expected):
    assert lasting(shares) == expected


def ended_at(result, *delays):
    """The result with stick-slip ended in all draws of the gain 6 kN s/rad at some delays alone."""
    status = np.full_like(result.status, STATUSES.index("sticking"))
    status[2, [DELAYS.index(delay) for delay in delays]] = STATUSES.index("ok")
    return replace(result, status=status)


@pytest.mark.parametrize(
    ("delays", "at", "after"),
    [((0.0, 0.1, 1.0), 0.1, 0.5), ((0.5,), None, 0.0), (DELAYS, 1.0, None)],
)
def test_limits_are_the_last_delay_that_ends_it_and_the_next(result, delays, at, after):
    limits = ended_at(result, *delays).limits[2]
    told = limits.summary()["ends_up_to"]
    assert told["delay"] == at
    assert [one and one["delay"] for one in (told["at"], told["next"])] == [at, after]
    if limits.ends_at:
        assert told["at"]["share"] == 1.0


# --- designs -----------------------------------------------------------------------------------


def test_a_design_whose_own_weight_follows_is_taken_as_it_is(short):
    own = short.replace({**LAW, "weight_on_bit.gain": "3 kN*s/rad"})
    tree = {**own.tree, "weight_delay": {}}
    bare = type(own)(own.name, validated(tree, own.origin), tree, own.origin)
    assert not bare.tables.weight_delay.values
    assert following_design(bare).weight_on_bit.hoist == 0.5
    one, other = (weight_delay(d, [6e3], [0.1, 0.5], 2) for d in (bare, short))
    for name, values in one.measures.items():
        np.testing.assert_array_equal(values, other.measures[name])


def test_a_constant_weight_alone_gets_the_law_without_limits():
    law = following_design(drillctl.load("monteiro-trindade-140kn")).weight_on_bit
    assert isinstance(law, FollowingSpeed)
    assert law.least == 0.0
    assert law.gain == 0.0


def test_an_observer_at_the_surface_may_be_late_too(design):
    observer = {"weight_delay.set.weight_on_bit.law": "surface-observer"}
    law = following_design(design.replace(observer)).weight_on_bit
    assert isinstance(law, ObservedWeight)
    assert law.hoist == 0.5


@pytest.mark.parametrize(
    ("options", "where", "message"),
    [
        ({"gains": [-1e3]}, "weight_delay.gains", "must be 0 or more"),
        ({"delays": [-0.1]}, "weight_delay.delays", "must be 0 or more"),
        ({"gains": []}, "weight_delay.gains", "is empty"),
        ({"delays": []}, "weight_delay.delays", "is empty"),
        ({"gains": ["2 s"]}, "weight_delay.gains", "2 s"),
        ({"realizations": 0}, "uncertainty.realizations", "0 is not allowed"),
    ],
)
def test_impossible_settings_are_refused(design, options, where, message):
    with pytest.raises(InputError, match=message) as caught:
        weight_delay(design, **options)
    assert where in str(caught.value)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"weight_delay.gain": [1.0]}, "unknown key; did you mean 'gains'"),
        ({"weight_delay.gains": [2000.0]}, "has no unit"),
        ({"weight_delay.set.controller.kp": 3.0}, "paths begin with 'weight_on_bit.'"),
        ({"weight_delay.set.weight_on_bit.gain": "1 kN*s/rad"}, "it is what the study runs over"),
        ({"weight_delay.set.weight_on_bit.law": "stick-slip-alarm"},
         "'stick-slip-alarm' does not follow the bit speed; allowed: navarro-lopez-suarez"),
        ({"weight_delay.set.weight_on_bit.path.hoistlag": "1 s"},
         "weight_delay.set: weight_on_bit.path.hoistlag: unknown key; did you mean 'hoist_lag'"),
        ({"weight_delay.set.weight_on_bit.minimum": "150 kN"}, "outside the limits"),
        ({"uncertain": {"weight_on_bit.path.delay": {"distribution": "normal", "cov": 0.1}}},
         "uncertain.weight_on_bit.path.delay: is what the study runs over"),
    ],
)  # fmt: skip
def test_impossible_designs_are_refused(design, values, message):
    with pytest.raises(InputError, match=message):
        weight_delay(design.replace(values), [1e3], [0.1], 2)


def test_more_runs_than_fit_the_memory_are_refused(design):
    with pytest.raises(InputError, match=r"weight_delay: .* cells need about"):
        weight_delay(design, realizations=10**9)
