"""Design files: TOML text in, a validated frozen `Design` out, and back.

- `tables.py`: every key a design may hold, with its unit and range; the larger tables have files
  of their own: `bit_rock_tables.py`, `controller_tables.py`, `weight_tables.py`,
  `scenario_tables.py`, `uncertain_tables.py`, `compare_tables.py`, `delay_tables.py`;
  `base.py`: what every table is.
- `quantities.py`: the field types those tables use.
- `merging.py`: a design laid over its model; single values set by path.
- `validation.py`: errors in the user's words.
- `parts.py`, `drive.py`, `weight.py`: the physical parts that the tables describe.
- `design.py`: the `Design` itself.
- `reading.py`, `writing.py`, `paths.py`: files in, files out, values by dotted path.
"""

from drillctl.design.design import Design
from drillctl.design.paths import Parameter, parameter, parameters
from drillctl.design.reading import load, parse_setting, to_toml

__all__ = ["Design", "Parameter", "load", "parameter", "parameters", "parse_setting", "to_toml"]
