"""A long simulation and what its returns say: it settles, repeats, or does neither.

A return is the moment at which the bit speeds up through its mean speed, after it has been
below half of the way from its mean down to its least speed. Releases would count every
micro-slip, and bare crossings of the mean every ripple on a fast stretch; a return counts
neither.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.optimize import brentq

from drillctl.arrays import Array
from drillctl.design import Design
from drillctl.errors import SimulationError
from drillctl.rig.top_drive import RealDrive
from drillctl.rig.weight_on_bit import PATHS
from drillctl.simulation.lanes import Kind
from drillctl.simulation.limit_cycle.flow import Flow
from drillctl.simulation.limit_cycle.shooting import Orbit, find_orbit
from drillctl.simulation.reference import Motion, solve_whole, stuck_between
from drillctl.store.codec import documented, label

LAST = 10  # returns that are reported
PER_CYCLE = 4  # A motion may repeat with every return, or with every second, third or fourth
FINE = 400  # samples in an expected period
LARGEST = 0.02
"""Largest swing of the bit speed, as a share of its mean, of a motion that has settled."""
CLOSE = 0.1
"""Largest distance of the last returns, over the swing, from which an orbit is looked for."""
STEPS = 6  # Newton steps from the last return: it lies near the orbit, or there is none to be found
NOISE = 1e-6  # distance over the swing below which returns are the same to the integrator's error

STATUSES = ("equilibrium", "settling", "stalled", "periodic", "repeating", "not periodic")
"""What a long motion does.

