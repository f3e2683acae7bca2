"""The search of gains with the least objective: a first look, a race, a population, a polish.

1. *First look*: gains spread over the bounds, each at a few realizations, by the batch engine.
2. *Race*: the better part goes on to more realizations.
3. *Population*: differential evolution among what is left, which moves along a narrow valley
   whatever its direction.
4. *Polish*: a pattern search at all realizations, down to a thousandth of the bounds' width, from
   the best of the population, and from the best of the gains known before where these come near:
   the design's own and those of the linear design, or those of a neighbour.

All gains meet the same realizations, so that differences are of gains. The known gains stay out of
the population: they would draw all of it into their valley, though others may be deeper. Where a
law contains another, whose valley is a thousandth of its bounds, it must never end above that one:
the study of the advantage polishes known gains however far they are behind.

J1 jumps where a stick event appears or goes, and the derivatives of its trajectories do not show
it; docs/robust-gains.md has what a search by derivatives took, for the same gains or worse.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

import numpy as np

from drillctl.arrays import Array
from drillctl.design import Design
from drillctl.errors import InputError
from drillctl.progress import SILENT, Progress
from drillctl.store.codec import documented, label
from drillctl.store.json_files import picked
from drillctl.studies.tune.linear_design import LinearDesign, linear_or_why
from drillctl.studies.tune.problem import ALIKE, GainProblem, Point, alike
from drillctl.studies.tune.tuned import (
    Tuned,
    TunedGains,
    by_path,
    put,
    spelled,
    spread,
    tuned_parameters,
    unmet,
)

LOOK = (64, 300, 500, 800)
"""Gains of the first look by the number of parameters; more have as many as four."""
RACE = (("first look", 16, 80), ("race", 64, 16))
"""Rounds of the race: realizations, and how many gains are kept after it."""
GENERATIONS, AMONG = 20, 100  # of the population, and realizations that it lives among
CROSSING = 0.9  # share of the parameters of a trial that are changed
NEAR = 1.2
"""Merit of known gains, over that of the population's end, up to which they are polished too."""
APART = 0.05
"""Least distance of two ends of the population that are polished, over the bounds' width."""
FIRST_STEP, LAST_STEP = 0.01, 1e-3  # of the polish, over the bounds' width
ROUNDS = 14  # most rounds of it

_merit = attrgetter("merit")
Note = Callable[[str, Sequence[Point]], None]
"""Receives the name of a stage that is over and its points, the best first."""


def optimum(
    problem: GainProblem, known: Sequence[Array] = (), near: float = math.inf, ends: int = 1,
    note: Note = lambda stage, points: None,
) -> Point:  # fmt: skip
    """Gains of the least objective, at all realizations.

    `ends`: how many of the population are polished, if they are apart. Of the gains `known` before
    (SI) the best is polished too, where its merit is within `near` times that of the population.
    """
    points = spread(problem.tuned, LOOK[min(len(problem.tuned), len(LOOK)) - 1])
    for stage, count, kept in RACE:
        field_ = sorted(problem.points(points, min(count, len(problem))), key=_merit)
        points = np.stack([point.values for point in field_[:kept]])
        note(stage, field_)
    population = _evolved(problem, points)
    note("population", population)
    starts = [problem.at_all(point) for point in _apart(problem, population, ends)]
    least = min(start.merit for start in starts)
    near_starts = [start for start in starts if start.merit <= NEAR * least]
    best = min((polished(problem, start) for start in near_starts), key=_merit)
    inside = [problem.values(problem.shares(np.asarray(one, dtype=float))) for one in known]
    if inside:
        other = min(problem.points(np.stack(inside), len(problem)), key=_merit)
        if other.merit <= near * best.merit:
            best = min(best, polished(problem, other), key=_merit)
    note("polish", [best])
    return best


def _evolved(problem: GainProblem, points: Array) -> list[Point]:
    """A population after some generations, the best first."""
    # Differential evolution (Storn & Price, J. Global Optim. 11 (1997) 341-359), the variant that
    # leans to the best (current-to-best/1): a batch of trials at a time is what the engine likes,
    # and differences within a population lie along the valley that it has settled in.
    random, count = np.random.Generator(np.random.Philox(0)), min(AMONG, len(problem))
    population = problem.points(points, count)
    size, n = len(population), len(problem.tuned)
    for _ in range(GENERATIONS):
        shares = np.stack([problem.shares(point.values) for point in population])
        best = shares[int(np.argmin([point.merit for point in population]))]
        pairs = np.stack([random.permutation(size)[:2] for _ in range(size)])
        scale = random.uniform(0.4, 0.9, (size, 1))
        moved = shares + scale * (best - shares + shares[pairs[:, 0]] - shares[pairs[:, 1]])
        taken = random.random((size, n)) < CROSSING
        trials = problem.points(problem.values(np.where(taken, moved, shares)), count)
        population = [min(pair, key=_merit) for pair in zip(population, trials, strict=True)]
    return sorted(population, key=_merit)


