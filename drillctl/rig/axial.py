"""The axial string: masses and springs along the string, from hook to bit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from drillctl.arrays import Array
from drillctl.rig import table as q
from drillctl.rig.drillstring.assembly import APART, chain
from drillctl.rig.table import Table

HELD = 1e12
"""Mass (kg) of a top that moves at a speed of its own: nothing at the bit changes it."""


class AxialTable(Table):
    """Axial motion of the string, which a regenerative bit needs.

    `model`: `lumped`, a mass above the bit, or `elements`, the sections of the string with the
    elements that they have in torsion. `mass` of a lumped string, by default that of its
    sections. `top`: the hook holds a constant `force`, drill-string weight less weight on bit, or
    moves at the constant `velocity` at which the rig drills steadily. `damping` acts at the bit on
    what differs from steady drilling, `stiffness_damping` in the string.
    """

    model: Literal["lumped", "elements"] = "lumped"
    mass: q.Mass | None = None
    top: Literal["force", "velocity"] = "force"
    top_mass: q.MassOrZero = 0.0
    youngs_modulus: q.Modulus = 206e9
    damping: q.AxialDamping = 0.0
    stiffness_damping: q.TimeOrZero = 0.0


@dataclass(frozen=True, eq=False)
class AxialString:
    """M u'' + C (u' - v0) + K u = forces; nodes from top to bit."""

    mass: Array  # shape (nodes, nodes): kg
    damping: Array  # shape (nodes, nodes): N s/m
    stiffness: Array  # shape (nodes, nodes): N/m
    impedance: float = 0.0  # at the bit, of a string of elements (N s/m); 0 of a lumped one

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return len(self.mass)

    @cached_property
    def modes(self) -> tuple[Array, Array]:
        """Angular frequencies (rad/s), and mass-normalised shapes by column; the rigid body first.

        With one BLAS thread, as another count gives other bits.
        """
        import scipy.linalg
        from threadpoolctl import threadpool_limits

        with threadpool_limits(limits=1, user_api="blas"):
            squares, shapes = scipy.linalg.eigh(self.stiffness, self.mass)
        squares[0] = 0.0
        shapes[:, 0] = 1.0 / np.sqrt(self.mass.sum())
        return np.sqrt(np.maximum(squares, 0.0)), np.asarray(shapes)

    @cached_property
    def total(self) -> float:
        """Mass that moves with the bit (kg), without a top that does not."""
        return float(self.mass.sum() - (HELD if self.mass[0, 0] > 0.5 * HELD else 0.0))


def axial_string(table: AxialTable, stiffness: Array, mass: Array, consistent: bool) -> AxialString:
    """The axial string of elements, shape (elements,): springs (N/m) and masses (kg)."""
    top = HELD if table.top == "velocity" else table.top_mass
    if table.model == "lumped" and table.top == "force":
        total = np.array([[float(mass.sum()) + top]])
        return AxialString(total, np.array([[table.damping]]), np.zeros((1, 1)))
    lumped = table.model == "lumped"
    share = (0.0, 0.0) if lumped else (1 / 3, 1 / 6) if consistent else (1 / 2, 0.0)
    m = chain(mass, share).toarray()
    m[-1, -1] += mass.sum() if lumped else 0.0
    k = chain(stiffness, APART).toarray()
    c = chain(table.stiffness_damping * stiffness, APART).toarray()
    m[0, 0] += top
    c[-1, -1] += table.damping
    impedance = 0.0 if lumped else math.sqrt(stiffness[-1] * mass[-1])
    return AxialString(m, c, k, impedance)