`equilibrium`: the bit turns evenly; `settling`: its swing shrinks, but has not died out;
`stalled`: it stands still; `periodic`: its returns contract to an orbit that is stable;
`repeating`: they contract, and the orbit is not followed, for a drive or weight with a memory; and
`not periodic`: it swings for ever, or for as long as was looked, and nothing repeats.
"""


@dataclass(frozen=True, eq=False)
@documented
class Returns:
    """Returns of one long simulation."""

    duration: float = label(unit="s", means="length of the simulation")
    mean_speed: float = label(
        unit="rad/s", means="mean bit speed from first to last return, else over the second half"
    )
    swing: Array = label(
        "window", unit="rad/s", means="range of bit speed in each period of the second half"
    )
    times: Array = label("return", unit="s", name="return_time", means="returns in the second half")
    points: Array = label(
        "return",
        "coordinate",
        unit="rad, rad/s",
        name="return_point",
        means="where the motion was: coordinates of `flow.Flow`",
    )
    peaks: Array = label(
        "interval", unit="rad/s", name="return_peak", means="highest bit speed between returns"
    )
    stuck: Array = label(
        "interval", unit="s", name="return_stuck", means="time at rest between returns"
    )
    time: Array = label(
        "simulated_time",
        unit="s",
        name="simulated_time",
        means="between the last two returns, else the last expected period",
    )
    bit_speed: Array = label(
        "simulated_time", unit="rad/s", name="simulated_bit_speed", means="simulated bit speed"
    )
    top_speed: Array = label(
        "simulated_time", unit="rad/s", name="simulated_top_speed", means="simulated top speed"
    )

    @property
    def periods(self) -> Array:
        """Times between the last returns (s), `LAST` at most."""
        return np.diff(self.times)[-LAST:]

    @property
    def last_peaks(self) -> Array:
        """Highest bit speeds between the last returns (rad/s), `LAST` at most."""
        return self.peaks[-LAST:]

    @property
    def settled(self) -> bool:
        """Whether the bit turns evenly, ever more so."""
        return bool(
            self.mean_speed > 0.0
            and self.bit_speed.min() > 0.0
            and self.swing[-1] <= LARGEST * self.mean_speed
            and self.swing[-1] <= self.swing[0]
        )

    @property
    def stalled(self) -> bool:
        """Whether the bit stood still throughout the last expected period."""
        return bool(self.swing[-1] == 0.0 and self.bit_speed[-1] == 0.0)

    def distances(self, apart: int = 1) -> Array:
        """Distance of each return from the one `apart` before, over the swing of bit speed."""
        gaps = np.abs(self.points[apart:] - self.points[:-apart]).max(axis=1, initial=0.0)
        return np.asarray(gaps / max(float(self.swing[-1]), 1e-300))

    def summary(self) -> dict[str, Any]:
        """Spread of the last returns, SI units; None where there are none."""
        some = len(self.times) > 1

        def spread(values: Array) -> list[float] | None:
            return [float(values.min()), float(values.max())] if some else None

        return {
            "duration": self.duration,
            "mean_bit_speed": self.mean_speed,
            "returns": len(self.times),
            "period_spread": spread(self.periods),
            "peak_spread": spread(self.last_peaks),
            "stuck_time_spread": spread(self.stuck[-LAST:]),
            "last_distance": float(self.distances()[-1]) if some and self.swing[-1] > 0 else None,
        }


def long_run(
    design: Design, period: float, periods: int, start: Kind | None, tolerance: float
) -> Returns:
    """Simulate for many expected periods and take the returns of the second half."""
    programmed = design.program.settled  # the second half is to be free of it
    values: dict[str, Any] = {
        "simulation.duration": f"{max(period * periods, 2.0 * programmed)!r} s",
        "simulation.j1_from": "0 s",
    }
    if start is not None:
        values["start.kind"] = start
    motion = solve_whole(design.replace(values), tolerance)
    return take_returns(motion, period)


def take_returns(motion: Motion, period: float, level: float | None = None) -> Returns:
    """The returns in the second half of a run."""
    duration = float(motion.ends[-1])
    begin = 0.5 * duration
    time = np.linspace(begin, duration, max(2, int(FINE * (duration - begin) / period)))
    speed = motion.bit_speed(time)
    mean = float(speed.mean())
    level = mean if level is None else level
    half_down = 0.5 * (level + float(speed.min()))

    def excess(time: float) -> float:
        return float(motion.bit_speed(np.array([time]))[0]) - level

    rises = _rises(time, speed, level, half_down)
    moments = np.array([brentq(excess, *pair, xtol=1e-12, rtol=1e-14) for pair in rises])
    flow = Flow(motion.design)
    points = [flow.point(state) for state in motion.states(moments).T]
    if len(moments) > 1:  # whole cycles have the mean, any other stretch has it nearly
        mean = motion.mean_speed(float(moments[0]), float(moments[-1]))
    windows = np.array_split(speed, max(2, int((duration - begin) / period)))
    last = moments[-2:] if len(moments) > 1 else np.array([duration - period, duration])
    shown = np.linspace(last[0], last[1], FINE + 1)
    return Returns(
        duration=duration,
        mean_speed=mean,
        swing=np.array([np.ptp(part) for part in windows]),
        times=moments,
        points=np.array(points).reshape(len(points), flow.projection.shape[0]),
        peaks=np.array([_peak(motion, *pair) for pair in pairwise(moments)]),
        stuck=np.array([stuck_between(motion, *pair) for pair in pairwise(moments)]),
        time=shown - shown[0],
        bit_speed=motion.bit_speed(shown),
        top_speed=motion.top_speed(shown),
    )


def judge(design: Design, returns: Returns) -> tuple[str, Orbit | None]:
    """What a long run comes to."""
    if returns.stalled:
        return "stalled", None
    if returns.settled:
        return "equilibrium", None
    for apart in range(1, PER_CYCLE + 1):
        if not _contract(returns, apart):
            continue
        if has_memory(design):
            return "repeating", None
        orbit = _orbit_after(design, returns, apart)
        if orbit is not None:
            return "periodic", orbit
    shrinks = returns.swing[-1] < 0.5 * returns.swing[0] and not returns.stuck.any()
    return ("settling" if shrinks else "not periodic"), None


def has_memory(design: Design) -> bool:
    """Whether the motion has states beyond those that an orbit is followed with."""
    return isinstance(design.top_drive, RealDrive) or isinstance(design.weight_on_bit, PATHS)


def _contract(returns: Returns, apart: int) -> bool:
    """Whether every `apart`-th return comes nearer to the one before."""
    if len(returns.times) < apart + 6:
        return False
    distances = returns.distances(apart)
    third = len(distances) // 3
    shrinks = np.median(distances[-third:]) < 0.5 * np.median(distances[:third])
    return bool(distances[-1] <= CLOSE and (shrinks or distances[-1] < NOISE))


def _orbit_after(design: Design, returns: Returns, apart: int) -> Orbit | None:
    """The stable orbit to which every `apart`-th return contracts, if there is one."""
    distances = returns.distances(apart)
    last, period = returns.points[-1], float(returns.times[-1] - returns.times[-1 - apart])
    try:
        orbit = find_orbit(design, last, period, steps=STEPS)
    except SimulationError:
        return None
    if not orbit.stable:
        return None
    # Steps that shrink by the multiplier each time add up to this much at most, and a bit.
    still = 2.0 * distances[-1] / (1.0 - abs(orbit.multipliers[0])) + NOISE
    away = np.abs(orbit.point - last).max() / returns.swing[-1]
    return orbit if away <= still else None


def _rises(time: Array, speed: Array, level: float, low: float) -> list[tuple[float, float]]:
    """Pairs of times between which the speed rises through a level, coming from `low`."""
    results: list[tuple[float, float]] = []
    armed = False
    for i in range(len(time) - 1):
        armed = armed or bool(speed[i] < low)
        if armed and speed[i] < level <= speed[i + 1]:
            results.append((float(time[i]), float(time[i + 1])))
            armed = False
    return results


def _peak(motion: Motion, begin: float, end: float) -> float:
    """Highest bit speed between two times, at a located extreme."""
    moments = motion.extremes[:, 0]
    inside = moments[(moments > begin) & (moments < end)]
    return float(motion.bit_speed(np.append(inside, [begin, end])).max())
