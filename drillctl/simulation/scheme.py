"""Which step and how many modes the batch engine uses."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drillctl.design.tables import SimulationTable
from drillctl.errors import InputError
from drillctl.rig.drillstring import Drillstring

Array = NDArray[np.float64]

NO_TURNS: Array = np.empty(0)
WHOLE = 1e-7  # how far from a whole number of steps a moment may be that falls on the end of one
STEEPEST = 0.5
"""Largest product of bit mobility over a step and falling slope: beyond it the inclusion at
the bit could have more than one root."""


WALLED = 0.2  # of the step without friction of the wall: a front passes some 20 m in 7 ms
FEWEST_STEPS = 20
"""Fewest steps in a period of the first elastic mode; fewer would not show stick-slip."""

MOST_STEPS = 10**8
"""Most steps of a run: some twenty seconds, however few its lanes are."""


@dataclass(frozen=True)
class Accuracy:
    """What a named accuracy stands for."""

    step: float  # longest step (s)
    steps_per_period: float  # fewest steps in a period of the first elastic mode, for short strings
    # modes that turn more than this (rad) in a step are left out: a step cannot follow them
    phase: float
    # largest product of bit mobility over a step and falling slope, where waves leave a light bit
    fall: float


ACCURACIES = {
    "fast": Accuracy(step=0.05, steps_per_period=110, phase=1.3, fall=STEEPEST),
    "standard": Accuracy(step=0.025, steps_per_period=220, phase=1.0, fall=0.11),
    "fine": Accuracy(step=1.0 / 140.0, steps_per_period=770, phase=0.64, fall=0.04),
}
"""Steps that go into a tenth of a second, at which signals are kept. Median and 99th percentile of
the relative error of J1 over the paper's map: `fast` 1.5e-4 and 7e-3, `standard` 5e-5 and 2e-3,
`fine` 1e-4 at the 99th percentile, held by a test. The error falls with the square of the step,
counted in periods of the first elastic mode."""


SMALLEST = 1e-7
"""J1 (s) under which errors are taken in parts of this: a rig that never leaves its set speed."""
ROUNDING = 1e-9  # relative difference of two schemes that may be rounding
UNLIKELY = 0.025  # chance of a sample that speaks against a promise


@dataclass(frozen=True)
class Promise:
    """What a named accuracy promises of the relative error of J1, over the paper's map."""

    # median and 99th percentile; None for no promise
    median: float | None
    p99: float

    def kept(self, errors: Array) -> bool:
        """Whether a sample of errors, shape (lanes,), leaves it standing.

        It does unless so many of them lie over a percentile as chance has in less than one of
        forty samples of a map that keeps it (binomial, one-sided).
        """
        known = errors[np.isfinite(errors)]
        promised = [(self.p99, 0.01)] + ([] if self.median is None else [(self.median, 0.5)])
        return known.size > 0 and all(
            _chance(int((known > bar).sum()), known.size, share) >= UNLIKELY
            for bar, share in promised
        )


def _chance(over: int, count: int, share: float) -> float:
    """Chance of so many or more of `count` where each is one with the chance `share`."""
    from scipy.special import bdtrc

    return float(bdtrc(over - 1, count, share))


PROMISES = {
    "fast": Promise(1.5e-4, 7e-3),
    "standard": Promise(5e-5, 2e-3),
    "fine": Promise(None, 1e-4),
}


@dataclass(frozen=True)
class Scheme:
    """Step, number of steps and number of modes of a run."""

    step: float  # length of a step (s); `steps` of them are exactly the duration
    steps: int  # number of steps
    modes: int  # lowest undamped modes carried, the rigid body included
    sampling: int = 0  # steps to a period of a sampled controller; 0 for a continuous one


def _share_of_longest(string: Drillstring, accuracy: Accuracy) -> float:
    """Share of the longest step in which the bit is followed as closely as an accuracy asks for.

    At the longest step itself each release of a light bit under pipe is off by a good part of the
    wave that it sends up; a lumped string has no waves.
    """
    lumped = string.parts.sections[-1].inertia == 0.0
    return 1.0 if lumped else accuracy.fall / STEEPEST


class Bound(NamedTuple):
    """A bound on the step."""

    name: str  # 'accuracy', 'elastic_mode', 'friction', 'rock' or 'given'
    step: float  # longest step that it allows (s)
    reason: str  # in words


