"""The whole linear loop of any design in state space: string, drive, rock and moving weight.

The equations are those of the physics rooms, written once there; with limits away they are
linear, and each column of the state matrix is their response to one unit of state.

Poles of the loop, the slope of the rock included.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from drillctl.arrays import Array, ComplexArray, Index
from drillctl.design import Design
from drillctl.linear.ends import BitSide, WeightPath
from drillctl.linear.state_space import (
    StateMatrices,
    closed_loop_matrices,
    named,
    plant_matrices,
    state_names,
    string_states,
)
from drillctl.rig.drillstring import Drillstring
from drillctl.rig.top_drive import RealDrive, SampledDrive
from drillctl.rig.top_drive.real_drive import MEMORY, respond

if TYPE_CHECKING:
    import control


PADE = 6  # order of the rational function that stands for the delay of a weight path
HELD_PADE = 3  # the same for the mean delay of a sampled controller, which is short


@dataclass(frozen=True, eq=False)
class Delay:
    """x' = a x + b u, y = c x: a delay as a strictly proper rational function."""

    # matrices, (order, order), (order,), (order,)
    a: Array
    b: Array
    c: Array


def pade(delay: float, order: int) -> Delay:
    """The Pade approximation of a delay (s) with a numerator of one order less.

    Strictly proper, so that no torque acts on itself at once.
    """
    n, m = order, order - 1

    # Of exp(-x), numerator of degree m, denominator of degree n, lowest power first.
    def weights(k: int, first: int, second: int) -> float:
        top = math.factorial(first + second - k) * math.factorial(first)
        bottom = math.factorial(first + second) * math.factorial(k) * math.factorial(first - k)
        return top / bottom

    numerator = [(-1) ** k * weights(k, m, n) * delay**k for k in range(m + 1)]
    denominator = [weights(k, n, m) * delay**k for k in range(n + 1)]
    lead = denominator[-1]
    a = np.eye(n, k=1)
    a[-1] = -np.array(denominator[:-1]) / lead
    b = np.zeros(n)
    b[-1] = 1.0
    c = np.zeros(n)
    c[: m + 1] = np.array(numerator) / lead
    return Delay(a, b, c)


class _Drive:
    """A drive inside its limits: torque and rates from its states, linear."""

    def __init__(self, law: Any, gain: float) -> None:
        self.gain = gain
        self.held: Delay | None = None
        kp, ki = law.gains()
        if isinstance(law, RealDrive):
            numbers = {name: getattr(law, name) for name in RealDrive._fields}
            self.law = RealDrive(**(numbers | {"feedforward": 0.0, "tracking": 0.0}))
            if isinstance(law, SampledDrive):
                self.held = pade((0.5 + law.late) * law.period, HELD_PADE)
        else:
            self.law = RealDrive(
                0.0, kp, ki, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
                -math.inf, math.inf, math.inf, math.inf, 0.0,
            )  # fmt: skip

    @property
    def states(self) -> int:
        return len(MEMORY) + (0 if self.held is None else len(self.held.b))

    def respond(self, memory: Array, speed: float, lead: float, free: float) -> tuple[float, Array]:
        own, waiting = memory[: len(MEMORY)], memory[len(MEMORY) :]
        if self.held is None:
            torque, changes = respond(self.law, own, speed, lead, 0.0, (free, self.gain))
            return torque, np.array(changes)
        # What is given out has waited; the motor follows that, with its own lag if it has one.
        given = float(self.held.c @ waiting)
        torque = float(own[4]) if self.law.lag > 0.0 else given
        # A controller that acts on a torque known to it: its motor is a state.
        known = self.law._replace(lag=max(self.law.lag, 1.0))
        end = (free, self.gain)
        rates = np.array(respond(known, np.array([*own[:4], torque]), speed, lead, 0.0, end)[1])
        command = rates[4] * known.lag + torque
        rates[4] = (given - torque) / self.law.lag if self.law.lag > 0.0 else 0.0
        return torque, np.concatenate([rates, self.held.a @ waiting + self.held.b * command])


