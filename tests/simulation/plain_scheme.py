"""The batch engine's scheme once more, in plain NumPy, for PI, Navarro-Lopez and a held weight.

Nothing is shared with the kernels: the string is stepped by the exponential of its modal matrix,
lanes are columns, and every choice is a `where`. Newton's method stops by the kernels' rule, which
is part of the scheme.
"""

import numpy as np
import scipy.linalg


def plain_run(string, modes, step, steps, kp, ki, a1, a2, beta, weight, omega, first):
    """J1 (s) and time stuck (s) of lanes that start turning at `first` (rad/s)."""
    frequency, shapes = (x[..., :modes] for x in string.undamped_modes)
    top, bit = shapes[0], shapes[-1]
    still, unit = np.zeros((modes, modes)), np.eye(modes)
    damping = shapes.T @ string.damping @ shapes
    inputs = np.vstack([np.zeros((modes, 2)), np.column_stack([top, -bit])])
    motion = np.block([[still, unit], [-np.diag(frequency**2), -damping]])
    both = scipy.linalg.expm(np.block([[motion, inputs], [np.zeros((2, 2 * modes + 2))]]) * step)
    free_step, push = both[:-2, :-2], both[:-2, -2:]
    angle_of, speed_of = np.concatenate([top, 0 * top]), np.concatenate([0 * bit, bit])

    slope = kp / step + ki / 2
    shrink = 1 / (1 + slope * (angle_of @ push[:, 0]))
    share = slope * shrink * (angle_of @ push[:, 1])
    gain = speed_of @ push[:, 0] * share - speed_of @ push[:, 1]
    rise = a1 * weight, (a2 - a1) * weight
    static = a2 * weight
    whole = np.concatenate([np.zeros(modes), shapes.T @ string.mass @ np.ones(string.nodes)])
    z = np.outer(whole, np.full_like(kp, first - omega))
    angle, w, direction = np.zeros_like(kp), np.full_like(kp, first), np.ones_like(kp)
    falling = np.full_like(kp, rise[1] * np.exp(-beta * first))
    torque, held = rise[0] + falling, np.full_like(kp, -1.0)
    j1, stuck = np.zeros_like(kp), np.zeros_like(kp)
    once, twice = w, w  # one and two steps ago
    for _ in range(steps):
        swing = free_step @ z
        alone = ((kp / step - ki / 2) * angle - slope * (angle_of @ swing)) * shrink
        free = omega + speed_of @ swing + speed_of @ push[:, 0] * alone
        own = direction * (free - gain / 2 * torque) > gain / 2 * static
        sign = np.where(own, direction, np.where(free > 0, 1.0, -1.0))
        before = np.where(own, sign * torque, static)
        right = sign * free - gain / 2 * before
        holding = np.abs(free) / gain
        was_stuck = direction == 0
        loose = was_stuck & (holding > static)
        with np.errstate(all="ignore"):
            part = np.where(loose & (held >= 0), 0.5 + (static - holding) / (holding - held), 0)
        right = right + gain / 2 * np.where(part == 0, 0, (holding - held) * part**2)
        sticks = ~own & (holding <= static)
        foreseen = np.maximum(direction * (3 * (w - once) + twice), 0)
        u = newton(right, gain / 2, rise, beta, foreseen, sticks)
        once, twice = w, once
        past = direction * (free - gain / 2 * torque) - gain / 2 * static
        with np.errstate(all="ignore"):
            stopped = past / (past - np.abs(w))
        stuck += step * np.where(loose, part, np.where(sticks, np.where(was_stuck, 1, stopped), 0))
        new = np.where(sticks, 0.0, sign * u)
        bit_torque = (free - new) / gain
        top_torque = alone - share * bit_torque
        z = swing + push @ np.stack([top_torque, bit_torque])
        torque = np.where(sticks, 0.0, sign * 2 * (right - u) / gain)
        held = np.where(was_stuck & sticks, holding, -1.0)
        old, error = w - omega, new - omega
        j1 += step / 2 * (np.abs(old) + np.abs(error)) / omega
        crossed = old * error < 0
        both = np.maximum(np.abs(old) + np.abs(error), 1e-300)
        j1 -= np.where(crossed, step * np.abs(old * error) / both, 0) / omega
        angle, w, direction = angle_of @ z, new, np.where(sticks, 0.0, sign)
    return j1, stuck


def newton(right, half, rise, beta, u, sticks):
    """The root u >= 0 of u + half T(u) = right from a speed nearby, by the engine's rule."""
    falling = rise[1] * np.exp(-beta * u)
    inverse = 1 / (1 - half * beta * falling)
    step = (right - u - half * (rise[0] + falling)) * inverse
    is_open = np.where(sticks, 0, np.abs(step**3 * beta)) > (1e-3 * (1 + u)) ** 2
    u = np.maximum(u + step - half / 2 * beta**2 * falling * inverse * step**2, 0)
    while is_open.any():
        falling = rise[1] * np.exp(-beta * u)
        new = np.maximum(
            u + (right - u - half * (rise[0] + falling)) / (1 - half * beta * falling), 0
        )
        far = np.abs(new - u) > 1e-3 * (1 + u)
        u = np.where(is_open, new, u)
        is_open &= far
    return u
