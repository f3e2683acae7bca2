"""The exact step of a string against the matrix exponential, for any viscous damping."""

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st

import drillctl
from drillctl.rig.drillstring import Drillstring, Section, assemble
from drillctl.rig.top_drive import PI
from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.arithmetic import OPTIONS
from drillctl.simulation.kernels.observer_step import NoObserver
from drillctl.simulation.kernels.string_step import (
    MOST_READ,
    BlockString,
    DenseString,
    UndampedString,
    complete_and_propagate,
    load_string,
    look,
)
from drillctl.simulation.kernels.vectors import emitted, put
from drillctl.simulation.lanes import Start
from drillctl.simulation.propagator import string_step

HOLDS = {
    "steps of the string": "matrix exponential, any viscous damping",
}

numba = pytest.importorskip("numba")
STEP = 0.02


@emitted
def _pass(string, drive, observer, room, state, work):
    load_string(string, room)
    complete_and_propagate(string, drive, observer, room, state, work)


@emitted
def _look(string, state, work):
    speed, angle = look(string, state, work)
    put(work, r.SEEN_TOP, speed)
    put(work, r.SEEN_TWIST, angle)


@numba.njit(**OPTIONS)
def _steps(string, drive, observer, room, state, work, torques, seen):
    for n in range(len(torques)):
        _pass(string, drive, observer, room, state, work)
        work[r.TOP_TORQUE] = torques[n, 0]
        work[r.BIT_TORQUE] = torques[n, 1]
        _look(string, state, work)
        seen[n, 0] = work[r.SEEN_TOP]
        seen[n, 1] = work[r.SEEN_TWIST]


def run_steps(*arguments):
    """The steps of a string that nothing asks for its top speed."""
    nothing = np.zeros(1)
    string, *rest = arguments
    room = np.zeros(MOST_READ * len(string.push))
    _steps(string, PI(nothing, nothing), NoObserver(nothing), room, *rest)


def by_kernel(string: Drillstring, angle, speed, torques, modes=999):
    """Top speed and bit angle after each step, in lane 0."""
    stepper = string_step(string, STEP, modes)
    z = stepper.state(Start(((angle, np.ones(1)),), ((speed, np.ones(1)),)), np.zeros(1))[:, 0]
    state = np.zeros((2 * len(z), r.WIDTH))
    state[: len(z), 0] = z
    seen = np.zeros((len(torques), 2))
    run_steps(stepper.string, state.ravel(), np.zeros(r.ROWS * r.WIDTH), torques, seen)
    return stepper, seen


def by_exponential(string: Drillstring, angle, speed, torques):
    n = string.nodes
    mass = string.mass.toarray()
    a = np.zeros((2 * n + 2, 2 * n + 2))
    a[:n, n : 2 * n] = np.eye(n)
    a[n : 2 * n, :n] = -np.linalg.solve(mass, string.stiffness.toarray())
    a[n : 2 * n, n : 2 * n] = -np.linalg.solve(mass, string.damping.toarray())
    inputs = np.zeros((n, 2))
    inputs[0, 0], inputs[-1, 1] = 1.0, -1.0
    a[n : 2 * n, 2 * n :] = np.linalg.solve(mass, inputs)
    step = scipy.linalg.expm(a * STEP)
    z, seen = np.concatenate([angle, speed, [0.0, 0.0]]), []
    for torque in torques:
        z[2 * n :] = torque
        z = step @ z
        seen.append([z[n], z[n - 1]])
    return np.array(seen)


def a_string(stiffness_damping=0.0, mass_damping=0.0, top=0.0, bit=0.0, ratio=0.0, uneven=0.0):
    sections = (
        Section("pipe", 6, 400.0, 200.0, 0.0, 2000.0, 0.0, stiffness_damping, mass_damping),
        Section("collar", 3, 5000.0, 90.0, 0.0, 200.0, uneven, stiffness_damping, mass_damping),
    )
    return assemble(sections, 500.0, 300.0, top, bit, modal_damping=ratio)


