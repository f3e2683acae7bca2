"""Waves at the top of the pipe, from torque and speed of the drive, and the string below them.

With T the torque below the drive (the drive's less what its inertia takes) and Z the impedance of
the uppermost pipe, T + Z w goes down and T - Z w comes up. Driven by the wave that goes down and
ended above by a matched pipe, the string with the rock predicts the wave that comes up: neither
the controller nor a model of the drive but its inertia is needed.

A uniform undamped string is a delay each way and the body of the bit. Any other is finite elements
with a matched damper at the top, whose mean of consistent and lumped mass has dispersion of fourth
order only.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from scipy.interpolate import CubicSpline
from scipy.signal import savgol_filter

from drillctl.arrays import Array, ComplexArray
from drillctl.rig.drillstring import Parts

FINEST = 0.025  # step of the bit (s) at most: the falling friction stays on one branch
USED_RATE = 20.0  # (Hz) what is faster and noisy is averaged to this first
CLEAN = 2e-5  # noise over swing below which nothing is averaged
SMOOTH = (5, 3)  # samples and order of the derivative of a noisy speed
FASTEST = 4.0  # (Hz) up to which a mesh is fine enough
PER_WAVE = 8  # elements in its wave length there


@dataclass(frozen=True)
class Factors:
    """What the string of a design is multiplied by."""

    travel_time: float = 1.0
    impedance: float = 1.0
    bit_inertia: float = 1.0
    drive_inertia: float = 1.0


@dataclass(frozen=True, eq=False)
class Below:
    """The string under a matched pipe as exponentials; see `inclusion`."""

    impedance: float  # of the uppermost pipe (N m s/rad)
    delay: float  # one way, if it is a delay and a body, else 0 (s)
    rates: ComplexArray  # shape (states,), as the following
    drive: ComplexArray  # of the wave that goes down
    torque: ComplexArray
    bit: ComplexArray  # output: bit speed
    top: ComplexArray  # output: speed at the top

    @property
    def memory(self) -> float:
        """Time (s) after which a motion of the string has left through its matched top."""
        slowest = float(np.min(np.abs(self.rates.real)))
        return 2.0 * self.delay + min(3.0 / max(slowest, 1e-3), 30.0)


def is_uniform(parts: Parts) -> bool:
    """Whether a string is one undamped pipe with the bit's body at its end."""
    if len(parts.sections) != 1 or parts.modal_damping or parts.bit_damping:
        return False
    one = parts.sections[0]
    damped = one.stiffness_damping or one.mass_damping or one.drag or one.coupling_damping
    return bool(one.inertia > 0.0 and not damped)


def travel_time(parts: Parts) -> float:
    """Time (s) of a wave from top to bit."""
    return float(sum((s.inertia / s.stiffness) ** 0.5 for s in parts.sections))


def impedance(parts: Parts) -> float:
    """Impedance of the uppermost pipe (N m s/rad)."""
    return float((parts.sections[0].inertia * parts.sections[0].stiffness) ** 0.5)


def below(parts: Parts, factors: Factors = Factors()) -> Below:
    """The string under a matched pipe, its numbers times factors."""
    sections = tuple(
        replace(
            one,
            stiffness=one.stiffness * factors.impedance / factors.travel_time,
            inertia=one.inertia * factors.impedance * factors.travel_time,
        )
        for one in parts.sections
    )
    body = parts.bit_inertia * factors.bit_inertia
    made = replace(parts, sections=sections, bit_inertia=body)
    zeta = impedance(made)
    if is_uniform(made):
        body += sections[0].end_inertia
        one: ComplexArray = np.ones(1, complex)
        into: ComplexArray = np.full(1, 1.0 / body, complex)
        return Below(zeta, travel_time(made), -zeta * into, into, into, one, one)
    return _elements(made, zeta)


