"""Gains with the least objective over the realizations: a first look, a race, a trust region.

1. *First look*: gains spread over the bounds, each at a few realizations, by the batch engine;
   besides them the design's own gains and those of the linear design.
2. *Race*: the better part goes on to more realizations, until few are left.
3. *Trust region* (`trust_region.py`) from the best that are apart, with CasADi's derivatives at
   some of the realizations, then from the best of those at all of them.
4. *Polish* (`polish.py`): steps along the axes and along what they have gained, at all
   realizations, down to a thousandth of the bounds' width.

All gains meet the same realizations, so that differences are of gains. Whatever the model of a
trust region promises, the batch engine decides.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design
from drillctl.errors import InputError
from drillctl.progress import SILENT, Progress
from drillctl.studies.robust.crossings import by_path
from drillctl.studies.robust.judge import Judge, Point
from drillctl.studies.robust.linear_design import linear_design
from drillctl.studies.robust.polish import polished
from drillctl.studies.robust.spread import spread
from drillctl.studies.robust.trust_region import Derivatives, descended
from drillctl.studies.robust.tuned import Tuned, put, tuned_parameters

if TYPE_CHECKING:
    from pathlib import Path

Array = NDArray[np.float64]

FIRST = {1: 64, 2: 400, 3: 800}
"""Gains of the first look by the number of parameters; more have as many as three."""
RACE = ((16, 4), (64, 6), (256, 0))
"""Realizations of each round, and by how much the field is divided after it; the last leaves the
starts."""
APART = 0.05
"""Least distance of two starts over the bounds' width."""


@dataclass(frozen=True, eq=False)
class Tuning:
    """Gains found by a search, not certified yet.

    Attributes
    ----------
    design : Design
        With the gains put in.
    tuned : tuple of Tuned
        What was tuned.
    values : ndarray, shape (parameters,)
        Their values (SI); where requirements cannot be met, of the closest point found.
    value : float
        Objective at all realizations of the search (s).
    share : float
        Share of them with J1 at or under the level.
    violations : dict
        Requirements that are missed, over their limits.
    realizations : int
        How many could be run.
    trajectories : int
        Runs of the batch engine, and of CasADi with each direction of a derivative as one more.
    stages : list of dict
        What each stage led to, and the trajectories until then.
    message : str
        What was found.
    derivatives : str
        How they were taken, or why not.
    seconds, processor_seconds : float
        Time that it took (s).
    """

    design: Design
    tuned: tuple[Tuned, ...]
    values: Array
    value: float
    share: float
    violations: dict[str, float]
    realizations: int
    trajectories: int
    stages: list[dict[str, Any]]
    message: str
    derivatives: str
    seconds: float
    processor_seconds: float

    @property
    def feasible(self) -> bool:
        """Whether every requirement is kept."""
        return not self.violations

    @property
    def gains(self) -> dict[str, float]:
        """Values by path (SI)."""
        return by_path(self.tuned, self.values)

    def summary(self) -> dict[str, Any]:
        """Strict JSON values, SI."""
        table = self.design.tables.tune
        return {
            "gains": self.gains,
            "objective": table.objective
            + (f" {table.quantile:g}" if table.objective in ("quantile", "cvar") else ""),
            "value": self.value,
            "level": table.level,
            "share": self.share,
            "feasible": self.feasible,
            "violations": self.violations,
            "realizations": self.realizations,
            "trajectories": self.trajectories,
            "stages": self.stages,
            "derivatives": self.derivatives,
            "message": self.message,
            "seconds": self.seconds,
            "processor_seconds": self.processor_seconds,
        }

    def save(self, folder: str | Path) -> Path:
        """Write the design with its gains as a new design file, ready to run, and the summary."""
        from drillctl.studies.robust.saving import save_design

        return save_design(self.design, self.summary(), folder)


@dataclass
class _Log:
    """Stages as they end."""

    judge: Judge
    progress: Progress
    stages: list[dict[str, Any]] = field(default_factory=list)

    def note(self, name: str, best: Point, **more: Any) -> None:
        """A stage is over."""
        self.progress.advance(1)
        self.stages.append({
            "stage": name, "best": by_path(self.judge.tuned, best.values), "merit": best.merit,
            "realizations": best.realizations, "trajectories": self.judge.trajectories, **more,
        })  # fmt: skip


