"""PI against PI with a weight on bit that follows the bit speed, each at its robust optimum.

- `policies.py`: what is compared, and what of it is tuned.
- `optimum.py`: robust gains of a policy.
- `cases.py`: policies at their optima on equal terms, at fresh draws.
- `sweeps.py`: areas over the gains of the drive, front and map over weights and speeds.
- `delays.py`: against the delay of the path.
- `compute.py`: all of it; `tables.py`: CSV.
"""

from drillctl.studies.advantage.compute import Advantage, advantage, checked
from drillctl.studies.advantage.tables import write_advantage

__all__ = ["Advantage", "advantage", "checked", "write_advantage"]