class _Weight:
    """The path of a moving weight: its torque and rates from its states, linear."""

    def __init__(self, path: WeightPath | None) -> None:
        self.path = path
        self.delay: Delay | None = None
        if path is not None and path.delay > 0.0:
            self.delay = pade(path.delay, PADE)

    @property
    def states(self) -> int:
        if self.path is None:
            return 0
        sensor = 1 if self.path.observer is None else self.path.observer.states
        return sensor + (0 if self.delay is None else PADE) + 1

    def respond(self, memory: Array, bit: float, top: float, torque: float) -> tuple[float, Array]:
        """Torque of the rock by the weight (N m), and rates."""
        if self.path is None:
            return 0.0, memory
        path, observer = self.path, self.path.observer
        first = 1 if observer is None else observer.states
        signal_rates = np.zeros(first)
        if observer is not None:
            own = memory[:first]
            signal = float(observer.read @ own)
            signal_rates = observer.free @ own
            signal_rates += observer.by_torque * torque + observer.by_speed * top
        elif path.sensor > 0.0:
            signal = float(memory[0])
            signal_rates[0] = (bit - signal) / path.sensor
        else:
            signal = bit
        waiting, hoisted = memory[first:-1], float(memory[-1])
        seen, waits = signal, np.zeros(0)
        if self.delay is not None:
            seen = float(self.delay.c @ waiting)
            waits = self.delay.a @ waiting + self.delay.b * signal
        if path.hoist == 0.0:
            return path.gain * seen, np.array([*signal_rates, *waits, 0.0])
        moved = (seen - hoisted) / path.hoist
        return path.gain * hoisted, np.array([*signal_rates, *waits, moved])


def loop_model(design: Design, bit: BitSide) -> StateMatrices:
    """The loop of a design in state space."""
    plant = plant_matrices(design.sliding_string)
    size = len(plant.a)
    top, bit_row = plant.c[0], plant.c[1]
    drive = _Drive(design.linear_drive, float(top @ plant.b[:, 0]))
    weight = _Weight(bit.path)
    ends = np.cumsum([size, drive.states, weight.states])

    def response(state: Array, lead: float, load: float) -> tuple[Array, Array]:
        x, memory, path = np.split(state, ends[:2])
        speed, turning = float(top @ x), float(bit_row @ x)
        # The torque of the top reaches an observer after that of the rock is known.
        by_weight, _ = weight.respond(path, turning, speed, 0.0)
        rock = load - bit.slope * turning + by_weight
        free = float(top @ (plant.a @ x + plant.b[:, 1] * rock))
        torque, drive_rates = drive.respond(memory, speed, lead, free)
        _, weight_rates = weight.respond(path, turning, speed, torque)
        rates = plant.a @ x + plant.b @ np.array([torque, rock])
        outputs = np.array([*(plant.c @ x), torque])
        return np.concatenate([rates, drive_rates, weight_rates]), outputs

    total = int(ends[-1])
    zero = np.zeros(total)
    columns = [response(unit, 0.0, 0.0) for unit in np.eye(total)]
    inputs = [response(zero, 1.0, 0.0), response(zero, 0.0, 1.0)]
    return _seen_only(StateMatrices(
        np.column_stack([rates for rates, _ in columns]),
        np.column_stack([rates for rates, _ in inputs]),
        np.column_stack([outputs for _, outputs in columns]),
        np.column_stack([outputs for _, outputs in inputs]),
    ))  # fmt: skip


def _seen_only(matrices: StateMatrices) -> StateMatrices:
    """Without the states that act on nothing but themselves and on no output."""
    a, b, c, d = matrices
    others = a - np.diag(np.diag(a))
    kept = np.flatnonzero(np.any(others != 0.0, axis=0) | np.any(c != 0.0, axis=0))
    if len(kept) == len(a):
        return matrices
    return _seen_only(StateMatrices(a[np.ix_(kept, kept)], b[kept], c[:, kept], d))


