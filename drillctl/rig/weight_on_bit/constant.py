"""Constant weight on bit."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

from drillctl.rig.table import Table
from drillctl.rig.weight_on_bit.law import PathTable, WeightOnBitLaw


class ConstantWeight(NamedTuple):
    """Weight on bit held at its operating value.

    Attributes
    ----------
    level : float
        Weight on bit (N).
    """

    level: Any

    @property
    def moves(self) -> bool:
        """Whether the weight changes with the bit speed."""
        return False

    def weight(self, speed: Any) -> Any:
        """Weight on bit (N); the same at any bit speed `speed` (rad/s)."""
        return self.level

    def slope(self, speed: Any) -> Any:
        """Weight per bit speed (N s/rad): none."""
        return 0.0 * speed


class ConstantWeightTable(Table):
    """Weight on bit held at the operating point's value; its path waits for another law."""

    law: Literal["constant"] = "constant"
    path: PathTable = PathTable()


LAWS = (
    WeightOnBitLaw(
        ConstantWeightTable,
        lambda table, nominal, speed: ConstantWeight(nominal),
        moves=False,
        forms=((ConstantWeight, '`law = "constant"`', "The default."),),
    ),
)
