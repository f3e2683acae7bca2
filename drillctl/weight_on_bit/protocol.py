"""What a weight-on-bit law must offer to run in both engines."""

from __future__ import annotations

from typing import Any, Protocol


class WeightLaw(Protocol):
    """Weight on bit against bit speed."""

    def weight(self, bit_speed: Any) -> Any:
        """Weight on bit (N) at `bit_speed` (rad/s)."""
        ...
