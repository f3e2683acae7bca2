"""What every top-drive law offers; how it moves is in `top_drive` and in the engines."""

from __future__ import annotations

from typing import Any, Protocol


class TopDriveLaw(Protocol):
    """Torque of the drive against angle and speed in the turning frame, in steady motion."""

    def torque(self, angle: Any, speed: Any) -> Any:
        """Torque on the drive (N m) at `angle` (rad) and `speed` (rad/s)."""
        ...

    def gains(self) -> tuple[Any, Any]:
        """Proportional (N m s/rad) and integral (N m/rad) gain of the linearised law."""
        ...

    def impedance(self, s: Any) -> Any:
        """Torque against the motion per speed (N m s/rad) at complex frequencies `s` (1/s)."""
        ...
