"""Robust gains: a linear design with CasADi, and a search over many realizations at once.

`tuned.py`: what is tuned, and which numbers of a drive follow from it.

Linear design, for the largest friction-slope margin over a set of loops:

- `line_data.py`: a string as data, complex symbols.
- `loops.py`, `requirements.py`: the loops that gains must hold for, their crossings, and how far
  requirements are missed at given gains.
- `linear_nlp.py`: the smooth program near given gains.
- `linear_design.py`: starts, and the search from each.

Nonlinear design, for the least statistic of J1 over realizations:

- `runs.py`: runs of many gains by the batch engine; `problem.py`: objective and requirements.
- `search.py`: from a first look to the gains, for the study of the advantage too.

What follows for the gains:

- `certificate.py`: runs at draws that no search has seen, margins, audit, how far gains may drift.
- `baselines.py`: other gains and laws at the same draws.
- `tune_study.py`: all of it in one go; `tune_data.py`: its dataset.

CasADi is imported where a function needs it, never with the package.
"""

from drillctl.studies.robust.linear_design import LinearDesign, linear_design
from drillctl.studies.robust.search import Tuning, search
from drillctl.studies.robust.tune_study import Tune, tune
from drillctl.studies.robust.tuned import Tuned, tuned_parameters

__all__ = [
    "LinearDesign",
    "Tune",
    "Tuned",
    "Tuning",
    "linear_design",
    "search",
    "tune",
    "tuned_parameters",
]