CASES = {
    "undamped": a_string(),
    "modal ratio": a_string(ratio=0.03),
    "over and under critical": a_string(stiffness_damping=0.3),
    "all dampers": a_string(1e-3, 0.1, 40.0, 15.0, 0.01, 60.0),
    "internal, not classical": a_string(uneven=400.0),
    "to ground, not classical": a_string(top=300.0),
    "heavily damped bit": a_string(bit=5e4),
}


@pytest.mark.parametrize("name", CASES)
def test_steps_equal_the_matrix_exponential(name):
    string = CASES[name]
    random = np.random.default_rng(3)
    angle, speed = random.normal(size=(2, string.nodes))
    torques = 1e3 * random.normal(size=(200, 2))
    stepper, seen = by_kernel(string, angle, speed, torques)
    expected = by_exponential(string, angle, speed, torques)
    assert np.abs(seen - expected).max() <= 1e-9 * np.abs(expected).max()
    assert isinstance(stepper.string, UndampedString if name == "undamped" else BlockString)


def test_modes_too_fast_for_the_short_form_take_blocks(monkeypatch):
    from drillctl.simulation import propagator as undamped_step

    string = CASES["undamped"]
    random = np.random.default_rng(7)
    angle, speed = random.normal(size=(2, string.nodes))
    torques = 1e3 * random.normal(size=(100, 2))
    _, by_modes = by_kernel(string, angle, speed, torques)
    frequency, _ = string.undamped_modes
    monkeypatch.setattr(undamped_step, "LARGEST_TURN", 0.5 * frequency.max() * STEP)
    stepper, by_blocks = by_kernel(string, angle, speed, torques)
    assert isinstance(stepper.string, BlockString)
    assert np.abs(by_modes - by_blocks).max() <= 1e-11 * np.abs(by_blocks).max()


@settings(max_examples=40, deadline=None)
@given(
    top=st.floats(0, 1e4),
    bit=st.floats(0, 1e4),
    uneven=st.floats(0, 1e4),
    internal=st.floats(0, 1.0),
    ground=st.floats(0, 10.0),
)
def test_any_viscous_damping(top, bit, uneven, internal, ground):
    string = a_string(internal, ground, top, bit, 0.0, uneven)
    random = np.random.default_rng(4)
    angle, speed = random.normal(size=(2, string.nodes))
    torques = 1e3 * random.normal(size=(60, 2))
    _, seen = by_kernel(string, angle, speed, torques)
    expected = by_exponential(string, angle, speed, torques)
    assert np.abs(seen - expected).max() <= 1e-7 * np.abs(expected).max()


def critically_damped() -> Drillstring:
    """Two inertias on a unit spring, damped to ground: a double pole, no basis of eigenvectors.

    With inertias 1 and M and damper c the poles but zero solve M s^3 + c M s^2 + (1 + M) s + c
    = M (s + a)^2 (s + 5 a) = 0 for a^2 = 7/72, M = 72/5, c = 7 a.
    """
    spring = (Section("spring", 1, 1.0, 0.0),)
    return assemble(spring, 1.0, 72.0 / 5.0, top_damping=7.0 * np.sqrt(7.0 / 72.0))


def test_a_badly_conditioned_basis_is_not_used():
    string = critically_damped()
    random = np.random.default_rng(5)
    angle, speed = random.normal(size=(2, 2))
    torques = random.normal(size=(300, 2))
    stepper, seen = by_kernel(string, angle, speed, torques)
    expected = by_exponential(string, angle, speed, torques)
    assert np.abs(seen - expected).max() <= 1e-9 * np.abs(expected).max()
    assert isinstance(stepper.string, DenseString)


def test_dense_and_block_steps_agree(monkeypatch):
    from drillctl.simulation import propagator

    string = CASES["all dampers"]
    random = np.random.default_rng(6)
    angle, speed = random.normal(size=(2, string.nodes))
    torques = 1e3 * random.normal(size=(100, 2))
    _, by_blocks = by_kernel(string, angle, speed, torques)
    monkeypatch.setattr(propagator, "WORST_CONDITION", 0.0)
    stepper, dense = by_kernel(string, angle, speed, torques)
    assert isinstance(stepper.string, DenseString)
    assert np.abs(dense - by_blocks).max() <= 1e-10 * np.abs(by_blocks).max()


