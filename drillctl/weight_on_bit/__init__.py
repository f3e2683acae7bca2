"""Weight-on-bit laws: the force on the bit while it drills.

A law is a `NamedTuple` of numbers with two pure functions of the bit speed in its own direction
(rad/s, not negative): `weight(speed)` (N) and its `slope(speed)` (N s/rad); `moves` tells whether
the weight changes at all.
"""

from drillctl.weight_on_bit.constant import ConstantWeight
from drillctl.weight_on_bit.following_speed import FollowingSpeed
from drillctl.weight_on_bit.protocol import WeightLaw

__all__ = ["ConstantWeight", "FollowingSpeed", "WeightLaw"]
