"""Reports of a design as HTML, PDF or Markdown.

Reads results and calls studies; computes nothing itself.

- `making.py`: `report`, from a design to files.
- `recipes.py`: profiles, and how each study is run; `gather.py`: reads or runs them.
- `cells.py`: values and time responses of the cells of a map.
- `sections/`: one file per section, studies in, blocks out; `blocks.py`: the blocks.
- `rig_drawing.py`: the drawing of the rig; `words.py`: numbers and units as text.
- `html.py` with `templates/`, `markdown.py`: the document as a file; `html.py` also prints the PDF.
- `pictures.py`: figures as files.
"""

from drillctl.reporting.making import FORMATS, Report, report
from drillctl.reporting.recipes import FULL, PROFILES, QUICK, STANDARD, Profile
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
