"""The benefit of a weight that follows the bit speed, against the delay of its path.

W = W_n + K_w (|w_b| - w_ref) takes weight off a slow bit. It needs the bit speed, which comes up
late. Every gain and delay is run at the same draws of what is uncertain and compared draw by draw
with the constant weight, which is the same law with K_w = 0.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drillctl import units
from drillctl.arrays import Array
from drillctl.design import Design
from drillctl.ensemble.cases import (
    Crossing,
    Estimate,
    Runs,
    Share,
    crossing,
    joined,
    scheme_of,
    share_of,
)
from drillctl.ensemble.draws import (
    DrawnGroup,
    DrawnLanes,
    Failures,
    draw_all,
    drawn_lanes,
    run_draws,
)
from drillctl.ensemble.grid import refuse_too_large
from drillctl.ensemble.parameters import Draws, refuse_dependent, uncertain_parameters
from drillctl.errors import InputError
from drillctl.progress import SILENT, Progress
from drillctl.simulation.lanes import Lanes
from drillctl.simulation.measures import AXIAL_MEASURES, MEASURES, STATUSES, with_axial
from drillctl.store.codec import label
from drillctl.store.json_files import picked
from drillctl.store.result import Timed, timed
from drillctl.studies.delay.settings import LAW, VARIED

LAWS = ("navarro-lopez-suarez", "surface-observer")  # laws of a weight that follows the bit speed
GAIN, DELAY = VARIED
KEPT = (
    "j1", "peak_bit_speed", "peak_pipe_torque", "mean_weight_on_bit", "mean_weight_after_start",
)  # fmt: skip
"""Measures that are kept of a run, beside those of axial motion."""
ENOUGH = 0.95  # share of the draws in which stick-slip must have ended


@dataclass(frozen=True)
class DelayedBenefit:
    """One gain at one delay, over all draws."""

    delay: float  # total delay of the path (s)
    j1: Estimate  # mean of J1 (s)
    difference: Estimate  # mean of J1 less that of the constant weight at the same draw (s)
    ended: Share  # of the draws in which stick-slip has ended: no sticking in the last 20 s
    # means over the draws; None if all failed
    peak_bit_speed: float | None  # rad/s
    peak_pipe_torque: float | None  # N m
    mean_weight: float | None  # after the start of the run (N)
    axial: dict[str, float | None]  # measures of axial motion (SI), where a rig has it

    def summary(self) -> dict[str, Any]:
        """As strict JSON values, SI."""
        return {
            "delay": self.delay,
            **self.j1.summary("j1", "j1_"),
            **self.difference.summary("difference", "difference_"),
            "pairs": self.difference.draws,
            "ended": self.ended.hits,
            "ended_share": self.ended.value,
            "ended_interval_95": list(self.ended.interval),
            **picked(self, "peak_bit_speed", "peak_pipe_torque", "mean_weight"),
            **self.axial,
        }


@dataclass(frozen=True)
class GainLimits:
    """How much delay one gain bears.

    What a longer delay may bring back, as one near the period of the motion does, is not a limit
    anyone would drill by.
    """

    gain: float  # K_w (N s/rad)
    # longest delay at which stick-slip has ended in 95 % of the draws, shorter ones included, and
    # the delay after it; None if there is none
    ends_at: DelayedBenefit | None
    ends_before: DelayedBenefit | None
    # delay at which the mean of J1 stops being under that of the constant weight
    harmful_from: Crossing

    def summary(self) -> dict[str, Any]:
        """As strict JSON values; the delay is null if stick-slip ends at none."""
        at, after = (
            one and {"delay": one.delay, **one.ended.summary("share")}
            for one in (self.ends_at, self.ends_before)
        )
        return {
            "gain": self.gain,
            "ends_up_to": {"delay": at and at["delay"], "at": at, "next": after},
            "harmful_from": self.harmful_from.summary("delay"),
        }


def lasting(shares: Sequence[float], enough: float = ENOUGH) -> int:
    """How many of the shares, from the first on, are at least `enough`."""
    return next((k for k, share in enumerate(shares) if share < enough), len(shares))


@dataclass(frozen=True, eq=False)
class WeightDelay(Timed, Runs, kind="delay"):
    """A weight on bit that follows the bit speed, over gains and delays, at the same draws.

    Its design's `[weight_delay]` holds gains, delays and law, its `[uncertainty]` number and seed
    of the draws. It is itself the runs of all gains and delays: `at(i, k)` gives those of one.
    """

    measures: dict[str, Array] = label(
        "gain", "delay", "realization", unit=lambda name: MEASURES[name].unit,
        means="measures by name; NaN where a run failed", flat=True,
    )  # fmt: skip
    status: NDArray[np.int8] = label(
        "gain", "delay", "realization", flags=STATUSES, means="how each run ended"
    )
    design: Design = label(means="what was run")
    drawn: dict[str, Array] = label("realization", means="drawn values by path, SI")
    constant: Runs = label(means="of the constant weight, K_w = 0")
    failures: tuple[Failures, ...] = label(means="draws without a result, by reason")

    @property
    def gains(self) -> Array:
        """K_w (N s/rad), increasing, shape (gains,)."""
        return np.array(self.design.tables.weight_delay.gains)

    @property
    def delays(self) -> Array:
        """Total delays of the path (s), increasing, shape (delays,)."""
        return np.array(self.design.tables.weight_delay.delays)

    @property
    def realizations(self) -> int:
        """Number of draws."""
        return self.design.tables.uncertainty.realizations

    @property
    def seed(self) -> int:
        """What the draws follow from."""
        return self.design.tables.uncertainty.seed

    @property
    def enough(self) -> float:
        """Share of the draws in which stick-slip must have ended."""
        return ENOUGH

    @cached_property
    def baseline(self) -> DelayedBenefit:
        """The constant weight over all draws; its difference from itself is none."""
        return self._benefit(self.constant, 0.0)

    @cached_property
    def benefits(self) -> tuple[tuple[DelayedBenefit, ...], ...]:
        """By gain and delay."""
        return tuple(
            tuple(self._benefit(self.at(i, k), float(d)) for k, d in enumerate(self.delays))
            for i in range(len(self.gains))
        )

    @cached_property
    def limits(self) -> tuple[GainLimits, ...]:
        """How much delay each gain bears; a gain of zero is never harmful."""
        return tuple(map(self._limits, map(float, self.gains), self.benefits))

    def _benefit(self, runs: Runs, delay: float) -> DelayedBenefit:
        return DelayedBenefit(
            delay=delay,
            j1=runs.mean_estimate("j1", self.seed),
            difference=runs.difference(self.constant, "j1", self.seed),
            ended=share_of(runs.ended),
            peak_bit_speed=runs.mean("peak_bit_speed"),
            peak_pipe_torque=runs.mean("peak_pipe_torque"),
            mean_weight=runs.mean("mean_weight_after_start"),
            axial={name: runs.mean(name) for name in AXIAL_MEASURES if name in runs.measures},
        )

    def _limits(self, gain: float, benefits: tuple[DelayedBenefit, ...]) -> GainLimits:
        harmful = Crossing(None, (None, None))
        if gain > 0.0:
            lines = [(one.difference.value, *one.difference.ends) for one in benefits]
            harmful = crossing(self.delays, *np.array(lines, dtype=float).T)
        held = lasting([one.ended.value for one in benefits])
        at, after = ([None, *benefits, None][held + k] for k in (0, 1))
        return GainLimits(gain, at, after, harmful)

    def derived(self) -> dict[str, Any]:
        """Gains and delays, and the difference and the end of stick-slip of each, with units."""

        def over(unit: str, pick: Callable[[DelayedBenefit], Any]) -> tuple[Any, ...]:
            values = [[pick(one) for one in row] for row in self.benefits]
            return ("gain", "delay"), np.array(values, dtype=float), {"units": unit}

        return {
            "gain": ("gain", self.gains, {"units": "N*s/rad"}),
            "delay": ("delay", self.delays, {"units": "s"}),
            "difference": over("s", lambda one: one.difference.value),
            "difference_low": over("s", lambda one: one.difference.ends[0]),
            "difference_high": over("s", lambda one: one.difference.ends[1]),
            "ended_share": over("1", lambda one: one.ended.value),
            "ended_low": over("1", lambda one: one.ended.interval[0]),
            "ended_high": over("1", lambda one: one.ended.interval[1]),
        }

    def summary(self) -> dict[str, Any]:
        """Limits and figures of every gain and delay, settings; SI units."""
        step, modes = scheme_of([self.constant, self])
        constant = self.baseline.summary()
        for key in ("delay", "difference", "difference_interval_95", "pairs"):
            del constant[key]
        return {
            "gains": [
                {**limits.summary(), "delays": [one.summary() for one in row]}
                for limits, row in zip(self.limits, self.benefits, strict=True)
            ],
            "constant": constant,
            "delays": self.delays.tolist(),
            "uncertain": list(self.drawn),
            "failures": [asdict(failure) for failure in self.failures],
            "step": step,
            "modes": modes,
            **picked(self, "realizations", "seed", "total_seconds"),
        }


@timed
def weight_delay(
    design: Design,
    gains: Sequence[float | str] | None = None,
    delays: Sequence[float | str] | None = None,
    realizations: int | None = None,
    progress: Progress = SILENT,
) -> WeightDelay:
    """Run a weight on bit that follows the bit speed over gains and delays, at the same draws.

    Parameters
    ----------
    design : Design
        Its `[weight_delay]` table gives gains, delays and what its law has beside them; hoist lag,
        sensor, sampling and limits stay as they are. What is uncertain is drawn as its
        `[uncertain]` and `[uncertainty]` say.
    gains : sequence of float or str, optional
        K_w instead of the design's own: N s/rad, or text with a unit. Not negative.
    delays : sequence of float or str, optional
        Total delays of the path instead of the design's own: s, or text with a unit. Not negative.
    realizations : int, optional
        Number of draws instead of the design's own.
    progress : Progress
        Receives finished runs.

    Returns
    -------
    WeightDelay
        A draw that is impossible or breaks down is a status and counted, not an exception.

    Raises
    ------
    InputError
        Impossible settings, a law that does not follow the bit speed, every draw impossible, or
        more runs than fit the memory.

    Notes
    -----
    The law is that of Navarro-Lopez & Suarez, Proc. IEEE CCA (2004) 1454-1460, behind the way of
    `drillctl.rig.weight_on_bit.RealWeight`.
    """
    design = _given(design, gains, delays, realizations)
    refuse_dependent(design)
    table, count = design.tables.weight_delay, design.tables.uncertainty.realizations
    refuse_too_large([len(table.gains), len(table.delays), count], "weight_delay")
    following = following_design(design)
    draws = draw_all(following, count, design.tables.uncertainty.seed)
    lanes = delayed_lanes(following, draws, np.array(table.delays))
    alone = delayed_lanes(following, draws, np.array(table.delays[:1]))
    progress.begin("simulating delays", count * len(table.delays) * len(table.gains))
    constant = alone.run(0.0).at(0)
    shape = (len(table.delays), count)
    results = []
    for gain in table.gains:
        # The constant weight is the same at any delay.
        results.append(lanes.run(gain) if gain > 0.0 else constant.over(shape, constant.measures))
        progress.advance(count * len(table.delays))
    runs = joined(results, np.stack)
    return WeightDelay(
        **vars(runs),
        design=design,
        drawn=draws.values,
        constant=constant,
        failures=lanes.parts[0][0].failures,
    )


def _given(
    design: Design, gains: Sequence[float | str] | None, delays: Sequence[float | str] | None,
    realizations: int | None,
) -> Design:  # fmt: skip
    """The design with what was given beside it, so that it alone makes the run again."""
    values: dict[str, Any] = {}
    for key, given in (("gains", gains), ("delays", delays)):
        if given is not None:
            values[f"weight_delay.{key}"] = [
                one if isinstance(one, str) else units.SI(one) for one in given
            ]
    if realizations is not None:
        values["uncertainty.realizations"] = realizations
    return design.replace(values) if values else design


def following_design(design: Design) -> Design:
    """The design with a weight on bit that follows the bit speed, as yet with no gain or delay."""
    for path in VARIED:
        if path in design.tables.uncertain:
            where = design.where(f"uncertain.{path}")
            raise InputError("is what the study runs over and cannot be drawn", where)
    values = following_law(design, design.tables.weight_delay.values)
    with design.within("weight_delay.set"):
        result = design.replace({**values, GAIN: units.SI(0.0), DELAY: units.SI(0.0)})
        # Limits are compared with the nominal weight only when the law is made of them.
        result.weight_on_bit  # noqa: B018
    uncertain_parameters(result)
    return result


def following_law(design: Design, given: dict[str, Any]) -> dict[str, Any]:
    """Values of `[weight_on_bit]` whose law follows the bit speed: the design's, if it does."""
    own = design.tables.weight_on_bit.law
    values = {f"{LAW}law": LAWS[0] if own == "constant" else own, **given}
    if (law := values[f"{LAW}law"]) not in LAWS:
        raise InputError(
            f"{law!r} does not follow the bit speed; allowed: {', '.join(LAWS)}",
            design.where(f"{LAW}law"),
        )
    return values


