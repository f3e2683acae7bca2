"""Robust gains in one go: searched, certified, set beside what one would have had without."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any, ClassVar

from drillctl.design import Design
from drillctl.progress import SILENT, Progress
from drillctl.provenance import provenance
from drillctl.store.codec import label
from drillctl.store.result import Result
from drillctl.studies.tune.baselines import Baseline, baselines
from drillctl.studies.tune.certificate import Certificate, FreshDraws, certified
from drillctl.studies.tune.search import Tuning, search, search_problem
from drillctl.studies.tune.tuned import tuned_parameters


@dataclass(frozen=True, eq=False)
class Tune(Result):
    """Gains with their certificate."""

    kind: ClassVar[str] = "tune"

    design: Design = label(means="as it was given")
    tuning: Tuning = label(means="gains of the search, at its own realizations")
    certificate: Certificate = label(flat=True, means="the gains at fresh realizations")
    baselines: tuple[Baseline, ...] = label(
        over="baseline", name="baseline", means="other gains and laws at the same realizations"
    )
    total_seconds: float = label(unit="s", means="from call to return")
    provenance: dict[str, str] = label(
        default_factory=provenance, means="versions and processor it came from"
    )

    @property
    def tuned_design(self) -> Design:
        """The design with the tuned gains, ready to run."""
        return self.tuning.design

    @property
    def gains(self) -> dict[str, float]:
        """Tuned values by path (SI)."""
        return self.tuning.gains

    @property
    def passed(self) -> bool:
        """Whether every requirement is kept and the certificate is passed."""
        return self.tuning.feasible and self.certificate.passed

    @property
    def message(self) -> str:
        """The result in a sentence or two."""
        if not self.tuning.feasible:
            return self.tuning.message
        if self.certificate.passed:
            return f"{self.tuning.message}; {self.certificate.message}"
        result = self.certificate.message + self._nearer
        if self.tuning.share < self.certificate.required:
            return f"{self.tuning.message}; {result}"
        at = ", ".join(f"{path} = {value:.6g}" for path, value in self.gains.items())
        return f"{result}; the closest found is {at}"

    @property
    def _nearer(self) -> str:
        """The baseline that keeps the level most often, if more often than the tuned gains.

        The least quantile is blind to the probability where no gains reach the level.
        """
        run = [one for one in self.baselines if one.runs is not None]
        best = max(run, key=lambda one: one.runs.hits if one.runs else 0, default=None)
        if best is None or best.runs is None or best.runs.hits <= self.certificate.runs.hits:
            return ""
        return f" (the baseline {best.name!r} has {best.runs.probability:.4f} at the same)"

    def summary(self) -> dict[str, Any]:
        """Strict JSON values, SI: of the search, with `certificate` and `baselines`."""
        result = self.tuning.summary()
        result["message"] = self.message
        return result | {
            "passed": self.passed,
            "search_message": self.tuning.message,
            "certificate": self.certificate.summary(),
            "baselines": {one.name: one.summary() for one in self.baselines},
            "total_seconds": self.total_seconds,
        }

    def requested(self) -> tuple[Design, dict[str, Any]]:
        """Whether a grid was gone through as well."""
        grid = any(one.name == "exhaustive grid" for one in self.baselines)
        return self.design, {"exhaustive": True} if grid else {}


def tune(
    design: Design,
    exhaustive: bool = False,
    progress: Progress = SILENT,
    verbose: bool = False,
) -> Tune:
    """Search robust gains, certify them, and set them beside others.

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
    result = search(design, progress, verbose)
    grid = search_problem(design, tuned) if exhaustive else None
    return Tune(
        design=design,
        tuning=result,
        certificate=certified(result.design, fresh, result.values, progress),
        baselines=baselines(design, fresh, grid, progress),
        total_seconds=time.perf_counter() - begin,
    )
