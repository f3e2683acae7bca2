"""Linear robust design: gains with the largest friction-slope margin over a set of loops.

Starts spread over the bounds are looked at on the frequency grid. From the best of them programs
(`linear_nlp.py`) are solved within a reach that grows where a program was right about what it
promised and shrinks where other crossings had become the lowest: a trust region whose model is
exact but for the crossings that it does not know of.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from drillctl.arrays import Array
from drillctl.design import Design
from drillctl.ensemble.parameters import draw
from drillctl.errors import InputError
from drillctl.linear.loop_analysis import tolerated_slope
from drillctl.store.codec import documented, label
from drillctl.store.json_files import picked, strict
from drillctl.studies.tune.linear_nlp import PRICE, LinearProgram
from drillctl.studies.tune.loops import least_seen, loops_of, refuse_not_linear
from drillctl.studies.tune.requirements import Loops, LoopsState
from drillctl.studies.tune.settings import TuneConstraintsTable
from drillctl.studies.tune.tuned import (
    Tuned,
    TunedGains,
    by_path,
    designs_at,
    put,
    spread,
    tuned_parameters,
    unmet,
)

LOOKED_AT = 48  # starts that are looked at on the grid, for each tuned parameter
LOOPS_LOOKED_AT = 4  # loops at which they are
STARTS = 2
"""Of them, followed further; never two within `APART` of each other, over the bounds' width."""
APART = 0.15
FIRST_REACH = 0.25  # longest first step over the bounds' width
SHORTEST_REACH = 1e-6  # and the reach at which a search ends
LEAST_GAIN = 1e-6  # gain of a program, over what there is, under which it ends too
PROGRAMS = 25  # most programs from one start
KEPT = 1e-6  # violation that is rounding


@dataclass(frozen=True, eq=False)
@documented
class LinearDesign(TunedGains):
    """Gains of the linear design."""

    design: Design = label(means="with the gains put in")
    tuned: tuple[Tuned, ...] = label(means="what was tuned")
    values: Array = label(
        "parameter", means="tuned values (SI); of an infeasible problem the closest ones"
    )
    loops: int = label(means="how many loops they hold for")
    excess: float = label(
        unit="N*m*s/rad", means="least slope margin less slope of the rock over the loops"
    )
    slope_margin: float = label(unit="N*m*s/rad", means="D* of the design itself with these gains")
    deciding_frequency_hz: float = label(unit="Hz", means="of the poles that decide it")
    violations: dict[str, float] = label(
        means="requirements that are missed, with how far; empty for a feasible design. Slopes "
        "count over the steepest slope of the rock, sensitivities over their limit, damping ratios "
        "as they are"
    )
    message: str = label(means="the result, or what could not be met")
    starts: list[dict[str, Any]] = label(means="what each start led to")
    programs: int = label(means="nonlinear programs solved")
    seconds: float = label(unit="s", means="time that it took")
    processor_seconds: float = label(unit="s", means="processor time that it took")

    def summary(self) -> dict[str, Any]:
        """Strict JSON values, SI."""
        figures = picked(
            self, "gains", "excess", "slope_margin", "deciding_frequency_hz", "loops", "feasible",
            "violations", "message", "programs", "seconds",
        )  # fmt: skip
        return dict(strict(figures))


