"""Robust gains in one go: searched, certified, set beside what one would have had without."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

from drillctl.design import Design
from drillctl.progress import SILENT, Progress
from drillctl.provenance import provenance
from drillctl.studies.robust.baselines import Baseline, baselines
from drillctl.studies.robust.certificate import Certificate, FreshDraws, certified
from drillctl.studies.robust.search import Tuning, search, search_problem
from drillctl.studies.robust.tuned import tuned_parameters

if TYPE_CHECKING:
    from pathlib import Path

    import xarray


@dataclass(frozen=True, eq=False)
class Tune:
    """Found gains with their certificate.

    Attributes
    ----------
    design : Design
        As it was given.
    tuning : Tuning
        What the search found, at its own realizations.
    certificate : Certificate
        What fresh realizations say of it.
    baselines : tuple of Baseline
        Other gains and laws at the same fresh realizations.
    total_seconds : float
        From call to return.
    provenance : dict of str
        Versions and processor it came from.
    """

    design: Design
    tuning: Tuning
    certificate: Certificate
    baselines: tuple[Baseline, ...]
    total_seconds: float
    provenance: dict[str, str] = field(default_factory=provenance)

    @property
    def tuned_design(self) -> Design:
        """The design with the found gains, ready to run."""
        return self.tuning.design

    @property
    def gains(self) -> dict[str, float]:
        """Found values by path (SI)."""
        return self.tuning.gains

    @property
    def passed(self) -> bool:
        """Whether every requirement is kept and the certificate is passed."""
        return self.tuning.feasible and self.certificate.passed

    @property
    def message(self) -> str:
        """What came of it, in a sentence or two."""
        if not self.tuning.feasible:
            return self.tuning.message
        if self.certificate.passed:
            return f"{self.tuning.message}; {self.certificate.message}"
        found = self.certificate.message + self._nearer
        if self.tuning.share < self.certificate.required:
            return f"{self.tuning.message}; {found}"
        at = ", ".join(f"{path} = {value:.6g}" for path, value in self.gains.items())
        return f"{found}; the closest found is {at}"

    @property
    def _nearer(self) -> str:
        """The baseline that keeps the level most often, if it does so more than what was found.

        The least quantile is blind to the probability where no gains reach the level.
        """
        run = [one for one in self.baselines if one.runs is not None]
        best = max(run, key=lambda one: one.runs.hits if one.runs else 0, default=None)
        if best is None or best.runs is None or best.runs.hits <= self.certificate.runs.hits:
            return ""
        return f" (the baseline {best.name!r} has {best.runs.probability:.4f} at the same)"

    def summary(self) -> dict[str, Any]:
        """Strict JSON values, SI: of the search, with `certificate` and `baselines`."""
        found = self.tuning.summary()
        found["message"] = self.message
        return found | {
            "passed": self.passed,
            "search_message": self.tuning.message,
            "certificate": self.certificate.summary(),
            "baselines": {one.name: one.summary() for one in self.baselines},
            "total_seconds": self.total_seconds,
        }

    @cached_property
    def data(self) -> xarray.Dataset:
        """J1 of gains and baselines at the fresh realizations; probability about the optimum."""
        from drillctl.studies.robust.tune_data import dataset

        return dataset(self)

    def save(self, folder: str | Path) -> Path:
        """Write design, dataset and summary into a folder; see `drillctl.store`."""
        from drillctl.store import save

        return save(self, folder)


def tune(
    design: Design,
    exhaustive: bool = False,
    progress: Progress = SILENT,
    verbose: bool = False,
) -> Tune:
    """Find robust gains, certify them, and set them beside others.

    Parameters
    ----------
    design : Design
        Its `[tune]` table says what is tuned, to what end and how it is certified; `[uncertain]`
        what is drawn. A design without either has defaults.
    exhaustive : bool
        Whether to go through a grid of 41 x 41 gains at the realizations of the search as well:
        some 1.7 million trajectories.
    progress : Progress
        Receives finished stages.
    verbose : bool
        Let IPOPT print.

    Returns
    -------
    Tune
        Requirements that cannot be met, a level that no gains reach and a certificate that
        fails are stated in its message.

    Raises
    ------
    InputError
        Nothing that can be tuned, bounds that cannot be used, or no realization that a rig can
        have.
    """
    begin = time.perf_counter()
    tuned = tuned_parameters(design)
    fresh = FreshDraws(design, tuned)  # an impossible certificate is refused before the search
    found = search(design, progress, verbose)
    grid = search_problem(design, tuned) if exhaustive else None
    return Tune(
        design=design,
        tuning=found,
        certificate=certified(found.design, fresh, found.values, progress),
        baselines=baselines(design, fresh, grid, progress),
        total_seconds=time.perf_counter() - begin,
    )
