"""What a rock that varies along the way is to the bit in a step.

Its factor at the end of a step over time or depth is known beforehand; over the bit's angle it is
that of the angle to which the last two speeds lead.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from drillctl.rig.bit_rock.law import Exp, by_weight
from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.arithmetic import exp, gather, least, most, rounded_down
from drillctl.simulation.kernels.vectors import at, put


class SameRock(NamedTuple):
    """The rock is the same everywhere."""

    unused: Any  # numba wants a number


class VariationStep(NamedTuple):
    """`drillctl.rig.bit_rock.variation.Variation` of every lane, with its paths."""

    table: Any  # shape (paths x nodes,): X, path after path
    last: Any  # shape (1,): number of the last node but one
    # shape (lanes,): where the path of a lane begins; way per time, per angle and per depth of a
    # bit that drills by itself, nodes per way; standard deviation of the logarithm
    begin: Any
    advance: Any
    turns: Any
    sinks: Any
    per_spacing: Any
    spread: Any


class VariedRock(NamedTuple):
    """A bit-rock law times the factors of one step."""

    law: Any
    end: Any  # at its end
    mean: Any  # on the mean over it

    @property
    def set_valued(self) -> bool:
        """Whether a bit can stand still under the law."""
        return bool(self.law.set_valued)

    def static_torque(self, weight: Any) -> Any:
        """Largest torque of a bit at rest (N m)."""
        return self.mean * self.law.static_torque(weight)

    def kinetic_torque_at_rest(self, weight: Any) -> Any:
        """Torque of a bit that just turns (N m)."""
        return self.mean * self.law.kinetic_torque_at_rest(weight)

    def torque_and_slope(self, weight: Any, speed: Any, exp: Exp) -> tuple[Any, Any]:
        """Torque (N m) and slope (N m s/rad) at `speed` >= 0 (rad/s)."""
        torque, slope = self.law.torque_and_slope(weight, speed, exp)
        return self.end * torque, self.end * slope

    def torque_by_weight(self, weight: Any, speed: Any, exp: Exp) -> Any:
        """Torque per weight at constant speed (m)."""
        return self.end * by_weight(self.law, weight, speed, exp)


def varies(variation: Any) -> bool:
    """Whether the rock varies along the way."""
    return isinstance(variation, VariationStep)


def varied(law: Any, variation: Any, work: Any) -> Any:
    """The law that the bit meets in this step."""
    if not varies(variation):
        return law
    return VariedRock(law, at(work, r.FACTOR), at(work, r.FACTOR_MEAN))


def begin_variation(variation: Any, work: Any, first: Any) -> None:
    """Rows at time zero."""
    if varies(variation):
        factor = _factor(variation, 0.0 * at(work, r.BIT_SPEED), first)
        put(work, r.FACTOR, factor)
        put(work, r.FACTOR_MEAN, factor)


def advance_variation(variation: Any, work: Any, first: Any, begin: Any, step: Any) -> None:
    """Rows of the step from `begin` (s) on."""
    if not varies(variation):
        return
    speed, before = at(work, r.BIT_SPEED), at(work, r.SPEED_BEFORE)
    # By the trapezoid as far as it went, and straight on.
    turned = at(work, r.TURNED)
    ahead = turned + 0.5 * step * (3.0 * speed - before)
    way = at(variation.advance, first) * (begin + step) + at(variation.turns, first) * ahead
    deep = at(work, r.SUNK) + step * at(work, r.SINKING)
    way = way + at(variation.sinks, first) * deep
    factor = _factor(variation, way, first)
    put(work, r.FACTOR_MEAN, 0.5 * (at(work, r.FACTOR) + factor))
    put(work, r.FACTOR, factor)


def turn_variation(variation: Any, work: Any, speed_before: Any, step: Any) -> None:
    """Angle of the bit at the end of the step."""
    if varies(variation):
        mean = 0.5 * (speed_before + at(work, r.BIT_SPEED))
        put(work, r.TURNED, at(work, r.TURNED) + step * mean)


def _factor(variation: Any, way: Any, first: Any) -> Any:
    """Factor at a place on the way; the path stays what it is beyond its ends."""
    place = least(most(way * at(variation.per_spacing, first), 0.0), variation.last[0])
    node = rounded_down(place)
    begin, spread = at(variation.begin, first), at(variation.spread, first)
    left = gather(variation.table, begin + node)
    right = gather(variation.table, begin + node + 1.0)
    return exp(spread * (left + (place - node) * (right - left) - 0.5 * spread))
