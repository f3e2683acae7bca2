"""The driven set-valued inclusion at the bit, in time, compiled.

The string below a measured wave is a sum of exponentials, x' = lambda x + a u - b T, whose outputs
are the bit speed w = Re(sum c x) and one more. T is the torque of the rock: T(w) of a turning bit,
anything within the static torque of one at rest. Input and torque are straight within a step, so
that a step of a turning bit is one equation for its speed at the end, w + G T(w) = w_free; a bit
at rest has the torque that keeps it there. Where it stops or leaves, the step is parted there.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drillctl.simulation.kernel_cache import njit

EXPONENTIAL, POINTS = 0, 1
"""Kinds of law: numbers (a1, a2, beta), or torques at the speeds of `knots`."""
SLIPS, RESTS = 1, 0


def _torque(kind, static, numbers, knots, speed):  # type: ignore[no-untyped-def]
    """Torque and slope at a speed of zero or more."""
    if kind == 0:
        fall = (numbers[1] - numbers[0]) * np.exp(-numbers[2] * speed)
        return numbers[0] + fall, -numbers[2] * fall
    last = len(knots) - 1
    if speed >= knots[last]:
        return numbers[last], 0.0
    k = 0
    while speed >= knots[k + 1]:
        k += 1
    slope = (numbers[k + 1] - numbers[k]) / (knots[k + 1] - knots[k])
    return numbers[k] + slope * (speed - knots[k]), slope


_torque_of = njit(_torque, inline="always", cache=False)


def _weights(rates, step, decay, first, second):  # type: ignore[no-untyped-def]
    """Decay over a step and weights of the values at its beginning and end."""
    for k in range(len(rates)):
        z = rates[k] * step
        e = np.exp(z)
        if abs(z) < 1e-3:
            total = step * (1.0 + z / 2.0 + z * z / 6.0)
            end = step * (0.5 + z / 6.0 + z * z / 24.0)
        else:
            total = (e - 1.0) / rates[k]
            end = (e - 1.0 - z) / (rates[k] * z)
        decay[k], first[k], second[k] = e, total - end, end


_weights_of = njit(_weights, cache=False)


def _speed(kind, static, numbers, knots, gain, target, guess):  # type: ignore[no-untyped-def]
    """The positive root of v + gain T(v) = target: Newton, kept between bounds."""
    v = max(guess, 0.0)
    low, high = 0.0, target
    for _ in range(60):
        t, slope = _torque_of(kind, static, numbers, knots, v)
        g = v + gain * t - target
        if g > 0.0:
            high = v
        else:
            low = v
        trial = v - g / (1.0 + gain * slope)
        if not low <= trial <= high:
            trial = 0.5 * (low + high)
        if abs(trial - v) <= 1e-14 * (1.0 + v):
            return trial
        v = trial
    return v


_speed_of = njit(_speed, cache=False)


def _advance(  # type: ignore[no-untyped-def]
    rates, a, b, c, d, step, drive, kind, static, numbers, knots, state, begin, speeds, others,
    torques,
):  # fmt: skip
    """Run over a drive given at even times; returns the first step after a stop, or -1."""
    n = len(rates)
    decay, first, second = state.copy(), state.copy(), state.copy()
    e, f, s = state.copy(), state.copy(), state.copy()
    _weights_of(rates, step, decay, first, second)
    x, y = state.copy(), state.copy()
    # Of a whole step: what the state, the drive at both ends and the torque at both ends give.
    kept, turned = c * decay, c * rates
    a0, a1, b0, b1 = a * first, a * second, b * first, b * second
    w = to_torque = from_drive = by_a0 = by_a1 = by_b0 = by_b1 = 0.0
    for k in range(n):
        w += (c[k] * x[k]).real
        to_torque += (c[k] * b[k]).real
        from_drive += (c[k] * a[k]).real
        by_a0 += (c[k] * a0[k]).real
        by_a1 += (c[k] * a1[k]).real
        by_b0 += (c[k] * b0[k]).real
        by_b1 += (c[k] * b1[k]).real
    at_rest = _torque_of(kind, static, numbers, knots, 0.0)[0]
    resting = begin == 0
    sign = 1.0 if w >= 0.0 else -1.0
    held = 0.0
    first_stop = -1
    if resting:
        w = 0.0
    torque = sign * _torque_of(kind, static, numbers, knots, abs(w))[0]
    if resting:
        for k in range(n):
            held += (c[k] * (rates[k] * x[k] + a[k] * drive[0])).real
        torque = held / to_torque
    for i in range(len(drive)):
        out = 0.0
        for k in range(n):
            out += (d[k] * x[k]).real
        speeds[i], others[i], torques[i] = w, out, torque
        if i == len(drive) - 1:
            break
        left, done, rounds = 1.0, 0.0, 0
        free = by_a0 * drive[i] + by_a1 * drive[i + 1]
        for k in range(n):
            free += kept[k].real * x[k].real - kept[k].imag * x[k].imag
        if resting:  # a whole step at rest
            level = free / (by_b0 + by_b1)
            after = from_drive * drive[i + 1]
            for k in range(n):
                y[k] = (
                    decay[k] * x[k] + a0[k] * drive[i] + a1[k] * drive[i + 1]
                    - (b0[k] + b1[k]) * level
                )  # fmt: skip
                after += turned[k].real * y[k].real - turned[k].imag * y[k].imag
            after /= to_torque
            if abs(after) <= static:
                x[:] = y
                torque, left = after, 0.0
        elif sign * (free - by_b0 * torque) > by_b1 * at_rest:  # a whole step of slip
            v = _speed_of(
                kind, static, numbers, knots, by_b1, sign * (free - by_b0 * torque), sign * w
            )
            after = sign * _torque_of(kind, static, numbers, knots, v)[0]
            for k in range(n):
                x[k] = (
                    decay[k] * x[k] + a0[k] * drive[i] + a1[k] * drive[i + 1] - b0[k] * torque
                    - b1[k] * after
                )  # fmt: skip
            w, torque, left = sign * v, after, 0.0
        while left > 1e-9 and rounds < 8:
            rounds += 1
            u0 = drive[i] + done * (drive[i + 1] - drive[i])
            if left == 1.0:
                for k in range(n):
                    e[k], f[k], s[k] = decay[k], first[k], second[k]
            else:
                _weights_of(rates, left * step, e, f, s)
            u1 = drive[i + 1]
            if resting:
                # The torque that keeps it at rest at the end of the step, level within it.
                free, gain = 0.0, 0.0
                for k in range(n):
                    free += (c[k] * (e[k] * x[k] + a[k] * (f[k] * u0 + s[k] * u1))).real
                    gain += (c[k] * b[k] * (f[k] + s[k])).real
                level = free / gain
                ahead = 0.0
                for k in range(n):
                    y[k] = (
                        e[k] * x[k] + a[k] * (f[k] * u0 + s[k] * u1) - b[k] * (f[k] + s[k]) * level
                    )
                    ahead += (c[k] * (rates[k] * y[k] + a[k] * u1)).real
                after = ahead / to_torque
                if abs(after) <= static:
                    for k in range(n):
                        x[k] = y[k]
                    w, torque = 0.0, after
                    left = 0.0
                    continue
                # It leaves where the torque reaches the static one, straight within the step.
                sign = 1.0 if after > 0.0 else -1.0
                now = min(max(sign * torque, -static), static)
                share = (static - now) / (sign * after - now) if sign * after > now else 0.0
                if share > 0.0:
                    part = share * left
                    _weights_of(rates, part * step, e, f, s)
                    um = u0 + share * (u1 - u0)
                    free, gain = 0.0, 0.0
                    for k in range(n):
                        free += (c[k] * (e[k] * x[k] + a[k] * (f[k] * u0 + s[k] * um))).real
                        gain += (c[k] * b[k] * (f[k] + s[k])).real
                    level = free / gain
                    for k in range(n):
                        x[k] = (
                            e[k] * x[k]
                            + a[k] * (f[k] * u0 + s[k] * um)
                            - b[k] * (f[k] + s[k]) * level
                        )
                    done += part
                    left -= part
                resting, w = False, 0.0
                torque = sign * _torque_of(kind, static, numbers, knots, 0.0)[0]
                continue
            free, gain = 0.0, 0.0
            for k in range(n):
                free += (
                    c[k] * (e[k] * x[k] + a[k] * (f[k] * u0 + s[k] * u1) - b[k] * f[k] * torque)
                ).real
                gain += (c[k] * b[k] * s[k]).real
            t0 = at_rest
            if sign * free > gain * t0:
                v = _speed_of(kind, static, numbers, knots, gain, sign * free, sign * w)
                after = sign * _torque_of(kind, static, numbers, knots, v)[0]
                for k in range(n):
                    x[k] = (
                        e[k] * x[k]
                        + a[k] * (f[k] * u0 + s[k] * u1)
                        - b[k] * (f[k] * torque + s[k] * after)
                    )
                w, torque = sign * v, after
                left = 0.0
                continue
            # It stops within the step: where, by the secant through speeds with the torque at rest.
            end = sign * t0
            low, high = 0.0, 1.0
            at_low, at_high = sign * w, sign * free - gain * t0
            share = 0.0
            for _ in range(40):
                if at_low <= 0.0:
                    break
                share = low + (high - low) * at_low / (at_low - at_high)
                _weights_of(rates, share * left * step, e, f, s)
                um = u0 + share * (u1 - u0)
                v = 0.0
                for k in range(n):
                    v += (
                        c[k]
                        * (
                            e[k] * x[k]
                            + a[k] * (f[k] * u0 + s[k] * um)
                            - b[k] * (f[k] * torque + s[k] * end)
                        )
                    ).real
                v *= sign
                if v > 0.0:
                    low, at_low = share, v
                    at_high *= 0.5  # Illinois
                else:
                    high, at_high = share, v
                    at_low *= 0.5
                if abs(v) < 1e-12 or high - low < 1e-12:
                    break
            if share > 0.0:
                um = u0 + share * (u1 - u0)
                for k in range(n):
                    x[k] = (
                        e[k] * x[k]
                        + a[k] * (f[k] * u0 + s[k] * um)
                        - b[k] * (f[k] * torque + s[k] * end)
                    )
            part = share * left
            done += part
            left -= part
            um = drive[i] + done * (drive[i + 1] - drive[i])
            held = 0.0
            for k in range(n):
                held += (c[k] * (rates[k] * x[k] + a[k] * um)).real
            held /= to_torque
            w = 0.0
            if abs(held) <= static:
                resting, torque = True, held
                if first_stop < 0:
                    first_stop = i + 1
            else:  # it turns on, or back
                sign = 1.0 if held > 0.0 else -1.0
                torque = sign * t0
    state[:] = x
    return first_stop


advance: Any = njit(_advance)
"""Over a drive at even times: bit speed, other output and torque are written to the last three.

`rates`, `a`, `b`, `c`, `d`, `state`: complex, shape (states,). `begin`: `SLIPS` or `RESTS`.
"""
