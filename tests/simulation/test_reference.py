"""The reference solver against event-accurate values, balances and known behaviour."""

import numpy as np
import pytest
from scipy.integrate import DOP853

import drillctl
from benchmarks.peers.reference import solver as peer
from drillctl.design import Design
from drillctl.errors import SimulationError
from drillctl.simulation import reference
from drillctl.simulation import reference_run as run
from drillctl.simulation.reference import numbers_of, solve, solve_whole
from drillctl.simulation.reference_steps import explicit_dense_output, tableau
from drillctl.simulation.run import sample

HOLDS = {
    "reference solver": "event-accurate values of six runs, J1 to 1e-5; energy to 1e-8; another "
    "integrator",
    "lumped string": "two published equilibria, bistability, period 5.092533 s",
}

# Kp, Ki, WOB (kN), J1 (s), time stuck (s), peak bit speed (rad/s): computed once with another
# program (LSODA at 1e-9 with located events), to the digits given.
EVENT_ACCURATE = [
    (625, 125, 140, 19.45694, 8.8444, 22.9684),
    (600, 150, 140, 20.02091, 7.926, 24.5234),
    (200, 100, 140, 103.04558, 41.6554, 32.5694),
    (400, 100, 140, 82.43215, 30.9162, 23.5447),
    (625, 125, 120, 12.22839, 5.4076, 17.7486),
    (200, 100, 120, 80.40938, 36.0667, 26.4402),
]


def paper(kp: float, ki: float, weight: float, **values: object) -> Design:
    return drillctl.load(
        "monteiro-trindade-2012",
        **{
            "controller.kp": kp,
            "controller.ki": ki,
            "operating_point.weight_on_bit": f"{weight} kN",
            **values,
        },
    )


@pytest.mark.parametrize(("kp", "ki", "weight", "j1", "stuck", "peak"), EVENT_ACCURATE)
def test_event_accurate_values(kp, ki, weight, j1, stuck, peak, figure):
    motion = solve(paper(kp, ki, weight))
    measures = sample(motion).measures
    assert measures.j1 == pytest.approx(j1, rel=1e-5)
    assert measures.stuck_time == pytest.approx(stuck, abs=1e-3)
    assert measures.peak_bit_speed == pytest.approx(peak, abs=1e-4)
    assert motion.energy.relative_residual < 1e-8
    figure("energy left over, of the work done, reference solver", motion.energy.relative_residual)
    figure("error of J1, relative, reference solver", abs(measures.j1 / j1 - 1.0))


def test_tolerance_converges():
    design = paper(625, 125, 140, **{"simulation.duration": "20 s"})
    exact = sample(solve(design, tolerance=1e-11)).measures.j1
    errors = [abs(sample(solve(design, tolerance=t)).measures.j1 - exact) for t in (1e-4, 1e-7)]
    assert errors[1] < 1e-6
    assert errors[1] < errors[0] / 10


def test_another_integrator_agrees(figure):
    design = paper(400, 100, 140, **{"simulation.duration": "15 s"})
    by_dop853 = sample(solve(design, 1e-9)).measures
    by_radau = peer.solve(design, 1e-8, "Radau")
    j1 = peer.j1(by_radau)
    assert j1 == pytest.approx(by_dop853.j1, rel=1e-6)
    figure("J1 by Radau against DOP853, relative", abs(j1 / by_dop853.j1 - 1.0))
    stuck = sum(piece.end - piece.begin for piece in by_radau.pieces if piece.direction == 0)
    assert stuck == pytest.approx(by_dop853.stuck_time, abs=1e-5)


