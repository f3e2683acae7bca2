"""A dataset on disk, whole or not at all."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from drillctl.provenance import provenance
from drillctl.store.names import stored_name


def write_dataset(result: Any, folder: Path) -> None:
    """Write a result's dataset as `data.zarr`, with its provenance, whole or not at all."""
    part, target = folder / "data.part", folder / "data.zarr"
    shutil.rmtree(part, ignore_errors=True)
    data = result.data
    data = data.rename({name: stored_name(str(name)) for name in (*data.variables, *data.dims)})
    data.attrs = provenance() | data.attrs
    data.to_zarr(part, mode="w", consolidated=False)
    shutil.rmtree(target, ignore_errors=True)
    part.rename(target)
