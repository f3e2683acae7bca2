"""Results as tables for people."""

from drillctl.printing.advantage import advantage
from drillctl.printing.comparison import comparison
from drillctl.printing.doctor import doctor
from drillctl.printing.linear import loop, modes
from drillctl.printing.maps import sweep
from drillctl.printing.runs import cycle, simulation
from drillctl.printing.tuning import tune
from drillctl.printing.uncertainty import uncertainty
from drillctl.printing.weight_delay import weight_delay

__all__ = [
    "advantage",
    "comparison",
    "cycle",
    "doctor",
    "loop",
    "modes",
    "simulation",
    "sweep",
    "tune",
    "uncertainty",
    "weight_delay",
]
