"""What a top-drive law must offer to run in both engines."""

from __future__ import annotations

from typing import Protocol


class TopDriveLaw(Protocol):
    """Torque of the drive against angle and speed in the turning frame."""

    def torque(self, angle: float, speed: float) -> float:
        """Torque on the drive (N m) at `angle` (rad) and `speed` (rad/s)."""
        ...

    def mean_torque(self, angle: float, rate: float) -> tuple[float, float]:
        """Offset (N m) and slope (N m/rad) of the mean torque over a step from `angle`; `rate` = 1 / step (1/s)."""
        ...

    def gains(self) -> tuple[float, float]:
        """Proportional (N m s/rad) and integral (N m/rad) gain of the linearised law."""
        ...
