"""Design files: TOML text in, a validated frozen `Design` out, and back.

- `tables.py`: every key a design may hold, with its unit and range; uncertain parameters and draws
  in `uncertain_tables.py`; those of a law stand beside the law, those of a study beside the study.
- `merging.py`: a design laid over its model; single values set by path.
- `validation.py`: errors in the user's words.
- `parts.py`: the physical parts and laws that the tables describe.
- `warnings.py`: what a design allows and probably does not mean.
- `design.py`: the `Design` itself.
- `reading.py`, `paths.py`: files in, files out, values by dotted path; `starter.toml`: the file
  to begin with.
"""

from drillctl.design.design import Design
from drillctl.design.paths import Parameter, axis_tables, parameter, parameters, tuned_ranges
from drillctl.design.reading import load, parse_setting, to_toml

__all__ = [
    "Design",
    "Parameter",
    "axis_tables",
    "load",
    "parameter",
    "parameters",
    "parse_setting",
    "to_toml",
    "tuned_ranges",
]
