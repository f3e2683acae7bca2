"""PI with a constant weight on bit against PI with one that follows the bit speed.

Regions over the gains of the drive; front and map over weights and speeds; delays of the path. The
advantage against the delay has two answers, which are not to be mixed. *Gains of the ideal
path*, kept while the signal comes later: the advantage turns to harm, and the delay where it does
is a zero of a line. *Gains tuned anew* at every delay: a policy that may set its gain to zero
contains the constant weight and is never worse but for the draws; its advantage fades, and the
delay is reported where it falls under a stated share of the constant weight's objective, and where
its interval first holds zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from drillctl import units
from drillctl.arrays import Array, Mask
from drillctl.design import Design
from drillctl.ensemble.cases import Crossing, Estimate, percentile_estimate, resampled_crossing
from drillctl.ensemble.draws import CommonDraws
from drillctl.ensemble.grid import Axis, refuse_too_large
from drillctl.ensemble.probability import INNER, OUTER, Area, Scatter, probability_map, region_areas
from drillctl.ensemble.sweeps import sweep
from drillctl.errors import InputError
from drillctl.progress import SILENT, Progress
from drillctl.store.codec import label
from drillctl.store.json_files import picked, strict
from drillctl.store.result import Timed, timed
from drillctl.studies.advantage.cases import (
    ALL_TERMS,
    DELAY,
    GAIN,
    IDEAL,
    MEAN,
    SPEED,
    WEIGHT,
    Case,
    Measured,
    Optima,
    Optimum,
    Policies,
    Policy,
    cases,
    fresh_draws,
    less,
    measured,
    optima_of,
    optimum_beside,
    policies,
)
from drillctl.studies.tune.problem import GainRuns

INDEPENDENT = Scatter(1)
FIGURES = {
    "objective": "s", "objective_low": "s", "objective_high": "s", "mean_weight": "N",
    "rop_proxy": "1", "tuned_value": "s", "advantage": "s", "advantage_low": "s",
    "advantage_high": "s", "kp": "N*m*s", "ki": "N*m", "gain": "N*s/rad",
}  # fmt: skip
"""What is reported of a policy at a weight and speed, with its unit.

