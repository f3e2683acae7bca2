"""What every weight-on-bit law offers."""

from __future__ import annotations

from typing import Any, Protocol


class WeightLaw(Protocol):
    """Weight on bit; more is offered by a law that acts at once, and by one with a memory."""

    @property
    def moves(self) -> bool:
        """Whether the weight changes at once with the bit speed."""
        ...

    def _asdict(self) -> dict[str, Any]:
        """The law's numbers by name."""
        ...
