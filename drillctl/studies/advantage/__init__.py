"""PI against PI with a weight on bit that follows the bit speed, each at its robust optimum.

- `policies.py`: what is compared, and what of it is tuned.
- `optimum.py`: robust gains without derivatives, from known ones on.
- `measured.py`: designs at fresh draws; resampled objectives.
- `equalities.py`: equal nominal weight, mean weight, ROP proxy.
- `cases.py`: the table; `regions.py`: areas over the gains of the drive.
- `chart.py`: front and map over weights and speeds; `delays.py`: against the delay of the path.
- `study.py`, `result.py`: all of it; `tables.py`: CSV.
"""

from drillctl.studies.advantage.result import Advantage
from drillctl.studies.advantage.study import advantage, checked
from drillctl.studies.advantage.tables import write_advantage

__all__ = ["Advantage", "advantage", "checked", "write_advantage"]
