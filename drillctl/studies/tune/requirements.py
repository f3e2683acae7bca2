"""What loops of given gains are worth: slope margins, and how far requirements are missed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from drillctl.arrays import Array, ComplexArray
from drillctl.linear.ends import BitSide
from drillctl.linear.loop_analysis import ROUNDING
from drillctl.linear.loop_margins import pole_grid
from drillctl.linear.loop_model import loop_poles, model_poles
from drillctl.rig.drillstring.frequencies import natural_frequencies
from drillctl.studies.tune.loops import Crossing, Loop, chain, crossings_of, slope_margin_of
from drillctl.studies.tune.settings import TuneConstraintsTable
from drillctl.studies.tune.tuned import Tuned, by_path, put

PEAKS = 6  # peaks of a sensitivity, and delays, that are kept: the worst


class Peak(NamedTuple):
    """A peak of the sensitivity: its angular frequency (rad/s) and height."""

    omega: float
    height: float


class Late(NamedTuple):
    """A delay (s) of the drive at which poles lie on the axis, and their frequency (rad/s)."""

    omega: float
    delay: float


@dataclass(frozen=True, eq=False)
class LoopState:
    """One loop at given gains."""

    loop: Loop  # which
    crossings: list[Crossing]  # the lowest, by rising slope
    stable: bool  # whether it is stable without slope
    # of the first modes (1/s), upper half plane; asked for where damping is required
    poles: ComplexArray = field(default_factory=lambda: np.empty(0, dtype=complex))
    # highest ones; asked for where the sensitivity is limited
    peaks: list[Peak] = field(default_factory=list)
    # the shortest that the loop does not bear; asked for where one is required
    delays: list[Late] = field(default_factory=list)

    @property
    def margin(self) -> float:
        """Slope margin (N m s/rad); NaN for a loop that is not stable without slope."""
        return slope_margin_of(self.crossings) if self.stable else math.nan

    @property
    def excess(self) -> float:
        """Slope margin less the slope of the rock (N m s/rad)."""
        return self.margin - self.loop.slope if self.stable else -math.inf

    @property
    def damping(self) -> float:
        """Least damping ratio of its first modes; 1 where none is a pair."""
        return float(np.min(-self.poles.real / np.abs(self.poles), initial=1.0))

    @property
    def peak(self) -> float:
        """Largest sensitivity; at least 1."""
        return max([1.0, *(p.height for p in self.peaks)])


@dataclass(frozen=True, eq=False)
class Loops:
    """What gains must hold for, and what is asked of them."""

    tuned: tuple[Tuned, ...]  # what is tuned
    loops: list[Loop]  # their slope margin is what counts
    asked: TuneConstraintsTable  # requirements

    @property
    def scale(self) -> float:
        """What slopes are measured in (N m s/rad)."""
        return max(max(abs(loop.slope) for loop in self.loops), 1.0)

    @property
    def needs_stability(self) -> bool:
        """Whether something is asked that an unstable loop does not have."""
        asked = (self.asked.peak_sensitivity, self.asked.damping_ratio, self.asked.delay)
        return any(one is not None for one in asked)

    def at(self, values: Array) -> LoopsState:
        """All loops at values (SI), shape (parameters,)."""
        named = by_path(self.tuned, values)
        return LoopsState(self, values, [self._state(x, values, named) for x in self.loops])

    def _stable(self, loop: Loop, values: Array) -> bool:
        """Whether a loop is stable without slope; ideal gains only take energy."""
        if loop.design.simple_drive and (loop.weight is None or loop.design.simple_loop):
            return True
        variant = put(loop.design, self.tuned, values)
        path = None if loop.weight is None else self._path(loop, values)
        poles = model_poles(variant, BitSide(0.0, path))
        return bool(poles.real.max() < ROUNDING * np.abs(poles).max())

    def _path(self, loop: Loop, values: Array) -> Any:
        from drillctl.linear.ends import weight_path

        variant = put(loop.design, self.tuned, values)
        return weight_path(variant, variant.speed)

    def _state(self, loop: Loop, values: Array, named: Mapping[str, float]) -> LoopState:
        result = crossings_of(loop, named)
        stable = self._stable(loop, values)
        if not (self.needs_stability and stable):
            return LoopState(loop, result, stable)
        poles = self._poles(loop, values)
        asked, omega = self.asked, pole_grid(loop.ends, poles)
        return LoopState(
            loop,
            result,
            stable,
            self._first(loop, poles) if asked.damping_ratio is not None else poles[:0],
            _peaks(loop, named, omega) if asked.peak_sensitivity is not None else [],
            _delays(loop, named, omega) if asked.delay is not None else [],
        )

    def _poles(self, loop: Loop, values: Array) -> ComplexArray:
        """Poles of a loop with the slope of the rock (1/s)."""
        variant = put(loop.design, self.tuned, values)
        if variant.simple_drive and loop.weight is None:
            return loop_poles(variant.string, *variant.top_drive.gains(), loop.slope)
        return model_poles(variant, BitSide(loop.slope, self._path(loop, values)))

    def _first(self, loop: Loop, poles: ComplexArray) -> ComplexArray:
        """Poles of the drive's mode and the first elastic ones, the upper of each pair."""
        count = self.asked.modes
        held = natural_frequencies(loop.ends.parts, "finite-elements", count + 1, top_held=True)
        limit = math.sqrt(held[count - 1] * held[count]) if len(held) > count else math.inf
        return poles[(poles.imag > 0.0) & (np.abs(poles) < limit)]


