"""What a weight-on-bit law must offer to run in both engines."""

from __future__ import annotations

from typing import Any, Protocol


class WeightLaw(Protocol):
    """Weight on bit against bit speed."""

    @property
    def moves(self) -> bool:
        """Whether the weight changes with the bit speed."""
        ...

    def weight(self, speed: Any) -> Any:
        """Weight on bit (N) at bit speed `speed` >= 0 (rad/s)."""
        ...

    def slope(self, speed: Any) -> Any:
        """Weight per bit speed (N s/rad) there."""
        ...
