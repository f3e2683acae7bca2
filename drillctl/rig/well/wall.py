"""Dry friction of the wall, set-valued at rest, gathered at some nodes of a string.

The torque of a length is mu r N at rest and for |w| < w_c, a share of it beyond (after Aarsnes &
Shor 2018). N is that of the string rotating off bottom or under weight; it does not change in a
run. Each cell's torque goes to the two nodes about it, in inverse proportion to their distance.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from drillctl.arrays import Array
from drillctl.rig.well.soft_string import Line, tension

BY_TORQUE = 0.3
"""Share of the torque in the measure that nodes stand in equal parts of. With 12, 16 and 20 nodes
the first slip of Well A is then within the scatter of finer ones; with 1 or 0 it is not."""


class Wall(NamedTuple):
    """Friction at nodes of a string, from the top down; the last is the bit."""

    nodes: tuple[int, ...]
    torque: Array  # shape (nodes,): at rest, at most (N m)
    ratio: float  # of it that is left beyond the critical speed
    critical: float  # speed (rad/s)

    @property
    def total(self) -> float:
        """Torque at rest of the whole string, at most (N m)."""
        return float(self.torque.sum())


def edges_of(wall: Wall, depth: Array) -> Array:
    """Measured depths (m) between which the string belongs to each node, shape (nodes + 1,)."""
    places = depth[list(wall.nodes)]
    if len(places) == 1:
        return np.array([0.0, places[0]])
    between = 0.5 * (places[:-1] + places[1:])
    first = max(0.0, places[0] - (between[0] - places[0]))
    return np.concatenate([[first], between, places[-1:]])


def cell_torque(line: Line, factor: Array, weight_on_bit: float, coupled: bool) -> Array:
    """Largest torque of the wall on each cell of a string that turns (N m)."""
    along = tension(line, -weight_on_bit, 0.0 * factor)
    _, mean = line.side_forces(along if coupled else 0.0 * along)
    return np.asarray(mean * factor * line.radius * line.length)


@lru_cache(maxsize=16)
def choose_nodes(
    line: Line, depth: tuple[float, ...], count: int, coupled: bool
) -> tuple[int, ...]:
    """Nodes for the friction of a string, the bit the last.

    Each stands in the middle of equal parts of a measure, three tenths the torque of the wall and
    seven tenths the length on which it rubs; the bit at the end of half a part. Torque alone would
    leave the front of slip gaps to jump over. Of the string in air without weight on bit and with
    one friction factor: other numbers of the same string have the same nodes.
    """
    bit = len(depth) - 1
    torque = cell_torque(line, np.ones(len(line.run)), 0.0, coupled)
    if count == 1 or not torque.any():
        return (bit,)
    rubs = (torque > 1e-9 * torque.max()) * line.length
    measure = BY_TORQUE * torque / torque.sum() + (1.0 - BY_TORQUE) * rubs / rubs.sum()
    sums = np.concatenate([[0.0], np.cumsum(measure)])
    middles = (np.arange(count - 1) + 0.5) / (count - 0.5)
    wanted = np.interp(middles * sums[-1], sums, line.depth)
    found = {int(np.abs(np.array(depth) - place).argmin()) for place in wanted}
    return tuple(sorted((found | {bit}) - {0}))


def lumped(
    line: Line, depth: Array, nodes: tuple[int, ...], factor: Array, weight_on_bit: float,
    well: Any,
) -> Wall:  # fmt: skip
    """Friction of a well (its table) at nodes."""
    torque = cell_torque(line, factor, weight_on_bit, well.tension)
    middle = 0.5 * (line.depth[:-1] + line.depth[1:])
    places = depth[list(nodes)]
    below = np.clip(np.searchsorted(places, middle), 1, max(len(nodes) - 1, 1))
    at = np.zeros(len(nodes))
    if len(nodes) == 1:
        at[0] = torque.sum()
    else:
        share = np.clip((middle - places[below - 1]) / np.diff(places)[below - 1], 0.0, 1.0)
        np.add.at(at, below, share * torque)
        np.add.at(at, below - 1, (1.0 - share) * torque)
    critical = well.critical_speed if well.friction_ratio < 1.0 else math.inf
    return Wall(nodes, at, well.friction_ratio, critical)