def _elements(parts: Parts, zeta: float) -> Below:
    """Exponentials of finite elements with a matched damper at the top."""
    springs: list[float] = []
    dampers: list[float] = []
    mass: list[tuple[float, float, float]] = []  # of an element, its drag, and a body below it
    for one in parts.sections:
        time = (one.inertia / one.stiffness) ** 0.5
        count = max(int(np.ceil(time * FASTEST * PER_WAVE)), 1) if one.inertia else 1
        for number in range(count):
            springs.append(one.stiffness * count)
            dampers.append(
                one.stiffness_damping * one.stiffness * count + one.coupling_damping * count
            )
            drag = (one.mass_damping * one.inertia + one.drag) / count
            mass.append(
                (one.inertia / count, drag, one.end_inertia if number == count - 1 else 0.0)
            )
    n = len(springs) + 1
    m, c, k = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    # Halfway between consistent and lumped: the error of the wave speed is of fourth order.
    share = np.array([[5.0, 1.0], [1.0, 5.0]]) / 12.0
    pull = np.array([[1.0, -1.0], [-1.0, 1.0]])
    for j, (spring, damper, (inertia, drag, body)) in enumerate(
        zip(springs, dampers, mass, strict=True)
    ):
        part = slice(j, j + 2)
        m[part, part] += inertia * share
        c[part, part] += damper * pull + drag * share
        k[part, part] += spring * pull
        m[j + 1, j + 1] += body
    m[-1, -1] += parts.bit_inertia
    c[-1, -1] += parts.bit_damping
    c[0, 0] += zeta
    # Twist of the elements and speed of the nodes: no state for the angle of the whole.
    twist = np.eye(n)[:-1] - np.eye(n)[1:]
    inverse = np.linalg.inv(m)
    matrix = np.zeros((2 * n - 1, 2 * n - 1))
    matrix[: n - 1, n - 1 :] = twist
    matrix[n - 1 :, : n - 1] = -inverse @ (twist.T * np.array(springs))
    matrix[n - 1 :, n - 1 :] = -inverse @ c
    rates, shapes = scipy.linalg.eig(matrix)
    into = np.zeros((2 * n - 1, 2))
    into[n - 1 :, 0], into[n - 1 :, 1] = inverse[:, 0], inverse[:, -1]
    gains = np.linalg.solve(shapes, into)
    keep = rates.imag >= 0.0  # of a pair one, twice its real part
    twice = np.where(rates.imag > 0.0, 2.0, 1.0)[keep]
    return Below(
        zeta, 0.0, rates[keep], gains[keep, 0], gains[keep, 1],
        twice * shapes[-1, keep], twice * shapes[n - 1, keep],
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Track:
    """A stretch of a log at the rate that is used: means over `mean` samples."""

    time: Array  # (s), even, shape (samples,)
    torque: Array  # of the drive (N m)
    speed: Array  # of the drive (rad/s)
    rise: Array  # its derivative (rad/s2)
    mean: int  # samples of the log in each
    weight: Array | None  # (N)
    bit: Array | None  # downhole speed (rad/s)
    noise: tuple[float, float]  # of torque (N m) and speed (rad/s), of one sample of the log

    @property
    def spacing(self) -> float:
        """Time between samples (s)."""
        return float(self.time[1] - self.time[0])


def noise_of(values: Array) -> float:
    """Standard deviation of the white noise of even samples, by their fourth differences."""
    fourth = np.diff(values, 4)
    return float(np.median(np.abs(fourth)) / 0.6745 / np.sqrt(70.0)) if len(fourth) else 0.0


def track(
    time: Array, torque: Array, speed: Array, weight: Array | None = None, bit: Array | None = None
) -> Track:
    """Even samples of a stretch, averaged where they are fast and noisy."""
    spacing = float(np.median(np.diff(time)))
    even = time[0] + spacing * np.arange(round((time[-1] - time[0]) / spacing) + 1)
    columns = {
        name: np.interp(even, time, np.asarray(one, float))
        for name, one in (("torque", torque), ("speed", speed), ("weight", weight), ("bit", bit))
        if one is not None
    }
    noise = noise_of(columns["torque"]), noise_of(columns["speed"])
    swings = [float(np.ptp(np.percentile(columns[k], (2, 98)))) for k in ("torque", "speed")]
    clean = all(n <= CLEAN * max(s, 1e-9) for n, s in zip(noise, swings, strict=True))
    mean = 1 if clean else max(1, round(1.0 / (spacing * USED_RATE)))
    if mean > 1:
        count = len(even) // mean
        even = even[: count * mean].reshape(count, mean).mean(axis=1)
        columns = {
            name: one[: count * mean].reshape(count, mean).mean(axis=1)
            for name, one in columns.items()
        }
    step = even[1] - even[0]
    if clean:
        rise = CubicSpline(even, columns["speed"])(even, 1)
    else:
        rise = savgol_filter(columns["speed"], *SMOOTH, deriv=1, delta=step)
    return Track(
        even, columns["torque"], columns["speed"], rise, mean, columns.get("weight"),
        columns.get("bit"), noise,
    )  # fmt: skip


def split(one: Track, inertia: float, damping: float, zeta: float) -> tuple[Array, Array]:
    """The waves that go down and come up (N m), of a drive with an inertia and a damper."""
    torque = one.torque - inertia * one.rise - damping * one.speed
    return torque + zeta * one.speed, torque - zeta * one.speed
