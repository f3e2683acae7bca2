"""Weight on bit on its way: seen late, observed, taken off on an alarm; both engines."""

from __future__ import annotations

import numpy as np
import pytest

import drillctl
from drillctl.errors import InputError
from drillctl.linear import ends_of
from drillctl.linear.ends import BitSide, weight_path
from drillctl.linear.loop_margins import weight_delay_margin
from drillctl.linear.loop_model import model_poles
from drillctl.linear.observer import observer
from drillctl.rig.weight_on_bit import AlarmWeight, FollowingSpeed, ObservedWeight, RealWeight

HOLDS = {
    "weight on its way": "order 2; a pure delay sample by sample; delay margin against poles that "
    "cross",
}

DESIGN = "monteiro-trindade-140kn"
SLOPE = 290.0746971030263
# Coefficients instead of the table: the kernels are made in half the time.
FIXED = {"bit_rock": {"law": "navarro-lopez-suarez", "a1": 0.026, "a2": 0.085, "beta": 0.098}}
LATE = {"delay": "0.5 s", "hoist_lag": "0.5 s"}


def rig(law="navarro-lopez-suarez", path=None, rock=FIXED, **values):
    own = {"minimum": "42 kN", "maximum": "182 kN", "gain": "4 kN*s/rad"}
    if law == "stick-slip-alarm":
        own = {"minimum": "42 kN"}
    weight = {"law": law} | own | values.pop("weight", {}) | ({"path": path} if path else {})
    gains = {"controller.kp": 200.0, "controller.ki": 100.0, "simulation.duration": "40 s"}
    return drillctl.load(DESIGN, weight_on_bit=weight, **rock, **(gains | values))


def both(design, step="5 ms"):
    fine = design.replace({"simulation.step": step})
    return tuple(drillctl.simulate(fine, engine=e).measures for e in ("batch", "reference"))


# Laws


def test_an_ideal_path_is_the_ideal_law():
    ideal = rig().weight_on_bit
    assert isinstance(ideal, FollowingSpeed)
    assert rig(path={"delay": "0 s", "rate_limit": "inf"}).weight_on_bit == ideal
    assert isinstance(rig(path=LATE).weight_on_bit, RealWeight)
    assert isinstance(rig("surface-observer").weight_on_bit, ObservedWeight)


def test_the_path_stays_when_the_law_changes():
    late = rig(path=LATE)
    constant = late.replace({"weight_on_bit.law": "constant"})
    assert constant.weight_on_bit.level == 140e3
    again = constant.replace(
        {"weight_on_bit.law": "navarro-lopez-suarez", "weight_on_bit.gain": "4 kN*s/rad"}
    )
    assert again.weight_on_bit.delay == late.weight_on_bit.delay
    with pytest.raises(InputError, match=r"path\.delay: 1 has no unit"):
        drillctl.load(DESIGN, **{"weight_on_bit.path.delay": 1})


def test_a_limited_rate_comes_with_a_lag():
    assert rig(path={"rate_limit": "10 kN/s"}).weight_on_bit.hoist == 0.1
    kept = rig(path={"rate_limit": "10 kN/s", "hoist_lag": "2 s"}).weight_on_bit
    assert (kept.hoist, kept.rate) == (2.0, 10e3)


def test_an_alarm_takes_off_and_puts_on():
    law = AlarmWeight(100e3, 0.6, 0.0, 0.0, 0.0, 1e12, 10.0, 0.8, 0.3, 0.25)
    assert law.next_level(1.0, 0.0, 20.0, 10.0) == pytest.approx(0.75)  # SSI 1
    assert law.next_level(0.75, 0.0, 20.0, 10.0) == pytest.approx(0.6)  # not under the least
    assert law.next_level(0.6, 9.0, 11.0, 10.0) == pytest.approx(0.8)  # SSI 0.1
    assert law.next_level(0.8, 9.0, 11.0, 10.0) == 1.0  # not over the nominal
    assert law.next_level(0.8, 5.0, 15.0, 10.0) == 0.8  # between calm and alarm
    assert law.next_level(1.0, 0.0, 0.0, 0.0) == pytest.approx(0.75)  # stuck throughout


# Simulated


@pytest.mark.parametrize(
    "path",
    [
        LATE,
        {"delay": "13 ms", "hoist_lag": "0.2 s", "sensor_lag": "0.1 s"},  # under a step
        {"delay": "0.2 s"},
        {"delay": "0.5 s", "sampling_period": "1 s", "hoist_lag": "0.5 s", "rate_limit": "30 kN/s"},
    ],
)
def test_engines_agree_on_what_comes_late(path):
    batch, reference = both(rig(path=path))
    assert batch.j1 == pytest.approx(reference.j1, rel=2e-4)
    assert batch.mean_weight_on_bit == pytest.approx(reference.mean_weight_on_bit, rel=1e-4)
    assert batch.peak_bit_speed == pytest.approx(reference.peak_bit_speed, rel=1e-3)


