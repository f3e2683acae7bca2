"""Drives as they are built: what limits, lags and sampling do, and the ideal they come from."""

from __future__ import annotations

import math

import numpy as np
import pytest

import drillctl
from drillctl.errors import InputError
from drillctl.linear import ends_of
from drillctl.linear.ends import BitSide
from drillctl.linear.export import nonlinear_system
from drillctl.linear.loop_model import loop_poles, model_poles, pade
from drillctl.linear.tuning import active_damping
from drillctl.rig.top_drive import PI, RealDrive, SampledDrive

HOLDS = {
    "real drives": "impedances against states; limits kept; sampling to zero with order 1; the "
    "ideal law at infinite limits",
}

DESIGN = "monteiro-trindade-140kn"
SLOPE = 290.0746971030263


def rig(law=None, drive=None, **values):
    controller = {} if law is None else {"controller": law}
    drives = {} if drive is None else {"controller.drive": drive}
    return drillctl.load(DESIGN, **controller, **drives, **values)


# From the table to the law


@pytest.mark.parametrize(
    "drive",
    [
        {},
        {"torque_limit": "inf kN*m", "power_limit": "inf", "torque_rate_limit": math.inf},
        {"lag": "0 s", "encoder_lag": "0 ms", "sampling_period": "0 s"},
    ],
)
def test_infinite_limits_and_no_lags_are_the_ideal_law(drive):
    assert rig(drive=drive).top_drive == rig().top_drive == PI(625.0, 125.0)


def test_a_drive_without_limits_moves_like_the_ideal_one():
    """The chain of lags with all of them zero is the ideal law, in the reference solver's terms."""
    ideal = drillctl.simulate(rig(**{"simulation.duration": "20 s"}))
    far = rig(drive={"torque_limit": "1e9 kN*m"}, **{"simulation.duration": "20 s"})
    assert isinstance(far.top_drive, RealDrive)
    assert drillctl.simulate(far).measures.j1 == pytest.approx(ideal.measures.j1, rel=1e-7)


def test_changing_the_law_keeps_the_drive_around_it():
    limited = rig(drive={"torque_limit": "20 kN*m"})
    soft = limited.replace({"controller.law": "soft-torque"})
    assert soft.top_drive.most == 20e3
    assert soft.top_drive.kp == pytest.approx(4 * soft.string.pipe_impedance)
    assert "20 kN*m" in drillctl.design.to_toml(soft)


def test_torque_laws_take_their_numbers_from_the_string():
    zeta, inertia = rig().string.pipe_impedance, 500.0
    matched = rig({"law": "z-torque", "absorption": 0.5, "high_pass": "20 s"}).top_drive
    assert matched.mobility == pytest.approx(0.5 / zeta)
    assert (matched.sensed_inertia, matched.corner) == pytest.approx((inertia, math.tau / 20))
    assert (matched.kp, matched.ki) == pytest.approx((50 * zeta, 5 * inertia))
    whole = rig({"law": "torsional-rectification"}).top_drive
    assert whole == rig({"law": "z-torque", "absorption": 1.0}).top_drive
    damped = rig({"law": "active-damping"}).top_drive
    damper, spring = active_damping(rig().string)
    assert (1 / damped.mobility, damped.corner / damped.mobility) == pytest.approx((damper, spring))
    assert damped.sensed_inertia == 0.0


def test_active_damping_makes_two_pairs_of_poles_coincide():
    """Of the two-body model that the rule is made for, exactly."""
    j_b, j_d, k = 400.0, 500.0, 315.0
    w = math.sqrt(k / j_b)
    damper, spring = 2.0 * math.sqrt(k * j_d), w * w * j_d
    quartic = np.polyadd(
        np.polymul([j_b, 0.0, k], [j_d, damper, k + spring]), [0.0, 0.0, 0.0, 0.0, -k * k]
    )
    poles = np.roots(quartic)
    assert np.abs(np.abs(poles) - w).max() < 1e-5 * w
    assert np.ptp(np.abs(poles.real)) < 1e-4
    found = active_damping(rig().string)
    assert found[1] == pytest.approx(rig().string.stick_slip_frequency ** 2 * 500.0)


@pytest.mark.parametrize("share", [1.0, 0.5, 0.0])
def test_z_torque_absorbs_what_it_says(share):
    """Above the high-pass a wave is reflected by (1 - a) / (1 + a) but for the stiff controller."""
    design = rig({"law": "z-torque", "absorption": share, "high_pass": "1e6 s", "stiffness": 1e7})
    s = 2j * np.pi * np.array([0.05, 0.2, 1.0])
    impedance = design.top_drive.impedance(s) + s * 500.0
    zeta = design.string.pipe_impedance
    reflected = (zeta - impedance) / (zeta + impedance)
    expected = abs(1.0 - 1.0 / share) / (1.0 + 1.0 / share) if share else 1.0
    assert np.abs(reflected) == pytest.approx(expected, abs=2e-3)


