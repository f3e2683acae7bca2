"""What a bit-rock law must offer to run in both engines."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

Exp = Callable[[Any], Any]
"""An exponential: `math.exp`, a compiled one, or `casadi.exp`."""


class BitRockLaw(Protocol):
    """Torque on the bit against its speed and the weight on it."""

    @property
    def set_valued(self) -> bool:
        """True where the law is a set at zero speed, so that a bit can stand still."""
        ...

    def static_torque(self, weight: Any) -> Any:
        """Largest torque on a bit at rest (N m) under `weight` (N)."""
        ...

    def kinetic_torque_at_rest(self, weight: Any) -> Any:
        """Torque (N m) in the limit of a bit that turns ever slower under `weight` (N)."""
        ...

    def steepest_fall(self, weight: Any) -> Any:
        """Largest value of minus the slope at any speed (N m s/rad) under `weight` (N)."""
        ...

    def torque_and_slope(self, weight: Any, speed: Any, exp: Exp) -> tuple[Any, Any]:
        """Torque (N m) at `speed` >= 0 (rad/s) under `weight` (N), and its slope (N m s/rad)."""
        ...
