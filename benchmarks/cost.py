"""What a step asks of the modal pass: operations and bytes, counted from the arrays it is given."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from drillctl.simulation.kernels.string_step import BlockString, UndampedString

DOUBLE = 8


@dataclass(frozen=True)
class Count:
    """What a step asks of the modal pass, per lane and mode."""

    flops: float  # double-precision operations; a multiply-add is two
    # of the modal state, read and written; what is shared by lanes is not counted, nor the sums,
    # which fit in registers
    bytes: float

    @property
    def intensity(self) -> float:
        """Operations per byte."""
        return self.flops / self.bytes


def count(string: Any) -> Count:
    """Operations and bytes of a string made ready, a mode of it."""
    if isinstance(string, UndampedString):
        return _undamped(string)
    if isinstance(string, BlockString):
        return _blocks(string)
    states = len(string.free)
    # Two pushes, the pipe torque, a row of the matrix and three signals: a multiply-add each.
    flops = 2 * (3 + states + 3) * states
    return Count(2 * flops / states, 2 * 2 * DOUBLE * 2.0)


def _undamped(string: UndampedString) -> Count:
    """As `simulation/undamped_step.py` has it.

    The force on the mode is a multiply-add, its two entries in `push` one each; its part of the
    pipe torque is one; so is its turn by `kappa`, followed by an addition. One addition sums up the
    top angle, two multiply-adds the bit speed.
    """
    modes = len(string.kappa)
    fused = string.ratio.size + string.push.size + string.pipe.size + string.kappa.size
    fused += string.bit_speed.size
    additions = 2 * modes
    return Count((2 * fused + additions) / modes, 2 * DOUBLE * 2 * modes / modes)


def _blocks(string: BlockString) -> Count:
    """A multiply-add for each entry of `push` and `pipe`, the product of a 2 x 2 block, two sums.

    The product is two multiplications and two multiply-adds.
    """
    blocks = len(string.free)
    fused = string.push.size + string.pipe.size + string.free.size // 2
    single = string.free.size // 2 + 2 * blocks
    return Count((2 * fused + single) / blocks, 2 * DOUBLE * 2.0)
