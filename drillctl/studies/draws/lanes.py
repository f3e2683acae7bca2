"""Draws of uncertain parameters as lanes of the batch engine; impossible ones told apart."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drillctl import units
from drillctl.design import Design
from drillctl.errors import InputError
from drillctl.simulation.lanes import Lanes, kinds, lane_numbers, lanes_of
from drillctl.studies.draws.parameters import Draws
from drillctl.studies.grid import SHARED


@dataclass(frozen=True, eq=False)
class DrawnGroup:
    """Draws that share a string."""

    design: Design  # of the first of them
    lanes: Lanes  # one a draw
    numbers: NDArray[np.int64]  # shape (lanes,): Position of each among all draws


@dataclass(frozen=True)
class Failures:
    """Draws that came to nothing, for one reason."""

    reason: str  # key or cause
    count: int  # how many draws
    example: str  # what was said of the first of them


@dataclass(frozen=True, eq=False)
class DrawnLanes:
    """All draws of a design."""

    # the possible ones; a single group unless a draw changes the string or a law's type
    groups: tuple[DrawnGroup, ...]
    failures: tuple[Failures, ...]  # the impossible ones


def drawn_lanes(design: Design, draws: Draws) -> DrawnLanes:
    """Lanes of a design at every draw."""
    design = beyond_the_table(design, tuple(draws.values))
    apart = any(path.startswith(SHARED) for path in draws.values)
    possible: list[_Drawn] = []
    errors: list[InputError] = []
    like: dict[tuple[Any, ...], Design] = {}
    for number in range(len(draws)):
        values = {path: units.SI(column[number]) for path, column in draws.values.items()}
        try:
            variant = design.replace(values)
            lane = lane_numbers(variant)
        except InputError as error:
            errors.append(error)
        else:
            # Thousands of designs would fill the memory; lanes that run together need but one.
            kind = kinds(variant)
            kept = variant if apart else like.setdefault(kind, variant)
            possible.append(_Drawn(number, kept, lane))
    if not possible:
        raise InputError(f"every draw is impossible; the first: {errors[0]}", "uncertain")
    parts = [[one] for one in possible]
    if not apart:
        parts = [[one for one in possible if one.design is kept] for kept in like.values()]
    return DrawnLanes(tuple(_group(part) for part in parts), told(errors))


class _Drawn(NamedTuple):
    """A possible draw: its position, the design of its string, the numbers of its lane."""

    number: int
    design: Design
    lane: dict[str, float]


def beyond_the_table(design: Design, drawn: tuple[str, ...]) -> Design:
    """The design with its friction table extrapolated, if the weight on bit is drawn."""
    table = getattr(design.tables.bit_rock, "table", None)
    if table is None or "operating_point.weight_on_bit" not in drawn:
        return design
    return design.replace({"bit_rock.outside_table": "extrapolate"})


def _group(part: list[_Drawn]) -> DrawnGroup:
    columns = {key: np.array([one.lane[key] for one in part]) for key in part[0].lane}
    design = part[0].design
    return DrawnGroup(design, lanes_of(design, columns), np.array([one.number for one in part]))


def told(errors: list[InputError]) -> tuple[Failures, ...]:
    """Errors counted by the key that they name: their numbers differ from draw to draw."""
    by_key: dict[str, list[InputError]] = {}
    for error in errors:
        by_key.setdefault(error.where, []).append(error)
    return tuple(Failures(key, len(some), some[0].problem) for key, some in by_key.items())
