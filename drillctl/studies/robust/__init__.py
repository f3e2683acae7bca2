"""Robust gains: searched with CasADi, for many realizations at once.

What both designs share: `tuned.py` names what is tuned and what numbers of a drive follow,
`spread.py` spreads points over bounds, `realizations.py` makes designs of draws, `saving.py`
writes a tuned design as a file ready to run.

Linear design, for the largest friction-slope margin over a set of loops:

- `pairs.py`: complex symbols; `line_data.py`: a string as data.
- `loops.py`: the loops that gains must hold for; `crossings.py`, `requirements.py`: what they are
  worth at given gains.
- `loop_points.py`, `linear_nlp.py`: the smooth program near given gains.
- `linear_design.py`: starts, and the search from each.

Nonlinear design, for the least statistic of J1 over realizations:

- `string_matrices.py`, `drive_steps.py`, `bit_step.py`, `trajectory.py`: the batch engine's
  scheme in CasADi, J1 and its derivatives.
- `evaluation.py`: runs of the batch engine, counted; `objective.py`: statistics and limits;
  `judge.py`: both together.
- `trust_region.py`, `polish.py`, `search.py`: from a first look to the gains.

What is made of found gains:

- `fresh.py`: runs at draws that no search has seen; `certificate.py`: how often they keep the
  level, margins, worst draw, audit; `tolerance.py`: how far gains may drift.
- `baselines.py`: other gains and laws at the same draws.
- `tune_study.py`: all of it in one go; `tune_data.py`: its dataset.

CasADi is imported where a function needs it, never with the package.
"""

from drillctl.studies.robust.linear_design import LinearDesign, linear_design
from drillctl.studies.robust.search import Tuning, search
from drillctl.studies.robust.trajectory import Trajectories
from drillctl.studies.robust.tune_study import Tune, tune
from drillctl.studies.robust.tuned import Tuned, tuned_parameters

__all__ = [
    "LinearDesign",
    "Trajectories",
    "Tune",
    "Tuned",
    "Tuning",
    "linear_design",
    "search",
    "tune",
    "tuned_parameters",
]
