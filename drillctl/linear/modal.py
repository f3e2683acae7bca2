"""Natural frequencies, damping ratios and shapes of a string."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drillctl.drillstring import Drillstring
from drillctl.errors import InputError
from drillctl.linear.poles import Pole, fixed_top_poles, free_free_poles

if TYPE_CHECKING:
    from pathlib import Path

    import xarray

    from drillctl.design import Design

Array = NDArray[np.float64]

RIGID_TWIST = 1e-12
"""Twist of an element taken as rounding, over the largest angle of the string."""


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
    shape: Array
    torque_shape: Array


@dataclass(frozen=True, eq=False)
class Modes:
    """Modes of a string with its top free and with its top held.

    Attributes
    ----------
    free_free : tuple of Mode
        Both ends free, inertias of top drive and BHA included; the rigid body first, then by
        rising frequency.
    fixed_top : tuple of Mode
        The top drive held still; by rising frequency.
    node_depth : ndarray, shape (nodes,)
        Measured depth of the nodes (m); all zero for a lumped string.
    element_depth : ndarray, shape (elements,)
        Depth of the middle of the elements (m).
    design : Design or None
        The rig they belong to; None for the modes of a bare string.
    """

    free_free: tuple[Mode, ...]
    fixed_top: tuple[Mode, ...]
    node_depth: Array
    element_depth: Array
    design: Design | None = None

    def summary(self) -> dict[str, list[dict[str, Any]]]:
        """Frequencies (Hz) and damping ratios as strict JSON values.

        Returns
        -------
        dict
            `free_free` and `fixed_top`, each a list of `{"frequency_hz", "damping_ratio"}`,
            with `"overdamped": True` on real poles alone.
        """
        return {
            "free_free": [_entry(mode) for mode in self.free_free],
            "fixed_top": [_entry(mode) for mode in self.fixed_top],
        }

    @property
    def data(self) -> xarray.Dataset:
        """Frequencies, damping ratios (NaN where there is none) and shapes, with units."""
        import xarray

        coords = {
            "node_depth": ("node", self.node_depth, {"units": "m"}),
            "element_depth": ("element", self.element_depth, {"units": "m"}),
        }
        variables = _variables("free_free", self.free_free)
        variables |= _variables("fixed_top", self.fixed_top)
        return xarray.Dataset(variables, coords)

    def save(self, folder: str | Path) -> Path:
        """Write design, dataset and summary into a folder; see `drillctl.store`."""
        from drillctl.store import save

        return save(self, folder)


def modes(subject: Design | Drillstring, count: int = 10) -> Modes:
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
    entry: dict[str, Any] = {
        "frequency_hz": mode.frequency_hz,
        "damping_ratio": mode.damping_ratio,
    }
    return entry | {"overdamped": True} if mode.overdamped else entry


def _variables(support: str, found: tuple[Mode, ...]) -> dict[str, Any]:
    """Variables of a dataset for one boundary condition."""
    mode = f"{support}_mode"
    ratios = [math.nan if m.damping_ratio is None else m.damping_ratio for m in found]
    plain = {"units": "1"}
    return {
        f"{support}_frequency": (mode, [m.frequency_hz for m in found], {"units": "Hz"}),
        f"{support}_damping_ratio": (mode, ratios, plain),
        f"{support}_overdamped": (mode, [m.overdamped for m in found]),
        f"{support}_shape": ((mode, "node"), np.array([m.shape for m in found]), plain),
        f"{support}_torque_shape": (
            (mode, "element"),
            np.array([m.torque_shape for m in found]),
            plain,
        ),
    }
