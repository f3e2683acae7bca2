"""A drive that gives the same torque whatever the string does."""

from __future__ import annotations

from typing import Any, NamedTuple


class ConstantTorque(NamedTuple):
    """Constant torque, no speed control: :math:`T_m = u`.

    Attributes
    ----------
    level : float
        Torque u on the drive (N m).
    """

    level: Any

    def torque(self, angle: Any, speed: Any) -> Any:
        """Torque on the drive (N m); the same at any `angle` (rad) and `speed` (rad/s)."""
        return self.level

    def mean_torque(self, angle: Any, rate: Any) -> tuple[Any, Any]:
        """Offset (N m) and slope (N m/rad) of the mean torque over a step of 1 / `rate` (s)."""
        return self.level, 0.0

    def gains(self) -> tuple[Any, Any]:
        """No speed control: both gains are zero."""
        return 0.0, 0.0

    def impedance(self, s: Any) -> Any:
        """Torque that the drive takes per speed (N m s/rad) at `s` (1/s): none."""
        return 0.0 * s
