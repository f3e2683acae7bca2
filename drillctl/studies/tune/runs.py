"""Runs of many gains at the same draws by the batch engine, every trajectory counted."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design
from drillctl.ensemble.draws import DrawnGroup, Failures, drawn_lanes
from drillctl.ensemble.parameters import draw
from drillctl.ensemble.running import measured
from drillctl.errors import InputError
from drillctl.simulation.batch import Prepared, prepare, trace
from drillctl.simulation.lanes import Lanes
from drillctl.studies.tune.tuned import (
    StringNumbers,
    Tuned,
    controller_paths,
    drive_numbers,
    middle,
    put,
    string_numbers,
    tracked,
)

Array = NDArray[np.float64]

SAMPLED = 0.1  # distance of the samples that an effort is read from (s)
TOGETHER = 20_000  # lanes made at a time: bounds the memory


@dataclass(frozen=True, eq=False)
class Ready:
    """A group of realizations that share a string, ready to run."""

    group: DrawnGroup
    prepared: Prepared
    string: StringNumbers


class GainRuns:
    """Measures of gains at the realizations of a design.

    The realizations are the first of one sequence, the same for all gains: what is compared is
    compared under the same conditions, and more of them begin with the same ones.
    """

    def __init__(
        self, design: Design, tuned: tuple[Tuned, ...], realizations: int, seed: int
    ) -> None:
        self.design, self.tuned = middle(design, tuned), tuned
        self.draws = draw(self.design, realizations, seed)
        self.trajectories = 0
        self._at_once = _at_once(self.design, tuned)
        drawn = drawn_lanes(self.design, self.draws)
        self.failures: tuple[Failures, ...] = drawn.failures
        self.groups = [self._ready(group) for group in drawn.groups]
        self.numbers = np.sort(np.concatenate([g.group.numbers for g in self.groups]))

    def __len__(self) -> int:
        return len(self.numbers)

    def _ready(self, group: DrawnGroup) -> Ready:
        table = group.design.tables.simulation
        return Ready(group, prepare(group.lanes, table), string_numbers(group.design.string))

    def measures(
        self, points: Array, names: tuple[str, ...], first: int = 0, last: int | None = None,
        give_up: float = math.inf,
    ) -> dict[str, Array]:  # fmt: skip
        """Measures of points at realizations."""
        chosen = self.numbers[first:last]
        results = {name: np.full((len(points), len(chosen)), np.nan) for name in names}
        if not self._at_once:
            for row, point in enumerate(points):
                self._one_by_one(point, chosen, results, row, give_up)
        else:
            for ready in self.groups:
                members = np.flatnonzero(np.isin(ready.group.numbers, chosen))
                if len(members):
                    columns = np.searchsorted(chosen, ready.group.numbers[members])
                    self._group(points, ready, members, columns, results, give_up)
        self.trajectories += len(points) * len(chosen)
        if "j1" in results:
            results["j1"] = np.where(np.isnan(results["j1"]), math.inf, results["j1"])
        return results

    def _group(
        self, points: Array, ready: Ready, members: NDArray[np.int64],
        columns: NDArray[np.int64], result: dict[str, Array], give_up: float,
    ) -> None:  # fmt: skip
        """All points at the realizations that share a string."""
        most = TOGETHER // (20 if "effort" in result else 1)  # traces take more room
        rows = max(1, most // len(members))
        for begin in range(0, len(points), rows):
            some = points[begin : begin + rows]
            lanes = self._lanes(some, ready, members)
            for name, values in _run(lanes, ready.prepared, tuple(result), give_up).items():
                place = np.ix_(np.arange(begin, begin + len(some)), columns)
                result[name][place] = values.reshape(len(some), len(members))

    def _lanes(self, points: Array, ready: Ready, members: NDArray[np.int64]) -> Lanes:
        """Every point at every member, point by point."""
        lanes = ready.group.lanes[np.tile(members, len(points))]
        columns = {t.path: np.repeat(points[:, k], len(members)) for k, t in enumerate(self.tuned)}
        numbers: dict[str, Any] = {}
        if any(path.startswith("controller.") for path in columns):
            numbers = drive_numbers(ready.group.design, columns, ready.string)
            numbers = tracked(ready.group.design, numbers)
        drive = lanes.drive._replace(
            **{
                k: np.broadcast_to(np.asarray(v, float), len(lanes)).copy()
                for k, v in numbers.items()
                if k in lanes.drive._fields
            }
        )
        weight = lanes.weight
        if "weight_on_bit.gain" in columns:
            weight = weight._replace(gain=columns["weight_on_bit.gain"])
        return replace(lanes, drive=drive, weight=weight)

    def _one_by_one(
        self, point: Array, chosen: NDArray[np.int64], result: dict[str, Array], row: int,
        give_up: float,
    ) -> None:  # fmt: skip
        """A point whose lanes are made anew from the design: any parameter may be tuned."""
        try:
            drawn = drawn_lanes(put(self.design, self.tuned, point), self.draws)
        except InputError:  # no rig at all
            return
        for group in drawn.groups:
            members = np.flatnonzero(np.isin(group.numbers, chosen))
            if len(members) == 0:
                continue
            lanes = group.lanes[members]
            prepared = prepare(lanes, group.design.tables.simulation)
            columns = np.searchsorted(chosen, group.numbers[members])
            for name, values in _run(lanes, prepared, tuple(result), give_up).items():
                result[name][row, columns] = values


def _at_once(design: Design, tuned: tuple[Tuned, ...]) -> bool:
    """Whether lanes differ in numbers of drive and weight law alone, which are known."""
    known = [*controller_paths(design)]
    if hasattr(design.weight_on_bit, "gain"):
        known.append("weight_on_bit.gain")
    drawn = any(path.startswith("controller.") for path in design.tables.uncertain)
    return all(t.path in known for t in tuned) and not drawn


def _run(
    lanes: Lanes, prepared: Prepared, names: tuple[str, ...], give_up: float
) -> dict[str, Array]:
    kept = tuple(name for name in names if name != "effort")
    result = measured(lanes, prepared, kept, give_up).measures
    if "effort" in names:
        result["effort"] = _effort(lanes, prepared)
    return result


def _effort(lanes: Lanes, prepared: Prepared) -> Array:
    """Root mean square of the top torque less its steady value (N m)."""
    from drillctl.linear.operating_point import rock_at

    _, signals = trace(lanes, prepared, SAMPLED)
    steady, _ = rock_at(lanes.friction, lanes.weight, lanes.set_speed)
    drag = float(lanes.string.ground_damping.sum()) * lanes.set_speed
    return np.asarray(np.sqrt(np.mean((signals["top_torque"] - steady - drag) ** 2, axis=0)))
