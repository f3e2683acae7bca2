"""Results on disk: one folder per run.

    run.json       verb, version, identity, provenance; whether the run is finished
    design.toml    the resolved design
    blocks/        finished blocks of an unfinished run
    data.zarr      the dataset, labelled by parameter path; result.json says how to read it
    summary.json   what the command prints
    journal.jsonl  the hash of every file as it was written
    *.png, *.csv   figures and tables

`folder.py`: whose folder it is, how a run begins and ends; `lock.py`, `journal.py`: one process at
a time, and whether a file is what was written; `codec.py`: a result as arrays and JSON;
`result.py`: their base class; `tables.py`: tables for terminal, CSV and reports.

No pickle anywhere; a folder with any other content is never written to.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from drillctl.registry import at_first_use

if TYPE_CHECKING:
    from drillctl.store.folder import RunFolder as RunFolder
    from drillctl.store.folder import claim as claim
    from drillctl.store.folder import growing_realizations as growing_realizations
    from drillctl.store.folder import identity as identity
    from drillctl.store.result import Result as Result
    from drillctl.store.result import open as open

# A list of names is written as JSON from here, and needs nothing of a design.
__all__, __getattr__, __dir__ = at_first_use(__name__)
