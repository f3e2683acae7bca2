"""Nonlinear simulation of the closed loop with set-valued friction.

- `reference.py`: adaptive integration with located events; `system.py`, `phases.py`: its
  equations; `drive_in_time.py`, `weight_in_time.py`: laws with a memory in them; `printed.py`: the
  paper's own three branches; `trajectory.py`: signals and measures.
- `batch.py`: thousands of lanes at a fixed step; `lanes.py`: what a lane is; `propagator.py`:
  the exact step of the string; `step_laws.py`: laws with a memory for it; `kernels/`: compiled
  loops and nothing else; `scheme.py`: step and modes; `scheme_reasons.py`: why these;
  `cost.py`: operations of a step.
- `start.py`, `measures.py`: shared by both.
"""

from drillctl.simulation.run import simulate
from drillctl.simulation.trajectory import Simulation

__all__ = ["Simulation", "simulate"]
