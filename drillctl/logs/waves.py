"""Waves at the top of the pipe, from torque and speed of the drive, and the string below them.

With T the torque below the drive (the drive's less what its inertia takes) and Z the impedance of
the uppermost pipe, T + Z w goes down and T - Z w comes up. Driven by the wave that goes down and
ended above by a matched pipe, the string with the rock predicts the wave that comes up: neither
the controller nor a model of the drive but its inertia is needed.

A uniform undamped string is a delay each way and the body of the bit. Any other is finite elements
with a matched damper at the top, whose mean of consistent and lumped mass has dispersion of fourth
order only. Where the uppermost part is a spring without inertia, a little of the drive belongs to
what is computed, and Z is that of the spring and the bodies below it: a string that is damped, too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy.linalg
from scipy.interpolate import CubicSpline
from scipy.signal import savgol_coeffs, savgol_filter
from scipy.signal.windows import tukey

from drillctl.arrays import Array, ComplexArray
from drillctl.rig.drillstring import Parts
from drillctl.rig.drillstring.assembly import APART, chain, elements_of

FINEST = 0.025  # step of the bit (s) at most: the falling friction stays on one branch
PER_SWING = 100  # of them in the period of a quick string at least
USED_RATE = 20.0  # (Hz) what is faster and noisy is averaged to this first
USED_SAMPLES = 50  # a period at least, where that is more
CLEAN = 2e-5  # noise over swing below which nothing is averaged
SMOOTH = 5  # samples of the derivative of a noisy speed, by cubics, or where noise is more than
NOISY = 0.05  # of its variance up to
LONGEST = 0.1  # of a period
FASTEST = 4.0  # (Hz) up to which a mesh is fine enough, or ten times the string's own
PER_WAVE = 8  # elements in its wave length there
HALFWAY = (5.0 / 12.0, 1.0 / 12.0)
"""Shares of an element's mass, between consistent and lumped: the error of the wave speed is of
fourth order."""
LIGHT = 0.01  # time in which the top of a lumped string settles, over its period


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
    # of the drive, above what is computed (kg m2, N m s/rad)
    top_inertia: float
    top_damping: float
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
    return float(sum(s.travel_time for s in parts.sections))


def stiffness(parts: Parts) -> float:
    """Stiffness of the whole string (N m/rad)."""
    return 1.0 / sum(1.0 / s.stiffness for s in parts.sections)


def swing(parts: Parts) -> float:
    """Period (s) of the string held at its top, about."""
    bodies = parts.bit_inertia + sum(s.inertia / 3.0 + s.end_inertia for s in parts.sections)
    return float(2.0 * np.pi * (bodies / stiffness(parts)) ** 0.5)


def impedance(parts: Parts) -> float:
    """Impedance of the uppermost pipe (N m s/rad), or one of the size of a lumped string's."""
    first = parts.sections[0]
    lumped = stiffness(parts) * swing(parts) / (2.0 * np.pi)
    return first.impedance or lumped


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
    drive = parts.top_inertia * factors.drive_inertia
    made = replace(parts, sections=sections, bit_inertia=body, top_inertia=drive)
    zeta = impedance(made)
    if is_uniform(made):
        body += sections[0].end_inertia
        one: ComplexArray = np.ones(1, complex)
        into: ComplexArray = np.full(1, 1.0 / body, complex)
        return Below(
            zeta, drive, parts.top_damping, travel_time(made), -zeta * into, into, into, one, one
        )
    return _elements(made, zeta)


def _elements(parts: Parts, zeta: float) -> Below:
    """Exponentials of finite elements with a matched damper at the top."""
    fastest = max(FASTEST, 10.0 / swing(parts))
    one = elements_of(tuple(
        replace(x, elements=max(int(np.ceil(x.travel_time * fastest * PER_WAVE)), 1))
        for x in parts.sections
    ))  # fmt: skip
    n = len(one.bodies)
    m = chain(one.inertia, HALFWAY).toarray() + np.diag(one.bodies)
    k = chain(one.stiffness, APART).toarray()
    c = (chain(one.damping, APART) + chain(one.drag, HALFWAY)).toarray() + np.diag(one.dampers)
    m[-1, -1] += parts.bit_inertia
    c[-1, -1] += parts.bit_damping
    if parts.modal_damping:
        c += _modal(m, k, parts)
    inside = 0.0
    if not parts.sections[0].inertia:  # a node needs a mass
        inside = min(parts.top_inertia, LIGHT * zeta * swing(parts))
        m[0, 0] += inside
    c[0, 0] += zeta
    # Twist of the elements and speed of the nodes: no state for the angle of the whole.
    twist = np.eye(n)[:-1] - np.eye(n)[1:]
    inverse = np.linalg.inv(m)
    matrix = np.zeros((2 * n - 1, 2 * n - 1))
    matrix[: n - 1, n - 1 :] = twist
    matrix[n - 1 :, : n - 1] = -inverse @ (twist.T * one.stiffness)
    matrix[n - 1 :, n - 1 :] = -inverse @ c
    rates, shapes = scipy.linalg.eig(matrix)
    into = np.zeros((2 * n - 1, 2))
    into[n - 1 :, 0], into[n - 1 :, 1] = inverse[:, 0], inverse[:, -1]
    gains = np.linalg.solve(shapes, into)
    keep = rates.imag >= 0.0  # of a pair one, twice its real part
    twice = np.where(rates.imag > 0.0, 2.0, 1.0)[keep]
    return Below(
        zeta, parts.top_inertia - inside, parts.top_damping, 0.0,
        rates[keep], gains[keep, 0], gains[keep, 1],
        twice * shapes[-1, keep], twice * shapes[n - 1, keep],
    )  # fmt: skip


