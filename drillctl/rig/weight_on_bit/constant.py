"""Constant weight on bit."""

from __future__ import annotations

from typing import Any, NamedTuple


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