def closed_loop(design: Design) -> control.StateSpace:
    """The string closed with its top-drive law, the bit torque left as an input.

    The torque is kp (set_speed - top_speed) + ki integral, Eq. 2 of Monteiro & Trindade
    (2012). Speeds are absolute; under a constant-torque law, whose level is left out, every
    signal is the change from steady drilling and `set_speed` acts on nothing.

    Parameters
    ----------
    design : Design
        The rig; its top-drive law gives the gains.

    Returns
    -------
    control.StateSpace
        `closed_loop`. Inputs `set_speed` (rad/s) and `bit_torque` (N m), outputs those of the
        plant and `top_torque` (N m). States of the plant and, with integral action, `integral`
        (rad, of the speed error).
    """
    return closed_at(design, BitSide(0.0))


def closed_at(design: Design, bit: BitSide) -> control.StateSpace:
    """The same with the bit closed; the states of a memory, beyond the string, are numbered."""
    if design.simple_drive and bit.path is None:
        kp, ki = design.linear_drive.gains()
        matrices = with_slope(closed_loop_matrices(design.sliding_string, kp, ki), bit.slope)
        return named(matrices, "closed_loop", state_names(design.string.nodes, ki))
    matrices = loop_model(design, bit)
    strings = string_states(design.string.nodes)
    of = "drive" if bit.path is None else "memory"
    others = [f"{of}_{i}" for i in range(1, len(matrices.a) - len(strings) + 1)]
    return named(matrices, "closed_loop", [*strings, *others])


def poles_of(design: Design, bit: BitSide) -> ComplexArray:
    """Poles of the loop (1/s), by magnitude: of two gains where these are all of the drive."""
    if design.simple_loop:
        return loop_poles(design.sliding_string, *design.linear_drive.gains(), bit.slope)
    return model_poles(design, bit)


def model_poles(design: Design, bit: BitSide) -> ComplexArray:
    """The same of any design."""
    return _poles(loop_model(design, bit))


def _poles(matrices: StateMatrices) -> ComplexArray:
    poles = np.linalg.eigvals(matrices.a)
    return np.asarray(poles[np.argsort(np.abs(poles), kind="stable")])


STACK = 2**22  # entries of the matrices that are solved together, 32 MB of them


def with_slope(matrices: StateMatrices, slope: float) -> StateMatrices:
    """State matrices with a rock torque that falls by `slope` (N m s/rad) closed at the bit."""
    a, b, c, d = matrices
    return StateMatrices(a - slope * np.outer(b[:, 1], c[1]), b, c, d)


def loop_poles(string: Drillstring, kp: float, ki: float, slope: float) -> ComplexArray:
    """Eigenvalues of the closed loop."""
    return _poles(with_slope(closed_loop_matrices(string, kp, ki), slope))


def many_loop_poles(
    string: Drillstring, kp: ArrayLike, ki: ArrayLike, slope: ArrayLike, threads: int = 1
) -> ComplexArray:
    """Eigenvalues for many gains at once."""
    from threadpoolctl import threadpool_limits

    kp, ki, slope = (np.ravel(x) for x in np.broadcast_arrays(kp, ki, slope))
    # The matrix is affine in the three numbers: two controllers and one slope give its parts.
    still = closed_loop_matrices(string, 0.0, 1.0).a
    per_kp = closed_loop_matrices(string, 1.0, 1.0).a - still
    two = closed_loop_matrices(string, 0.0, 2.0)
    per_ki = two.a - still
    per_slope = -np.outer(two.b[:, 1], two.c[1])
    base = still - per_ki

    def solve(part: Index) -> ComplexArray:
        k, i, d = (x[part, None, None] for x in (kp, ki, slope))
        poles = np.linalg.eigvals(base + k * per_kp + i * per_ki + d * per_slope)
        order = np.argsort(np.abs(poles), axis=1, kind="stable")
        return np.take_along_axis(poles, order, axis=1).astype(complex)

    states = len(base)
    shares = -(-len(kp) // (4 * threads))  # so many that all threads end at about the same time
    length = max(1, min(shares, STACK // states**2))
    parts = [np.arange(len(kp))[i : i + length] for i in range(0, len(kp), length)]
    with threadpool_limits(limits=1, user_api="blas"), ThreadPoolExecutor(threads) as pool:
        poles = np.concatenate(list(pool.map(solve, parts)))
    # Without integral action nothing reads its state: a pole at zero that is not the loop's.
    poles[ki == 0.0, 0] = np.nan
    return poles
