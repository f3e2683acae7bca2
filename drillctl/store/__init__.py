"""Results on disk: one folder per run.

    run.json       verb, version, identity, provenance; whether the run is finished
    design.toml    the resolved design
    blocks/        finished blocks of an unfinished map, written atomically
    data.zarr      the dataset, labelled by parameter path; under uncertainty it grows by blocks
    summary.json   what the command printed
    *.png, *.csv   figures and tables

No pickle anywhere; a folder with any other content is never written to.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from drillctl.registry import resolve

if TYPE_CHECKING:
    from drillctl.store.differences import growing_realizations as growing_realizations
    from drillctl.store.folder import RunFolder as RunFolder
    from drillctl.store.folder import claim as claim
    from drillctl.store.folder import identity as identity
    from drillctl.store.saving import open as open
    from drillctl.store.saving import save as save

_HOME = {
    "RunFolder": "folder",
    "claim": "folder",
    "growing_realizations": "differences",
    "identity": "folder",
    "open": "saving",
    "save": "saving",
}

__all__ = [*_HOME]


def __getattr__(name: str) -> Any:
    # A list of names is written as JSON from here, and needs nothing of a design.
    if name in _HOME:
        return resolve(f"drillctl.store.{_HOME[name]}:{name}")
    raise AttributeError(f"module 'drillctl.store' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