# The linear loop


DRIVES = {
    "lags": (None, {"lag": "50 ms", "encoder_lag": "100 ms"}),
    "z-torque": ({"law": "z-torque"}, None),
    "z-torque with lags": ({"law": "z-torque"}, {"lag": "5 ms", "encoder_lag": "2 ms"}),
    "z-torque with a filter": ({"law": "z-torque", "absorption": 0.5}, {"torque_lag": "20 ms"}),
    "active damping": ({"law": "active-damping"}, None),
    "sampled": (None, {"sampling_period": "50 ms", "lag": "10 ms", "one_sample_delay": True}),
}


@pytest.mark.parametrize("name", DRIVES)
def test_poles_of_the_states_are_zeros_of_the_impedances(name):
    """Two routes: states of string and drive, and the impedances of both; SI, N m s/rad."""
    design = rig(*DRIVES[name])
    bit = BitSide(SLOPE)
    poles = model_poles(design, bit)
    low = poles[(np.abs(poles) < 4.0) & (poles.imag > 0.0)]
    assert len(low) >= 2
    ends, drive = ends_of(design.string), design.top_drive.impedance(low)
    assert np.abs(bit.bit_impedance(ends, low, drive) - SLOPE).max() < 1e-3
    assert np.abs(bit.top_impedance(ends, low) + drive).max() < 1e-3


def test_the_model_of_an_ideal_drive_is_that_of_its_gains():
    found = model_poles(rig(), BitSide(SLOPE))
    expected = loop_poles(rig().string, 625.0, 125.0, SLOPE)
    assert np.sort_complex(found) == pytest.approx(np.sort_complex(expected), abs=1e-9)


@pytest.mark.parametrize("order", [2, 3, 6])
def test_a_delay_as_a_rational_function(order):
    tau = 0.7
    made = pade(tau, order)
    for s in (0.0, 0.3j, 1.0j, -0.2 + 0.5j):
        found = made.c @ np.linalg.solve(s * np.eye(order) - made.a, made.b)
        # Its first deviation is of the order 2 n in s tau.
        assert abs(found - np.exp(-s * tau)) <= abs(s * tau) ** (2 * order) + 1e-12


def test_the_loop_of_a_real_drive_answers_its_set_speed():
    system = rig({"law": "z-torque"}, {"lag": "5 ms"}).loop()
    assert system.input_labels == ["set_speed", "bit_torque"]
    low = system(1e-6j)
    row = system.output_labels.index("top_speed")
    assert low[row, 0] == pytest.approx(1.0, abs=1e-3)


# Simulated


LIMITED = {"torque_limit": "13 kN*m", "torque_rate_limit": "20 kN*m/s", "power_limit": "120 kW"}


def test_both_engines_agree_and_keep_the_limits():
    for drive in (LIMITED, {"lag": "50 ms", "encoder_lag": "100 ms"}):
        design = rig(drive=drive, **{"simulation.step": "5 ms", "simulation.duration": "40 s"})
        batch = drillctl.simulate(design, engine="batch", interval=0.02)
        reference = drillctl.simulate(design, interval=0.02)
        assert batch.measures.j1 == pytest.approx(reference.measures.j1, rel=2e-4)
        assert batch.measures.stuck_time == pytest.approx(reference.measures.stuck_time, rel=1e-3)
        if drive is LIMITED:
            for run in (batch, reference):
                torque, speed = run.signals["top_torque"], run.signals["top_speed"]
                assert torque.min() >= -1e-6
                assert torque.max() == pytest.approx(13e3, rel=1e-6)
                assert np.abs(np.diff(torque)).max() <= 20e3 * 0.02 * (1 + 1e-6)
                # The motor lags behind a power limit that falls with a speed that rises.
                assert (torque * speed).max() <= 120e3 * 1.02


def test_torque_feedback_runs_in_both_engines():
    for law in ("z-torque", "active-damping"):
        design = rig({"law": law}, **{"simulation.step": "5 ms", "simulation.duration": "30 s"})
        batch = drillctl.simulate(design, engine="batch").measures
        reference = drillctl.simulate(design).measures
        assert batch.j1 == pytest.approx(reference.j1, rel=1e-4)
        assert batch.peak_pipe_torque == pytest.approx(reference.peak_pipe_torque, rel=1e-2)


