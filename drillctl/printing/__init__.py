"""Results as tables for people."""

from drillctl.printing.tuning import tune

__all__ = [
    "tune",
]