def linear_design(
    design: Design,
    strings: int = 0,
    seed: int | None = None,
    asked: TuneConstraintsTable | None = None,
    verbose: bool = False,
) -> LinearDesign:
    """Find the gains of the largest slope margin.

    Parameters
    ----------
    design : Design
        Its `[tune]` table names what is tuned, its bounds and what is required.
    strings : int
        Draws of what `[uncertain]` names that the gains must hold for besides the design itself.
    seed : int, optional
        Of the draws; by default that of `[tune]`.
    asked : TuneConstraintsTable, optional
        Requirements instead of those of `[tune]`.
    verbose : bool
        Let IPOPT print.

    Returns
    -------
    LinearDesign
        Requirements that cannot be met are stated in its message, with the closest point.

    Raises
    ------
    InputError
        A parameter that the linear loop does not know, or bounds within which no loop is stable.
    """
    begin, processor = time.perf_counter(), time.process_time()
    tuned = tuned_parameters(design)
    refuse_not_linear(design, tuned)
    asked = design.tables.tune.constraints if asked is None else asked
    designs = [design]
    if strings:
        seed = design.tables.tune.seed if seed is None else seed
        designs += designs_at(design, draw(design, strings, seed))
    loops = loops_of(designs, tuned)
    problem = Loops(tuned, loops, asked)
    program = LinearProgram(problem, verbose)
    followed = [_followed(problem, program, start) for start in _starts(problem)]
    if not followed:
        raise InputError(
            "no loop between the bounds of the tuned parameters is stable without falling friction",
            "tune.parameters",
        )
    best = min(followed, key=_merit)
    return _result(design, problem, best, followed, program.solves, begin, processor)


def _result(
    design: Design,
    problem: Loops,
    best: LoopsState,
    followed: list[LoopsState],
    programs: int,
    begin: float,
    processor: float,
) -> LinearDesign:
    variant = put(design, problem.tuned, best.values)
    margin, omega = tolerated_slope(variant, variant.speed)
    missed = {key: value for key, value in best.violations.items() if value > KEPT}
    starts = [
        {"gains": by_path(problem.tuned, s.values), "excess": s.excess, "violation": s.violation}
        for s in followed
    ]
    return LinearDesign(
        design=variant,
        tuned=problem.tuned,
        values=best.values,
        loops=len(problem.loops),
        excess=best.excess,
        slope_margin=margin,
        deciding_frequency_hz=omega / (2.0 * math.pi),
        violations=missed,
        message=_message(best, missed),
        starts=starts,
        programs=programs,
        seconds=time.perf_counter() - begin,
        processor_seconds=time.process_time() - processor,
    )


def _message(best: LoopsState, missed: dict[str, float]) -> str:
    at = ", ".join(f"{k} = {v:.6g}" for k, v in by_path(best.problem.tuned, best.values).items())
    if missed:
        return unmet(at, missed)
    if best.excess < 0.0:
        return (
            f"no gains between these bounds are stable: at the best gains, {at}, the slope of the "
            f"rock exceeds the slope margin by {-best.excess:.4g} N m s/rad"
        )
    return f"largest slope margin at {at}: {best.excess:.4g} N m s/rad above the slope of the rock"


def _starts(problem: Loops) -> list[LoopsState]:
    """The best of many gains, apart from each other, that are stable without slope."""
    tuned, loops = problem.tuned, problem.loops
    looked = loops[:: max(1, len(loops) // LOOPS_LOOKED_AT)][:LOOPS_LOOKED_AT]
    points = spread(tuned, LOOKED_AT * len(tuned))
    excess = [min(least_seen(x, by_path(tuned, p)) - x.slope for x in looked) for p in points]
    width = np.array([t.high - t.low for t in tuned])
    chosen: list[LoopsState] = []
    for k in np.argsort(-np.array(excess), kind="stable"):
        far = all(np.max(np.abs(points[k] - s.values) / width) > APART for s in chosen)
        if not far:
            continue
        state = problem.at(points[k])
        if math.isfinite(state.excess):
            chosen.append(state)
        if len(chosen) == STARTS:
            break
    return chosen


def _merit(state: LoopsState) -> float:
    """What a search lowers: the margin, less what requirements are missed by."""
    return -state.excess / state.problem.scale + PRICE * state.violation


def _followed(problem: Loops, program: LinearProgram, state: LoopsState) -> LoopsState:
    """The end of a search from one start."""
    reach = FIRST_REACH
    for _ in range(PROGRAMS):
        trial = problem.at(program.step(state, reach))
        gain = _merit(state) - _merit(trial)
        if not gain > 0.0:
            reach *= 0.25
            if reach < SHORTEST_REACH:
                break
            continue
        state = trial
        if gain < LEAST_GAIN * (1.0 + abs(_merit(state))):
            break
        reach = min(2.0 * reach, 1.0)
    return state