def search(
    design: Design, progress: Progress = SILENT, derivatives: bool = True, verbose: bool = False
) -> Tuning:
    """Search the gains of the least objective.

    Parameters
    ----------
    design : Design
        Its `[tune]` table says what is tuned and to what end, `[uncertain]` what is drawn. Step
        and modes are those of accuracy `fast` unless the design gives a step.
    progress : Progress
        Told of finished stages.
    derivatives : bool
        Whether to take trust-region steps by derivatives, where the laws allow it.
    verbose : bool
        Let IPOPT print.

    Returns
    -------
    Tuning
        A level that no gains reach, or requirements that none meet, are told in its message.

    Raises
    ------
    InputError
        A parameter that does not exist, bounds reversed, or no realization that a rig can have.
    """
    begin, processor = time.perf_counter(), time.process_time()
    tuned = tuned_parameters(design)
    judge = searching_judge(design, tuned)
    log = _Log(judge, progress)
    progress.begin("tuning", 5)
    field_ = _race(judge, _first_look(judge, design, verbose), log)
    made = Derivatives.of(judge) if derivatives else "not asked for"
    if isinstance(made, Derivatives):
        ends = [descended(judge, made, start) for start in field_]
        best = min((judge.at_all(point) for point in ends), key=_merit)
        log.note("trust region", best, starts=len(field_))
        best = descended(judge, made, best)
        log.note("trust region at all realizations", best)
    else:
        best = min((judge.at_all(point) for point in field_), key=_merit)
    best = polished(judge, best)
    log.note("polish", best)
    how = made if isinstance(made, str) else "forward mode of CasADi through the scheme"
    return _told(design, judge, best, log, how, begin, processor)


def searching_judge(design: Design, tuned: tuple[Tuned, ...]) -> Judge:
    """What a search judges gains by: its realizations, `fast` unless a step is given."""
    if design.tables.simulation.step is None:
        design = design.replace({"simulation.accuracy": "fast"})
    return Judge(design, tuned)


def _merit(point: Point) -> float:
    return point.merit


def _first_look(judge: Judge, design: Design, verbose: bool) -> Array:
    """Gains of the first look, shape (points, parameters)."""
    points = spread(judge.tuned, FIRST[min(len(judge.tuned), 3)])
    more = [judge.own(design), _linear(design, verbose)]
    return np.vstack([points, *(point for point in more if point is not None)])


def _linear(design: Design, verbose: bool) -> Array | None:
    """Gains of the linear design, where it knows what is tuned."""
    try:
        return linear_design(design, verbose=verbose).values
    except InputError:
        return None


def _race(judge: Judge, points: Array, log: _Log) -> list[Point]:
    """The starts that are left of many gains."""
    names = {0: "first look"}
    for round_, (count, divisor) in enumerate(RACE):
        count = min(count, len(judge))
        found = judge.points(points, count)
        found.sort(key=_merit)
        log.note(names.get(round_, f"race, round {round_}"), found[0], gains=len(points))
        if divisor:
            kept = max(len(points) // divisor, judge.table.starts)
            points = np.stack([point.values for point in found[:kept]])
    chosen: list[Point] = []
    for point in found:
        apart = [
            np.max(np.abs(judge.shares(point.values) - judge.shares(c.values))) for c in chosen
        ]
        if all(distance > APART for distance in apart):
            chosen.append(point)
        if len(chosen) == judge.table.starts:
            break
    return chosen


def _told(
    design: Design, judge: Judge, best: Point, log: _Log, how: str, begin: float, processor: float
) -> Tuning:
    missed = judge.violations(best)
    return Tuning(
        design=put(design, judge.tuned, best.values),
        tuned=judge.tuned,
        values=best.values,
        value=best.value,
        share=best.share,
        violations=missed,
        realizations=len(judge),
        trajectories=judge.trajectories,
        stages=log.stages,
        message=_message(judge, best, missed),
        derivatives=how,
        seconds=time.perf_counter() - begin,
        processor_seconds=time.process_time() - processor,
    )


def _message(judge: Judge, best: Point, missed: dict[str, float]) -> str:
    at = ", ".join(f"{k} = {v:.6g}" for k, v in by_path(judge.tuned, best.values).items())
    table = judge.table
    if missed:
        worst = max(missed, key=lambda key: missed[key])
        return (
            f"the requirements cannot all be met between these bounds: at the closest point found, "
            f"{at}, {', '.join(missed)} {'is' if len(missed) == 1 else 'are'} missed, "
            f"{worst} by {missed[worst]:.3g} of its limit"
        )
    if best.share < table.probability:
        return (
            f"no gains between these bounds have J1 <= {table.level:g} s with probability "
            f"{table.probability:g}: at the best found, {at}, it is {best.share:.3f} over "
            f"{best.realizations} realizations"
        )
    return f"least {table.objective} of J1 found: {best.value:.4g} s at {at}"
