"""Results as tables for people."""

from drillctl.printing.advantage import advantage
from drillctl.printing.comparison import comparison
from drillctl.printing.linear import loop, modes
from drillctl.printing.runs import cycle
from drillctl.printing.tuning import tune
from drillctl.printing.weight_delay import weight_delay

__all__ = [
    "advantage",
    "comparison",
    "cycle",
    "loop",
    "modes",
    "tune",
    "weight_delay",
]