The advantage is the objective of the constant weight less that of the policy.
"""


@dataclass(frozen=True, eq=False)
class Regions:
    """J1 of one policy over the gains of the drive."""

    policy: str  # name
    gain: float  # of the weight (N s/rad)
    kp: Array = label("kp", unit="N*m*s", means="Kp over the bounds of the tuning")
    ki: Array = label("ki", unit="N*m", means="Ki over the bounds of the tuning")
    j1: Array = label(
        "kp", "ki", "region_realization", unit="s", name="region_j1",
        means="J1 at fresh draws; infinite where one failed",
    )  # fmt: skip
    nominal: Array = label(
        "kp", "ki", unit="s", name="region_nominal_j1",
        means="J1 without draws; NaN where it failed",
    )  # fmt: skip
    levels: tuple[float, ...] = label(unit="s", means="levels of J1")
    seed: int = label(means="of the resampling")

    @cached_property
    def areas(self) -> dict[float, dict[str, Area]]:
        """Shares of the window by level: `p95`, `p05` with intervals, of realizations."""
        flat = np.ascontiguousarray(np.moveaxis(self.j1, -1, 0).reshape(self.j1.shape[-1], -1))
        results = {}
        for level in self.levels:
            one = probability_map(flat, level, INDEPENDENT)
            both = region_areas(flat, [(one, INNER), (one, OUTER)], INDEPENDENT, self.seed)
            results[level] = dict(zip(("p95", "p05"), both, strict=True))
        return results

    def nominal_area(self, level: float) -> float:
        """Share of the window with J1 at or under a level (s) without draws."""
        return float((self.nominal <= level).mean())

    def summary(self) -> dict[str, Any]:
        """As strict JSON values."""
        return {
            "gain": self.gain,
            "levels": {
                f"{level:g}": {
                    "nominal_area": self.nominal_area(level),
                    **{
                        f"area_{name}": {"value": area.value, "interval_95": list(area.interval)}
                        for name, area in areas.items()
                    },
                }
                for level, areas in self.areas.items()
            },
        }


def regions(compared: Policies, optima: Optima, progress: Progress) -> tuple[Regions, ...]:
    """Regions of every policy with the gain of the weight at its optimum."""
    results = []
    for policy, best in zip(compared, optima, strict=True):
        results.append(_regions(policy, best))
        progress.advance(1)
    return tuple(results)


def _regions(policy: Policy, best: Optimum) -> Regions:
    table = policy.design.tables.advantage
    drive = policy.tuned[:2]
    axes = [np.linspace(t.low, t.high, table.region_points) for t in drive]
    gain = float(best.values[2]) if policy.follows else 0.0
    design = policy.design
    if policy.follows:
        design = design.replace({GAIN: units.SI(gain)})
    runs = GainRuns(design, drive, table.region_realizations, table.seed)
    points = np.stack([a.ravel() for a in np.meshgrid(*axes, indexing="ij")], axis=1)
    j1 = runs.measures(points, ("j1",))["j1"]
    grid = tuple(Axis(t.path, t.unit, a) for t, a in zip(drive, axes, strict=True))
    shape = (len(axes[0]), len(axes[1]))
    return Regions(
        policy=policy.name,
        gain=gain,
        kp=axes[0],
        ki=axes[1],
        j1=j1.reshape(*shape, -1),
        nominal=sweep(design, grid, audit_cells=0, measures=("j1",)).j1,
        levels=policy.design.tables.map.levels,
        seed=table.seed,
    )


@dataclass(frozen=True, eq=False)
class Chart:
    """Every policy at every weight and speed, each time at its own robust optimum."""

    weights: Array = label("weight", unit="N", means="nominal weight on bit")
    speeds: Array = label("{over}", unit="rad/s", name="{over}", means="set speed")
    policies: tuple[str, ...] = label(means="names, the constant weight first")
    # by the names of `FIGURES`; NaN where unknown
    figures: dict[str, Array] = label(
        "policy", "weight", "{over}", unit=lambda name: FIGURES[name], flat=True
    )
    over: str = "speed"  # name of the dimension of the speeds

    def at_speed(self, speed: float) -> Chart | None:
        """The part at one set speed (rad/s), where it is among the speeds."""
        j = np.flatnonzero(self.speeds == speed)
        if not j.size:
            return None
        figures = {name: values[:, :, j] for name, values in self.figures.items()}
        return Chart(self.weights, self.speeds[j], self.policies, figures, "front_speed")

    def significant(self, policy: int) -> Mask:
        """Where the interval of a policy's advantage excludes zero, shape (weights, speeds)."""
        low, high = (self.figures[f"advantage_{end}"][policy] for end in ("low", "high"))
        return np.asarray(low * high > 0.0)


def chart(
    compared: Policies, weights: Sequence[float], speeds: Sequence[float], draws: CommonDraws,
    progress: Progress, over: str = "speed",
) -> Chart:  # fmt: skip
    """Tune every policy at every weight and speed, and measure it at the fresh draws."""
    shape = (len(compared), len(weights), len(speeds))
    figures = {name: np.full(shape, np.nan) for name in FIGURES}
    count = compared.constant.design.tables.advantage.sweep_realizations
    known: dict[tuple[int, int], Optima] = {}
    for j, speed in enumerate(speeds):
        for i, weight in enumerate(weights):
            here = compared.at(WEIGHT, weight).at(SPEED, speed)
            near = [known[at] for at in ((i - 1, j), (i, j - 1)) if at in known]
            best = known[i, j] = optima_of(here, count, progress, near)
            own = [measured(x.with_gains(y.values), draws) for x, y in zip(here, best, strict=True)]
            for k, (result, runs) in enumerate(zip(best, own, strict=True)):
                for name, value in _figures(result, runs, own[0]).items():
                    figures[name][k, i, j] = np.nan if value is None else value
    names = tuple(policy.name for policy in compared)
    return Chart(np.array(weights), np.array(speeds), names, figures, over)


def _figures(best: Optimum, own: Measured, ground: Measured) -> dict[str, float | None]:
    results: dict[str, float | None] = {
        "mean_weight": own.runs.mean("mean_weight_after_start"),
        "rop_proxy": own.runs.mean("rop_proxy"),
        "tuned_value": best.value,
        **dict(zip(("kp", "ki", "gain"), (*best.values, 0.0), strict=False)),
    }
    for name, one in (("objective", own.estimate), ("advantage", ground.less(own))):
        results |= {name: one.value, f"{name}_low": one.ends[0], f"{name}_high": one.ends[1]}
    return results


