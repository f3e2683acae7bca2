"""Stability regions under uncertainty: a map at thousands of realizations.

- `study.py`: `uncertainty`, from design to result.
- `result.py`: `Uncertainty`; `labels.py`: the same as dataset and summary.
- `probability.py`: probability cell by cell; `areas.py`: of regions; `scatter.py`: what tells
  the sampling error.
- `objectives.py`, `best.py`: best cells, and those that cannot be told apart from them.
- `convergence.py`, `stopping.py`: how many realizations are enough.
- `sensitivity.py`: Sobol indices.
"""

from drillctl.studies.uncertainty.probability import ProbabilityMap
from drillctl.studies.uncertainty.result import Uncertainty
from drillctl.studies.uncertainty.study import uncertainty

__all__ = ["ProbabilityMap", "Uncertainty", "uncertainty"]
