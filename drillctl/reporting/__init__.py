"""Reports of a design as HTML, PDF or Markdown.

Reads results and calls studies; computes nothing itself.

- `making.py`: `report`, from a design to files.
- `gather.py`: profiles, and the studies of a report, read or run.
- `cells.py`: values and time responses of the cells of a map.
- `sections/`: sections that no study makes by itself; `blocks.py`: what they are made of.
- `pages.py` with `templates/`: the document as HTML, PDF or Markdown.
- `pictures.py`: figures as files.
"""

from drillctl.reporting.gather import FULL, PROFILES, QUICK, STANDARD, Profile
from drillctl.reporting.making import FORMATS, Report, report
from drillctl.reporting.sections import SECTIONS

__all__ = [
    "FORMATS",
    "FULL",
    "PROFILES",
    "QUICK",
    "SECTIONS",
    "STANDARD",
    "Profile",
    "Report",
    "report",
]