STEPS = 10  # into which a step of the grid is divided where kept gains lose their advantage
STEPS_ANEW = 5  # the same where gains tuned anew do, each of which is a search


@dataclass(frozen=True, eq=False)
class DelayLine:
    """One choice of gains over the delays, at the same fresh draws."""

    name: str
    delays: Array = label(
        "{name}_delay", unit="s", name="{name}_delay",
        means="increasing, closer together where the advantage vanishes",
    )  # fmt: skip
    gains: Array = label("{name}_delay", "parameter", means="kp, ki and K_w, SI")
    objective: Array = label("{name}_delay", unit="s", means="at the fresh draws")
    advantage: Array = label(
        "{name}_delay", unit="s", means="objective of the constant weight less that"
    )
    low: Array = label("{name}_delay", unit="s", means="lower end of its 95 % interval")
    high: Array = label("{name}_delay", unit="s", means="upper end of its 95 % interval")
    zero: Crossing = label(means="where the advantage first is none")
    material: Crossing = label(
        means="where it first falls under the stated share of the constant weight's objective"
    )

    @property
    def indistinct_from(self) -> float | None:
        """First of the delays (s) at which the interval does not lie above zero."""
        result = np.flatnonzero(~(self.low > 0.0))
        return float(self.delays[result[0]]) if result.size else None


@dataclass(frozen=True, eq=False)
class DelayCurve:
    """The advantage against the delay of the path."""

    delays: Array = label(
        "delay", unit="s",
        means="of the way from the bit to the driller; lags and limits are the same at all",
    )  # fmt: skip
    constant: float = label(unit="s", means="objective of the constant weight")
    kept: DelayLine = label(means="gains of the ideal path")
    anew: DelayLine = label(means="gains tuned at each delay")

    def summary(self) -> dict[str, Any]:
        """As strict JSON values, SI."""
        lines = {
            name: {
                **picked(line, "delays", "advantage", "low", "high", "indistinct_from"),
                "zero": line.zero.summary("delay"),
                "material": line.material.summary("delay"),
            }
            for name, line in (("kept", self.kept), ("anew", self.anew))
        }
        return dict(strict({"delays": self.delays, "constant": self.constant, **lines}))


def delay_curve(
    compared: Policies, optima: Optima, draws: CommonDraws, progress: Progress
) -> DelayCurve:
    """Advantage of the real path over the delays of the design's `[advantage]` table."""
    constant = _objectives(compared.constant, optima.constant.values, draws)
    ground = float(constant[0])
    table = compared.real.design.tables.advantage
    delays, fixed = np.array(table.delays), optima.ideal.values
    anew = _tuned_anew(compared.real, optima, draws, ground, progress)
    kept: Points = {
        delay: (fixed, _objectives(compared.real, fixed, draws, delay)) for delay in table.delays
    }
    advantages = np.array([ground - kept[delay][1][0] for delay in table.delays])
    for delay in _between(delays, advantages):
        kept[delay] = fixed, _objectives(compared.real, fixed, draws, delay)
    return DelayCurve(
        delays,
        ground,
        _line("kept", kept, constant, table.material),
        _line("anew", anew, constant, table.material),
    )


def _tuned_anew(
    policy: Policy, optima: Optima, draws: CommonDraws, constant: float, progress: Progress
) -> Points:
    """Gains tuned at each delay of the grid, and closer where the advantage vanishes."""
    # What is best at one delay is a start for the next. Where the grid has lost the advantage in a
    # step, the small steps into it may carry it over the end: then it is looked for in the next.
    table, tune = policy.design.tables.advantage, policy.design.tables.tune
    results: dict[float, Optimum] = {}
    points: Points = {}

    def tuned(delay: float, start: Array) -> Optimum:
        # As many draws as the constant weight was tuned at: fewer would fit their own draws more.
        return optimum_beside(
            _late(policy, delay), tune.realizations, optima.constant, [optima.real.values, start]
        )

    def keep(delay: float, one: Optimum) -> Array:
        results[delay] = one
        points[delay] = one.values, _objectives(policy, one.values, draws, delay)
        return one.values

    last = optima.real.values
    for delay in table.delays:
        last = keep(delay, tuned(delay, last))
        progress.advance(1)
    none = table.material * constant
    while True:
        over = [d for d in table.delays if constant - points[d][1][0] <= none]
        before = [d for d in table.delays if over and d < over[0]]
        if not before:
            return points
        last = results[before[-1]].values
        for delay in np.linspace(before[-1], over[0], STEPS_ANEW + 1)[1:-1].tolist():
            last = keep(delay, tuned(delay, last))
        again = tuned(over[0], last)
        if not again.value < results[over[0]].value:
            return points
        keep(over[0], again)


