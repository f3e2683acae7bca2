"""Natural frequencies, damping ratios and shapes of a string; the string as a sum of its modes.

In coordinates q of the undamped modes the string is q'' + D q' + w^2 q = 0 with D = Phi^T C Phi.
Where D is diagonal each mode is a quadratic with roots in closed form; else the first-order matrix
in (w q, q') is solved, in which all entries are of the size of frequencies.

Damping that is given mode by mode couples all nodes and has no place in a transmission line: seen
from its ends such a string is a sum over its modes (`Expansion`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg

from drillctl.arrays import Array, ComplexArray, own_errstate
from drillctl.design import Design
from drillctl.errors import InputError
from drillctl.linear.transmission import EndMobility, FromMobility
from drillctl.rig.drillstring import Drillstring
from drillctl.store.codec import label
from drillctl.store.result import Result

DIAGONAL = 1e-10
"""Largest off-diagonal entry of a modal damping matrix taken as rounding, over the largest."""


class Pole(NamedTuple):
    """One pole in the upper half plane, the real axis included."""

    value: complex  # of the pole (rad/s)
    shape: ComplexArray  # shape (nodes,): Angles of the nodes, to a complex factor


def free_free_poles(string: Drillstring) -> list[Pole]:
    """Poles of the string with both ends free, by magnitude; the rigid body is the first."""
    frequency, shapes = string.undamped_modes
    damping = shapes.T @ (string.damping @ shapes)
    rigid = Pole(0.0, shapes[:, 0].astype(complex))
    braked = bool(string.ground_damping.any())
    kept = slice(0 if braked else 1, None)
    result = _poles(frequency[kept], damping[kept, kept], shapes[:, kept])
    return [rigid, *sorted(result, key=_size)]


def fixed_top_poles(string: Drillstring) -> list[Pole]:
    """Poles of the string with the top drive held, by magnitude."""
    from threadpoolctl import threadpool_limits

    # One BLAS thread, since another count gives other bits.
    with threadpool_limits(limits=1, user_api="blas"):
        squares, below = scipy.linalg.eigh(
            string.stiffness.toarray()[1:, 1:], string.mass.toarray()[1:, 1:]
        )
    shapes = np.vstack([np.zeros(len(squares)), below])
    damping = shapes.T @ (string.damping @ shapes)
    return sorted(_poles(np.sqrt(squares), damping, shapes), key=_size)


def _size(pole: Pole) -> float:
    return abs(pole.value)


def _poles(frequency: Array, damping: Array, shapes: Array) -> list[Pole]:
    """Poles of q'' + D q' + w^2 q = 0; of a mode with w = 0 that of its speed alone."""
    # Which modes a damping matrix couples depends on the boundary: tested here for each.
    off_diagonal = damping - np.diag(np.diagonal(damping))
    if np.all(np.abs(off_diagonal) <= DIAGONAL * np.abs(damping).max(initial=0.0)):
        return [
            Pole(value, shapes[:, i].astype(complex))
            for i, w in enumerate(frequency)
            for value in quadratic_poles(float(w), float(damping[i, i]))
        ]
    return _coupled_poles(frequency, damping, shapes)


def quadratic_poles(frequency: float, damping: float) -> list[complex]:
    """Roots of s^2 + damping s + frequency^2, of a conjugate pair the upper one."""
    half = damping / 2.0
    if half < frequency:
        return [complex(-half, math.sqrt((frequency - half) * (frequency + half)))]
    # The smaller root from the product of both: their difference would cancel.
    fast = half + math.sqrt((half - frequency) * (half + frequency))
    return (
        [complex(-fast)] if frequency == 0.0 else [complex(-fast), complex(-(frequency**2) / fast)]
    )


def _coupled_poles(frequency: Array, damping: Array, shapes: Array) -> list[Pole]:
    modes = len(frequency)
    elastic = np.flatnonzero(frequency)
    stiffness = np.zeros((len(elastic), modes))
    stiffness[np.arange(len(elastic)), elastic] = frequency[elastic]
    matrix = np.block(
        [[np.zeros((len(elastic), len(elastic))), stiffness], [-stiffness.T, -damping]]
    )
    values, vectors = scipy.linalg.eig(matrix)
    # The speeds of a pole, q' = s q, have the shape of its angles.
    return [
        Pole(complex(value), shapes @ vectors[len(elastic) :, i])
        for i, value in enumerate(values)
        if value.imag >= 0.0
    ]


COUNT = 10  # modes of each list unless others are requested
RIGID_TWIST = 1e-12  # twist of an element taken as rounding, over the largest angle of the string


