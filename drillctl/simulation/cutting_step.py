"""Fixed steps of a bit that cuts its own wake, compiled; a lane by itself.

Both strings are propagated exactly under forces held over a step, the drive is eliminated in
closed form. What is left are two scalar inclusions, the axial one and then the torsional one, both
in closed form: cutting forces are the mean of those at both ends of the step, so that free swings
are of second order; phases change at the ends of steps. The surface behind the bit lies in a ring
of angle and depth, straight between two of its points.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numba
import numpy as np

from drillctl.simulation.kernel_cache import on_disk

OPTIONS: dict[str, Any] = {"fastmath": {"contract"}, "nogil": True, "error_model": "numpy"}
RING = 4096  # points of the surface that a lane remembers: a power of two
FINEST = 3000.0  # most of them between two blades

(J1, STUCK_TIME, STICKS, LATE_LOW, LATE_HIGH, LATE_ANGLE, LATE_STUCK, TURNED, LOW, HIGH, PEAK_PIPE,
 PEAK_TOP, OUTSIDE_NARROW, OUTSIDE_WIDE, WORK, WEIGHT, POWER, DEPTH, CUT, AXIAL_STUCK, OFF_BOTTOM,
 AXIAL_WORK, BOUND, MEASURED) = range(24)  # fmt: skip
"""What is measured of a lane: sums over time, extremes, the last moments outside the bands."""
ROWS = {
    J1: "J1", STUCK_TIME: "STUCK_TIME", STICKS: "STICKS", LATE_LOW: "LATE_LOW",
    LATE_HIGH: "LATE_HIGH", LATE_ANGLE: "LATE_ANGLE", LATE_STUCK: "LATE_STUCK",
    TURNED: "BIT_ANGLE", LOW: "LOW", HIGH: "HIGH", PEAK_PIPE: "PEAK_PIPE", PEAK_TOP: "PEAK_TOP",
    OUTSIDE_NARROW: "OUTSIDE_NARROW", OUTSIDE_WIDE: "OUTSIDE_WIDE", WORK: "WORK",
    WEIGHT: "WEIGHT_SUM", POWER: "ROP_SUM", BOUND: "BOUND",
}  # fmt: skip
"""Which of them are rows of `kernels.rows`, by their names there."""
SIGNALS = 11
"""Of a trace: those of `kernels.advance.TRACED`, then depth (m) and rate of penetration (m/s)."""


compiled = numba.njit(_nrt=False, **OPTIONS)
"""No references are counted in what makes no array: each look at one would count, atomically."""


class Blocks(NamedTuple):
    """A string as 2 x 2 blocks z' = F z + top T_top + bit T_bit, a step long."""

    free: Any  # shape (blocks, 4)
    top: Any  # shape (blocks, 2)
    bit: Any  # shape (blocks, 2)
    load: Any  # shape (blocks, 2): by what is constant
    # shape (6, blocks, 2): displacement and velocity of the top, the bit, the node below the top
    read: Any


class Lane(NamedTuple):
    """Numbers of a lane."""

    per_depth: float  # of all blades: N/m
    torque_per_depth: float  # N m/m
    flat: float  # N
    flat_torque: float  # N m
    between: float  # rad
    weight: float  # N
    set_speed: float
    constant: float
    kp: float
    ki: float
    slope: float  # of the surface at the start (m/rad)
    spread: float  # of a rock that varies, with its spacing and its ways
    spacing: float
    advance: float
    turns: float
    sinks: float  # way per depth
    path: float  # row of its path in the table
    steady: float  # rate of penetration at which dampers take no force (m/s)


class Clock(NamedTuple):
    """Time of a run."""

    step: float
    steps: int
    j1_from: float
    window_from: float
    every: int
    give_up: float


@compiled
def _sum(read: Any, which: int, z: Any) -> float:
    total = 0.0
    for k in range(z.shape[0]):
        total += read[which, k, 0] * z[k, 0] + read[which, k, 1] * z[k, 1]
    return total


@compiled
def _by(read: Any, which: int, push: Any) -> float:
    total = 0.0
    for k in range(push.shape[0]):
        total += read[which, k, 0] * push[k, 0] + read[which, k, 1] * push[k, 1]
    return total


PACKED = 20  # numbers of a block, side by side, so that a step passes on one array a string


