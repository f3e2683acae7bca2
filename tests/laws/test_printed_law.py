"""The printed three-branch friction beside the set that it stands in for."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import drillctl
from benchmarks.peers.reference import solver as peer
from drillctl.cli import run
from drillctl.errors import InputError
from drillctl.linear import loop, operating_point
from drillctl.rig.bit_rock import NavarroLopezSuarez, PrintedThreeBranch
from drillctl.simulation.reference import solve, solve_whole
from drillctl.simulation.reference_rates import (
    BACKWARD_EDGE,
    BIT_SPEED,
    CREEPING,
    FORWARD_EDGE,
    PUSHED,
)
from drillctl.simulation.run import sample

HOLDS = {
    "printed three-branch friction": "the set it stands in for: J1 within 1e-5, difference "
    "proportional to the tolerance; energy; an integrator that knows no edges; Radau",
}

DESIGN = "monteiro-trindade-140kn"
LAW = "printed-three-branch"
NUMBERS = {120: (0.029, 0.079, 0.097), 140: (0.026, 0.085, 0.098)}
DELTA = 1e-4


def exact(kp=625.0, ki=125.0, weight=140, **values):
    point = {
        "controller.kp": kp,
        "controller.ki": ki,
        "operating_point.weight_on_bit": f"{weight} kN",
    }
    return drillctl.load(DESIGN, **point | values)


def printed(kp=625.0, ki=125.0, weight=140, **values):
    rock = {"law": LAW} | dict(zip(("a1", "a2", "beta"), NUMBERS[weight], strict=True))
    return exact(kp, ki, weight, **{"bit_rock": rock} | values)


def stuck_pieces(motion):
    """Begin (s), end (s) and phase of each piece within the tolerance."""
    return motion.pieces[motion.directions == 0.0, :3]


def drift(motion, begin, end):
    """Angle (rad) by which the bit turns between two times (s)."""
    first, last = motion.bit_angle(np.array([begin, end]))
    return float(last - first) + motion.design.speed * (end - begin)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kp", "ki", "weight"), [(625, 125, 140), (200, 100, 140), (200, 100, 120)]
)
def test_close_to_the_set_valued_law(kp, ki, weight):
    # Measured: J1 within 6.7e-6, 3.3e-7 and 3.1e-6; time stuck 0.006, 0.022 and 0.018 s longer.
    motion = solve(printed(kp, ki, weight))
    found, due = sample(motion).measures, sample(solve(exact(kp, ki, weight))).measures
    assert found.j1 == pytest.approx(due.j1, rel=1e-5)
    assert 0.0 < found.stuck_time - due.stuck_time < 0.03
    assert found.peak_bit_speed == pytest.approx(due.peak_bit_speed, rel=2e-5)
    assert found.sticks == due.sticks
    assert motion.energy.relative_residual < 1e-9


def test_a_stuck_bit_drifts_by_at_most_the_tolerance():
    motion = solve(printed())
    pieces = stuck_pieces(motion)
    stuck = float((pieces[:, 1] - pieces[:, 0]).sum())
    for begin, end, _ in pieces:
        speed = motion.components([BIT_SPEED], np.linspace(begin, end, 20)[1:])
        assert np.abs(speed + motion.design.speed).max() <= DELTA * (1.0 + 1e-7)
    turned = sum(abs(drift(motion, begin, end)) for begin, end, _ in pieces)
    assert 0.5 * DELTA * stuck < turned <= DELTA * stuck
    run = sample(motion)
    assert run.measures.stuck_time == pytest.approx(stuck)
    assert np.any((run.signals["stuck"] == 1.0) & (run.signals["bit_speed"] != 0.0))


@pytest.mark.slow
def test_a_smaller_tolerance_tends_to_the_set():
    # J1 differs by an amount proportional to the tolerance: 2.8e-4, 1.4e-4, 7.1e-5 s.
    due = sample(solve(exact(**{"simulation.duration": "30 s"}))).measures.j1
    off = []
    for tolerance in ("2e-4 rad/s", "1e-4 rad/s", "5e-5 rad/s"):
        values = {"simulation.duration": "30 s", "bit_rock.tolerance": tolerance}
        off.append(sample(solve(printed(**values))).measures.j1 - due)
    assert off[0] / off[1] == pytest.approx(2.0, abs=0.1)
    assert off[1] / off[2] == pytest.approx(2.0, abs=0.1)


@pytest.mark.slow
def test_the_same_by_an_implicit_integrator():
    design = printed(**{"simulation.duration": "15 s"})
    one, other = sample(solve(design, 1e-9)), peer.solve(design, 1e-9, "Radau")
    assert one.measures.j1 == pytest.approx(peer.j1(other), rel=1e-9)
    events = [event.time for event in other.events]
    assert [event.time for event in one.events] == pytest.approx(events, abs=1e-6)


def test_every_branch_has_the_torque_that_is_printed():
    motion = solve_whole(printed(200.0, 100.0, **{"simulation.duration": "50 s"}))
    string, law = motion.design.string, motion.design.bit_rock
    static = law.a2 * 140e3
    seen = set()
    for begin, end, phase in motion.pieces[:, :3]:
        times = np.linspace(begin, end, 5)[1:-1]
        for state, torque in zip(motion.states(times).T, motion.torques(times)[2], strict=True):
            pipe = string.element_stiffness[-1] * (
                state[string.nodes - 2] - state[string.nodes - 1]
            )
            speed = abs(state[-1] + motion.design.speed)
            seen.add(phase)
            if phase == CREEPING:
                assert abs(pipe) <= static * (1 + 1e-9)
                assert torque == pytest.approx(pipe, rel=1e-12)
            elif phase == PUSHED:
                assert abs(pipe) >= static * (1 - 1e-9)
                assert torque == math.copysign(static, pipe)
            elif phase in (FORWARD_EDGE, BACKWARD_EDGE):
                assert speed == pytest.approx(DELTA, rel=1e-9)
                assert abs(torque) <= static
            else:
                due = law.torque_and_slope(140e3, speed, math.exp)[0]
                assert torque == pytest.approx(phase * due, rel=1e-12)
                assert speed >= DELTA * (1 - 1e-7)
    assert seen == {1, CREEPING, PUSHED, FORWARD_EDGE, BACKWARD_EDGE}


def test_an_integrator_that_knows_no_edges_chatters_about_the_same_motion():
    design = printed(**{"simulation.duration": "1 s"})
    motion = peer.solve(design)
    system, nodes = motion.system, design.string.nodes
    stuck = stuck_pieces(solve(design))[0, 0]
    begin, end = stuck - 0.01, stuck + 0.5

    def rates(time, state):
        speed = system.bit_speed(state)
        if abs(speed) > DELTA:
            return system.rates(time, state, 1 if speed > 0.0 else -1)
        return system.rates(time, state, CREEPING if system.overload(time, state) <= 0 else PUSHED)

    due = next(p for p in motion.pieces if p.begin <= end < p.end).solution(end)
    start = motion.pieces[0].solution(begin)
    found = solve_ivp(rates, (begin, end), start, method="RK45", rtol=1e-8, atol=1e-8)
    assert found.nfev > 10_000  # what it costs
    assert found.y[nodes - 1, -1] == pytest.approx(due[nodes - 1], abs=0.1 * DELTA * 0.5)


@pytest.mark.parametrize("kind", ["rest", "wound_up", "turning"])
def test_energy_balances_from_any_start(kind):
    values = {
        "start.kind": kind,
        "simulation.duration": "20 s",
        "drillstring.sections.pipe.stiffness_damping": "1e-3 s",
        "drillstring.sections.pipe.mass_damping": "0.05 1/s",
        "bha.damping": "20 N*m*s/rad",
    }
    motion = solve(printed(500.0, 100.0, 120, **values))
    due = sample(solve(exact(500.0, 100.0, 120, **values))).measures
    assert motion.energy.relative_residual < 1e-9
    assert sample(motion).measures.j1 == pytest.approx(due.j1, rel=2e-5)


def test_a_lumped_bit_keeps_the_speed_it_came_in_with():
    # Its own inertia alone is on the last node: Equation 3 leaves nothing to brake the bit.
    values = {"start.kind": "rest", "simulation.duration": "20 s"}
    design = drillctl.load("navarro-lopez-2dof-bistable", **values)
    law = design.bit_rock
    table = {"law": LAW, "a1": law.a1, "a2": law.a2, "beta": law.beta}
    motion = solve(design.replace({"bit_rock": table}))
    later = stuck_pieces(motion)[1:]
    assert set(later[:, 2]) == {FORWARD_EDGE}
    for begin, end, _ in later:
        assert drift(motion, begin, end) == pytest.approx(DELTA * (end - begin), rel=1e-6)


@pytest.mark.parametrize("drive", ["lag", "sampling_period"])
def test_weight_and_drive_with_a_memory(drive):
    values = {
        "simulation.duration": "15 s",
        f"controller.drive.{drive}": "0.05 s",
        "weight_on_bit.law": "navarro-lopez-suarez",
        "weight_on_bit.gain": "1 kN*s/rad",
    }
    rock = {"law": "navarro-lopez-suarez", "a1": 0.026, "a2": 0.085, "beta": 0.098}
    due = sample(solve(exact(**values | {"bit_rock": rock}))).measures
    motion = solve(printed(**values))
    assert sample(motion).measures.j1 == pytest.approx(due.j1, rel=2e-4)
    assert motion.energy.relative_residual < 1e-8


def test_the_rock_may_change_in_a_run():
    values = {"simulation.duration": "15 s", "scenario.bit_rock.until": "4 s",
              "scenario.bit_rock.static_factor": 1.2}  # fmt: skip
    due = sample(solve(exact(**values))).measures
    assert sample(solve(printed(**values))).measures.j1 == pytest.approx(due.j1, rel=1e-4)


def test_at_the_operating_point_it_is_equation_five():
    a1, a2, beta = NUMBERS[140]
    rock = {"law": "navarro-lopez-suarez", "a1": a1, "a2": a2, "beta": beta}
    with_it, without = printed(), exact(bit_rock=rock)
    assert with_it.bit_rock.turning == without.bit_rock == NavarroLopezSuarez(a1, a2, beta)
    assert operating_point(with_it) == operating_point(without)
    assert loop(with_it).summary() == loop(without).summary()


def test_a_table_over_the_weight():
    design = drillctl.load(DESIGN)
    rock = {**design.tree["bit_rock"], "law": LAW, "tolerance": "2e-4 rad/s", "a1_factor": 1.1}
    assert design.replace({"bit_rock": rock}).bit_rock == PrintedThreeBranch(
        0.026 * 1.1, 0.085, 0.098, 2e-4
    )
    moving = {"law": "navarro-lopez-suarez", "gain": "1 kN*s/rad"}
    with pytest.raises(InputError, match=r"bit_rock\.table: is not allowed with .* moves"):
        design.replace({"bit_rock": rock, "weight_on_bit": moving})


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"bit_rock.law": LAW}, "a1, a2, beta missing"),
        ({"bit_rock": {"law": LAW, "a1": 0.1, "a2": 0.05, "beta": 0.1}}, "must not be less"),
        ({"bit_rock": {"law": LAW, "a1": 0.0, "a2": 0.1, "beta": 0.1, "tolerance": "0 rad/s"}},
         "greater than 0"),
        ({"bit_rock": {"law": LAW, "a1": 0.0, "a2": 0.1, "beta": 0.1,
                       "regularised_over": "1 rad/s"}}, "unknown key"),
    ],
)  # fmt: skip
def test_impossible_numbers_are_refused(values, message):
    with pytest.raises(InputError, match=message):
        drillctl.load(DESIGN, **values)


@pytest.mark.parametrize(
    ("command", "message"),
    [
        (["simulate", "--engine", "batch"], "not a law of the batch engine"),
        (["map"], "not a law of the batch engine"),
        (["regions"], "not a law of the batch engine"),
        (["compare"], "not a law of the batch engine"),
        (["regularisation"], "has no regularised form"),
        (["cycle"], "cycles are not found"),
    ],
)
def test_what_runs_on_the_batch_engine_is_refused_by_name(command, message, tmp_path, capsys):
    settings = [f"bit_rock.law={LAW}", "bit_rock.a1=0.026", "bit_rock.a2=0.085",
                "bit_rock.beta=0.098"]  # fmt: skip
    options = [part for setting in settings for part in ("--set", setting)]
    out = tmp_path / "out"
    code = run([command[0], DESIGN, *command[1:], *options, "--out", str(out)])
    told = " ".join(capsys.readouterr().err.split())
    assert code == 2
    assert f"bit_rock.law: '{LAW}'" in told or "bit_rock.law: cycles" in told
    assert message in told
    assert "navarro-lopez-suarez" in told
    assert not out.exists()
