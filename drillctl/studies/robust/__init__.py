"""Robust gains: searched with CasADi, for many realizations at once.

Linear design, for the largest friction-slope margin over a set of loops:

- `tuned.py`: what is tuned, and the drive's numbers that follow; `pairs.py`: complex symbols.
- `line_data.py`: a string as data; `loops.py`: the loops that gains must hold for.
- `crossings.py`, `requirements.py`: what loops of given gains are worth.
- `loop_points.py`, `linear_nlp.py`: the smooth program near given gains.
- `linear_design.py`: starts, and the search from each.
- `saving.py`: a tuned design as a file ready to run.

CasADi is imported where a function needs it, never with the package.
"""

from drillctl.studies.robust.linear_design import LinearDesign, linear_design

__all__ = ["LinearDesign", "linear_design"]