WEIGHT = {"weight_on_bit.law": "navarro-lopez-suarez", "weight_on_bit.gain": "1 kN*s/rad"}
LAWS = {
    "from rest": {"start.kind": "rest", "bha.damping": "20 N*m*s/rad"},
    "modal damping": {"drillstring.modal_damping": 0.02},
    "smooth rock": {"bit_rock.regularised_over": "0.5 rad/s"},
    "z-torque": {"controller": {"law": "z-torque", "absorption": 0.9}},
    "limits": {
        "controller.drive.lag": "0.05 s", "controller.drive.encoder_lag": "5 ms",
        "controller.drive.torque_limit": "11 kN*m",
    },
    "sampled": {
        "controller.drive.lag": "0.05 s", "controller.drive.sampling_period": "20 ms",
        "controller.drive.torque_rate_limit": "40 kN*m/s",
    },
    "programs": {
        "scenario.speed.start": "60 rpm", "scenario.speed.begin": "2 s",
        "scenario.speed.end": "9 s",
        "scenario.weight_on_bit.start": "60 kN", "scenario.weight_on_bit.end": "10 s",
        "scenario.bit_rock.until": "5 s", "scenario.bit_rock.static_factor": 1.1,
    },
    "ideal weight": WEIGHT,
    "late weight": WEIGHT | {
        "weight_on_bit.path.delay": "0.4 s", "weight_on_bit.path.hoist_lag": "0.5 s",
    },
    "read weight": WEIGHT | {
        "weight_on_bit.path.delay": "0.2 s", "weight_on_bit.path.sampling_period": "0.5 s",
        "weight_on_bit.path.sensor_lag": "0.1 s", "weight_on_bit.path.hoist_lag": "0.5 s",
    },
    "observed weight": WEIGHT | {"weight_on_bit.law": "surface-observer"},
    "alarm": {"weight_on_bit.law": "stick-slip-alarm", "weight_on_bit.path.hoist_lag": "1 s",
              "weight_on_bit.window": "5 s"},
}  # fmt: skip


@pytest.mark.parametrize("name", LAWS)
def test_the_peer_in_plain_python_agrees(name):
    design = paper(400, 100, 140, **{"simulation.duration": "15 s"} | LAWS[name])
    motion, due = solve(design, 1e-9), peer.solve(design, 1e-9)
    assert len(motion.events) == len(due.events)
    for event, other in zip(motion.events, due.events, strict=True):
        assert (event.kind, event.direction) == (other.kind, other.direction)
        assert event.time == pytest.approx(other.time, abs=1e-7)
    assert sample(motion).measures.j1 == pytest.approx(peer.j1(due), rel=1e-8)
    assert motion.energy.drive == pytest.approx(due.energy.drive, rel=1e-8)
    times = np.array([piece.begin + 0.4 * (piece.end - piece.begin) for piece in due.pieces])
    torques = [
        due.system.told(time, piece.solution(time), piece.phase)
        for time, piece in zip(times, due.pieces, strict=True)
    ]
    for value, other in zip(motion.torques(times)[:3], np.array(torques).T, strict=True):
        assert value == pytest.approx(other, rel=1e-6, abs=1e-2)


def test_coefficients_are_those_of_scipy():
    made, dense = tableau(), explicit_dense_output()
    a = np.zeros((16, 16))
    np.put_along_axis(a, made.of, made.a, axis=1)
    assert np.array_equal(a[:12, :12], DOP853.A)
    assert np.array_equal(a[12, :12], DOP853.B)
    assert np.array_equal(a[13:], DOP853.A_EXTRA)
    assert np.array_equal(made.c, [*DOP853.C, 1.0, *DOP853.C_EXTRA])
    errors = np.zeros((2, 16))
    np.put_along_axis(errors, made.errors_of, made.errors, axis=1)
    assert np.array_equal(errors[:, :13], [DOP853.E5, DOP853.E3])
    weights = np.zeros((16, 6))
    weights[dense.of] = dense.weights
    assert np.array_equal(weights[:, 2:], DOP853.D.T)


STIFF = {"drillstring.sections.pipe.stiffness_damping": "1e-3 s", "simulation.duration": "15 s"}


@pytest.mark.parametrize("name", [name for name in LAWS if name != "modal damping"])
def test_stiff_steps_agree_with_explicit_ones(name):
    design = paper(400, 100, 140, **STIFF | LAWS[name])
    due, motion = solve(design, 1e-11), solve(design, 1e-8, stiff=True)
    assert motion.method == "Rodas5P"
    assert [event.kind for event in motion.events] == [event.kind for event in due.events]
    times = [event.time for event in due.events]
    assert [event.time for event in motion.events] == pytest.approx(times, abs=2e-6)
    assert sample(motion).measures.j1 == pytest.approx(sample(due).measures.j1, rel=1e-6)
    assert motion.energy.relative_residual < 1e-8