@dataclass(frozen=True, eq=False)
class Mode:
    """One mode: a pair of conjugate poles, one real pole, or the rigid body.

    Attributes
    ----------
    frequency_hz : float
        Magnitude of the pole over 2 pi (Hz): the natural frequency, not the damped one.
    damping_ratio : float or None
        Share of critical damping; None for the rigid body and for real poles.
    overdamped : bool
        Whether the pole is real and not zero. An overdamped mode has two such poles, each an
        entry of its own.
    shape : ndarray, shape (nodes,)
        Angle of the nodes, the largest of magnitude 1, positive at the bit. Where damping
        makes the nodes move out of phase, as they stand when the largest has its peak.
    torque_shape : ndarray, shape (elements,)
        Elastic torque of the elements in that position, positive where the upper end leads,
        the largest of magnitude 1; zero where the string turns as one body.
    """

    frequency_hz: float
    damping_ratio: float | None
    overdamped: bool
    shape: Array = label("node")
    torque_shape: Array = label("element")


@dataclass(frozen=True, eq=False)
class Modes(Result, kind="modes"):
    """Modes of a string with its top free and with its top held.

    With both ends free, inertias of top drive and BHA included, the rigid body comes first, then
    by rising frequency. All depths of a lumped string are zero.
    """

    free_free: tuple[Mode, ...] = label(over="free_free_mode", means="both ends free")
    fixed_top: tuple[Mode, ...] = label(over="fixed_top_mode", means="the top drive held still")
    node_depth: Array = label("node", unit="m", means="measured depth of the nodes")
    element_depth: Array = label("element", unit="m", means="depth of the middle of the elements")
    design: Design | None = label(  # type: ignore[assignment]
        default=None, means="the rig; None for a bare string"
    )
    count: int = label(default=COUNT, means="most entries requested of each list")

    def summary(self) -> dict[str, list[dict[str, Any]]]:
        """Frequencies (Hz) and damping ratios as strict JSON values.

        Returns
        -------
        dict
            `free_free` and `fixed_top`, each a list of `{"frequency_hz", "damping_ratio"}`,
            with `"overdamped": True` on real poles alone; `mesh`, the elements of each section
            of a design.
        """
        mesh = () if self.design is None else self.design.mesh
        return {
            "free_free": [_entry(mode) for mode in self.free_free],
            "fixed_top": [_entry(mode) for mode in self.fixed_top],
            "mesh": [one.summary() for one in mesh],
        }

    def derived(self) -> dict[str, Any]:
        """Frequencies and damping ratios, NaN where there is none."""
        made: dict[str, Any] = {}
        for support in ("free_free", "fixed_top"):
            dim, result = f"{support}_mode", getattr(self, support)
            ratios = [math.nan if m.damping_ratio is None else m.damping_ratio for m in result]
            hertz = [m.frequency_hz for m in result]
            made[f"{support}_frequency"] = (dim, hertz, {"units": "Hz"})
            made[f"{support}_damping_ratio"] = (dim, ratios, {"units": "1"})
        return made

    def requested(self) -> tuple[Design, dict[str, Any]]:
        """The rig, and the count if it is not the usual one."""
        if self.design is None:
            raise InputError("modes of a bare string have no design to be saved with", "save")
        return self.design, {} if self.count == COUNT else {"count": self.count}


@own_errstate()
def modes(subject: Design | Drillstring, count: int = COUNT) -> Modes:
    """Modes of a string, without control and without bit-rock contact.

    Parameters
    ----------
    subject : Design or Drillstring
        The string, or the rig it belongs to.
    count : int
        Most entries in each list, the rigid body included.

    Returns
    -------
    Modes
        Eigenvalues of s^2 M + s C + K, exact for any damping, at both boundary conditions.

    Raises
    ------
    InputError
        `count` is less than 1.
    """
    if count < 1:
        raise InputError(f"count must be 1 or more, got {count}", "count")
    string = subject if isinstance(subject, Drillstring) else subject.string
    depth = string.depth
    return Modes(
        free_free=tuple(_mode(pole, string) for pole in free_free_poles(string)[:count]),
        fixed_top=tuple(_mode(pole, string) for pole in fixed_top_poles(string)[:count]),
        node_depth=depth,
        element_depth=0.5 * (depth[:-1] + depth[1:]),
        design=None if isinstance(subject, Drillstring) else subject,
        count=count,
    )


def _mode(pole: Pole, string: Drillstring) -> Mode:
    size = abs(pole.value)
    oscillates = pole.value.imag > 0.0
    # Dampers only brake: a ratio under zero is rounding.
    ratio = max(0.0, -pole.value.real / size) if oscillates else None
    angle = _real_shape(pole)
    return Mode(
        frequency_hz=size / (2.0 * math.pi),
        damping_ratio=ratio,
        overdamped=size > 0.0 and not oscillates,
        shape=angle,
        torque_shape=_torque_shape(angle, string.element_stiffness),
    )


def _real_shape(pole: Pole) -> Array:
    """Angles when the node that moves most has its peak, over that peak; bit positive."""
    angle = (pole.shape / pole.shape[np.argmax(np.abs(pole.shape))]).real
    return 0.0 - angle if angle[-1] < 0.0 else angle  # not -angle: a held top stays at plain zero


