"""Friction over a table, under a weight that is known before the step: looked up once a step.

A law over the weight on bit costs more than a string of modes where each of Newton's steps walks
through the rows of its table. Where the weight has a memory it is a number within a step, and so
are the torques and the decay that follow from it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from drillctl.rig.bit_rock import OverWeight
from drillctl.rig.bit_rock.law import Exp
from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.arithmetic import at, by_type, inlined, put
from drillctl.simulation.kernels.laws import law_at
from drillctl.simulation.kernels.weight_step import has_memory


class HeldRock(NamedTuple):
    """`OverWeight` at the weights of one step."""

    rest: Any  # static torque under the mean weight of the step (N m)
    # torque at high speed, and what the static torque is above it, at the end of the step (N m)
    level: Any
    spread: Any
    decay: Any  # decay with speed (s/rad)

    @property
    def set_valued(self) -> bool:
        """A bit can stand still under this law."""
        return True

    def static_torque(self, weight: Any) -> Any:
        """Largest torque of a bit at rest (N m)."""
        return self.rest

    def kinetic_torque_at_rest(self, weight: Any) -> Any:
        """Torque of a bit that just turns (N m)."""
        return self.rest

    def torque_and_slope(self, weight: Any, speed: Any, exp: Exp) -> tuple[Any, Any]:
        """Torque (N m) and slope (N m s/rad) at `speed` >= 0 (rad/s)."""
        falling = self.spread * exp(-self.decay * speed)
        return self.level + falling, -self.decay * falling


_held = inlined(OverWeight.held)


def _is_held(friction: Any, weight: Any) -> bool:
    return friction.instance_class is OverWeight and has_memory(weight)


def rock(friction: Any, weight: Any, work: Any) -> Any:
    """The bit-rock law that the lanes meet in this step."""
    raise NotImplementedError("compiled only")


@by_type(rock)
def _rock(friction, weight, work):
    if _is_held(friction, weight):
        return lambda friction, weight, work: HeldRock(
            at(work, r.HELD_REST),
            at(work, r.HELD_LEVEL),
            at(work, r.HELD_SPREAD),
            at(work, r.HELD_DECAY),
        )
    return lambda friction, weight, work: law_at(friction, work, r.FRICTION)


def hold_rock(friction: Any, weight: Any, work: Any) -> None:
    """Look the table up at the weights of this step, where they are numbers."""
    raise NotImplementedError("compiled only")


@by_type(hold_rock)
def _hold_rock(friction, weight, work):
    if _is_held(friction, weight):
        return lambda friction, weight, work: _look_up(friction, work)
    return lambda friction, weight, work: None


@inlined
def _look_up(friction: Any, work: Any) -> None:
    law = law_at(friction, work, r.FRICTION)
    _, rest, _ = _held(law, at(work, r.REST_LOAD))
    level, static, decay = _held(law, at(work, r.HOISTED))
    put(work, r.HELD_REST, rest)
    put(work, r.HELD_LEVEL, level)
    put(work, r.HELD_SPREAD, static - level)
    put(work, r.HELD_DECAY, decay)