def test_order_of_stiff_steps(figure):
    # Slip of the bit alone, in steps of one length; the drive has a filter and a limit.
    drive = {"controller.drive.lag": "0.2 s", "simulation.duration": "0.32 s"}
    design = paper(400, 100, 140, **STIFF | drive)
    due = solve_whole(design, 1e-13).states(np.array([0.32]))[:, 0]
    ends = [in_steps_of_one_length(design, count) for count in (16, 32, 64)]
    errors = [np.abs(end[: len(due)] - due).max() for end in ends]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    figure("order of the stiff steps", orders[-1])
    assert orders[-1] > 4.8  # of a string that is nearly linear it is 6


def in_steps_of_one_length(design, count):
    """The last state of a run in so many stiff steps, behind a first one that is short."""
    numbers = numbers_of(design)
    rig, state = numbers.rig, numbers.state
    work, clock = run.work_for(len(state)), reference._clock(design, numbers, 1e-13)
    method, solver = run.method_for(True, design.string.nodes, len(state))
    run.begin(rig, clock, work, state)
    for k in range(count + 1):
        clock = reference._with_room(numbers, clock)
        run.advance(rig, method, solver, clock, work, numbers.sums, state, 1)
        if k == 0:
            assert 0.0 < clock.now[run.TIME] < 1e-3
            clock = clock._replace(tolerance=1e9)  # from here on every step is taken as it is
            length = (1.0 + 1e-12) * (clock.duration - clock.now[run.TIME]) / count
        clock.now[run.STEP] = length
    assert clock.now[run.TIME] == clock.duration
    return state


def test_method_by_what_the_string_asks():
    fine = {"drillstring.sections.pipe.elements": 400, "simulation.duration": "1 s"}
    assert solve(paper(400, 100, 140, **fine)).method == "DOP853"
    assert solve(paper(400, 100, 140, **STIFF | fine)).method == "Rodas5P"
    assert solve(paper(400, 100, 140, **STIFF)).method == "DOP853"


@pytest.mark.parametrize("kind", ["rest", "turning", "wound_up"])
def test_energy_balance_from_any_start(kind):
    design = paper(
        500, 100, 120,
        **{
            "start.kind": kind,
            "simulation.duration": "30 s",
            "drillstring.sections.pipe.stiffness_damping": "1e-3 s",
            "drillstring.sections.pipe.mass_damping": "0.05 1/s",
            "bha.damping": "20 N*m*s/rad",
        },
    )  # fmt: skip
    motion = solve(design)
    assert motion.energy.drive > 0
    assert motion.energy.bit > 0
    assert motion.energy.damping > 0
    assert motion.energy.relative_residual < 1e-8


def test_friction_never_leaves_its_set():
    run = drillctl.simulate(paper(200, 100, 120))
    stuck = run.signals["stuck"] > 0.5
    static = 9480.0
    assert stuck.sum() > 1000
    assert np.abs(run.signals["bit_torque"][stuck]).max() <= static * (1 + 1e-9)
    assert np.all(run.signals["bit_speed"][stuck] == 0.0)
    turning = ~stuck & (np.abs(run.signals["bit_speed"]) > 1e-6)
    opposes = run.signals["bit_torque"][turning] * run.signals["bit_speed"][turning]
    assert np.all(opposes > 0)


def test_a_stop_of_the_bit_reaches_the_top_after_the_travel_time():
    # 200 elements, so that the front is sharp: L / c = 0.942 s.
    common = {
        "drillstring.sections.pipe.elements": 200,
        "simulation.duration": "1.6 s",
        "controller.kp": 0,
        "controller.ki": 0,
        "start.speed": "100 rpm",
    }
    braked = drillctl.simulate(paper(0, 0, 140, **common), interval=1e-3)
    # The bit is braked from the first moment; until the wave arrives the top knows nothing, and
    # then it slows down quadratically, as torque and then speed build up.
    change = np.abs(braked.signals["top_speed"] - braked.signals["top_speed"][0])
    assert change[braked.time < 0.85].max() < 1e-3 * change[-1]
    growing = (braked.time > 1.05) & (braked.time < 1.25)
    slope, offset = np.polyfit(braked.time[growing], np.sqrt(change[growing]), 1)
    assert -offset / slope == pytest.approx(0.942, abs=0.01)