@pytest.mark.parametrize("more", [{}, {"sampling_period": "1e5 s"}])
def test_what_comes_after_the_run_is_neither_seen_nor_remembered(more):
    late = [
        drillctl.simulate(rig(path={"delay": delay, **more}), engine="batch").measures.j1
        for delay in ("101 s", "150 s", "1e6 s")
    ]
    assert late[0] == late[1] == late[2]
    with pytest.raises(InputError, match=r"weight_on_bit.path: .* signals it would remember"):
        drillctl.simulate(
            rig(path={"delay": "90 s"}, **{"simulation.step": "5 us"}), engine="batch"
        )


def test_order_2_of_what_comes_late():
    """Against the reference solver, over a run that neither sticks nor meets a limit."""
    values = {"start.speed": "100 rpm", "operating_point.weight_on_bit": "45 kN"}
    design = rig(path=LATE, weight={"minimum": "0 kN", "gain": "1 kN*s/rad"}, **values)
    expected = drillctl.simulate(design).measures.j1
    apart = []
    for step in ("50 ms", "25 ms", "12.5 ms"):
        variant = design.replace({"simulation.step": step, "simulation.modes": 31})
        apart.append(drillctl.simulate(variant, engine="batch").measures.j1 - expected)
    orders = np.log2(np.abs(np.array(apart[:-1]) / apart[1:]))
    assert orders == pytest.approx(2.0, abs=0.05)


def test_a_constant_delay_shifts_the_weight():
    """Without lags the weight is the law of the bit speed half a second before."""
    design = rig(path={"delay": "0.5 s"}, **{"simulation.step": "5 ms"})
    run = drillctl.simulate(design, engine="batch", interval=0.05)
    law = FollowingSpeed(*design.weight_on_bit[:5])
    expected = law.weight(np.abs(run.signals["bit_speed"][:-10]))
    assert run.signals["weight_on_bit"][10:] == pytest.approx(expected, rel=1e-9)


def test_the_hoist_keeps_its_rate_and_the_law_its_limits():
    design = rig(path={"rate_limit": "20 kN/s", "hoist_lag": "0.3 s"})
    for engine in ("batch", "reference"):
        run = drillctl.simulate(design, engine=engine, interval=0.025)
        weight = run.signals["weight_on_bit"]
        assert np.abs(np.diff(weight)).max() <= 20e3 * run.time[1] * (1 + 1e-6)
        assert weight.min() >= 42e3 - 1.0
        assert weight.max() <= 182e3 + 1.0


def test_an_alarm_agrees_in_both_engines():
    batch, reference = both(rig("stick-slip-alarm", {"delay": "2 s", "hoist_lag": "1 s"}))
    assert batch.j1 == pytest.approx(reference.j1, rel=2e-4)
    assert batch.mean_weight_on_bit == pytest.approx(reference.mean_weight_on_bit, rel=1e-4)
    assert batch.mean_weight_on_bit < 139e3


def test_an_alarm_waits_for_a_weight_that_is_ramped_in():
    """Windows end while there is no weight yet: its share of the nominal one is what counts."""
    scenario = {"scenario.weight_on_bit": {"start": "0 kN", "begin": "15 s", "end": "25 s"}}
    batch, reference = both(rig("stick-slip-alarm", {"hoist_lag": "1 s"}, **scenario))
    assert batch.j1 == pytest.approx(reference.j1, rel=5e-4)
    assert batch.mean_weight_on_bit == pytest.approx(reference.mean_weight_on_bit, rel=1e-3)


def test_an_observed_weight_agrees_in_both_engines():
    batch, reference = both(rig("surface-observer", {"hoist_lag": "0.3 s"}))
    assert batch.j1 == pytest.approx(reference.j1, rel=1e-3)


def test_a_map_runs_over_delays_from_none_on():
    """At no delay and no lag the ideal law, elsewhere its late form: two kernels, one map."""
    axes = [{"path": "weight_on_bit.path.delay", "min": "0 s", "max": "1 s", "points": 3}]
    found = drillctl.sweep(rig(map={"axes": axes, "audit_cells": 0}))
    j1 = found.measures["j1"]
    alone = drillctl.simulate(rig(), engine="batch").measures.j1
    assert j1[0] == pytest.approx(alone, rel=1e-12)
    late = drillctl.simulate(rig(path={"delay": "1 s"}), engine="batch").measures.j1
    assert j1[2] == pytest.approx(late, rel=1e-12)


# The observer


def test_a_string_without_an_observer_is_refused_in_words():
    damped = {"drillstring.stiffness_damping": "2e5 s"}
    with pytest.raises(InputError, match="no observer can be computed for this string"):
        observer(drillctl.load("aarsnes-shor-well-a", **damped).string, 100)