def _modal(m: Array, k: Array, parts: Parts) -> Array:
    """Damping of one ratio in every mode of the free string with its drive."""
    whole = m.copy()
    whole[0, 0] += parts.top_inertia
    squares, shapes = scipy.linalg.eigh(k, whole)
    rates = 2.0 * parts.modal_damping * np.sqrt(np.maximum(squares, 0.0))
    into = whole @ shapes
    return np.asarray((into * rates) @ into.T)


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
    rise_noise: float  # of the derivative (rad/s2)

    @property
    def spacing(self) -> float:
        """Time between samples (s)."""
        return float(self.time[1] - self.time[0])


def noise_of(values: Array) -> float:
    """Standard deviation of the white noise of even samples, by their fourth differences."""
    fourth = np.diff(values, 4)
    return float(np.median(np.abs(fourth)) / 0.6745 / np.sqrt(70.0)) if len(fourth) else 0.0


def track(
    time: Array, torque: Array, speed: Array, period: float,
    weight: Array | None = None, bit: Array | None = None,
) -> Track:  # fmt: skip
    """Even samples of a stretch, averaged where they are fast for a string's period and noisy."""
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
    mean = 1 if clean else max(1, round(1.0 / (spacing * max(USED_RATE, USED_SAMPLES / period))))
    if mean > 1:
        count = len(even) // mean
        even = even[: count * mean].reshape(count, mean).mean(axis=1)
        columns = {
            name: one[: count * mean].reshape(count, mean).mean(axis=1)
            for name, one in columns.items()
        }
    step = even[1] - even[0]
    rise, rise_noise = CubicSpline(even, columns["speed"])(even, 1), 0.0
    count = SMOOTH
    while not clean:
        rise = savgol_filter(columns["speed"], count, 3, deriv=1, delta=step)
        weights = savgol_coeffs(count, 3, deriv=1, delta=step)
        rise_noise = noise[1] * float(np.sqrt((weights**2).sum() / mean))
        count += 2
        if rise_noise**2 < NOISY * np.var(rise) or count * step > LONGEST * period:
            break
    return Track(
        even, columns["torque"], columns["speed"], rise, mean, columns.get("weight"),
        columns.get("bit"), noise, rise_noise,
    )  # fmt: skip


def split(one: Track, string: Below) -> tuple[Array, Array]:
    """The waves that go down and come up (N m)."""
    torque = one.torque - string.top_inertia * one.rise - string.top_damping * one.speed
    return torque + string.impedance * one.speed, torque - string.impedance * one.speed


class Portrait(NamedTuple):
    """What the waves alone say of the bit, no law assumed."""

    time: Array  # (s)
    speed: Array  # (rad/s)
    torque: Array  # of the rock (N m)


def at_the_bit(parts: Parts, string: Below, one: Track) -> Portrait:
    """Speed and torque at the bit: the string is inverted, line by line of the spectrum.

    Ends, where the string remembers what was before or answers later, are left out, and so is what
    is faster than noise allows.
    """
    down, up = split(one, string)
    z, time = 2.0 * string.impedance, one.time
    if string.delay:
        time = time[time >= time[0] + 2.0 * string.delay]
        down, up = np.interp(time - 2.0 * string.delay, one.time, down), up[-len(time) :]
    seen = (down - up) / z
    count, edge = len(time), int(min(string.memory / one.spacing, 0.2 * len(time)))
    frequency = np.fft.rfftfreq(count, one.spacing)

    def answer(to: ComplexArray, output: ComplexArray) -> ComplexArray:
        s, each = 2j * np.pi * frequency[:, None], 0.5 * output * to
        pairs = each / (s - string.rates) + each.conj() / (s - string.rates.conj())
        return np.asarray(pairs.sum(axis=1))

    shown = string.bit if string.delay else string.top
    weights = tukey(count, 2.0 * edge / count)
    lines = []
    for values in (down, seen):
        level = values.mean()
        line = np.fft.rfft((values - level) * weights)
        line[0] += level * count
        lines.append(line)
    quick = (20.0 if parts.sections[0].inertia else 4.0) / swing(parts)
    kept = np.exp(-0.5 * (frequency / min(quick, 0.4 / one.spacing)) ** 2)
    kept[kept < 1e-6] = 0.0
    torque = answer(string.drive, shown) * lines[0] - lines[1]
    torque *= np.where(kept > 0.0, kept / answer(string.torque, shown), 0.0)
    speed = kept * answer(string.drive, string.bit) * lines[0]
    speed -= answer(string.torque, string.bit) * torque
    inside = slice(edge, count - edge)
    return Portrait(time[inside], *(np.fft.irfft(x, count)[inside] for x in (speed, torque)))