def test_signs():
    run = drillctl.simulate(paper(625, 125, 140))
    late = run.time > 95
    # Steady drilling: drive, pipe and bit torque are all near T(100 rpm), and the top leads.
    for name in ("top_torque", "pipe_torque", "bit_torque"):
        assert run.signals[name][late].mean() == pytest.approx(6600, rel=0.02)
    assert run.signals["twist"][late].mean() == pytest.approx(6600 / 315.32, rel=0.02)


def test_lumped_string_is_bistable():
    # At 10 kN m: from 12 rad/s it settles at 5.005 rad/s, from rest it sticks and slips for ever.
    settles = drillctl.load("navarro-lopez-2dof-bistable", **{"simulation.duration": "150 s"})
    run = drillctl.simulate(settles)
    assert run.status == "ok"
    assert run.signals["bit_speed"][-1] == pytest.approx(5.005, abs=1e-3)
    sticks = solve(settles.replace({"start.kind": "rest"}))
    breaks = [event.time for event in sticks.events if event.kind == "release"]
    assert breaks[-1] - breaks[-2] == pytest.approx(5.092533, abs=1e-6)
    late = sample(sticks)
    assert late.status == "sticking"
    cycle = late.signals["bit_speed"][late.time > 130]
    assert cycle.max() == pytest.approx(6.945236, abs=1e-4)


@pytest.mark.parametrize(("start", "expected"), [("4.4 rad/s", 4.34501), ("0.15 rad/s", None)])
def test_lumped_string_equilibria_under_constant_torque(start, expected):
    # 6 kN m at 50 kN: equilibria at .14967 (unstable) and 4.34501 rad/s.
    design = drillctl.load(
        "navarro-lopez-2dof",
        **{
            "controller.torque": "6 kN*m",
            "operating_point.weight_on_bit": "50 kN",
            "start.kind": "turning",
            "start.speed": start,
            "simulation.duration": "200 s",
        },
    )
    final = drillctl.simulate(design).signals["bit_speed"][-1]
    if expected is None:
        assert abs(final - 0.14967) > 0.1
    else:
        assert final == pytest.approx(expected, abs=1e-4)


def test_damping_to_ground_loads_the_frame():
    # With the constant load J1 is 33.5; a frame that forgets it gives 31.7.
    design = paper(400, 100, 140, **{"drillstring.sections.pipe.mass_damping": "0.2 1/s"})
    assert drillctl.simulate(design).measures.j1 == pytest.approx(33.5, abs=0.1)


@pytest.mark.slow
def test_periodic_orbit_with_a_little_damping():
    design = paper(
        200, 100, 120,
        **{
            "drillstring.sections.pipe.stiffness_damping": "1e-3 s",
            "simulation.duration": "400 s",
        },
    )  # fmt: skip
    motion = solve(design)
    releases = [event.time for event in motion.events if event.kind == "release"]
    # It closes slowly: the mean of the last four cycles.
    assert (releases[-1] - releases[-5]) / 4 == pytest.approx(22.3036, abs=1e-3)
    run = sample(motion)
    assert run.signals["bit_speed"][run.time > 350].max() == pytest.approx(26.119, abs=1e-3)


@pytest.mark.parametrize("name", ["monteiro-trindade-140kn", "richard-detournay-2dof"])
def test_a_run_that_keeps_more_than_there_is_room_for_is_refused(monkeypatch, name):
    monkeypatch.setattr("drillctl.simulation.room.LARGEST", 1 << 20)
    with pytest.raises(SimulationError, match=r"^\d{4,} steps by \d.* s of the run, more than"):
        drillctl.simulate(drillctl.load(name, **{"simulation.duration": "1000 s"}), "reference")


def test_a_bit_that_cannot_be_freed_is_stalled():
    design = drillctl.load(
        "monteiro-trindade-140kn",
        **{"controller.law": "constant-torque", "controller.torque": "5 kN*m"},
    )
    run = drillctl.simulate(design.replace({"simulation.duration": "60 s", "start.kind": "rest"}))
    assert run.status == "stalled"
    assert run.measures.stick_slip_index is None
    assert run.measures.work_per_turn is None
