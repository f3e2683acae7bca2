"""Maps under uncertainty."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from drillctl.design import Design
from drillctl.ensemble.audit import Audit
from drillctl.ensemble.draws import Failures
from drillctl.store.differences import growing_realizations
from drillctl.store.kind import Kind
from drillctl.store.kinds.axes import asked_axes, axis_of
from drillctl.store.names import stored_name
from drillctl.studies.uncertainty import Uncertainty
from drillctl.studies.uncertainty.labels import write_uncertainty
from drillctl.studies.uncertainty.sensitivity import read_sensitivity
from drillctl.studies.uncertainty.stopping import Look
from drillctl.studies.uncertainty.study import map_axes

if TYPE_CHECKING:
    import xarray


def read_uncertainty(design: Design, data: xarray.Dataset, summary: dict[str, Any]) -> Uncertainty:
    """An `Uncertainty` as it was saved."""
    lanes = data["audited_lane"].values.astype(np.int64)
    keep = design.tables.uncertainty.keep
    measures = {name: data[name].values for name in dict.fromkeys(("j1", *keep))}
    told = summary.get("sensitivity")
    return Uncertainty(
        design=design,
        axes=tuple(axis_of(path, data) for path in summary["axes"]),
        levels=design.tables.map.levels,
        drawn={path: data[stored_name(path)].values for path in summary["uncertain"]},
        measures=measures,
        status=data["status"].values.astype(np.int8),
        nominal=data["nominal_j1"].values,
        audit=Audit(lanes, measures["j1"].ravel()[lanes], data["audited_j1"].values),
        failures=tuple(Failures(**failure) for failure in summary["failures"]),
        looks=tuple(
            Look(**{**one, "interval": tuple(one["interval"])}) for one in summary["looks"]
        ),
        sensitivity=None if told is None else read_sensitivity(told),
        **{name: summary[name] for name in ("seconds", "total_seconds")},
        provenance={key: str(value) for key, value in data.attrs.items()},
    )


def _asked_of_uncertainty(result: Uncertainty) -> tuple[Design, dict[str, Any]]:
    settings = asked_axes(result, map_axes)
    if len(result.audit.cells) != result.design.tables.map.audit_cells:
        settings["audited"] = result.audit.cells.tolist()
    return result.design, settings


KINDS = (
    Kind(
        "uncertainty",
        Uncertainty,
        read_uncertainty,
        _asked_of_uncertainty,
        write_uncertainty,
        growing_realizations,
    ),
)
