"""Robust gains in one go: searched, certified, compared with what one would have without.

Baselines are other gains and other laws at the same fresh draws. Where one does not apply, the
reason stands in its place.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from drillctl import units
from drillctl.arrays import Array
from drillctl.design import Design, load, parameter, tuned_ranges
from drillctl.ensemble.grid import Axis
from drillctl.ensemble.sweeps import sweep
from drillctl.errors import InputError
from drillctl.progress import SILENT, Progress
from drillctl.rig.top_drive.law import drive_laws
from drillctl.store.codec import label
from drillctl.store.json_files import picked
from drillctl.store.result import Timed, timed
from drillctl.studies.tune.certificate import Certificate, FreshDraws, FreshRuns, certified
from drillctl.studies.tune.linear_design import LinearDesign, linear_or_why
from drillctl.studies.tune.problem import PRICE, GainProblem
from drillctl.studies.tune.search import Tuning, search, search_problem
from drillctl.studies.tune.tuned import Tuned, by_path, spelled, tuned_parameters


@dataclass(frozen=True, eq=False)
class Tune(Timed, kind="tune"):
    """Gains with their certificate."""

    design: Design = label(means="as it was given")
    tuning: Tuning = label(means="gains of the search, at its own realizations")
    certificate: Certificate = label(flat=True, means="the gains at fresh realizations")
    baselines: tuple[Baseline, ...] = label(
        over="baseline", name="baseline", means="other gains and laws at the same realizations"
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
        return f"{result}; the closest is {spelled(self.tuning.tuned, self.tuning.values)}"

    @property
    def _nearer(self) -> str:
        """The baseline that keeps the level most often, if more often than the tuned gains."""
        # The least quantile is blind to the probability where no gains reach the level.
        run = [one for one in self.baselines if one.runs is not None]
        best = max(run, key=lambda one: one.runs.hits if one.runs else 0, default=None)
        if best is None or best.runs is None or best.runs.hits <= self.certificate.runs.hits:
            return ""
        reaches = best.runs.interval[0] >= self.certificate.required
        said = f"{best.name!r} {'meets it with' if reaches else 'has'} {best.runs.probability:.4f}"
        return f" (the baseline {said} at the same draws)"

    @property
    def on_bounds(self) -> tuple[str, ...]:
        """Where the search ended at an end of its range, and how far another may go, in words."""
        rig = tuned_ranges(self.design)
        texts = []
        for one, value in zip(self.tuning.tuned, self.tuning.values, strict=True):
            near = ON_BOUND * (one.high - one.low)
            least, most = rig.get(one.path, (0.0, 0.0))
            if one.high - value <= near:
                end, further = one.high, max(2.0 * one.high - one.low, most)
            elif value - one.low <= near and one.low > least:
                end, further = one.low, least
            else:
                continue
            if not _allowed(self.design, one.path, further):
                continue
            at, end_, beyond = (units.full(x, one.unit) for x in (value, end, further))
            texts.append(
                f"{one.path} = {at} lies at the end of its range, {end_}: better values "
                f"may lie beyond; search as far as {beyond} with [tune.parameters]"
            )
        return tuple(texts)

    def summary(self) -> dict[str, Any]:
        """Strict JSON values, SI: of the search, with `certificate` and `baselines`."""
        result = self.tuning.summary()
        result["message"] = self.message
        return result | {
            "passed": self.passed,
            "on_bounds": list(self.on_bounds),
            "search_message": self.tuning.message,
            "certificate": self.certificate.summary(),
            "baselines": {one.name: one.summary() for one in self.baselines},
            "total_seconds": self.total_seconds,
        }

    def requested(self) -> tuple[Design, dict[str, Any]]:
        """Whether a grid was gone through as well."""
        grid = any(one.name == "exhaustive grid" for one in self.baselines)
        return self.design, {"exhaustive": True} if grid else {}


def _allowed(design: Design, path: str, value: float) -> bool:
    """Whether a design may hold a value (SI): shares end at 1, and most numbers at 0."""
    try:
        design.replace({path: units.SI(value)})
    except InputError:
        return False
    return True


@timed
def tune(
    design: Design, exhaustive: bool = False, progress: Progress = SILENT, verbose: bool = False
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
    tuned = tuned_parameters(design)
    fresh = FreshDraws(design, tuned)  # an impossible certificate is refused before the search
    linear = linear_or_why(design, verbose)
    result = search(design, progress, verbose, linear)
    grid = search_problem(design, tuned) if exhaustive else None
    return Tune(
        design=design,
        tuning=result,
        certificate=certified(result.design, fresh, result.values, progress),
        baselines=baselines(design, fresh, linear, grid, progress),
    )


PAPER = {"controller.kp": 200.0, "controller.ki": 100.0}
"""Gains that Monteiro & Trindade (2012) begin with (N m s/rad, N m/rad)."""
PAPER_RIG = "monteiro-trindade-2012"
OTHER_LAWS = {"soft torque": "soft-torque", "Z-torque": "z-torque", "stiff speed": "stiff-speed"}
"""Laws at their default tuning."""
ANY_OTHER = {"soft-torque": "stiff-speed", "z-torque": "stiff-speed", "stiff-speed": "soft-torque"}
"""A law to change to on the way, which drops the numbers that a law has already."""
POINTS = 41  # along each axis of a grid
ON_BOUND = 0.01  # share of a range within which a tuned value counts as lying at its end
MOST_AXES = 2  # of a grid that is gone through


@dataclass(frozen=True, eq=False)
class Baseline:
    """Gains or a law beside the tuned ones."""

    name: str  # what it is
    gains: dict[str, Any]  # by path (SI); of another law its name, and those that it has too
    runs: FreshRuns | None  # at the fresh draws; None where it does not apply
    reason: str  # why it does not
    # of a search of its own: value (s) where it searched, trajectories, seconds
    search: dict[str, float]

    def summary(self) -> dict[str, Any]:
        """Strict JSON values, SI."""
        summary: dict[str, Any] = {"gains": self.gains, "reason": self.reason or None}
        if self.runs is not None:
            summary |= picked(self.runs, "value", "probability", "quantiles")
            summary["interval_95"] = list(self.runs.interval)
        return summary | ({"search": self.search} if self.search else {})


def baselines(
    design: Design, fresh: FreshDraws, linear: LinearDesign | InputError,
    exhaustive: GainProblem | None, progress: Progress = SILENT,
) -> tuple[Baseline, ...]:  # fmt: skip
    """What the tuned gains are compared with."""
    made = [
        ("as designed", lambda: _own(design, fresh)),
        ("paper's gains", lambda: _paper(design, fresh)),
        ("largest slope margin", lambda: _linear(linear, fresh)),
        ("least nominal J1", lambda: _nominal(design, fresh)),
        *((name, lambda law=law: _law(design, law, fresh)) for name, law in OTHER_LAWS.items()),
    ]
    if exhaustive is not None:
        made.append(("exhaustive grid", lambda: _exhaustive(exhaustive, fresh)))
    progress.begin("baselines", len(made))
    results = []
    for name, make in made:
        try:
            gains, runs, more = make()
            results.append(Baseline(name, gains, runs, "", more))
        except InputError as error:
            results.append(Baseline(name, {}, None, error.problem, {}))
        progress.advance(1)
    return tuple(results)


Made = tuple[dict[str, Any], FreshRuns, dict[str, float]]


def _own(design: Design, fresh: FreshDraws) -> Made:
    tuned = fresh.problem.tuned
    gains = {t.path: parameter(design, t.path).value for t in tuned}
    if any(value is None for value in gains.values()):  # by a rule of its law
        return gains, fresh.of_design(design), {}
    # The same runs; the draws are not made again.
    return gains, fresh.of_gains(np.array([gains[t.path] for t in tuned], dtype=float))[1], {}


def _paper(design: Design, fresh: FreshDraws) -> Made:
    if design.tables.controller.law != "pi":
        raise InputError(f"gains of a PI; the law is {design.tables.controller.law}")
    if design.string.parts != load(PAPER_RIG).string.parts:
        raise InputError("gains of the rig of Monteiro & Trindade (2012); this is another one")
    other = design.replace(dict(PAPER))
    if set(PAPER) <= {t.path for t in fresh.problem.tuned}:
        return dict(PAPER), _own(other, fresh)[1], {}
    return dict(PAPER), fresh.of_design(other), {}


def _law(design: Design, law: str, fresh: FreshDraws) -> Made:
    """A law at its default tuning; the drive around it stays."""
    other = design.replace({"controller.law": ANY_OTHER[law]}).replace({"controller.law": law})
    numbers = drive_laws()[law].controller(other.tables.controller, other.string)._asdict()
    paths = {f"controller.{key}": float(value) for key, value in numbers.items()}
    gains = {t.path: paths[t.path] for t in fresh.problem.tuned if t.path in paths}
    return {"law": law, **gains}, fresh.of_design(other), {}


def _linear(result: LinearDesign | InputError, fresh: FreshDraws) -> Made:
    if isinstance(result, InputError):
        raise result
    return result.gains, fresh.of_gains(result.values)[1], {"slope_margin": result.slope_margin}


def _nominal(design: Design, fresh: FreshDraws) -> Made:
    begin, tuned = time.perf_counter(), fresh.problem.tuned
    axes = tuple(Axis(t.path, t.unit, line) for t, line in zip(tuned, _lines(tuned), strict=True))
    result = sweep(design, axes, audit_cells=0, measures=("j1",))
    if result.minimum is None:
        raise InputError("no cell of the nominal map gives a finite answer")
    j1, at = result.minimum
    values = np.array([at[t.path] for t in tuned])
    more = {"value": j1, "trajectories": result.j1.size, "seconds": time.perf_counter() - begin}
    return by_path(tuned, values), fresh.of_gains(values)[1], more


def _lines(tuned: tuple[Tuned, ...]) -> list[Array]:
    if len(tuned) > MOST_AXES:
        raise InputError(f"a grid goes over {MOST_AXES} parameters, {len(tuned)} are tuned")
    return [np.linspace(t.low, t.high, POINTS) for t in tuned]


def _exhaustive(problem: GainProblem, fresh: FreshDraws) -> Made:
    """The best of a grid by the plain objective at all realizations of the search."""
    begin, before = time.perf_counter(), problem.trajectories
    grid = np.meshgrid(*_lines(problem.tuned), indexing="ij")
    cells = np.stack([column.ravel() for column in grid], axis=1)
    least, best = np.inf, cells[0]
    value = np.inf
    for first in range(0, len(cells), POINTS):
        for point in problem.points(cells[first : first + POINTS], len(problem)):
            merit = point.value + PRICE * sum(problem.violations(point).values())
            if merit < least:
                least, best, value = merit, point.values, point.value
    more = {
        "value": value,
        "trajectories": problem.trajectories - before,
        "seconds": time.perf_counter() - begin,
    }
    return by_path(problem.tuned, best), fresh.of_gains(best)[1], more
