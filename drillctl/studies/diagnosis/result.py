"""What `doctor` finds of a design: scheme and reasons, estimated and audited errors, speed."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design
from drillctl.ensemble import audit as auditing
from drillctl.ensemble.grid import Axis, shape_of
from drillctl.provenance import provenance
from drillctl.simulation.measures import STATUSES
from drillctl.studies.diagnosis.error_estimate import (
    PROMISES,
    REFINEMENTS,
    ErrorEstimate,
)

if TYPE_CHECKING:
    from pathlib import Path

    import xarray


Array = NDArray[np.float64]

CONFIRMED, REFERENCE = 3.0, 1e-6
"""An audited difference confirms an estimate up to so many times it, and what the reference
solver itself is good for."""


@dataclass(frozen=True, eq=False)
class Doctor:
    """What the batch engine does with a design.

    Attributes
    ----------
    design : Design
        That was examined.
    axes : tuple of Axis
        Of the map that the sample is from; none where the default map does not fit the design,
        which then is a sample of one.
    cells : ndarray of int, shape (lanes,)
        The sample, in the flattened map.
    estimate : ErrorEstimate
        J1 of its lanes at the scheme and at finer ones.
    status : ndarray of int8, shape (lanes,)
        Index into `simulation.measures.STATUSES`, at the scheme.
    scheme : dict or None
        Step, modes and why, as `SchemeReasons.summary` tells them; of the string with the shortest
        step if axes change the string. None if the engine refuses the design.
    strings : int
        Strings in the sample.
    audit : Audit
        Lanes of the sample simulated again with the reference solver.
    asked : int
        How many were to be.
    speed : dict or None
        As `Speed.summary` tells it.
    refused : str or None
        Why the batch engine does not take this design.
    advice : str or None
        What would keep the promise of the accuracy if it is not kept.
    total_seconds : float
        From call to return (s).
    provenance : dict of str
        Versions and processor it came from.
    """

    design: Design
    axes: tuple[Axis, ...]
    cells: NDArray[np.int64]
    estimate: ErrorEstimate
    status: NDArray[np.int8]
    scheme: dict[str, Any] | None
    strings: int
    audit: auditing.Audit
    asked: int
    speed: dict[str, Any] | None
    refused: str | None
    advice: str | None
    total_seconds: float
    provenance: dict[str, str] = field(default_factory=provenance)

    @property
    def engine(self) -> str:
        """Engine that `simulate` uses for this design."""
        return self.design.tables.simulation.engine or "reference"

    @property
    def accuracy(self) -> str:
        """Accuracy that the design asks for; explicit steps and modes are held to it too."""
        return self.design.tables.simulation.accuracy

    @property
    def confirmed(self) -> bool | None:
        """Whether the audited differences are such as the estimate says; None without any."""
        known = np.isfinite(self.audit.differences)
        if not known.any():
            return None
        own = self.estimate.of_lanes[np.searchsorted(self.cells, self.audit.cells)]
        said = np.fmax(own, self.estimate.errors.median)
        allowed = CONFIRMED * said + REFERENCE
        return bool((self.audit.differences[known] <= allowed[known]).all())

    @property
    def verdict(self) -> str:
        """`ok`, `not_reached`, `look` if the audit does not confirm the estimate, `refused`."""
        if self.refused is not None:
            return "refused"
        if not PROMISES[self.accuracy].kept(self.estimate.of_lanes):
            return "not_reached"
        return "look" if self.confirmed is False else "ok"

    @property
    def data(self) -> xarray.Dataset:
        """The sample: where each lane is, its J1 by three schemes, its error; audited cells."""
        import xarray

        where = np.unravel_index(self.cells, shape_of(self.axes)) if self.axes else ()
        coordinates: dict[str, Any] = {
            a.path: ("lane", a.values[at], {"units": a.unit})
            for a, at in zip(self.axes, where, strict=True)
        }
        flags = {"flag_values": list(range(len(STATUSES))), "flag_meanings": " ".join(STATUSES)}
        variables: dict[str, Any] = {
            "cell": ("lane", self.cells),
            "j1": (("refinement", "lane"), self.estimate.j1, {"units": "s"}),
            "estimated_error": ("lane", self.estimate.of_lanes, {"units": "1"}),
            "status": ("lane", self.status, flags),
            "audited_cell": ("audited", self.audit.cells),
            "audited_j1": ("audited", self.audit.reference, {"units": "s"}),
        }
        coordinates["refinement"] = ("refinement", list(REFINEMENTS))
        return xarray.Dataset(variables, coordinates, dict(self.provenance))

    def summary(self) -> dict[str, Any]:
        """Scheme and reasons, estimated and audited error, speed, verdict; SI units."""
        promise = PROMISES[self.accuracy]
        scheme = None if self.scheme is None else self.scheme | {"strings": self.strings}
        return {
            "verdict": self.verdict,
            "refused": self.refused,
            "advice": self.advice,
            "engine": self.engine,
            "scheme": scheme,
            "estimate": {
                "lanes": len(self.cells),
                "failed": int((~np.isfinite(self.estimate.of_lanes)).sum()),
                **self.estimate.errors.summary(),
                "order": self.estimate.order,
                "promised": {"median": promise.median, "p99": promise.p99},
            },
            "audit": {
                **self.audit.summary(),
                "asked": self.asked,
                "confirms_estimate": self.confirmed,
                "lanes": [self._audited(i) for i in range(len(self.audit.cells))],
            },
            "speed": self.speed,
            "axes": {
                a.path: {"min": float(a.values[0]), "max": float(a.values[-1]), "points": len(a)}
                for a in self.axes
            },
            "total_seconds": self.total_seconds,
        }

    def _audited(self, number: int) -> dict[str, Any]:
        cell = int(self.audit.cells[number])
        where = np.unravel_index(cell, shape_of(self.axes)) if self.axes else ()
        lane = int(np.searchsorted(self.cells, cell))
        return {
            "at": {a.path: float(a.values[k]) for a, k in zip(self.axes, where, strict=True)},
            "j1": float(self.audit.batch[number]),
            "reference_j1": float(self.audit.reference[number]),
            "relative_difference": float(self.audit.differences[number]),
            "estimated_error": float(self.estimate.of_lanes[lane]),
        }

    def save(self, folder: str | Path) -> Path:
        """Write design, dataset and summary into a folder; see `drillctl.store`."""
        from drillctl.store import save

        return save(self, folder)
