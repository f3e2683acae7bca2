"""Weight-on-bit laws: the force on the bit while it drills.

A law is a `NamedTuple` of numbers. One that acts at once has two pure functions of the bit speed
in its own direction (rad/s, not negative): `weight(speed)` (N) and its `slope(speed)` (N s/rad);
`moves` says whether the weight changes at all. Others (`PATHS`) have a memory instead and give
the `command` that a hoist follows; the engines keep the memory.

Each law has a file, which `drillctl.registry` names: its equation, its keys in a design, how it is
made from them, and its `LAWS` entry.
"""

from __future__ import annotations

from drillctl.rig.weight_on_bit.following_speed import FollowingSpeed, ObservedWeight, RealWeight
from drillctl.rig.weight_on_bit.law import ConstantWeight, WeightLaw
from drillctl.rig.weight_on_bit.stick_slip_alarm import AlarmWeight

PATHS = (RealWeight, AlarmWeight)
"""Laws with a memory: the weight does not follow from the bit speed of the moment."""

__all__ = [
    "PATHS",
    "AlarmWeight",
    "ConstantWeight",
    "FollowingSpeed",
    "ObservedWeight",
    "RealWeight",
    "WeightLaw",
]
