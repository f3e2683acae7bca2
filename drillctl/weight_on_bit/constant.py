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

    def weight(self, bit_speed: Any) -> Any:
        """Weight on bit (N); the same at any `bit_speed` (rad/s)."""
        return self.level
