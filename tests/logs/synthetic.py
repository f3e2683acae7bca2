"""Logs made by characteristics: a uniform undamped pipe, a PI drive, set-valued friction.

Independent of the package: no finite elements, no inclusion of waves.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numba
import numpy as np

WEIGHT = 140e3
LENGTH, SPEED_OF_WAVES, ZETA = 3000.0, 3184.3572, 297.06112


@numba.njit
def _rock(low, high, decay, speed):
    """Torque and slope: exponential, or with a negative decay straight down to the lower one."""
    if decay >= 0.0:
        fall = (high - low) * np.exp(-decay * speed)
        return low + fall, -decay * fall
    torque = high + decay * speed
    return (torque, decay) if torque > low else (low, 0.0)


@numba.njit
def _run(count, step, delay, zeta, top, bit, kp, ki, target, low, high, decay, peak, start):
    down, up = np.zeros(count + 1), np.zeros(count + 1)
    w, torque, b = np.zeros(count + 1), np.zeros(count + 1), np.zeros(count + 1)
    w[0] = b[0] = start
    down[0], up[0] = zeta * start, -zeta * start
    torque[0] = kp * (target - start)
    rock = _rock(low, high, decay, start)[0]
    total = 0.0
    for i in range(count):
        q0 = up[i - delay] if i >= delay else -zeta * start
        q1 = up[i + 1 - delay] if i + 1 >= delay else -zeta * start
        p0 = down[i - delay] if i >= delay else zeta * start
        p1 = down[i + 1 - delay] if i + 1 >= delay else zeta * start
        before = torque[i] - q0 - zeta * w[i]
        known = kp * target + ki * (total + 0.5 * step * (2.0 * target - w[i])) - q1
        rate = kp + 0.5 * ki * step + zeta
        w[i + 1] = (w[i] + 0.5 * step / top * (before + known)) / (1.0 + 0.5 * step / top * rate)
        total += 0.5 * step * (2.0 * target - w[i] - w[i + 1])
        torque[i + 1] = kp * (target - w[i + 1]) + ki * total
        down[i + 1] = q1 + 2.0 * zeta * w[i + 1]
        g, rise = 0.5 * step / bit, 1.0 + 0.5 * step * zeta / bit
        if b[i] > 0.0:
            right = b[i] + g * (p0 - zeta * b[i] - rock + p1)
            if right > g * high:
                v = b[i]
                if decay < 0.0:  # straight: on the falling piece, else on the level one
                    v = (right - g * high) / (rise + g * decay)
                    if high + decay * v < low:
                        v = (right - g * low) / rise
                for _ in range(50 if decay >= 0.0 else 0):
                    there, slope = _rock(low, high, decay, v)
                    new = v - (rise * v + g * there - right) / (rise + g * slope)
                    done = abs(new - v) < 1e-13
                    v = new
                    if done:
                        break
                b[i + 1] = v
                rock = _rock(low, high, decay, v)[0]
            else:
                b[i + 1], rock = 0.0, p1
        elif abs(p1) <= peak:
            b[i + 1], rock = 0.0, p1
        else:
            part = step * (p1 - peak) / max(p1 - p0, 1e-12)
            b[i + 1] = (p1 - high - 0.5 * (p1 - p0) * part / step) * part / bit
            rock = _rock(low, high, decay, b[i + 1])[0]
        up[i + 1] = p1 - 2.0 * zeta * b[i + 1]
    return w, torque, b


@dataclass(frozen=True)
class Rig:
    """What a log is made of, SI."""

    zeta: float = ZETA
    delay: float = LENGTH / SPEED_OF_WAVES
    top: float = 500.0
    bit: float = 394.0
    kp: float = 200.0
    ki: float = 100.0
    speed: float = 100.0 * np.pi / 30.0
    a1: float = 0.026 * WEIGHT
    a2: float = 0.085 * WEIGHT
    beta: float = 0.098
    peak: float | None = None  # static torque, if more than a2
    parts: int = 1000  # steps of a travel time
    _: dict = field(default_factory=dict, compare=False)

    def run(self, duration):
        """Time, torque, top speed and bit speed, fine."""
        step = self.delay / self.parts
        peak = self.a2 if self.peak is None else self.peak
        w, torque, b = _run(
            int(duration / step), step, self.parts, self.zeta, self.top, self.bit, self.kp,
            self.ki, self.speed, self.a1, self.a2, self.beta, peak, 70.0 * np.pi / 30.0,
        )  # fmt: skip
        return step * np.arange(len(w)), torque, w, b

    def curve(self, speed):
        """Torque of the rock (N m)."""
        return np.array([_rock(self.a1, self.a2, self.beta, w)[0] for w in np.atleast_1d(speed)])


def sampled(motion, rate, first, last, noise=(0.0, 0.0), seed=0):
    """Point samples with white noise on torque (N m) and speed (rad/s); time from zero."""
    random = np.random.default_rng(seed)
    time = np.arange(first, last, 1.0 / rate)
    fine, *signals = motion
    torque, speed, bit = (np.interp(time, fine, one) for one in signals)
    torque = torque + noise[0] * random.standard_normal(len(time))
    speed = speed + noise[1] * random.standard_normal(len(time))
    return time - time[0], torque, speed, bit


HEAD = ("time_s", "top_torque_Nm", "top_speed_rpm", "bit_speed_rpm", "wob_kN")


def write(path, samples, columns=3, weight=None):
    """A log as CSV."""
    time, torque, speed, bit = samples
    held = [time, torque, speed * 30.0 / np.pi, bit * 30.0 / np.pi][:columns]
    head = list(HEAD[:columns])
    if weight is not None:
        held.append(np.broadcast_to(weight, time.shape) / 1e3)
        head.append("wob_kN")
    np.savetxt(
        path, np.array(held).T, fmt="%.9g", delimiter=",", header=",".join(head), comments=""
    )
    return path


@numba.njit
def _lumped(count, step, top, bit, stiffness, gain, target, low, high, decay):
    w, b, twist, total = 0.7 * target, 0.7 * target, low / stiffness, low
    results = np.zeros((3, count))
    for i in range(count):
        total += 0.5 * gain * (target - w) * step
        torque = gain * (target - w) + total
        results[0, i], results[1, i], results[2, i] = torque, w, b
        below = stiffness * twist
        rock = low + (high - low) * np.exp(-decay * b)
        b = max(b + step * (below - rock) / bit, 0.0) if b > 0.0 or below > high else 0.0
        w += step * (torque - below) / top
        twist += step * (w - b)
    return results


def laboratory(duration, top, bit, stiffness, gain, target, low, high, decay):
    """Time, torque, top and bit speed of two bodies on a spring under PI, SI, fine."""
    step = 1e-4
    count = int(duration / step)
    motion = _lumped(count, step, top, bit, stiffness, gain, target, low, high, decay)
    return step * np.arange(count), *motion
