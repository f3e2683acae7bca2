"""What the batch engine does with a design."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from drillctl.design import Design
from drillctl.ensemble.audit import Audit
from drillctl.ensemble.grid import Axis
from drillctl.store.kind import Kind
from drillctl.store.names import stored_name
from drillctl.studies.diagnosis.error_estimate import ErrorEstimate
from drillctl.studies.diagnosis.result import Doctor

if TYPE_CHECKING:
    import xarray


def read_doctor(design: Design, data: xarray.Dataset, summary: dict[str, Any]) -> Doctor:
    """A `Doctor` as it was saved."""
    cells, audited = data["cell"].values, data["audited_cell"].values
    estimate = ErrorEstimate(data["j1"].values)
    batch = estimate.j1[0][np.searchsorted(cells, audited)]
    told = ("speed", "refused", "advice", "total_seconds")
    scheme = summary["scheme"]
    return Doctor(
        design=design,
        axes=tuple(
            Axis(path, data[stored_name(path)].attrs["units"], np.linspace(*ends.values()))
            for path, ends in summary["axes"].items()
        ),
        cells=cells.astype(np.int64),
        estimate=estimate,
        status=data["status"].values.astype(np.int8),
        scheme=scheme and {key: value for key, value in scheme.items() if key != "strings"},
        strings=scheme["strings"] if scheme else 0,
        audit=Audit(audited.astype(np.int64), batch, data["audited_j1"].values),
        asked=summary["audit"]["asked"],
        **{name: summary[name] for name in told},
        provenance={key: str(value) for key, value in data.attrs.items()},
    )


def _asked_of_doctor(result: Doctor) -> tuple[Design, dict[str, Any]]:
    return result.design, {"audited": result.asked}


KINDS = (Kind("doctor", Doctor, read_doctor, _asked_of_doctor),)