def _torque_shape(angle: Array, stiffness: Array) -> Array:
    """Torques over the largest; zero where the string turns as one body."""
    twist = angle[:-1] - angle[1:]
    if np.abs(twist).max() < RIGID_TWIST:
        return np.zeros_like(twist)
    torque = stiffness * twist
    return torque / np.abs(torque).max()


def _entry(mode: Mode) -> dict[str, Any]:
    entry: dict[str, Any] = {"frequency_hz": mode.frequency_hz, "damping_ratio": mode.damping_ratio}
    return entry | {"overdamped": True} if mode.overdamped else entry


CHUNK = 256  # frequencies solved at a time where the modes are coupled


class Expansion(FromMobility):
    """Mobility of a finite-element string from its undamped free-free modes."""

    def __init__(self, string: Drillstring) -> None:
        self.string = string

    @cached_property
    def _internal_damping(self) -> Array:
        """Damping between the modes (1/s), without the dampers at the two ends."""
        _, shapes = self.string.undamped_modes
        top, bit = shapes[0], shapes[-1]
        whole = shapes.T @ (self.string.damping @ shapes)
        ends = self.parts.top_damping * np.outer(top, top)
        ends += self.parts.bit_damping * np.outer(bit, bit)
        return np.asarray(whole - ends)

    def mobility(
        self, s: ComplexArray, top: ComplexArray | complex = 0.0, bit: ComplexArray | complex = 0.0
    ) -> EndMobility:
        """Response to torques on the two ends; see `transmission.Lines.mobility`."""
        s = np.asarray(s, dtype=complex)
        free, determinant = self._free(s)
        up, down = self.parts.top_damping + top, self.parts.bit_damping + bit
        own_top, own_bit, across = free[..., 0, 0], free[..., 2, 1], free[..., 2, 0]
        closed = 1.0 / (1.0 + up * own_top + down * own_bit + up * down * determinant)
        # The node under the drive: what the two ends leave of a torque on either of them.
        below_top = free[..., 1, 0] * (1.0 + down * own_bit) - free[..., 1, 1] * down * across
        below_bit = free[..., 1, 1] * (1.0 + up * own_top) - free[..., 1, 0] * up * across
        first = self.string.element_stiffness[0] + s * self.string.element_damping[0]
        top_mobility = (own_top + down * determinant) * closed
        return EndMobility(
            top=top_mobility,
            bit=(own_bit + up * determinant) * closed,
            transfer=across * closed,
            pipe_from_top=first / s * (top_mobility - below_top * closed),
            pipe_from_bit=first / s * (across - below_bit) * closed,
        )

    def _free(self, s: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Speeds of nodes 0, 1 and last per torque on first and last, with both ends free.

        Shape (..., 3, 2); and the determinant of what the ends feel of each other.
        """
        frequency, shapes = self.string.undamped_modes
        seen, driven = shapes[[0, 1, -1]], shapes[[0, -1]]
        damping = self._internal_damping
        off = damping - np.diag(np.diagonal(damping))
        flat = s.ravel()
        if np.abs(off).max() <= DIAGONAL * np.abs(damping).max():
            # The rigid body apart: of slow motion it is nearly all, and the determinant follows
            # from the rest.
            rigid = 1.0 / (flat + damping[0, 0])
            column = flat[:, None]
            each = column / (column**2 + column * np.diagonal(damping)[1:] + frequency[1:] ** 2)
            elastic = np.einsum("am,fm,bm->fab", seen[:, 1:], each, driven[:, 1:], optimize=True)
            result = elastic + rigid[:, None, None] * np.outer(seen[:, 0], driven[:, 0])
            t, b = driven[:, 0]
            ends = elastic[:, [0, 2]]
            mixed = t * t * ends[:, 1, 1] + b * b * ends[:, 0, 0] - 2.0 * t * b * ends[:, 1, 0]
            determinant = rigid * mixed + np.linalg.det(ends)
        else:
            result = np.concatenate(
                [self._solved(flat[i : i + CHUNK]) for i in range(0, len(flat), CHUNK)]
            )
            determinant = np.linalg.det(result[:, [0, 2]])
        return np.asarray(result).reshape(*s.shape, 3, 2), np.reshape(determinant, s.shape)

    def _solved(self, s: ComplexArray) -> ComplexArray:
        frequency, shapes = self.string.undamped_modes
        matrix = s[:, None, None] * self._internal_damping
        matrix = matrix + np.eye(len(frequency)) * (s[:, None] ** 2 + frequency**2)[:, None, :]
        driven = np.broadcast_to(shapes[[0, -1]].T, (len(s), len(frequency), 2))
        angles = shapes[[0, 1, -1]] @ np.linalg.solve(matrix, driven)
        return np.asarray(s[:, None, None] * angles)