Points = dict[float, tuple[Array, Array]]  # gains, and what was measured with them, by delay (s)


def _objectives(policy: Policy, gains: Array, draws: CommonDraws, delay: float = 0.0) -> Array:
    """Objective at the fresh draws, then of every resample, shape (1 + resamples,)."""
    return measured(_late(policy, delay).with_gains(gains), draws).objectives


def _late(policy: Policy, delay: float) -> Policy:
    return policy.at(DELAY, delay) if policy.follows else policy


def _between(delays: Array, advantage: Array) -> list[float]:
    """Delays between the two of the grid where an advantage first vanishes."""
    # It falls off a cliff there, where draws begin to stick: a straight line over a wide step of
    # the grid would put the crossing next to its upper end, whatever the cliff is.
    over = np.flatnonzero(advantage <= 0.0)
    if not over.size or over[0] == 0:
        return []
    k = int(over[0])
    inside = np.linspace(delays[k - 1], delays[k], STEPS + 1)[1:-1]
    return [float(delay) for delay in inside]


def _line(name: str, points: Points, constant: Array, share: float) -> DelayLine:
    """A line from what was measured: objectives of the draws, then of every resample."""
    delays = np.array(sorted(points))
    gains = np.stack([points[delay][0] for delay in delays.tolist()])
    result = np.stack([points[delay][1] for delay in delays.tolist()])
    apart = less(constant, result)
    ends = np.array([percentile_estimate(row).ends for row in apart], dtype=float)
    padded = np.zeros((len(gains), 3))
    padded[:, : gains.shape[1]] = gains
    return DelayLine(
        name=name,
        delays=delays,
        gains=padded,
        objective=result[:, 0],
        advantage=apart[:, 0],
        low=ends[:, 0],
        high=ends[:, 1],
        zero=resampled_crossing(delays, -apart),
        material=resampled_crossing(delays, -less(apart, share * constant)),
    )


@dataclass(frozen=True, eq=False)
class Advantage(Timed, kind="advantage"):
    """PI against PI with a weight that follows the bit speed, each at its own robust optimum.

    Its design's `[advantage]` and `[tune]` say what was compared and to what end.
    """

    design: Design = label(means="what was compared")
    cases: tuple[Case, ...] = label(
        over="case", flat=True,
        means="at the design's own weight and speed; the constant weight first",
    )  # fmt: skip
    regions: tuple[Regions, ...] = label(
        over="policy", flat=True, means="of each policy, over the gains of the drive"
    )
    front: Chart = label(means="over weights at the design's own speed")
    chart: Chart = label(name="map", means="over weights and speeds")
    delay: DelayCurve = label(means="against the delay of the real path")

    @property
    def baseline(self) -> Case:
        """The constant weight."""
        return self.cases[0]

    @property
    def levels(self) -> tuple[float, ...]:
        """Levels of J1 (s): those of `[map]` and that of `[tune]`."""
        own = self.design.tables
        return tuple(sorted({*own.map.levels, own.tune.level}))

    @property
    def seed(self) -> int:
        """What the fresh draws follow from."""
        return self.design.tables.advantage.seed

    def case(self, policy: str, terms: str) -> Case:
        """A case by the names of its policy and terms."""
        return next(one for one in self.cases if (one.policy, one.terms) == (policy, terms))

    @property
    def verdict(self) -> Estimate:
        """Objective with an ideal path at equal mean weight less that of the constant weight."""
        return self.case(IDEAL, MEAN.name).objective_less

    @property
    def objective(self) -> str:
        """What the gains are tuned to."""
        return self.design.tables.tune.objective_said

    def derived(self) -> dict[str, Any]:
        """Names of policies and gains."""
        return {
            "policy": ("policy", np.array(self.chart.policies, dtype=object)),
            "parameter": ("parameter", np.array(["kp", "ki", "gain"], dtype=object)),
        }

    def summary(self) -> dict[str, Any]:
        """Cases with paired differences, areas, front, map, crossing delays; SI units."""
        table, tune = self.design.tables.advantage, self.design.tables.tune
        return {
            "objective": tune.objective_name,
            "cases": {
                case.name: case.summary(self.baseline, self.levels, self.seed)
                for case in self.cases
            },
            "regions": {one.policy: one.summary() for one in self.regions},
            "front": _chart_summary(self.front),
            "map": _chart_summary(self.chart),
            "delay": self.delay.summary(),
            **picked(table, "realizations", "seed", "material"),
            "total_seconds": self.total_seconds,
        }