def _packed(blocks: Any, stiffness: float, damping: float) -> Any:
    """Each block's F, answers to top, bit and load, and what is read of it, in one row."""
    count = blocks.free.shape[0]
    packed = np.empty((count, PACKED))
    for k in range(count):
        packed[k, 0:4] = blocks.free[k]
        for i in range(2):
            packed[k, 4 + i], packed[k, 6 + i] = blocks.top[k, i], blocks.bit[k, i]
            packed[k, 8 + i] = blocks.load[k, i]
            for which in range(4):  # angle and speed of the top, of the bit
                packed[k, 10 + 2 * which + i] = blocks.read[which, k, i]
            packed[k, 18 + i] = stiffness * (
                blocks.read[0, k, i] - blocks.read[4, k, i]
            ) + damping * (blocks.read[1, k, i] - blocks.read[5, k, i])
    return packed


pack = numba.njit(**OPTIONS)(_packed)


@compiled
def _turn(
    p: Any, speed: float, net: float, torque: float, z: Any
) -> tuple[float, float, float, float, float]:
    """Complete the last step, and let the string swing through the next in one pass.

    Returns torque of the first element and speed of the top as the step begins; angle of the top,
    angle and speed of the bit as it would end without torques.
    """
    pipe = fast = above = angle = turning = 0.0
    for k in range(p.shape[0]):
        a = z[k, 0] + p[k, 4] * net + p[k, 6] * torque
        b = z[k, 1] + p[k, 5] * net + p[k, 7] * torque
        fast += p[k, 12] * a + p[k, 13] * b
        pipe += p[k, 18] * a + p[k, 19] * b
        c = p[k, 0] * a + p[k, 1] * b + speed * p[k, 8]
        d = p[k, 2] * a + p[k, 3] * b + speed * p[k, 9]
        z[k, 0], z[k, 1] = c, d
        above += p[k, 10] * c + p[k, 11] * d
        angle += p[k, 14] * c + p[k, 15] * d
        turning += p[k, 16] * c + p[k, 17] * d
    return pipe, fast, above, angle, turning


@compiled
def _sink(p: Any, speed: float, push: float, y: Any) -> tuple[float, float]:
    """The same of the axial string: depth and velocity of the bit as the step would end."""
    depth = sinking = 0.0
    for k in range(p.shape[0]):
        a = y[k, 0] + p[k, 6] * push
        b = y[k, 1] + p[k, 7] * push
        c = p[k, 0] * a + p[k, 1] * b + speed * p[k, 8]
        d = p[k, 2] * a + p[k, 3] * b + speed * p[k, 9]
        y[k, 0], y[k, 1] = c, d
        depth += p[k, 14] * c + p[k, 15] * d
        sinking += p[k, 16] * c + p[k, 17] * d
    return depth, sinking


