"""Results on disk: one folder a run.

    run.json       verb, version, identity, provenance; whether the run is finished
    design.toml    the resolved design
    blocks/        finished blocks of a map that is not, written atomically
    data.zarr      the dataset, labelled by parameter path; under uncertainty it grows by blocks
    summary.json   what the command printed
    *.png, *.csv   figures and tables

No pickle anywhere; a folder that holds anything else is never written to. `folder.py` claims
folders, `kinds/` says of each kind of result what it was asked for and how it is read back.
"""

from drillctl.store.differences import growing_realizations
from drillctl.store.folder import RunFolder, claim, identity
from drillctl.store.kinds.maps import asked_measures
from drillctl.store.saving import open, save, write_data

__all__ = [
    "RunFolder",
    "asked_measures",
    "claim",
    "growing_realizations",
    "identity",
    "open",
    "save",
    "write_data",
]
