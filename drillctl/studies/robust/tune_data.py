"""A tune as a dataset, and the parts of it that a dataset holds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from drillctl.ensemble.parameters import uncertain_parameters

if TYPE_CHECKING:
    import xarray

    from drillctl.studies.robust.tune_study import Tune


def dataset(result: Tune) -> xarray.Dataset:
    """J1 of the gains and of each baseline at the fresh draws, and what goes with it.

    That is the drawn values, the audited draws, the lines that tolerances were read from, and
    the probability about the optimum.
    """
    import xarray

    certificate = result.certificate
    seconds = {"units": "s"}
    units = {p.path: p.unit for p in uncertain_parameters(result.design)}
    run = [one for one in result.baselines if one.runs is not None]
    j1 = np.array([one.runs.j1 for one in run if one.runs is not None])
    j1 = j1.reshape(len(run), len(certificate.runs.j1))  # there may be none
    made: dict[str, Any] = {
        "j1": ("realization", certificate.runs.j1, seconds),
        "baseline_j1": (("baseline", "realization"), j1, seconds),
        "audited": ("audit", certificate.audit.cells.astype(np.int64)),
        "audited_j1": ("audit", certificate.audit.reference, seconds),
        **{
            drawn_name(path): ("realization", column, {"units": units[path]})
            for path, column in certificate.drawn.items()
        },
    }
    # As objects, which zarr keeps as text of any length.
    names = np.array([one.name for one in run], dtype=object)
    coordinates = {"baseline": ("baseline", names)}
    for k, one in enumerate(certificate.tolerances):
        made[f"line_{k}_value"] = (f"line_{k}", one.values, {"units": one.unit, "of": one.path})
        made[f"line_{k}_probability"] = (f"line_{k}", one.probability)
    about = certificate.neighbourhood
    made["probability"] = (tuple(axis.path for axis in about.axes), about.probability)
    found = xarray.Dataset(made, coords=coordinates, attrs=result.provenance)
    return found.assign_coords(
        {axis.path: (axis.path, axis.values, {"units": axis.unit}) for axis in about.axes}
    )


def drawn_name(path: str) -> str:
    """Name of the values drawn for a path: the path itself may be an axis."""
    return f"drawn {path}"
