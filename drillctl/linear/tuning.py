"""The top drive as the string feels it: impedance, and what it reflects of a wave.

Gains of a top drive from the string it turns.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drillctl.design import Design
from drillctl.errors import InputError
from drillctl.linear.poles import natural_frequencies
from drillctl.linear.response import FREQUENCIES, refuse_frequencies
from drillctl.rig.drillstring import Drillstring
from drillctl.rig.drillstring.assembly import Parts

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complexfloating[Any, Any]]


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
        Its drive and its uppermost pipe are looked at.
    frequency_hz : array_like, shape (frequencies,)
        Frequencies (Hz), each more than zero.
    label : str, optional
        What to call it in a picture; by default the law and its gains.

    Raises
    ------
    InputError
        An impossible frequency, or a string whose uppermost section is a lumped spring.
    """
    frequency = np.atleast_1d(np.asarray(frequency_hz, dtype=float))
    refuse_frequencies(frequency)
    s = 2j * math.pi * frequency
    parts = design.string.parts
    impedance = design.top_drive.impedance(s) + s * parts.top_inertia + parts.top_damping
    if label is None:
        label = design.tables.controller.law
        if design.simple_drive:
            kp, ki = design.top_drive.gains()
            label += f", Kp {kp:.4g}, Ki {ki:.4g}"
    return DriveImpedance(frequency, impedance, pipe_impedance(design.string), label)


def pipe_impedance(string: Drillstring) -> float:
    """Characteristic impedance of the uppermost pipe (N m s/rad): J sqrt(G rho)."""
    first = string.parts.sections[0]
    if first.inertia == 0.0:
        raise InputError(
            "a lumped spring has no impedance; describe the pipe by its geometry",
            f"drillstring.sections.{first.name}",
        )
    return first.impedance


def stick_slip_frequency(string: Drillstring) -> float:
    """Lowest angular frequency with the top held (rad/s)."""
    return _lowest_held(string.parts)


@lru_cache(maxsize=16)  # thousands of draws of a rock share a string
def _lowest_held(parts: Parts) -> float:
    return float(natural_frequencies(parts, "finite-elements", 1, top_held=True)[0])


def stiff_speed(
    string: Drillstring, stiffness: float = 50.0, rate: float = 5.0
) -> tuple[float, float]:
    """Gains of a stiff speed controller: Kp = 50 zeta, Ki = 5 J_d."""
    return stiffness * pipe_impedance(string), rate * string.parts.top_inertia


def soft_torque(string: Drillstring, share: float = 0.25) -> tuple[float, float]:
    """Gains of a tuned PI (soft torque): P = zeta / share, I = w_s^2 J_d.

    With this I the drive is a pure resistor at the stick-slip frequency w_s, and reflects
    (1 - share) / (1 + share) of a wave there.
    """
    if not (0.0 < share <= 1.0 and math.isfinite(share)):
        raise InputError(f"must be above 0 and at most 1, got {share:g}", "share")
    inertia = string.parts.top_inertia
    return pipe_impedance(string) / share, stick_slip_frequency(string) ** 2 * inertia


def z_torque(string: Drillstring, absorption: float = 1.0) -> float:
    r"""Mobility of an impedance-matched drive (Z-torque): m = a / zeta.

    The set speed of a stiff speed controller gives way to the torque that the pipe takes,

    .. math:: e = \Omega - \omega - \frac{a}{\zeta} (T_p - \bar T_p), \qquad
              T_p = T - J_d \dot\omega,

    so that above the high-pass of that torque the drive looks like the resistor zeta / a, its own
    inertia compensated, and reflects (1 - a) / (1 + a) of every wave from below. The filters of a
    public model of it: motor lag 5 ms, encoder 2 ms, high-pass 20 s, as periods (time constant:
    that over 2 pi).
    """
    return absorption / pipe_impedance(string)


def torsional_rectification(string: Drillstring) -> float:
    """Mobility of torsional rectification: that of `z_torque` with a = 1.

    After Tucker & Wang, J. Sound Vib. 224 (1999) 123-165: the top speed is made to follow the set
    speed less (pipe torque - its mean) / zeta, which absorbs each up-going wave. With an ideal
    drive it is the limit of impedance matching, and runs as such here.
    """
    return z_torque(string, 1.0)


def active_damping(string: Drillstring) -> tuple[float, float]:
    r"""Damper and spring of an actively damped drive: c_f = 2 sqrt(k J_d), k_f = w_s^2 J_d.

    Of the two-body model bit - pipe - drive - spring and damper, with k the stiffness of the whole
    string and w_s its lowest frequency with the top held, the characteristic polynomial is then

    .. math:: (s^2 + 2 \zeta w_s s + w_s^2)^2, \qquad \zeta = \frac{\sqrt{k / J_d}}{2 w_s}:

    both pairs of poles coincide, which is as much damping as the softer of two modes can have.
    After Jansen & van den Steen, J. Sound Vib. 179 (1995) 647-668, who tune their drive as an
    absorber of the first mode; the rule is ours.
    """
    inertia = string.parts.top_inertia
    spring = stick_slip_frequency(string) ** 2 * inertia
    return 2.0 * math.sqrt(string.static_stiffness * inertia), spring
