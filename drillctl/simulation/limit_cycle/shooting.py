r"""Periodic motions exactly: Newton's method on the flow with located events.

With F the point after a time T, M the monodromy matrix and f the rates, each step solves

.. math:: \begin{bmatrix} M - I & f_1 \\ f_0^T & 0 \end{bmatrix}
          \begin{bmatrix} \delta x \\ \delta T \end{bmatrix}
          = \begin{bmatrix} x - F(x, T) \\ 0 \end{bmatrix};

the last row keeps the start from sliding along the motion. It finds stable and unstable cycles
alike. The multipliers are the eigenvalues of M; one is 1, along the motion itself, and is left
out. A cycle is stable where all others lie inside the unit circle.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drillctl.arrays import Array, ComplexArray
from drillctl.design import Design
from drillctl.errors import SimulationError
from drillctl.simulation.limit_cycle.describing import HarmonicCycle, mean_torque_and_slope
from drillctl.simulation.limit_cycle.flow import Flow, Leg
from drillctl.store.codec import documented, label
from drillctl.store.json_files import picked

CLOSED = 1e-9
"""An orbit is closed when no angle (rad) and no speed (rad/s) is off by more after a period."""
MOST_STEPS = 25  # Newton steps before giving up
LARGEST_CHANGE = 0.2  # largest change of the period in one step, as a share of it
MOST_HALVINGS = 7  # halvings of a step that leads no nearer
LEAST_SWING = 1e-5
"""Swing of the bit speed over the set speed below which a motion is steady drilling."""
SAMPLES = 1201  # samples of an orbit, both ends included


@dataclass(frozen=True, eq=False)
@documented
class Orbit:
    """A periodic motion."""

    period: float = label(unit="s", means="duration")
    peak_bit_speed: float = label(unit="rad/s", means="highest bit speed")
    min_bit_speed: float = label(unit="rad/s", means="lowest bit speed")
    mean_bit_speed: float = label(unit="rad/s", means="time mean of the bit speed")
    stuck_time: float = label(unit="s", means="time at rest in a period")
    multipliers: ComplexArray = label(
        "number",
        name="multiplier",
        means="largest first, without the one at 1 that goes with the motion itself",
    )
    residual: float = label(
        unit="rad, rad/s", means="largest angle or speed by which the orbit does not close"
    )
    iterations: int = label(means="Newton steps that were taken")
    point: Array = label(
        "coordinate",
        unit="rad, rad/s",
        name="orbit_point",
        means="where it starts: coordinates of `flow.Flow`",
    )
    time: Array = label("time", unit="s", means="one period")
    bit_speed: Array = label("time", unit="rad/s", means="bit speed of the orbit")
    top_speed: Array = label("time", unit="rad/s", means="top speed of the orbit")

    @property
    def stable(self) -> bool:
        """Whether every neighbouring motion comes back to it."""
        return bool(abs(self.multipliers[0]) < 1.0)

    @property
    def amplitude(self) -> float:
        """Half the difference of the extremes of the bit speed (rad/s)."""
        return 0.5 * (self.peak_bit_speed - self.min_bit_speed)

    def summary(self) -> dict[str, Any]:
        """The numbers by name, SI units; of the multipliers the largest magnitude."""
        return {
            **picked(self, "period", "peak_bit_speed", "min_bit_speed", "mean_bit_speed"),
            **picked(self, "amplitude", "stuck_time"),
            "largest_multiplier": float(abs(self.multipliers[0])),
            **picked(self, "stable", "residual", "iterations"),
        }


def find_orbit(
    design: Design, point: Array, period: float, closed: float = CLOSED, steps: int = MOST_STEPS
) -> Orbit:
    """The periodic motion near a guess.

    Parameters
    ----------
    design : Design
        Rig and control.
    point : ndarray, shape (coordinates,)
        Guess of a point on it where the bit turns: coordinates of `flow.Flow`.
    period : float
        Guess of its period (s).
    closed : float
        Largest angle (rad) and speed (rad/s) by which it may fail to close.
    steps : int
        Newton steps before giving up.

    Returns
    -------
    Orbit
        Stable or not.

    Raises
    ------
    SimulationError
        Newton's method found none.
    """
    place = _Place(Flow(design), point, period)
    for step in range(steps + 1):
        if place.residual <= closed:
            return _orbit(place, step)
        if step < steps:
            place = _nearer(place)
    raise SimulationError(f"no periodic motion near the guess: {place.residual:.2g} off at the end")


def harmonic_guess(design: Design, cycle: HarmonicCycle) -> Array:
    """The point of a harmonic cycle at which the bit speeds up through its mean.

    Parameters
    ----------
    design : Design
        Rig and control.
    cycle : HarmonicCycle
        Of this design.

    Returns
    -------
    ndarray, shape (coordinates,)
        Coordinates of `flow.Flow`.
    """
    string = design.string
    kp, ki = (float(gain) for gain in design.top_drive.gains())
    mass, damping, stiffness = (
        matrix.toarray() for matrix in (string.mass, string.damping, string.stiffness)
    )
    stiffness[0, 0] += ki
    rock, _ = mean_torque_and_slope(design, cycle.mean_speed, cycle.amplitude)
    load = -string.ground_damping * cycle.mean_speed
    load[0] += design.top_drive.torque(0.0, cycle.mean_speed - design.speed)
    load[-1] -= float(rock)
    # Without integral action the angles are known but for a common turn; the least squares do.
    angle = np.linalg.lstsq(stiffness, load, rcond=None)[0]
    damping[0, 0] += kp
    s = 2j * np.pi * cycle.frequency_hz
    push = np.zeros(string.nodes)
    push[-1] = 1.0
    shape = np.linalg.solve(s**2 * mass + s * damping + stiffness, push)
    shape = shape / (s * shape[-1]) * cycle.amplitude * -1j
    speed = cycle.mean_speed - design.speed + (s * shape).real
    return Flow(design).point(np.concatenate([angle + shape.real, speed]))


class _Place:
    """A guess, and how far it is from closing."""

    def __init__(self, flow: Flow, point: Array, period: float) -> None:
        self.flow, self.point, self.period = flow, point, period
        flight = flow.follow(point, period)
        assert flight.matrix is not None
        self.matrix, self.rates = flight.matrix, flight.rates
        self.gap = point - flight.point
        self.residual = float(np.abs(self.gap).max())

    def start_rates(self) -> Array:
        state = self.flow.state(self.point)
        direction = self.flow.direction_at(state)
        return np.asarray(self.flow.projection @ self.flow.rates(state, direction))


def _nearer(place: _Place) -> _Place:
    """The place after one Newton step, shortened until it is nearer to closing."""
    change, longer = _newton(place)
    share = min(1.0, LARGEST_CHANGE * place.period / max(abs(longer), 1e-300))
    for _ in range(MOST_HALVINGS):
        result = _Place(place.flow, place.point + share * change, place.period + share * longer)
        if result.residual < place.residual:
            return result
        share /= 2.0
    raise SimulationError(
        f"no periodic motion near the guess: no step leads nearer than {place.residual:.2g}"
    )


def _newton(place: _Place) -> tuple[Array, float]:
    """Change of the start and of the period."""
    size = len(place.point)
    bordered = np.zeros((size + 1, size + 1))
    bordered[:size, :size] = place.matrix - np.eye(size)
    bordered[:size, size] = place.rates
    bordered[size, :size] = place.start_rates()
    try:
        solved = np.linalg.solve(bordered, np.append(place.gap, 0.0))
    except np.linalg.LinAlgError:
        raise SimulationError("the orbit is not isolated: Newton's matrix is singular") from None
    return solved[:size], float(solved[size])


def _orbit(place: _Place, steps: int) -> Orbit:
    flow, period = place.flow, place.period
    legs = flow.follow(place.point, period, matrix=False, dense=True).legs
    time = np.linspace(0.0, period, SAMPLES)
    top, bit = _speeds(flow, legs, time)
    moments = np.concatenate([leg.extremes for leg in legs])
    _, turning = _speeds(flow, legs, np.sort(moments))
    speeds = np.concatenate([bit, turning])
    if np.ptp(speeds) <= LEAST_SWING * flow.set_speed:
        raise SimulationError("the guess led to steady drilling, not to a periodic motion")
    return Orbit(
        period=period,
        peak_bit_speed=float(speeds.max()),
        min_bit_speed=float(speeds.min()),
        mean_bit_speed=_turned(flow, legs) / period,
        stuck_time=sum(leg.end - leg.begin for leg in legs if leg.direction == 0),
        multipliers=_multipliers(place.matrix),
        residual=place.residual,
        iterations=steps,
        point=place.point,
        time=time,
        bit_speed=bit,
        top_speed=top,
    )


def _multipliers(matrix: Array) -> ComplexArray:
    values = np.linalg.eigvals(matrix).astype(complex)
    others = np.delete(values, np.argmin(np.abs(values - 1.0)))
    return np.asarray(others[np.argsort(-np.abs(others), kind="stable")])


def _speeds(flow: Flow, legs: tuple[Leg, ...], time: Array) -> tuple[Array, Array]:
    """Absolute speeds of top and bit (rad/s) at increasing times."""
    which = np.minimum(np.searchsorted([leg.end for leg in legs], time), len(legs) - 1)
    top, bit = np.zeros(len(time)), np.zeros(len(time))
    for index, leg in enumerate(legs):
        mine = which == index
        if mine.any() and leg.solution is not None:
            state = leg.solution(time[mine])
            top[mine] = state[flow.nodes] + flow.set_speed
            if leg.direction != 0:
                bit[mine] = state[-1] + flow.set_speed
    return top, bit


def _turned(flow: Flow, legs: tuple[Leg, ...]) -> float:
    """Angle by which the bit turned (rad)."""
    first, last = legs[0], legs[-1]
    assert first.solution is not None
    assert last.solution is not None
    angle, bit = last.solution(last.end) - first.solution(first.begin), flow.nodes - 1
    return float(angle[bit]) + flow.set_speed * last.end
