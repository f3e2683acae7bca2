"""Stick-slip as a periodic motion: how long, how fast, and whether it repeats at all.

- `describing.py`: `harmonic_cycles`, one harmonic and the describing function of the friction;
  milliseconds, good for whether there is a cycle and about how long it takes.
- `flow.py`: the motion through slip and stick with what becomes of its neighbours.
- `shooting.py`: `find_orbit`, the exact cycle, stable or not, with its multipliers.
- `returns.py`: a long simulation, and the judgement whether it settles, repeats, or neither.
- `result.py`: `limit_cycle` puts the three side by side.

Speeds are absolute (rad/s) wherever a name says speed; points of the motion are in the frame
that turns at the set speed.
"""

from drillctl.simulation.limit_cycle.describing import HarmonicCycle, harmonic_cycles
from drillctl.simulation.limit_cycle.result import LimitCycle, limit_cycle
from drillctl.simulation.limit_cycle.returns import Returns
from drillctl.simulation.limit_cycle.shooting import Orbit, find_orbit, harmonic_guess

__all__ = [
    "HarmonicCycle",
    "LimitCycle",
    "Orbit",
    "Returns",
    "find_orbit",
    "harmonic_cycles",
    "harmonic_guess",
    "limit_cycle",
]
