"""Tension, side force and torque of a string without bending stiffness (Aarsnes & Shor 2018).

With the effective tension F, the weight in mud per length q and the tangent t downwards along the
well, the wall bears per length

    N = |F dt/ds + q (g - (g t) t)|,
    N^2 = (q sin i - F di/ds)^2 + (F sin i da/ds)^2,

the direction g straight down, i inclination and a azimuth; and upwards along the string

    dF/ds = q cos i  (+ mu N pulled out, - mu N run in),    F(bit) = -weight on bit.

The mud presses on all of the steel (pressure areas): q = g (m + rho_in A_in - rho_out A_out). Where
a string slides and turns at once, mu N acts against the sum of both velocities: a share
r w / sqrt((r w)^2 + v^2) of it on the torque, the other leg of the triangle on the tension.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from drillctl.arrays import Array
from drillctl.rig.well.survey import Path

GRAVITY = 9.81  # m/s2
LONGEST_CELL = 5.0  # m


class Run(NamedTuple):
    """A part of the string in one hole."""

    name: str  # of its section
    # measured depths of its ends (m)
    top: float
    bottom: float
    mass: float  # of its steel per length (kg/m)
    displaced: float  # outer less inner area: mud that it takes the place of (m2)
    radius: float  # at which it touches the wall (m)
    bending: float  # E I (N m2); 0 where its cross-section is not known
    clearance: float  # radial, between string and wall (m); 0 where no hole is given


class Motion(NamedTuple):
    """How a string moves in its well."""

    axial: float  # downwards (m/s); without rotation its sign alone counts
    turning: float  # rad/s

    def shares(self, radius: float) -> tuple[float, float]:
        """Shares of the friction in the tension (upwards positive) and in the torque."""
        around = abs(radius * self.turning)
        speed = math.hypot(around, self.axial)
        return (0.0, 0.0) if speed == 0.0 else (self.axial / speed, around / speed)


@dataclass(frozen=True, eq=False)
class Line:
    """A string laid into its well, cut into cells; ends of cells from the top to the bit."""

    depth: Array  # shape (ends,): measured depth (m)
    run: Array  # shape (cells,): number of its `Run`
    # shape (3, cells): at top, middle and bottom of each: cos i, |bend|^2, bend g, sin^2 i
    fall: Array
    bend_bend: Array
    bend_down: Array
    side_side: Array
    weight: Array  # shape (cells,): in mud per length (N/m)
    radius: Array  # shape (cells,): m

    @property
    def length(self) -> Array:
        """Of each cell (m)."""
        return np.diff(self.depth)

    def side_force(self, place: int, tension: Array) -> Array:
        """Force of the wall per length (N/m) at top, middle or bottom of every cell."""
        q = self.weight
        square = q * q * self.side_side[place] + tension * (
            2.0 * q * self.bend_down[place] + tension * self.bend_bend[place]
        )
        return np.sqrt(np.maximum(square, 0.0))

    def side_forces(self, tension: Array) -> tuple[Array, Array]:
        """The same in the middle and on the mean of every cell; of the tension at the ends (N)."""
        above, below = tension[:-1], tension[1:]
        top, middle, bottom = (
            self.side_force(k, force)
            for k, force in enumerate((above, 0.5 * (above + below), below))
        )
        return middle, (top + 4.0 * middle + bottom) / 6.0


def lay(path: Path, runs: tuple[Run, ...], mud_density: float) -> Line:
    """A string cut into cells, each of one run and one arc."""
    stops = {runs[0].top, *(run.bottom for run in runs)}
    stops |= {float(d) for d in path.depth if runs[0].top < d < runs[-1].bottom}
    edges = np.array(sorted(stops))
    edges = edges[np.concatenate([[True], np.diff(edges) > 1e-9])]
    parts = [
        np.linspace(a, b, 1 + math.ceil((b - a) / LONGEST_CELL))[:-1] for a, b in pairwise(edges)
    ]
    depth = np.concatenate([*parts, edges[-1:]])
    middle = 0.5 * (depth[:-1] + depth[1:])
    bottoms = np.array([run.bottom for run in runs])
    number = np.minimum(np.searchsorted(bottoms, middle), len(runs) - 1)
    # Just inside of the ends: a cell belongs to one arc.
    inside = 1e-9 * (depth[1:] - depth[:-1])
    rows = []
    for at in (depth[:-1] + inside, middle, depth[1:] - inside):
        _, tangent, bend = path.at(at)
        fall = tangent[:, 2]
        rows.append((fall, (bend * bend).sum(axis=1), bend[:, 2], np.maximum(1.0 - fall**2, 0.0)))
    weights = np.array([GRAVITY * (run.mass - mud_density * run.displaced) for run in runs])
    fall, bend_bend, bend_down, side_side = (np.array(x) for x in zip(*rows, strict=True))
    return Line(
        depth, number, fall, bend_bend, bend_down, side_side,
        weights[number], np.array([run.radius for run in runs])[number],
    )  # fmt: skip


def tension(line: Line, at_bit: float, drag: Array, coupled: bool = True) -> Array:
    """Effective tension at the ends of the cells (N); `drag`: friction factor with its sign.

    Without drag it is the weight that hangs below; with it each cell is a step of Runge & Kutta.
    """
    if not drag.any():
        mean = (line.fall[0] + 4.0 * line.fall[1] + line.fall[2]) / 6.0
        hanging = np.cumsum((line.weight * mean * line.length)[::-1])[::-1]
        return np.asarray(at_bit + np.concatenate([hanging, [0.0]]))
    result = np.empty(len(line.depth))
    result[-1] = force = at_bit
    counts = 1.0 if coupled else 0.0
    q, side = line.weight, line.side_side
    bb, bg = counts * line.bend_bend, counts * line.bend_down
    fall, length = line.fall, line.length

    def rate(i: int, place: int, force: float) -> float:
        square = q[i] ** 2 * side[place, i] + force * (
            2.0 * q[i] * bg[place, i] + force * bb[place, i]
        )
        return float(q[i] * fall[place, i] + drag[i] * math.sqrt(max(square, 0.0)))

    for i in range(len(length) - 1, -1, -1):
        h = float(length[i])
        a = rate(i, 2, force)
        b = rate(i, 1, force + 0.5 * h * a)
        c = rate(i, 1, force + 0.5 * h * b)
        d = rate(i, 0, force + h * c)
        result[i] = force = force + h / 6.0 * (a + 2.0 * (b + c) + d)
    return result


@dataclass(frozen=True, eq=False)
class Drag:
    """A string in its well, moved in one way."""

    # shape (ends,): measured depth (m), effective tension (N) and torque (N m)
    depth: Array
    tension: Array
    torque: Array
    side_force: Array  # shape (cells,): force of the wall per length in the middle of each (N/m)

    @property
    def hook_load(self) -> float:
        """What hangs at the rig (N); without block and hook."""
        return float(self.tension[0])


def drag(
    line: Line, friction: Array, motion: Motion, weight_on_bit: float, bit_torque: float,
    coupled: bool = True,
) -> Drag:  # fmt: skip
    """Lay a string under load; `friction`: factor of each cell; `coupled`: tension counts in N."""
    # Against a string that goes down the friction acts upwards: tension grows less.
    shares = np.array([motion.shares(float(r)) for r in line.radius])
    along = tension(line, -weight_on_bit, -friction * shares[:, 0], coupled)
    middle, mean = line.side_forces(along if coupled else 0.0 * along)
    each = mean * line.length * friction * shares[:, 1] * line.radius
    torque = bit_torque + np.concatenate([np.cumsum(each[::-1])[::-1], [0.0]])
    return Drag(line.depth, along, torque, middle)


def sinusoidal_limit(line: Line, runs: tuple[Run, ...]) -> Array:
    """Compression (N) at which each cell begins to buckle; infinite where that is not known.

    After Dawson & Paslay, J. Pet. Technol. 36 (1984) 1734-1738: 2 sqrt(E I q sin i / r), with r the
    radial clearance. In a vertical hole it says nothing.
    """
    bending = np.array([run.bending for run in runs])[line.run]
    clearance = np.array([run.clearance for run in runs])[line.run]
    known = (bending > 0.0) & (clearance > 0.0) & (line.side_side[1] > 0.0)
    sine = np.sqrt(line.side_side[1])
    with np.errstate(divide="ignore", invalid="ignore"):
        limit = 2.0 * np.sqrt(bending * line.weight * sine / clearance)
    return np.where(known, limit, np.inf)
