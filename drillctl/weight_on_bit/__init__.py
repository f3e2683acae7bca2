"""Weight-on-bit laws: the force on the bit while it drills.

A law is a `NamedTuple` of numbers with one pure function, `weight(bit_speed)` (N) of the bit
speed (rad/s).
"""

from drillctl.weight_on_bit.constant import ConstantWeight
from drillctl.weight_on_bit.protocol import WeightLaw

__all__ = ["ConstantWeight", "WeightLaw"]
