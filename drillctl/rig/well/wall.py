"""Dry friction of the wall, set-valued at rest, gathered at some nodes of a string.

The torque of a length is mu r N at rest and for |w| < w_c, a share of it beyond (after Aarsnes &
Shor 2018). N is that of the string rotating off bottom or under weight; it does not change in a
run. Each cell's torque goes to the two nodes about it, in inverse proportion to their distance.

A string that moves along the well at a speed v never sticks: with the drift d = v / r its torque
is that share of mu r N times w / sqrt(w^2 + d^2), and w_c bounds the sum of both velocities.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from drillctl.arrays import Array
from drillctl.rig.well.soft_string import Line, Motion, tension

BY_TORQUE = 0.3
"""Share of the torque in the measure that nodes stand in equal parts of. With 12, 16 and 20 nodes
the first slip of Well A is then within the scatter of finer ones; with 1 or 0 it is not."""

TURNING = Motion(0.0, 1.0)


class Wall(NamedTuple):
    """Friction at nodes of a string, from the top down; the last is the bit.

    Of a string that drifts the last has none: what rubs at the bit is a node of its own there,
    smooth, while the rock may still hold the bit.
    """

    nodes: tuple[int, ...]
    torque: Array  # shape (nodes,): at rest, at most (N m)
    ratio: float  # of it that is left beyond the critical speed
    critical: float  # speed (rad/s)
    drift: Array  # shape (nodes,): speed along the well over the radius (rad/s)

    @property
    def total(self) -> float:
        """Torque at rest of the whole string, at most (N m)."""
        return float(self.torque.sum())

    @property
    def drifts(self) -> bool:
        """Whether the string moves along the well."""
        return bool(self.drift.any())

    def _sliding(self, speed: Any) -> tuple[Array, Array, Array]:
        """Speed and sum of both velocities (rad/s), and what is left of the friction (N m)."""
        around = np.asarray(speed, dtype=float)[..., None]
        along = np.hypot(around, self.drift)
        return around, along, np.where(along > self.critical, self.ratio, 1.0) * self.torque

    def at_speed(self, speed: Any) -> Array:
        """Torque (N m) of all nodes while the string turns at a speed (rad/s) > 0."""
        around, along, left = self._sliding(speed)
        return np.asarray((left * around / along).sum(axis=-1))

    def slopes(self, speed: float) -> Array:
        """Growth of the torque of each node with its speed (N m s/rad): its viscous equivalent."""
        _, along, left = self._sliding(speed)
        return np.asarray(left * self.drift**2 / along**3)


def edges_of(wall: Wall, depth: Array) -> Array:
    """Measured depths (m) between which the string belongs to each node, shape (nodes + 1,)."""
    places = depth[list(wall.nodes)]
    if places[0] == places[-1]:  # the bit alone
        return np.array([0.0, *places])
    between = 0.5 * (places[:-1] + places[1:])
    first = max(0.0, places[0] - (between[0] - places[0]))
    return np.concatenate([[first], between, places[-1:]])


def cell_torque(
    line: Line, factor: Array, weight_on_bit: float, coupled: bool, motion: Motion = TURNING
) -> Array:
    """Largest torque of the wall on each cell of a string that turns (N m)."""
    up = np.array([motion.shares(float(r))[0] for r in line.radius])
    along = tension(line, -weight_on_bit, -factor * up, coupled)
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
    speed: float, well: Any,
) -> Wall:  # fmt: skip
    """Friction of a well (its table) at nodes of a string that turns at a speed (rad/s)."""
    motion = Motion(well.axial_speed, speed)
    torque = cell_torque(line, factor, weight_on_bit, well.tension, motion)
    at = _shared(line, depth[list(nodes)], torque)
    critical = well.critical_speed if well.friction_ratio < 1.0 else math.inf
    if well.axial_speed == 0.0 or not line.radius.any():  # springs without a body rub on nothing
        return Wall(nodes, at, well.friction_ratio, critical, 0.0 * at)
    # The radius at which a node rubs: of one friction factor, so that draws of it share a drift.
    alike = cell_torque(line, np.ones(len(torque)), weight_on_bit, well.tension)
    arm, sums = (_shared(line, depth[list(nodes)], x) for x in (alike * line.radius, alike))
    usual = float(line.radius.mean())
    radius = np.divide(arm, sums, out=np.full(len(at), usual), where=sums > 0.0)
    drift = abs(well.axial_speed) / radius
    return Wall(
        (*nodes, nodes[-1]), np.append(at, 0.0), well.friction_ratio, critical,
        np.append(drift, drift[-1]),
    )  # fmt: skip


def _shared(line: Line, places: Array, amount: Array) -> Array:
    """What cells have, given to the two nodes about each; at places (m), shape (nodes,)."""
    at = np.zeros(len(places))
    if len(places) == 1:
        at[0] = amount.sum()
        return at
    middle = 0.5 * (line.depth[:-1] + line.depth[1:])
    below = np.clip(np.searchsorted(places, middle), 1, len(places) - 1)
    share = np.clip((middle - places[below - 1]) / np.diff(places)[below - 1], 0.0, 1.0)
    np.add.at(at, below, share * amount)
    np.add.at(at, below - 1, (1.0 - share) * amount)
    return at