def test_modes_that_die_out_below_the_top_are_blocks_too(monkeypatch):
    """Short stiff pieces above the bit swing alone: the top sees them at 1e-17 of the others."""
    from drillctl.simulation import propagator

    string = drillctl.load("typical-slim").string
    top = np.abs(string.undamped_modes[1][0])
    assert top.min() < 1e-15 * top.max()
    random = np.random.default_rng(7)
    angle, speed = random.normal(size=(2, string.nodes))
    torques = 1e3 * random.normal(size=(100, 2))
    stepper, by_blocks = by_kernel(string, angle, speed, torques)
    assert isinstance(stepper.string, BlockString)
    monkeypatch.setattr(propagator, "WORST_CONDITION", 0.0)
    _, dense = by_kernel(string, angle, speed, torques)
    assert np.abs(dense - by_blocks).max() <= 1e-10 * np.abs(by_blocks).max()


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**31), steps=st.integers(1, 400))
def test_a_free_undamped_string_keeps_its_energy(seed, steps):
    string = CASES["undamped"]
    random = np.random.default_rng(seed)
    angle, speed = random.normal(size=(2, string.nodes))
    stepper = string_step(string, STEP, 999)
    z = stepper.state(Start(((angle, np.ones(1)),), ((speed, np.ones(1)),)), np.zeros(1))[:, 0]
    state = np.zeros((2 * len(z), r.WIDTH))
    state[: len(z), 0] = z
    flat = state.ravel()
    run_steps(
        stepper.string, flat, np.zeros(r.ROWS * r.WIDTH), np.zeros((steps, 2)), np.zeros((steps, 2))
    )
    n = string.nodes
    back = np.linalg.inv(np.hstack([stepper.angle_to_state, stepper.speed_to_state]))
    motion = back @ flat.reshape(-1, r.WIDTH)[: len(z), 0]

    def energy(u, v):
        return u @ (string.stiffness @ u) + v @ (string.mass @ v)

    assert energy(motion[:n], motion[n:]) == pytest.approx(energy(angle, speed), rel=1e-10)


@pytest.mark.parametrize("seed", range(5))
def test_held_torques_do_exactly_the_work_of_the_change_of_angle(seed):
    # What makes the discrete controller passive: work over a step = torque x change of angle.
    string = CASES["undamped"]
    random = np.random.default_rng(seed)
    before = random.normal(size=2 * string.nodes)
    top, bit = torques = 1e3 * random.normal(size=2)
    stepper = string_step(string, STEP, 999)
    n = string.nodes
    state = np.zeros((2 * len(stepper.angle_to_state), r.WIDTH))
    to_state = np.hstack([stepper.angle_to_state, stepper.speed_to_state])
    state[: len(to_state), 0] = to_state @ before
    flat, work = state.ravel(), np.zeros(r.ROWS * r.WIDTH)
    run_steps(stepper.string, flat, work, np.array([torques]), np.zeros((1, 2)))
    # The pass has propagated freely; the held torques are the state's `push`.
    by_top, ratio = stepper.string.push, stepper.string.ratio
    push = np.stack([by_top, -ratio[:, None] * by_top], axis=2).reshape(-1, 2)
    pushed = flat.reshape(-1, r.WIDTH)[: len(to_state), 0] + push @ [
        top,
        bit,
    ]
    after = np.linalg.solve(to_state, pushed)

    def energy(motion):
        u, v = motion[:n], motion[n:]
        return 0.5 * (u @ (string.stiffness @ u) + v @ (string.mass @ v))

    done = top * (after[0] - before[0]) - bit * (after[n - 1] - before[n - 1])
    assert energy(after) - energy(before) == pytest.approx(done, rel=1e-9, abs=1e-7)
