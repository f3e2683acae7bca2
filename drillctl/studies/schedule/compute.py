"""Gains over the depth: in tune at each, kept from an earlier one, and where they must change."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from drillctl import units
from drillctl.arrays import Array
from drillctl.design import Design
from drillctl.ensemble.cases import Interval, share_interval
from drillctl.errors import InputError
from drillctl.linear.tuning import drive_impedance
from drillctl.progress import SILENT, Progress
from drillctl.store.codec import label
from drillctl.store.json_files import picked, strict
from drillctl.store.result import Timed, timed
from drillctl.store.tables import percent
from drillctl.studies.recommend.assess import drawn
from drillctl.studies.recommend.candidates import gains_of
from drillctl.studies.recommend.window import window
from drillctl.studies.schedule.strings import Along
from drillctl.studies.tune.search import optimum, polished, search_problem
from drillctl.studies.tune.tuned import default_ranges, put

STAYS = 1.1
"""Merit, over that of a search from nowhere, up to which gains stay in the valley of the depth
before: between two valleys, where the table of stands would go, there are no good gains."""
HALVINGS = 24  # of the stretch in which gains must be changed


@dataclass(frozen=True, eq=False)
class Row:
    """One depth with gains in tune."""

    depth: float = label(means="or another value along the schedule (SI)")
    period: float = label(unit="s", means="of the lowest mode with the top held")
    gains: dict[str, float] = label(means="numbers of the drive by path (SI)")
    reflection: float = label(means="of a wave at that period, its magnitude; NaN without a pipe")
    j1: float = label(unit="s", means="median over the draws")
    hits: int = label(means="draws at or under the level")
    draws: int = label(means="of them all")
    lowest_speed: float | None = label(unit="rad/s", means="down to which the bit does not stick")
    highest_weight: float | None = label(unit="N", means="up to which it does not")
    stale_gains: dict[str, float] = label(means="of an earlier depth")
    stale_reflection: float = label(means="with these")
    stale_hits: int = label(means="draws at or under the level with these")

    @property
    def probability(self) -> float:
        """Share of the draws."""
        return self.hits / self.draws

    @property
    def interval(self) -> Interval:
        """Its interval, 95 %."""
        return share_interval(self.hits, self.draws)

    @property
    def stale_probability(self) -> float:
        """The share with gains of an earlier depth."""
        return self.stale_hits / self.draws

    def summary(self) -> dict[str, Any]:
        """Strict JSON values, SI."""
        return dict(strict({
            **picked(
                self, "depth", "period", "gains", "reflection", "stale_reflection", "j1",
                "probability", "lowest_speed", "stale_gains", "stale_probability",
            ),
            "interval_95": list(self.interval),
            "highest_weight_on_bit": self.highest_weight,
        }))  # fmt: skip


@dataclass(frozen=True, eq=False)
class Change:
    """Where gains must be changed, going deeper."""

    depth: float  # SI
    before: float  # depth that the gains until there were in tune at (SI)
    reason: str  # in words


@dataclass(frozen=True, eq=False)
class Schedule(Timed, kind="schedule"):
    """Gains over the depth, or along another axis."""

    design: Design = label(means="as it was given")
    path: str = label(means="`depth`, or the path of the axis")
    unit: str = label(means="of the values along it")
    law: str = label(means="whose gains are scheduled")
    rows: tuple[Row, ...] = label(means="by increasing depth")
    changes: tuple[Change, ...] = label(means="where gains must be changed")
    stands: Array = label("stand", name="stand", means="values along the axis, a stand apart")
    stand_gains: dict[str, Array] = label("stand", means="gains at each (SI), by path")

    @property
    def costs(self) -> float:
        """Most reflection that gains of `kept_from` times the depth add; NaN where none does."""
        added = [one.stale_reflection - one.reflection for one in self.rows]
        return max((x for x in added if math.isfinite(x)), default=math.nan)

    @property
    def hardly_needed(self) -> bool:
        """Whether keeping gains over `kept_from` to 1 of a depth costs next to nothing."""
        return bool(self.costs <= self.design.tables.schedule.material and not self.lost)

    @property
    def lost(self) -> tuple[Row, ...]:
        """Depths at which gains in tune keep the required probability, and earlier ones do not."""
        required = self.design.tables.tune.probability
        return tuple(x for x in self.rows if x.probability >= required > x.stale_probability)

    @property
    def short(self) -> tuple[Row, ...]:
        """Depths at which gains in tune keep the level with less than the required probability."""
        required = self.design.tables.tune.probability
        return tuple(one for one in self.rows if one.probability < required)

    @property
    def sentence(self) -> str:
        """Whether a schedule is needed, and where gains must change; quantities in full."""
        table = self.design.tables.schedule
        first, last = (units.full(x.depth, self.unit, 5) for x in (self.rows[0], self.rows[-1]))
        over = f"{100.0 * (1.0 / table.kept_from - 1.0):.0f} %"
        further = f"{over} deeper" if self.path == "depth" else f"{over} further in {self.path}"
        costs = []
        if not math.isnan(self.costs):
            costs.append(f"reflect up to {self.costs:.3f} more than gains in tune")
        if self.lost:
            at = ", ".join(units.full(one.depth, self.unit, 5) for one in self.lost)
            costs.append(f"lose the required probability at {at}")
        cost = f": gains kept until it is {further} {' and '.join(costs)}" if costs else ""
        needed = "Almost no schedule is needed" if self.hardly_needed else "A schedule is needed"
        begin = f"{needed} from {first} to {last}{cost}"
        if not self.changes:
            return f"{begin}. Going on, the gains of {first} do to the end."
        places: dict[str, list[str]] = {}
        for one in self.changes:
            places.setdefault(one.reason, []).append(units.full(one.depth, self.unit, 5))
        changes = "; ".join(f"at {', '.join(at)} ({why})" for why, at in places.items())
        return f"{begin}. Going on, set new gains {changes}."

    def summary(self) -> dict[str, Any]:
        """Strict JSON values, SI."""
        return {
            "axis": self.path,
            "law": self.law,
            "rows": [one.summary() for one in self.rows],
            "change_at": [one.depth for one in self.changes],
            "changes": [picked(one, "depth", "before", "reason") for one in self.changes],
            "hardly_needed": self.hardly_needed,
            "sentence": self.sentence,
            "stands": len(self.stands),
            **picked(self, "total_seconds"),
        }


@timed
def schedule(design: Design, progress: Progress = SILENT) -> Schedule:
    """Schedule the gains of a drive over the depth of the well.

    Parameters
    ----------
    design : Design
        Its `[schedule]` table says over what, of which law, and when gains must be changed.
    progress : Progress
        Receives each depth.

    Returns
    -------
    Schedule

    Raises
    ------
    InputError
        A depth that the string cannot have, or a law that does not apply to it.
    """
    along = Along(design)
    depths = along.values()
    for depth in (depths[0], depths[-1]):  # refused before anything is searched
        _ = along.by_rule(float(depth)).top_drive
    progress.begin("depths", len(depths))
    tuned = _Tuned(along)
    for depth in depths:
        tuned.add(float(depth))
        progress.advance(1)
    rows = tuple(_row(tuned, float(depth)) for depth in depths)
    stands = _stands(design, depths, along)
    at_stands = [tuned.gains(float(x)) for x in stands]
    return Schedule(
        design=design,
        path=along.path,
        unit=along.unit,
        law=along.asked.law,
        rows=rows,
        changes=_changes(tuned, rows),
        stands=stands,
        stand_gains={path: np.array([one[path] for one in at_stands]) for path in at_stands[0]},
    )


class _Tuned:
    """Gains in tune at any depth: by the rule of the law, or between those that were searched."""

    def __init__(self, along: Along) -> None:
        self.along = along
        self.searched: dict[float, dict[str, float]] = {}

    def add(self, depth: float) -> None:
        """Search the gains of a depth, from those of the depth before; a rule needs no search."""
        if self.along.asked.law != "tuned":
            return
        before = self.searched[max(self.searched)] if self.searched else None
        self.searched[depth] = searched(self.along.by_rule(depth), before)

    def gains(self, depth: float) -> dict[str, float]:
        """Gains (SI) by path."""
        if not self.searched:
            return gains_of(self.along.by_rule(depth))
        if depth in self.searched:
            return self.searched[depth]
        # They go with powers of the depth: straight lines in logarithms.
        at = np.array(list(self.searched))
        return {
            path: _between(depth, at, np.array([one[path] for one in self.searched.values()]))
            for path in self.searched[float(at[0])]
        }

    def design(self, depth: float, gains: dict[str, float]) -> Design:
        """The design at a depth with any gains."""
        made = self.along.by_rule(depth)
        return made.replace({path: units.SI(value) for path, value in gains.items()})


def _between(depth: float, at: Array, values: Array) -> float:
    if (at <= 0.0).any() or (values <= 0.0).any():
        return float(np.interp(depth, at, values))
    return float(np.exp(np.interp(math.log(depth), np.log(at), np.log(values))))


def searched(design: Design, before: dict[str, float] | None) -> dict[str, float]:
    """Gains of the least objective at a depth, from those of the depth before."""
    few = min(design.tables.schedule.realizations, design.tables.tune.realizations)
    design = design.replace({"tune.realizations": few})
    tuned = default_ranges(design)
    problem = search_problem(design, tuned)
    best = optimum(problem, ends=1)
    if before is not None:
        values = problem.shares(np.array([before[t.path] for t in tuned]))
        (start,) = problem.points(problem.values(values)[None, :], len(problem))
        near = polished(problem, start)
        best = near if near.merit <= STAYS * best.merit else best
    return gains_of(put(design, tuned, best.values))


def reflection(design: Design) -> float:
    """Magnitude of the reflection at the lowest frequency with the top held; NaN without a pipe."""
    omega = design.string.stick_slip_frequency
    try:
        seen = drive_impedance(design, omega / (2.0 * math.pi), "")
    except InputError:
        return math.nan
    return float(abs(seen.reflection[0]))


def _row(tuned: _Tuned, depth: float) -> Row:
    """One depth, simulated with the gains in tune and with those of an earlier depth."""
    design, asked = tuned.along.design, tuned.along.asked
    level, count = design.tables.tune.level, asked.realizations
    own = tuned.gains(depth)
    there = tuned.design(depth, own)
    earlier = tuned.gains(tuned.along.earlier(depth))
    stale = tuned.design(depth, earlier)
    j1, _ = drawn(there, count)
    kept, _ = drawn(stale, count)
    where = window(there)
    return Row(
        depth=depth,
        period=2.0 * math.pi / there.string.stick_slip_frequency,
        gains=own,
        reflection=reflection(there),
        j1=float(np.median(j1)),
        hits=int(np.count_nonzero(j1 <= level)),
        draws=count,
        lowest_speed=where.lowest_speed,
        highest_weight=where.highest_weight,
        stale_gains=earlier,
        stale_reflection=reflection(stale),
        stale_hits=int(np.count_nonzero(kept <= level)),
    )


def _changes(tuned: _Tuned, rows: tuple[Row, ...]) -> tuple[Change, ...]:
    """Where gains must be changed, each time to those in tune there."""
    results: list[Change] = []
    held = rows[0].depth
    for above, row in itertools.pairwise(rows):
        while held < row.depth and (reason := _worn(tuned, held, row)):
            last = max(held, above.depth)
            depth = _place(tuned, held, last, row.depth) if "reflect" in reason else last
            depth = row.depth if depth <= held else depth
            results.append(Change(depth, held, reason))
            held = depth
    return tuple(results)


def _worn(tuned: _Tuned, held: float, row: Row) -> str:
    """Why gains in tune at `held` will not do at a row; empty if they do."""
    asked, table = tuned.along.asked, tuned.along.design.tables.tune
    gains = tuned.gains(held)
    kept = tuned.design(row.depth, gains)
    added = reflection(kept) - row.reflection
    if added > asked.reflection:
        return f"there the old ones reflect {asked.reflection:g} more than those in tune"
    if row.probability < table.probability:
        return ""
    j1, _ = drawn(kept, asked.realizations)
    share = float(np.mean(j1 <= table.level))
    if share < table.probability:
        return f"further on the old ones have P(J1 <= {table.level:g} s) of {percent(share)}"
    return ""


def _place(tuned: _Tuned, held: float, low: float, high: float) -> float:
    """Depth at which gains in tune at `held` begin to reflect too much."""
    gains, most = tuned.gains(held), tuned.along.asked.reflection
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        own = tuned.design(middle, tuned.gains(middle))
        worn = reflection(tuned.design(middle, gains)) - reflection(own) > most
        low, high = (low, middle) if worn else (middle, high)
    return low


MOST_STANDS = 2000


def _stands(design: Design, depths: Array, along: Along) -> Array:
    """Values along the axis a stand apart, or the depths themselves of any other axis."""
    if along.path != "depth":
        return depths
    step = max(design.tables.schedule.stand, (depths[-1] - depths[0]) / MOST_STANDS)
    count = math.ceil((depths[-1] - depths[0]) / step)
    return np.minimum(depths[0] + step * np.arange(count + 1), depths[-1])
