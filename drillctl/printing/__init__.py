"""Results as tables for people."""

from drillctl.printing.advantage import advantage
from drillctl.printing.comparison import comparison
from drillctl.printing.tuning import tune
from drillctl.printing.weight_delay import weight_delay

__all__ = [
    "advantage",
    "comparison",
    "tune",
    "weight_delay",
]