def test_sampling_tends_to_the_continuous_drive_with_order_1():
    values = {"simulation.step": "5 ms", "simulation.duration": "40 s"}
    ideal = drillctl.simulate(rig(**values), engine="batch").measures.j1
    apart = []
    for period in ("40 ms", "20 ms", "10 ms"):
        design = rig(drive={"sampling_period": period}, **values)
        assert isinstance(design.top_drive, SampledDrive)
        apart.append(abs(drillctl.simulate(design, engine="batch").measures.j1 - ideal))
    orders = np.log2(np.array(apart[:-1]) / apart[1:])
    assert orders == pytest.approx(1.0, abs=0.15)


def test_a_sampled_drive_agrees_in_both_engines():
    drive = {
        "sampling_period": "100 ms", "one_sample_delay": True, "lag": "30 ms",
        "torque_limit": "14 kN*m",
    }  # fmt: skip
    design = rig(drive=drive, **{"simulation.step": "5 ms", "simulation.duration": "40 s"})
    batch, reference = (
        drillctl.simulate(design, engine=e).measures for e in ("batch", "reference")
    )
    assert batch.j1 == pytest.approx(reference.j1, rel=2e-4)


def test_a_period_that_does_not_divide_the_run_is_rounded():
    design = rig(drive={"sampling_period": "30 ms"}, **{"simulation.duration": "20 s"})
    run = drillctl.simulate(design, engine="batch")
    steps = 20.0 / run.step
    assert steps == pytest.approx(round(steps), abs=1e-9)
    assert round(steps) % 667 == 0


def test_anti_windup_lowers_the_overshoot():
    peaks = {}
    for way in ("none", "back-calculation"):
        drive = {"torque_limit": "12.5 kN*m", "anti_windup": way}
        values = {"start.kind": "rest", "simulation.duration": "40 s", "simulation.step": "10 ms"}
        gains = {"controller.kp": 400.0, "controller.ki": 400.0}
        run = drillctl.simulate(rig(drive=drive, **gains, **values), engine="batch")
        assert run.measures.peak_top_torque == pytest.approx(12.5e3)
        peaks[way] = float(run.signals["top_speed"].max())
    assert peaks["back-calculation"] < 0.9 * peaks["none"]


def test_a_drive_too_weak_to_free_the_bit_stalls_and_says_so():
    design = rig(drive={"torque_limit": "9 kN*m"})
    (warning,) = [one for one in design.warnings if one.key == "controller.drive.torque_limit"]
    assert "the static torque of the bit, 11.9 kN m" in str(warning)
    assert "stalled" in warning.text
    run = drillctl.simulate(design, engine="batch")
    assert run.status == "stalled"
    assert run.measures.j1 == pytest.approx(99.875, abs=0.03)
    enough = rig(drive={"torque_limit": "12 kN*m"})
    assert "controller.drive.torque_limit" not in {one.key for one in enough.warnings}


@pytest.mark.parametrize(
    ("drive", "message"),
    [
        ({"torque_limit": "6 kN*m"}, r"controller.drive.torque_limit: gives 6 kN\*m .* 6.6 kN\*m"),
        ({"power_limit": "50 kW"}, r"controller.drive.power_limit: gives 4.775 kN\*m"),
        (
            {"torque_limit": "-1 kN*m"},
            "drive.torque_limit: '-1 kN.m' is not allowed: it must be gr",
        ),
        (
            {"minimum_torque": "1 kN*m"},
            "drive.minimum_torque: '1 kN.m' is not allowed: it must be 0",
        ),
        ({"one_sample_delay": True}, "one_sample_delay needs a sampling_period"),
        ({"lag": "-1 s"}, "controller.drive.lag: '-1 s' is not allowed"),
        ({"lag": "0.01 ms"}, "controller.drive.lag: .* 0 or at least 0.1 ms"),
        ({"sampling_period": "0.1 ms"}, "sampling_period: .* 0 or at least 1 ms"),
        ({"sampling_period": "100 s"}, "controller.drive.sampling_period: 100 s: the run ends"),
        ({"lag": 0.1}, "controller.drive.lag: 0.1 has no unit"),
        ({"torqe_limit": "9 kN*m"}, "controller.drive.torqe_limit.*did you mean 'torque_limit'"),
    ],
)
def test_bad_drives_are_refused(drive, message):
    with pytest.raises(InputError, match=message):
        rig(drive=drive)


@pytest.mark.parametrize(
    ("law", "message"),
    [
        ({"law": "z-torque", "absorption": 1.5}, "controller.absorption: 1.5 is not allowed"),
        ({"law": "active-damping", "damper": 0.0}, "controller.damper: 0.0 is not allowed"),
        ({"law": "z-torqe"}, "no law 'z-torqe'; did you mean 'z-torque'"),
    ],
)
def test_bad_laws_are_refused(law, message):
    with pytest.raises(InputError, match=message):
        rig(law)


def test_exports_refuse_a_drive_with_memory():
    design = rig(drive={"lag": "10 ms"})
    with pytest.raises(InputError, match="ideal drive"):
        nonlinear_system(design)