@dataclass(frozen=True, eq=False)
class LoopsState:
    """All loops at given gains."""

    problem: Loops  # what is asked
    values: Array  # shape (parameters,): Tuned values (SI)
    loops: list[LoopState]  # as in `Loops`

    @property
    def excess(self) -> float:
        """Least slope margin less slope (N m s/rad)."""
        return min(state.excess for state in self.loops)

    @property
    def violations(self) -> dict[str, float]:
        """How far each requirement is missed, in its own scale; what is kept is not listed."""
        asked, scale = self.problem.asked, self.problem.scale
        results = {}
        if asked.slope_reserve is not None:
            results["slope_reserve"] = (asked.slope_reserve - self.excess) / scale
        elif self.problem.needs_stability:
            results["slope"] = -self.excess / scale
        if asked.peak_sensitivity is not None:
            peak = max(state.peak for state in self.loops)
            results["peak_sensitivity"] = peak / asked.peak_sensitivity - 1.0
        if asked.damping_ratio is not None:
            results["damping_ratio"] = asked.damping_ratio - min(s.damping for s in self.loops)
        if asked.delay is not None:
            borne = min([asked.delay, *(d.delay for state in self.loops for d in state.delays)])
            results["delay"] = 1.0 - borne / asked.delay
        return {key: value for key, value in results.items() if value > 0.0}

    @property
    def violation(self) -> float:
        """The largest of them; 0 if all is kept."""
        return max(self.violations.values(), default=0.0)


def _sides(loop: Loop, values: Mapping[str, float], omega: Array) -> tuple[Any, Any]:
    """Impedances of string, with the rock, and drive at the top, over a common factor."""
    s = 1j * omega
    known = chain(loop.ends, s)
    rock = loop.rock(values, s) - loop.slope
    below = known.beta + rock * known.delta
    return known.alpha + rock * known.gamma, loop.drive(values, s) * below


def _peaks(loop: Loop, values: Mapping[str, float], omega: Array) -> list[Peak]:
    """The highest peaks of the sensitivity at the top torque, on frequencies that resolve poles."""
    string, drive = _sides(loop, values, omega)
    height = np.abs(string / (string + drive))
    top = 1 + np.flatnonzero((height[1:-1] > height[:-2]) & (height[1:-1] >= height[2:]))
    best = top[np.argsort(-height[top])][:PEAKS]
    return [Peak(float(omega[k]), float(height[k])) for k in best]


def _delays(loop: Loop, values: Mapping[str, float], grid: Array) -> list[Late]:
    """The shortest delays of the drive that the loop does not bear: where it crosses over."""
    from scipy.optimize import elementwise

    def ratio(omega: Array) -> Array:
        string, drive = _sides(loop, values, omega)
        return np.asarray(np.log(np.abs(drive / string)))

    with np.errstate(divide="ignore"):
        over = ratio(grid) > 0.0
        place = np.flatnonzero(over[1:] != over[:-1])
        if len(place) == 0:
            return []
        omega = elementwise.find_root(ratio, (grid[place], grid[place + 1])).x
    string, drive = _sides(loop, values, omega)
    delay = np.mod(np.angle(drive / string) + math.pi, 2.0 * math.pi) / omega
    return [Late(float(omega[k]), float(delay[k])) for k in np.argsort(delay)[:PEAKS]]