@compiled
def _advance(
    lane: Any, torsion: Any, axial: Any, clock: Any, table: Any, tied: Any, sunk: Any, z: Any,
    y: Any, ring: Any, out: Any, trace: Any,
) -> None:  # fmt: skip
    """Advance one lane from time zero to the end; `z` and `y` are its states, `out` holds zeros."""
    step, mask = clock.step, RING - 1
    read, seen = torsion.read, axial.read
    # Answers at the end of a step to a torque, or a force, held over it.
    top_top, top_bit = _by(read, 0, torsion.top), _by(read, 0, torsion.bit)
    speed_top, speed_bit = _by(read, 3, torsion.top), _by(read, 3, torsion.bit)
    angle_top, angle_bit = _by(read, 2, torsion.top), _by(read, 2, torsion.bit)
    back, half = lane.kp / step, 0.5 * lane.ki
    shrink = 1.0 / (1.0 + (back + half) * top_top)
    share = -(back + half) * top_bit * shrink
    gain = -(speed_bit + speed_top * share)
    by_depth, by_speed = _by(seen, 2, axial.bit), _by(seen, 3, axial.bit)
    stiff = 0.5 * lane.per_depth
    top = _sum(read, 0, z)
    turned = _sum(read, 2, z)
    speed = _sum(read, 3, z) + lane.set_speed
    depth, sinking = _sum(seen, 2, y), _sum(seen, 3, y)
    first_turned, first_depth = turned, depth
    closest = lane.between / FINEST
    ring[0, 0], ring[0, 1] = turned - 3.0 * lane.between, depth - 3.0 * lane.slope * lane.between
    ring[1, 0], ring[1, 1] = turned, depth
    last, pointer = 1, 0
    cut = lane.slope * lane.between  # per blade, at the begin of the step
    stuck, contact = speed == 0.0, True
    hard = 1.0
    out[LATE_LOW], out[LATE_HIGH] = math.inf, -math.inf
    out[STICKS] = 1.0 if stuck else 0.0
    out[LOW] = out[HIGH] = speed
    force = lane.weight
    drive = lane.constant - lane.kp * (_sum(read, 1, z)) - lane.ki * top
    torque = lane.torque_per_depth * cut + lane.flat_torque
    sample = 0
    net = held = push = 0.0  # torques and force of the last step, which the next pass puts in
    for n in range(clock.steps + 1):
        pipe, fast, free_top, free_angle, free_speed = _turn(tied, lane.set_speed, net, held, z)
        out[PEAK_PIPE] = max(out[PEAK_PIPE], abs(pipe))
        if clock.every > 0 and n == sample * clock.every:
            trace[sample, 0], trace[sample, 1] = fast + lane.set_speed, speed
            trace[sample, 2], trace[sample, 3] = top, turned - lane.set_speed * n * step
            trace[sample, 4], trace[sample, 5] = pipe, torque
            trace[sample, 6] = 1.0 if stuck else 0.0
            trace[sample, 7], trace[sample, 8] = drive, force
            trace[sample, 9], trace[sample, 10] = depth, sinking
            sample += 1
        if n == clock.steps:
            break
        end = (n + 1) * step
        free_angle += lane.set_speed * end
        free_speed += lane.set_speed
        free_depth, free_sinking = _sink(sunk, lane.steady, push, y)
        level = shrink * (lane.constant - back * (free_top - top) - half * (free_top + top))
        free_speed += speed_top * level
        free_angle += angle_top * level
        # Where the bit will be, and what a blade before has left there.
        ahead = free_angle + (angle_bit + angle_top * share) * torque
        if stuck or ahead < turned:
            ahead = turned
        place = ahead - lane.between
        while pointer < last - 1 and ring[(pointer + 1) & mask, 0] < place:
            pointer += 1
        if last - pointer >= RING:
            pointer = last - RING + 1
        a, b = pointer & mask, (pointer + 1) & mask
        rise = (ring[b, 1] - ring[a, 1]) / (ring[b, 0] - ring[a, 0])
        behind = ring[a, 1] + rise * (place - ring[a, 0])
        if lane.spread > 0.0:
            way = (
                lane.advance * end + lane.turns * (ahead - first_turned)
                + lane.sinks * (depth - first_depth)
            )  # fmt: skip
            node = min(max(way / lane.spacing, 0.0), table.shape[1] - 2.0)
            k = int(node)
            one = int(lane.path)
            value = table[one, k] + (node - k) * (table[one, k + 1] - table[one, k])
            hard = math.exp(lane.spread * (value - 0.5 * lane.spread))
        k_half = stiff * hard
        was = cut if contact else 0.0
        # The axial inclusion.
        new_depth, new_sinking, g = 0.0, 0.0, 0.0
        if stuck and contact:
            push = -free_sinking / by_speed
            new_depth, new_sinking = free_depth + by_depth * push, 0.0
            g = (lane.weight - push - k_half * (was + new_depth - behind)) / lane.flat
            g = min(max(g, 0.0), 1.0)
        else:
            shrunk = 1.0 / (1.0 + k_half * by_depth)
            settled = False
            for trial in range(2):
                g = 1.0 - trial
                base = lane.weight - lane.flat * g - k_half * was
                new_depth = shrunk * (free_depth + by_depth * (base + k_half * behind))
                if new_depth < behind:
                    if trial == 0 and not contact:
                        continue
                    new_depth = free_depth + by_depth * base
                    push = base
                else:
                    push = base - k_half * (new_depth - behind)
                new_sinking = free_sinking + by_speed * push
                if (trial == 0 and new_sinking > 0.0) or (trial == 1 and new_sinking < 0.0):
                    settled = True
                    break
                if trial == 1 and not contact and new_depth < behind:
                    settled = True  # falls freely
                    break
            if not settled:
                push = -free_sinking / by_speed
                new_depth, new_sinking = free_depth + by_depth * push, 0.0
                g = (lane.weight - push - k_half * (was + max(new_depth - behind, 0.0))) / lane.flat
                g = min(max(g, 0.0), 1.0)
        contact_new = new_depth >= behind
        new_cut = max(new_depth - behind, 0.0)
        if not contact_new and not contact:
            g = 0.0
        # The torsional one.
        most = hard * lane.torque_per_depth * 0.5 * (was + new_cut) + lane.flat_torque * g
        was_stuck, new_speed, part = stuck, free_speed - gain * most, 0.0
        if new_speed <= 0.0:
            torque = free_speed / gain
            new_speed = 0.0
            if not was_stuck:
                part = speed / (speed - free_speed + gain * most)
                out[STICKS] += 1.0
                if contact_new or contact:
                    push = -free_sinking / by_speed
                    new_depth, new_sinking = free_depth + by_depth * push, 0.0
                    new_cut = max(new_depth - behind, 0.0)
            stuck = True
        else:
            torque = most
            stuck = False
        net, held = level + share * torque, torque
        top = free_top + top_top * net + top_bit * torque
        new_turned = free_angle + angle_top * (net - level) + angle_bit * torque
        if (stuck and was_stuck) or new_turned < turned:
            new_turned = turned
        # The surface that it leaves.
        left = new_depth if contact_new else behind
        apart = ring[last & mask, 0] - ring[(last - 1) & mask, 0]
        if apart >= closest and new_turned > ring[last & mask, 0]:
            last += 1
        if new_turned > ring[(last - 1) & mask, 0]:
            ring[last & mask, 0], ring[last & mask, 1] = new_turned, left
        # Measures.
        force = lane.weight - push
        drive = net
        rest = (1.0 - part if not was_stuck else 1.0) if stuck else 0.0
        counted = 0.0 if end <= clock.j1_from else min(step, end - clock.j1_from)
        x0, x1 = speed - lane.set_speed, new_speed - lane.set_speed
        area = 0.5 * (abs(x0) + abs(x1))
        if x0 * x1 < 0.0:
            area = 0.5 * (x0 * x0 + x1 * x1) / (abs(x0) + abs(x1))
        out[J1] += area * counted
        out[STUCK_TIME] += rest * step
        out[TURNED] = new_turned - first_turned
        out[LOW], out[HIGH] = min(out[LOW], new_speed), max(out[HIGH], new_speed)
        if end > clock.window_from:
            late = min(step, end - clock.window_from)
            out[LATE_LOW] = min(out[LATE_LOW], new_speed)
            out[LATE_HIGH] = max(out[LATE_HIGH], new_speed)
            out[LATE_ANGLE] += 0.5 * (speed + new_speed) * late
            out[LATE_STUCK] += rest * late
        out[PEAK_TOP] = max(out[PEAK_TOP], abs(drive))
        if abs(x1) > 0.02 * lane.set_speed:
            out[OUTSIDE_NARROW] = end
        if abs(x1) > 0.05 * lane.set_speed:
            out[OUTSIDE_WIDE] = end
        advanced = new_turned - turned
        out[WORK] += torque * advanced
        out[AXIAL_WORK] += force * (new_depth - depth)
        out[WEIGHT] += force * step
        out[POWER] += force * advanced
        out[CUT] += 0.5 * (was + new_cut) * step
        if new_sinking == 0.0 and sinking == 0.0 and contact_new:
            out[AXIAL_STUCK] += step
        if not contact_new:
            out[OFF_BOTTOM] += step
        speed, turned, depth, sinking = new_speed, new_turned, new_depth, new_sinking
        cut, contact = new_cut, contact_new
        if (n & 63) == 63 and out[J1] > clock.give_up * lane.set_speed:
            out[BOUND] = out[J1]
            break
    out[DEPTH] = depth - first_depth


def _run(
    begin: Any, end: Any, lanes: Any, torsion: Any, axial: Any, clock: Any, table: Any,
    element: Any, starts: Any, depths: Any, out: Any, traces: Any, watch: Any,
) -> None:  # fmt: skip
    """Advance some lanes; `lanes` has a row of `Lane` each, `starts` and `depths` their states."""
    ring = np.empty((RING, 2))
    tied, sunk = pack(torsion, element[0], element[1]), pack(axial, 0.0, 0.0)
    z, y = np.empty(starts.shape[1:]), np.empty(depths.shape[1:])
    for one in range(begin, end):
        if watch[0] != 0:
            break
        x = lanes[one]
        lane = Lane(
            x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10], x[11], x[12],
            x[13], x[14], x[15], x[16], x[17],
        )  # fmt: skip
        z[:], y[:] = starts[one], depths[one]
        _advance(lane, torsion, axial, clock, table, tied, sunk, z, y, ring, out[one], traces[one])


run = on_disk(_run, __file__)
"""Compiled, and kept on disk under a name that its source is part of."""
