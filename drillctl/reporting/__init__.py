"""Reports that can be handed over: a design's studies as HTML, PDF or Markdown.

A thin reader of results: it computes nothing itself beyond calling the studies.

- `making.py`: `report`, from a design to files; `profiles.py`: how much is computed.
- `studies.py`: what is asked of each study; `gather.py`: reads or does them in their folders.
- `cells.py`: what the cells of a map hold, for a reader who points at them.
- `sections/`: a file a section, studies in, blocks out; `blocks.py`: what they are made of.
- `verdict.py`: does the current setting pass; `rig_drawing.py`; `words.py`: numbers in words.
- `document.py`: all sections; `html.py` with `templates/`, `markdown.py`, `pdf.py`: written as.
- `pictures.py`: figures as files; `folder.py`: everything that lies beside the report.
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
