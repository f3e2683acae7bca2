"""Impedance of the top drive, its reflection of waves, and gains from the string."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from drillctl.arrays import Array, ComplexArray
from drillctl.design import Design
from drillctl.linear.response import FREQUENCIES, frequencies_of
from drillctl.rig.top_drive.tuned import (
    active_damping,
    soft_torque,
    stiff_speed,
    torsional_rectification,
    z_torque,
)

if TYPE_CHECKING:
    import xarray

__all__ = [
    "DriveImpedance",
    "active_damping",
    "drive_impedance",
    "soft_torque",
    "stiff_speed",
    "torsional_rectification",
    "z_torque",
]


@dataclass(frozen=True, eq=False)
class DriveImpedance:
    """Impedance and reflection of a top drive over frequency.

    Attributes
    ----------
    frequency_hz : ndarray, shape (frequencies,)
        Frequencies (Hz).
    impedance : ndarray of complex, shape (frequencies,)
        Z = C + i w J_d + damping (N m s/rad): torque against the motion per speed.
    pipe : float
        Characteristic impedance zeta of the uppermost pipe (N m s/rad).
    label : str
        What to call the drive in a picture.
    """

    frequency_hz: Array
    impedance: ComplexArray
    pipe: float
    label: str

    @property
    def reflection(self) -> ComplexArray:
        """Wave that goes down over the one that came up, r = (zeta - Z) / (zeta + Z).

        Magnitude 0 where the drive takes all of it, 1 for a drive that stands still or hangs
        free.
        """
        return (self.pipe - self.impedance) / (self.pipe + self.impedance)

    @property
    def data(self) -> xarray.Dataset:
        """Impedance and reflection over `frequency`, with units."""
        import xarray

        coords = {"frequency": ("frequency", self.frequency_hz, {"units": "Hz"})}
        variables = {
            "impedance": ("frequency", self.impedance, {"units": "N*m*s/rad"}),
            "reflection": ("frequency", self.reflection, {"units": "1"}),
        }
        return xarray.Dataset(variables, coords, {"pipe_impedance": self.pipe})


def drive_impedance(
    design: Design, frequency_hz: ArrayLike = FREQUENCIES, label: str | None = None
) -> DriveImpedance:
    """Impedance of a design's top drive, inertia and damping included.

    Parameters
    ----------
    design : Design
        The rig; its drive and its uppermost pipe count.
    frequency_hz : array_like, shape (frequencies,)
        Frequencies (Hz), each more than zero.
    label : str, optional
        What to call it in a picture; by default the law and its gains.

    Raises
    ------
    InputError
        An impossible frequency, or a string whose uppermost section is a lumped spring.
    """
    frequency = frequencies_of(frequency_hz)
    s = 2j * math.pi * frequency
    parts = design.string.parts
    impedance = design.linear_drive.impedance(s) + s * parts.top_inertia + parts.top_damping
    if label is None:
        label = design.tables.controller.law
        if design.simple_drive:
            kp, ki = design.linear_drive.gains()
            label += f", Kp {kp:.4g} N*m*s/rad, Ki {ki:.4g} N*m/rad"
    return DriveImpedance(frequency, impedance, design.string.pipe_impedance, label)