def _chart_summary(result: Chart) -> Any:
    shown = ("objective", "mean_weight", "advantage", "advantage_low", "advantage_high")
    policies = {
        name: {
            **{one: result.figures[one][k] for one in shown},
            "significant": result.significant(k),
        }
        for k, name in enumerate(result.policies)
    }
    return strict({"weights": result.weights, "speeds": result.speeds, "policies": policies})


@timed
def advantage(design: Design, progress: Progress = SILENT) -> Advantage:
    """Compare PI with a constant weight on bit and PI with one that follows the bit speed.

    Each is tuned to the objective of `[tune]` at the same draws and measured at fresh ones: at
    equal nominal weight, equal mean weight and equal ROP proxy; with an ideal path and a real one;
    over the gains of the drive, over weights and speeds, over delays of the path.

    Parameters
    ----------
    design : Design
        A PI is put in the place of another drive law; a weight on bit and a speed that are
        uncertain keep their nominal values. Its `[advantage]` table gives law and path of the
        weight, what is run over and how many draws.
    progress : Progress
        Receives finished searches.

    Returns
    -------
    Advantage
        Positive advantage: the weight that follows is better.

    Raises
    ------
    InputError
        A weight law that is not compared, a weight or speed outside what the rock or
        the limits of the law allow, impossible bounds, or something drawn that the study sets.

    Notes
    -----
    The law of the weight is that of Navarro-Lopez & Suarez, Proc. IEEE CCA (2004) 1454-1460.
    """
    compared = policies(design)
    checked(compared)
    table = design.tables.advantage
    speeds = table.speeds if design.speed in table.speeds else (*table.speeds, design.speed)
    cells = len(speeds) * len(table.weights) * len(compared)
    progress.begin("comparing", 2 * len(compared) + 2 * len(ALL_TERMS) + cells + len(table.delays))
    draws = fresh_draws(design)
    optima = optima_of(compared, design.tables.tune.realizations, progress)
    result = cases(compared, optima, draws, progress)
    areas = regions(compared, optima, progress)
    curve = delay_curve(compared, optima, draws, progress)
    over = chart(compared, table.weights, table.speeds, draws, progress)
    front = over.at_speed(design.speed)
    if front is None:
        front = chart(compared, table.weights, (design.speed,), draws, progress, "front_speed")
    return Advantage(
        design=design,
        cases=result,
        regions=areas,
        front=front,
        chart=over,
        delay=curve,
    )


def checked(compared: Policies) -> None:
    """Refuse (`InputError`) what would be refused in the midst of the work."""
    design = compared.constant.design
    table = design.tables.advantage
    for key, path, values in (
        ("weights", WEIGHT, table.weights), ("speeds", SPEED, table.speeds),
    ):  # fmt: skip
        for value in values:
            try:
                for policy in compared.at(path, value):
                    policy.design.bit_rock  # noqa: B018  its friction, and the limits of the law
                    policy.design.weight_on_bit  # noqa: B018
            except InputError as error:
                raise InputError(error.problem, design.where(f"advantage.{key}")) from None
    points = [table.region_points, table.region_points, table.region_realizations]
    refuse_too_large(points, "advantage.region_points", 1)
    refuse_too_large([table.realizations], "advantage.realizations")