def test_an_observer_comes_to_the_truth():
    """Of a string that turns as a whole under no torque the estimate is exact from the start, and
    a wrong start is forgotten."""
    string = rig().string
    found = observer(string)
    assert np.linalg.eigvals(found.free).real.max() < -0.05
    turning = found.state(np.zeros(string.nodes), np.full(string.nodes, 2.0))
    assert found.read @ turning == pytest.approx(2.0)
    # In steady twist under torque T: both ends at speed zero.
    torque = 5000.0
    twist = np.concatenate([[0.0], -np.cumsum(torque / string.element_stiffness)])
    steady = np.linalg.solve(found.free, -found.by_torque * torque)
    assert found.read @ steady == pytest.approx(0.0, abs=1e-9)
    assert steady[-1] == pytest.approx(torque, rel=1e-9)
    assert found.state(twist, 0.0 * twist)[1:-1] == pytest.approx(steady[1:-1], abs=1e-6)


# Linear


@pytest.mark.parametrize(
    ("law", "path"),
    [
        ("navarro-lopez-suarez", LATE),
        ("navarro-lopez-suarez", {"delay": "0.4 s", "sensor_lag": "0.2 s", "hoist_lag": "0.3 s"}),
        ("surface-observer", {"hoist_lag": "0.5 s"}),
    ],
)
def test_poles_of_the_states_are_zeros_of_the_impedances(law, path):
    design = rig(law, path, weight={"gain": "2 kN*s/rad"}, **{"controller.kp": 625.0})
    bit = BitSide(SLOPE, weight_path(design, design.speed))
    poles = model_poles(design, bit)
    low = poles[(np.abs(poles) < 3.0) & (poles.imag > 0.0)]
    assert len(low) >= 2
    ends, drive = ends_of(design.string), design.top_drive.impedance(low)
    assert np.abs(bit.bit_impedance(ends, low, drive) - SLOPE).max() < 1e-2
    assert np.abs(bit.top_impedance(ends, low) + drive).max() < 1e-2


def test_the_delay_margin_is_where_poles_cross():
    design = rig(path=LATE, weight={"gain": "2 kN*s/rad"}, **{"controller.kp": 625.0})
    design = design.replace({"controller.ki": 125.0})
    bit = BitSide(SLOPE, weight_path(design, design.speed))
    margin, omega = weight_delay_margin(ends_of(design.string), design.top_drive, bit)
    assert drillctl.loop(design).weight_delay_margin == pytest.approx(margin)
    for share, stable in ((0.98, True), (1.02, False)):
        late = design.replace({"weight_on_bit.path.delay": f"{0.5 + share * margin!r} s"})
        found = drillctl.loop(late)
        assert found.stable is stable
        if not stable:
            grows = found.poles[np.argmax(found.poles.real)]
            assert abs(grows.imag) == pytest.approx(omega, rel=0.02)


def test_the_ideal_law_has_the_slope_and_a_delay_margin():
    design = rig(weight={"gain": "2 kN*s/rad"}, **{"controller.kp": 625.0, "controller.ki": 125.0})
    ideal = drillctl.loop(design)
    late = drillctl.loop(design.replace({"weight_on_bit.path.delay": "10 ms"}))
    assert ideal.weight_delay_margin - late.weight_delay_margin == pytest.approx(0.01, abs=1e-9)
    assert ideal.slope_margin == pytest.approx(347.1688, rel=1e-5)


def test_a_constant_weight_has_no_delay_margin():
    assert drillctl.loop(drillctl.load(DESIGN)).weight_delay_margin is None


# Refused


@pytest.mark.parametrize(
    ("law", "weight", "message"),
    [
        ("navarro-lopez-suarez", {"gain": "-1 kN*s/rad"}, "weight_on_bit.gain: '-1 kN"),
        ("navarro-lopez-suarez", {"path": {"delay": "-1 s"}}, "path.delay: '-1 s' is not allowed"),
        ("navarro-lopez-suarez", {"path": {"dely": "1 s"}}, "path.dely: .*did you mean 'delay'"),
        (
            "navarro-lopez-suarez",
            {"path": {"rate_limit": "0 kN/s"}},
            "rate_limit: '0 kN/s' is not",
        ),
        ("surface-observer", {"path": {"sensor_lag": "1 s"}}, "sensor_lag is not allowed with"),
        ("stick-slip-alarm", {"path": {"delay": "11 s"}}, "delay 11 s must not exceed window 10"),
        ("stick-slip-alarm", {"calm": 0.9}, "calm = 0.9 must be less than alarm = 0.8"),
        ("stick-slip-alarm", {"reduction": 1.0}, "reduction = 1 must be more than 0"),
        ("stick-slip-alarm", {"minimum": "150 kN"}, "140 kN lies outside the limits"),
    ],
)
def test_bad_weights_are_refused(law, weight, message):
    with pytest.raises(InputError, match=message):
        _ = rig(law, weight=weight).weight_on_bit


def test_of_a_weight_with_memory_the_long_run_is_reported_alone():
    found = drillctl.limit_cycle(rig(path=LATE), periods=16)
    assert found.harmonic == ()
    assert found.orbit is None
    assert found.status in ("equilibrium", "settling", "repeating", "not periodic")
