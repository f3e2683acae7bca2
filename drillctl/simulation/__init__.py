"""Nonlinear simulation of the closed loop with set-valued friction.

- `reference.py`: adaptive integration with located events; `phases.py`: its equations;
  `trajectory.py`: its signals and measures.
- `batch.py`: thousands of lanes at a fixed step; `lanes.py`: what a lane is; `propagator.py`:
  the exact step of the string; `kernels/`: compiled loops and nothing else.
- `start.py`, `measures.py`: shared by both.
"""

from drillctl.simulation.run import simulate
from drillctl.simulation.trajectory import Simulation

__all__ = ["Simulation", "simulate"]
