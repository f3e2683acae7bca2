"""Nonlinear simulation of the closed loop with set-valued friction.

- `reference.py`: adaptive steps with located events; compiled: `reference_rates.py` its equations,
  `reference_steps.py`, `reference_stiff.py` its steps, `reference_run.py` its phases and events,
  `law_calls.py` the laws; `run.py`: signals and measures.
- `batch.py`: thousands of lanes at a fixed step; `lanes.py`: what a lane is and how it starts;
  `propagator.py`: the exact step of the string; `step_laws.py`: laws with a memory for it;
  `kernels/`: compiled loops and nothing else; `scheme.py`: step and modes.
- `measures.py`: what both measure; `limit_cycle/`: periodic motions, on `phases.py`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from drillctl.registry import at_first_use

if TYPE_CHECKING:
    from drillctl.simulation.run import Simulation as Simulation
    from drillctl.simulation.run import simulate as simulate

# Lanes are made without the reference solver and what of SciPy it takes.
__all__, __getattr__, __dir__ = at_first_use(__name__)