def _apart(problem: GainProblem, points: list[Point], most: int) -> list[Point]:
    """The first of some points that are apart from each other."""
    chosen: list[Point] = []
    for point in points:
        at = problem.shares(point.values)
        if all(np.max(np.abs(at - problem.shares(one.values))) > APART for one in chosen):
            chosen.append(point)
    return chosen[:most]


def polished(problem: GainProblem, start: Point) -> Point:
    """The end of a pattern search (Hooke & Jeeves 1961) from a point, at all realizations.

    A step each way along every axis and along the direction that the last round gained by; half
    the step where nothing is gained. It needs no slope, and goes on where J1 jumps.
    """
    best, step = problem.at_all(start), FIRST_STEP
    gained = np.zeros(len(best.values))
    for _ in range(ROUNDS):
        trials = problem.points(_around(problem, best, step, gained), len(problem))
        result = min(trials, key=_merit)
        if result.merit < best.merit:
            gained = problem.shares(result.values) - problem.shares(best.values)
            best = result
            continue
        gained = np.zeros(len(best.values))
        step *= 0.5
        if step < LAST_STEP:
            break
    return best


def _around(problem: GainProblem, best: Point, step: float, gained: Array) -> Array:
    """Points a step away along every axis, and twice what was gained last."""
    n, at = len(best.values), problem.shares(best.values)
    moves = [sign * step * np.eye(n)[k] for k in range(n) for sign in (1.0, -1.0)]
    if gained.any():
        moves.append(2.0 * gained)
    elif n == 2:  # a valley lies across the axes more often than not
        moves += [step * np.array([a, b]) for a in (0.7, -0.7) for b in (0.7, -0.7)]
    points = np.stack([problem.values(at + move) for move in moves])
    return points[np.any(points != best.values, axis=1)]


@dataclass(frozen=True, eq=False)
@documented
class Tuning(TunedGains):
    """Gains of a search, not certified yet."""

    value: float = label(unit="s", means="objective at all realizations of the search")
    share: float = label(means="share of them with J1 at or under the level")
    realizations: int = label(means="how many could be run")
    trajectories: int = label(means="runs of the batch engine")
    stages: list[dict[str, Any]] = label(means="what each stage led to, and runs until then")

    def summary(self) -> dict[str, Any]:
        """Strict JSON values, SI."""
        table = self.design.tables.tune
        figures = picked(
            self, "gains", "value", "share", "feasible", "violations", "realizations",
            "trajectories", "stages", "message", "seconds", "processor_seconds",
        )  # fmt: skip
        return {"objective": table.objective_name, "level": table.level, **figures}


def search(
    design: Design, progress: Progress = SILENT, verbose: bool = False,
    linear: LinearDesign | InputError | None = None,
) -> Tuning:  # fmt: skip
    """Search the gains of the least objective; `linear`: the linear design, where it is known."""
    begin, processor = time.perf_counter(), time.process_time()
    problem = search_problem(design, tuned_parameters(design))
    stages: list[dict[str, Any]] = []

    def note(stage: str, points: Sequence[Point]) -> None:
        progress.advance(1)
        best = points[0]
        if not stages and len(points) > 1 and alike(points):
            raise InputError(
                f"nothing between the bounds of {' and '.join(t.path for t in problem.tuned)} "
                f"changes the objective, {best.value:.4g} s, by more than {ALIKE:.0e} of it: "
                "there is nothing to tune",
                "tune.parameters",
            )
        stages.append({
            "stage": stage, "best": by_path(problem.tuned, best.values), "merit": best.merit,
            "realizations": best.realizations, "trajectories": problem.trajectories,
        })  # fmt: skip

    progress.begin("tuning", len(RACE) + 2)
    linear = linear or linear_or_why(design, verbose)
    asked = (problem.own(design), getattr(linear, "values", None))
    known = [one for one in asked if one is not None]
    best = optimum(problem, known, NEAR, problem.table.starts, note)
    missed = problem.violations(best)
    return Tuning(
        design=put(design, problem.tuned, best.values),
        tuned=problem.tuned,
        values=best.values,
        value=best.value,
        share=best.share,
        violations=missed,
        realizations=len(problem),
        trajectories=problem.trajectories,
        stages=stages,
        message=_message(problem, best, missed),
        seconds=time.perf_counter() - begin,
        processor_seconds=time.process_time() - processor,
    )


def search_problem(design: Design, tuned: tuple[Tuned, ...]) -> GainProblem:
    """The problem of a search: its realizations, `fast` unless a step is given."""
    if design.tables.simulation.step is None:
        design = design.replace({"simulation.accuracy": "fast"})
    return GainProblem(design, tuned)


def _message(problem: GainProblem, best: Point, missed: dict[str, float]) -> str:
    at = spelled(problem.tuned, best.values)
    table = problem.table
    if missed:
        return unmet(at, missed) + " of its limit"
    if best.share < table.probability:
        return (
            f"no gains between these bounds have J1 <= {table.level:g} s with probability "
            f"{table.probability:g}: at the best gains, {at}, it is {best.share:.3f} over "
            f"{best.realizations} realizations"
        )
    return f"least {table.objective} of J1: {best.value:.4g} s at {at}"