@dataclass(frozen=True, eq=False)
class DelayedLanes:
    """Every draw at every delay."""

    # with the number of delays: at no delay, where that is asked for, and at all others. Without
    # any lag the first is of the law that acts at once, which has a kernel of its own
    parts: tuple[tuple[DrawnLanes, int], ...]
    draws: int  # how many draws, the impossible ones included

    def run(self, gain: float) -> Runs:
        """Simulate all at one gain (N s/rad); runs of shape (delays, draws)."""
        results = []
        for part, size in self.parts:
            groups = tuple(
                replace(one, lanes=_with(one.lanes, gain=np.full(len(one.lanes), gain)))
                for one in part.groups
            )
            runs = run_draws(DrawnLanes(groups, part.failures), size * self.draws)
            kept = with_axial(KEPT, groups[0].design.axial is not None)
            results.append(runs.over((size, self.draws), kept))
        return joined(results, np.concatenate)


def delayed_lanes(following: Design, draws: Draws, delays: Array) -> DelayedLanes:
    """Lanes of a design at every draw and delay."""
    late = delays[delays > 0.0]
    parts = []
    if late.size < delays.size:
        parts.append((drawn_lanes(following, draws), 1))
    if late.size:
        first = drawn_lanes(following.replace({DELAY: units.SI(float(late[0]))}), draws)
        parts.append((_at_delays(first, len(draws), late), late.size))
    return DelayedLanes(tuple(parts), len(draws))


def _at_delays(drawn: DrawnLanes, count: int, delays: Array) -> DrawnLanes:
    """All draws again at every delay, delay by delay."""
    groups = []
    for group in drawn.groups:
        size = len(group.lanes)
        lanes = group.lanes[np.tile(np.arange(size), len(delays))]
        numbers = np.concatenate([group.numbers + k * count for k in range(len(delays))])
        delayed = _with(lanes, delay=np.repeat(delays, size))
        groups.append(DrawnGroup(group.design, delayed, numbers))
    return DrawnLanes(tuple(groups), drawn.failures)


def _with(lanes: Lanes, **numbers: Array) -> Lanes:
    """Lanes with other numbers of their weight law."""
    return replace(lanes, weight=lanes.weight._replace(**numbers))
