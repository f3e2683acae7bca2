"""The linear side: the string and its loops before any simulation.

From a string to its results:

- `transmission.py`: sections as transmission lines, of finite elements and of the continuum.
- `ends.py`: the string seen from its two ends, by lines, by modes or by solving M, C and K. All
  frequency-domain results below take this alone.
- `response.py`: `frequency_response` from any input to any output, open and closed loop.
- `operating_point.py`: steady drilling and the slope of the rock there.
- `slope_margin.py`: D*, the falling slope that a loop tolerates.
- `boundary.py`: the boundary of the stable gains in closed form.
- `loop_margins.py`: sensitivity, disk margins, delay margin at the top torque.
- `tuning.py`: impedance of the top drive; gains from the string.

As a state space:

- `state_space.py`: `plant`, `closed_loop`, `open_loop` as `control.StateSpace`, named signals.
- `modal.py`: natural frequencies, damping ratios and shapes.
- `loop_model.py`: poles of the loop; `boundary.py` holds those against a parameter as well.
- `export.py`: the nonlinear loop as `control.NonlinearIOSystem`; matrices for other programs.

`loop_analysis.py` puts the figures of one design together.

Transfer functions are never formed: their coefficients lose all digits on a string of some
thirty elements. `control` is imported where a system is made and not before, as it is slow.
"""

from drillctl.linear import export, tuning
from drillctl.linear.boundary import GainBoundary, RootLocus, gain_boundary, root_locus
from drillctl.linear.ends import ends_of
from drillctl.linear.loop_analysis import LoopAnalysis, critical_speed, critical_weight_on_bit, loop
from drillctl.linear.loop_margins import Margins, margins
from drillctl.linear.loop_model import closed_loop
from drillctl.linear.modal import Mode, Modes, modes
from drillctl.linear.operating_point import (
    OperatingPoint,
    cancelling_weight_gain,
    equilibria,
    operating_point,
)
from drillctl.linear.response import (
    FrequencyResponse,
    frequency_response,
    response_of,
    telling_frequencies,
)
from drillctl.linear.slope_margin import slope_margin, slope_margins
from drillctl.linear.state_space import open_loop, plant
from drillctl.linear.tuning import DriveImpedance, drive_impedance

__all__ = [
    "DriveImpedance",
    "FrequencyResponse",
    "GainBoundary",
    "LoopAnalysis",
    "Margins",
    "Mode",
    "Modes",
    "OperatingPoint",
    "RootLocus",
    "cancelling_weight_gain",
    "closed_loop",
    "critical_speed",
    "critical_weight_on_bit",
    "drive_impedance",
    "ends_of",
    "equilibria",
    "export",
    "frequency_response",
    "gain_boundary",
    "loop",
    "margins",
    "modes",
    "open_loop",
    "operating_point",
    "plant",
    "response_of",
    "root_locus",
    "slope_margin",
    "slope_margins",
    "telling_frequencies",
    "tuning",
]
