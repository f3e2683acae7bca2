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
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design
from drillctl.ensemble.parameters import draw
from drillctl.errors import InputError
from drillctl.linear.loop_analysis import tolerated_slope
from drillctl.studies.tune.linear_nlp import PRICE, LinearProgram
from drillctl.studies.tune.loops import Loop, least_seen, loops_of, refuse_not_linear
from drillctl.studies.tune.requirements import Loops, LoopsState
from drillctl.studies.tune.settings import TuneConstraintsTable
from drillctl.studies.tune.tuned import (
    Tuned,
    by_path,
    designs_at,
    put,
    save_design,
    spread,
    tuned_parameters,
)

if TYPE_CHECKING:
    from pathlib import Path

Array = NDArray[np.float64]

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
class LinearDesign:
    """Gains found by the linear design.

    Attributes
    ----------
    design : Design
        With the gains put in.
    tuned : tuple of Tuned
        What was tuned.
    values : ndarray, shape (parameters,)
        Their values (SI); of an infeasible problem the closest that was found.
    loops : int
        How many loops they hold for.
    excess : float
        Least slope margin less slope of the rock over the loops (N m s/rad).
    slope_margin : float
        D* of the design itself with these gains (N m s/rad).
    deciding_frequency_hz : float
        Frequency of the poles that decide it (Hz).
    violations : dict
        Requirements that are missed, with how far; empty for a feasible design. Slopes count over
        the steepest slope of the rock, sensitivities over their limit, damping ratios as they are.
    message : str
        What was found, or what could not be met.
    starts : list of dict
        What each start led to.
    programs : int
        Nonlinear programs solved.
    seconds, processor_seconds : float
        Time that it took (s).
    """

    design: Design
    tuned: tuple[Tuned, ...]
    values: Array
    loops: int
    excess: float
    slope_margin: float
    deciding_frequency_hz: float
    violations: dict[str, float]
    message: str
    starts: list[dict[str, Any]]
    programs: int
    seconds: float
    processor_seconds: float

    @property
    def feasible(self) -> bool:
        """Whether everything that was asked is kept."""
        return not self.violations

    @property
    def gains(self) -> dict[str, float]:
        """Values by path (SI)."""
        return by_path(self.tuned, self.values)

    def summary(self) -> dict[str, Any]:
        """Strict JSON values, SI."""
        return {
            "gains": self.gains,
            "excess": _finite(self.excess),
            "slope_margin": _finite(self.slope_margin),
            "deciding_frequency_hz": _finite(self.deciding_frequency_hz),
            "loops": self.loops,
            "feasible": self.feasible,
            "violations": dict(self.violations),
            "message": self.message,
            "programs": self.programs,
            "seconds": self.seconds,
        }

    def save(self, folder: str | Path) -> Path:
        """Write the design with its gains as a new design file, ready to run, and the summary."""
        return save_design(self.design, self.summary(), folder)


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
        Requirements that cannot be met are told in its message, with the closest point found.

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
    return _told(design, problem, best, followed, program.solves, begin, processor)


def _told(
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
        worst = max(missed, key=lambda key: missed[key])
        return (
            f"the requirements cannot all be met between these bounds: at the closest point found, "
            f"{at}, {', '.join(missed)} {'is' if len(missed) == 1 else 'are'} missed, "
            f"{worst} by {missed[worst]:.3g}"
        )
    if best.excess < 0.0:
        return (
            f"no gains between these bounds are stable: at the best found, {at}, the slope of the "
            f"rock exceeds the slope margin by {-best.excess:.4g} N m s/rad"
        )
    return f"largest slope margin at {at}: {best.excess:.4g} N m s/rad above the slope of the rock"


def _starts(problem: Loops) -> list[LoopsState]:
    """The best of many gains, apart from each other, that are stable without slope."""
    tuned, loops = problem.tuned, problem.loops
    looked = loops[:: max(1, len(loops) // LOOPS_LOOKED_AT)][:LOOPS_LOOKED_AT]
    points = spread(tuned, LOOKED_AT * len(tuned))
    excess = [min(_seen_excess(x, by_path(tuned, p)) for x in looked) for p in points]
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


def _seen_excess(loop: Loop, values: dict[str, float]) -> float:
    return least_seen(loop, values) - loop.slope


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


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
