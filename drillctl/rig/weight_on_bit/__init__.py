"""Weight-on-bit laws: the force on the bit while it drills.

A law is a `NamedTuple` of numbers. One that acts at once has two pure functions of the bit speed
in its own direction (rad/s, not negative): `weight(speed)` (N) and its `slope(speed)` (N s/rad);
`moves` tells whether the weight changes at all. The laws of `real_weight` have a memory instead
and give the `command` that a hoist follows; the engines keep the memory.
"""

from __future__ import annotations

from drillctl.rig.weight_on_bit.constant import ConstantWeight
from drillctl.rig.weight_on_bit.following_speed import FollowingSpeed
from drillctl.rig.weight_on_bit.protocol import WeightLaw
from drillctl.rig.weight_on_bit.real_weight import PATHS, AlarmWeight, ObservedWeight, RealWeight

__all__ = [
    "PATHS",
    "AlarmWeight",
    "ConstantWeight",
    "FollowingSpeed",
    "ObservedWeight",
    "RealWeight",
    "WeightLaw",
]
