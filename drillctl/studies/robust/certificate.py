"""The certificate of found gains: runs at fresh draws, and what else an engineer asks.

A search has seen its realizations, and its optimum is better at them than at others. Here the
gains are run at draws of another seed, by the batch engine at the accuracy of the design, a
sample of them by the reference solver. How often J1 keeps the level is then a binomial count,
whose interval (Clopper & Pearson 1934) is exact.

`passed` means *shown*: the lower end of the 95 % interval is at or above what is required. An
estimate above it whose interval reaches below is no proof, and the verdict says `not shown`: more
realizations decide.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drillctl import units
from drillctl.design import Design
from drillctl.ensemble.audit import Audit, choose_cells, references
from drillctl.ensemble.draws import Failures, beyond_the_table
from drillctl.errors import InputError
from drillctl.linear import loop
from drillctl.progress import SILENT, Progress
from drillctl.studies.robust.fresh import Fresh, FreshRuns
from drillctl.studies.robust.tolerance import Neighbourhood, Tolerance, neighbourhood, tolerances

Array = NDArray[np.float64]

MARGINS = (
    "stable", "slope", "slope_margin", "deciding_frequency_hz", "disk_margin", "peak_sensitivity",
    "delay_margin",
)  # fmt: skip
"""Of `drillctl.loop`."""


@dataclass(frozen=True, eq=False)
class Certificate:
    """What fresh draws say of gains."""

    runs: FreshRuns  # J1 at each draw
    required: float  # probability that is asked for
    seed: int  # of the draws
    drawn: dict[str, Array]  # shape (draws,): Drawn values by path (SI)
    failures: tuple[Failures, ...]  # draws that no rig has: they count as over the level
    # requirements that are missed at the fresh draws, over their limits
    violations: dict[str, float]
    # figures of the linear loop, see `drillctl.loop`; empty where there is none
    margins: dict[str, Any]
    no_margins: str  # why there are none
    audit: Audit  # A sample of the draws by the reference solver; `cells` are numbers of draws
    tolerances: tuple[Tolerance, ...]  # how far each parameter may drift alone
    neighbourhood: Neighbourhood  # probability about the optimum
    trajectories: int  # runs of the batch engine
    seconds: float  # time that it took (s)

    @property
    def passed(self) -> bool:
        """Whether it is shown that the probability is at or above what is required."""
        return self.runs.interval[0] >= self.required

    @property
    def verdict(self) -> str:
        """`passed`, `failed` if the contrary is shown, `not shown` if neither is."""
        if self.passed:
            return "passed"
        return "failed" if self.runs.interval[1] < self.required else "not shown"

    @cached_property
    def worst(self) -> int | None:
        """Number of the draw with the largest J1; None if no rig has any."""
        possible = np.flatnonzero(~np.isnan(self.runs.j1))
        return int(possible[np.argmax(self.runs.j1[possible])]) if len(possible) else None

    @property
    def other_side(self) -> int:
        """Audited draws that the two solvers put on different sides of the level."""
        level, audit = self.runs.level, self.audit
        known = np.isfinite(audit.reference)
        return int(np.count_nonzero(((audit.batch <= level) != (audit.reference <= level))[known]))

    @property
    def audit_verdict(self) -> str:
        """`ok` if both solvers put every audited draw on the same side of the level.

        `check` if they do not, or if the reference solver failed; `none` without audited draws.
        How far two solvers are apart on a draw that sticks to the end says little here.
        """
        if not len(self.audit.cells):
            return "none"
        fine = np.isfinite(self.audit.reference).all() and self.other_side == 0
        return "ok" if fine else "check"

    @property
    def message(self) -> str:
        """The verdict in a sentence."""
        low, high = self.runs.interval
        found = (
            f"J1 <= {self.runs.level:g} s with probability {self.runs.probability:.4f} "
            f"({low:.4f} to {high:.4f}, 95 %) over {len(self.runs.j1)} fresh realizations, "
            f"{self.required:g} required"
        )
        if self.verdict == "not shown":
            return f"certificate not shown: {found}; more realizations would decide"
        return f"certificate {self.verdict}: {found}"

    def summary(self) -> dict[str, Any]:
        """Strict JSON values, SI."""
        runs = self.runs
        return {
            "level": runs.level,
            "required_probability": self.required,
            "realizations": len(runs.j1),
            "seed": self.seed,
            "probability": runs.probability,
            "interval_95": list(runs.interval),
            "passed": self.passed,
            "verdict": self.verdict,
            "message": self.message,
            "value": runs.value,
            "quantiles": runs.quantiles,
            "failures": [vars(one) for one in self.failures],
            "violations": self.violations,
            "margins": self.margins or None,
            "no_margins": self.no_margins or None,
            "worst": self._worst(),
            "audit": {
                "realizations": len(self.audit.cells),
                "worst_relative_difference": self.audit.worst,
                "other_side_of_level": self.other_side,
                "verdict": self.audit_verdict,
            },
            "tolerance": {one.path: _of(one) for one in self.tolerances},
            "neighbourhood": {
                "parameters": [axis.path for axis in self.neighbourhood.axes],
                "realizations": self.neighbourhood.realizations,
            },
            "trajectories": self.trajectories,
            "seconds": self.seconds,
        }

    def _worst(self) -> dict[str, Any] | None:
        number = self.worst
        if number is None:
            return None
        return {
            "realization": number,
            "j1": float(self.runs.j1[number]),
            "drawn": {path: float(column[number]) for path, column in self.drawn.items()},
        }


def _of(one: Tolerance) -> dict[str, Any]:
    return {
        "value": one.value, "low": one.low, "high": one.high,
        "low_at_bound": one.low_at_bound, "high_at_bound": one.high_at_bound,
    }  # fmt: skip


def certified(
    design: Design, fresh: Fresh, values: Array, progress: Progress = SILENT
) -> Certificate:
    """Certify gains."""
    begin, before = time.perf_counter(), fresh.trajectories
    table, judge = design.tables.tune, fresh.judge
    point, runs = fresh.of_gains(values)
    margins, no_margins = _margins(design)
    audit = _audit(design, fresh, runs, table.certificate.audit, progress)
    drifts = tolerances(fresh, values, runs.probability, progress)
    return Certificate(
        runs=runs,
        required=table.probability,
        seed=table.fresh_seed,
        drawn=fresh.drawn,
        failures=fresh.failures,
        violations=judge.violations(point),
        margins=margins,
        no_margins=no_margins,
        audit=audit,
        tolerances=drifts,
        neighbourhood=neighbourhood(fresh, values, drifts),
        trajectories=fresh.trajectories - before,
        seconds=time.perf_counter() - begin,
    )


def _margins(design: Design) -> tuple[dict[str, Any], str]:
    try:
        found = loop(design).summary()
    except InputError as error:
        return {}, str(error)
    return {key: found[key] for key in MARGINS}, ""


def _audit(design: Design, fresh: Fresh, runs: FreshRuns, count: int, progress: Progress) -> Audit:
    """Some draws by the reference solver, spread over what lies under the level and beyond."""
    numbers = choose_cells(runs.j1, (runs.level,), count)
    design = beyond_the_table(design, tuple(fresh.drawn))
    designs = [
        design.replace({path: units.SI(column[n]) for path, column in fresh.drawn.items()})
        for n in numbers.tolist()
    ]
    return Audit(numbers, runs.j1[numbers], references(designs, progress))