def step_bounds(
    string: Drillstring, table: SimulationTable, fall: float, rock: Bound, walled: bool
) -> tuple[Bound, ...]:
    """What bounds the step; a given one stands alone, and is refused where it is too long.

    `fall`: steepest one of the friction (N m s/rad). `rock`: of one that is followed along the
    way. `walled`: whether the wall rubs, node by node: fronts of slip run along the string.
    """
    accuracy = ACCURACIES[table.accuracy]
    elastic = float(2.0 * math.pi / string.undamped_modes[0][1])
    # Mobility over a step is about step / inertia: the bit has no time to move the string.
    longest = STEEPEST * bit_inertia(string) / fall if fall > 0.0 else math.inf
    if table.step is not None:
        _refuse_long(table.step, elastic, longest, fall)
        return (Bound("given", table.step, "simulation.step"),)
    share, often = WALLED if walled else 1.0, accuracy.steps_per_period
    wall = f", times {WALLED:g} for friction along the wall" if walled else ""
    bounds = (
        Bound("accuracy", share * accuracy.step, f"the longest step of '{table.accuracy}'{wall}"),
        Bound(
            "elastic_mode", share * (elastic / often),
            f"{often:g} steps in a period of the first elastic mode, {elastic:.3g} s{wall}",
        ),
        Bound(
            "friction", longest * _share_of_longest(string, accuracy),
            f"the friction falls by up to {fall:.4g} N*m*s/rad: what a light bit follows",
        ),
        rock,
    )  # fmt: skip
    return tuple(bound for bound in bounds if bound.step < math.inf)


def _refuse_long(step: float, elastic: float, longest: float, fall: float) -> None:
    """Refuse a given step (s) that friction or string do not allow."""
    for what, allowed in (
        (f"friction law: its torque falls by {fall:.4g} N m s/rad", longest),
        (f"string: its first elastic mode has a period of {elastic:.3g} s", elastic / FEWEST_STEPS),
    ):
        if step > allowed:
            raise InputError(
                f"{step:g} s is too long for this {what}, which allows {allowed:.3g} s at most",
                "simulation.step",
            )


def choose_scheme(
    string: Drillstring,
    table: SimulationTable,
    bounds: Iterable[Bound],
    period: float | None = None,
    turns: Array = NO_TURNS,
) -> Scheme:
    """Step and modes from the accuracy asked for, unless they are given."""
    frequency, _ = string.undamped_modes
    step = min(bound.step for bound in bounds)
    if table.duration / min(step, period or step) > MOST_STEPS:
        _refuse_steps(table, step, period)
    steps, sampling = _whole_steps(table.duration, step, period, turns)
    step = table.duration / steps
    modes = table.modes
    if modes is None:
        modes = int((frequency * step <= ACCURACIES[table.accuracy].phase).sum())
    return Scheme(step, steps, min(max(modes, 2), string.nodes), sampling)


def _refuse_steps(table: SimulationTable, step: float, period: float | None) -> None:
    """Refuse a run that nobody can mean."""
    sampled = period is not None and period < step
    step = min(step, period or step)
    raise InputError(
        f"{table.duration / step:.3g} steps of {_time(step)} are too many: a run of "
        f"{_time(table.duration)} has at most {MOST_STEPS:.0e}, of "
        f"{_time(table.duration / MOST_STEPS)}",
        "controller.drive.sampling_period" if sampled
        else "simulation.step" if table.step is not None
        else "simulation.duration",
    )  # fmt: skip


def _time(seconds: float) -> str:
    units = (("s", 1.0), ("ms", 1e3), ("us", 1e6), ("ns", 1e9))
    unit, factor = next((one for one in units if seconds * one[1] >= 1.0), units[-1])
    return f"{seconds * factor:.3g} {unit}"


def plain_steps(duration: float, step: float) -> int:
    """Number of steps in a run that nothing but its length bounds further."""
    return max(1, math.ceil(duration / step * (1.0 - 1e-12)))


def _whole_steps(
    duration: float, step: float, period: float | None, turns: Array
) -> tuple[int, int]:
    """Number of steps in a run, and in a period of the controller."""
    if period is not None:
        periods = max(1, round(duration / period))
        sampling = plain_steps(period, step)
        return periods * sampling, sampling
    steps = plain_steps(duration, step)
    if len(turns) == 0:
        return steps, 0
    numbers = np.arange(steps, steps + steps // 4 + 1)
    places = np.outer(numbers, turns / duration)
    apart = np.abs(places - np.round(places)).max(axis=1)
    exact = np.flatnonzero(apart < WHOLE)
    return int(numbers[exact[0]] if exact.size else numbers[np.argmin(apart)]), 0


def bit_inertia(string: Drillstring) -> float:
    """Inertia (kg m2) that resists a sudden torque at the bit: 1 / (M^-1) at the last node."""
    import scipy.sparse.linalg

    unit = np.zeros(string.nodes)
    unit[-1] = 1.0
    response = scipy.sparse.linalg.spsolve(string.mass.tocsc(), unit)
    return float(1.0 / np.atleast_1d(response)[-1])
