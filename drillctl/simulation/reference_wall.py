"""Dry friction of the wall in the reference solver, compiled: the sets of nodes that stick.

Between two events every node of the wall either slides one way, under a torque that stays the same,
or sticks: its acceleration is zero, its equation left out of the mass matrix, and the torque that
holds it is what that equation asks for. A phase ends where a sliding node comes to rest or passes
the critical speed, or where a node would need more than its friction at rest. No torque is ever
smoothed, and the work of the wall is exact: torque times angle.

Where the string drifts along the well nothing sticks: the torque of a node is a smooth function of
its speed, and a phase ends where the sum of both velocities passes the critical speed. Its power
is integrated with that of damping; what of it is the wall's is told by a rule of fourth order.
"""

from __future__ import annotations

import math
from typing import Any

from drillctl.simulation.law_calls import compiled

# Rows of the table, a column a node: its number; friction at rest (N m); -1, 0 or 1 as it slides
# or sticks, 2 where it drifts; the share of the friction that is left; torque that holds it (N m);
# its angle as the phase began (rad); its drift, and the speed at which a share is lost (rad/s).
NODE, FRICTION, MODE, LEVEL, HOLDING, ANGLE, DRIFT, CRITICAL = range(8)
ROWS = 8
DRIFTS = 2.0

SAME = 1e-9  # share of a friction, or speed (rad/s), by which two events are one
CAME_FROM = 1e-14  # rad/s: a node that was put at the critical speed is that near, to rounding
MOST_TURNS = 200  # of a search for the sets that are consistent


@compiled
def drift_torque(table: Any, k: int, speed: float) -> float:
    """Torque of a node that drifts (N m)."""
    along = math.hypot(speed, table[DRIFT, k])
    return table[LEVEL, k] * table[FRICTION, k] * speed / along


@compiled
def drift_power(table: Any, speeds: Any, frame: float) -> float:
    """Power that the wall takes from a string that drifts (W)."""
    power = 0.0
    for k in range(table.shape[1]):
        speed = speeds[int(table[NODE, k])] + frame
        power += speed * drift_torque(table, k, speed)
    return power


@compiled
def drift_power_rate(table: Any, speeds: Any, frame: float, accelerations: Any) -> float:
    """Its rate of change (W/s)."""
    total = 0.0
    for k in range(table.shape[1]):
        i = int(table[NODE, k])
        speed, drift = speeds[i] + frame, table[DRIFT, k]
        cube = math.hypot(speed, drift) ** 3
        left = table[LEVEL, k] * table[FRICTION, k]
        total += accelerations[i] * left * speed * (speed**2 + 2.0 * drift**2) / cube
    return total


@compiled
def push_wall(table: Any, speeds: Any, frame: float, force: Any) -> None:
    """Torques of sliding nodes; those of the others are taken off, and kept."""
    for k in range(table.shape[1]):
        i = int(table[NODE, k])
        if table[MODE, k] == DRIFTS:
            force[i] -= drift_torque(table, k, speeds[i] + frame)
        elif table[MODE, k] == 0.0:
            table[HOLDING, k] = force[i]
            force[i] = 0.0
        else:
            force[i] -= table[MODE, k] * table[LEVEL, k] * table[FRICTION, k]


@compiled
def hold_wall(table: Any, side_mass: Any, acceleration: Any) -> None:
    """Complete the torques that hold nodes, of the accelerations beside them."""
    last = len(acceleration) - 1
    for k in range(table.shape[1]):
        if table[MODE, k] == 0.0:
            i = int(table[NODE, k])
            table[HOLDING, k] -= side_mass[i - 1] * acceleration[i - 1]
            if i < last:
                table[HOLDING, k] -= side_mass[i] * acceleration[i + 1]


@compiled
def factorise(table: Any, mass: Any, side_mass: Any, factor: Any, pivot: Any) -> None:
    """Factors of the mass matrix without the nodes that stick."""
    n = len(mass)
    stuck = pivot  # its place, until the pivot is known
    for i in range(n):
        stuck[i] = 0.0
    for k in range(table.shape[1]):
        if table[MODE, k] == 0.0:
            stuck[int(table[NODE, k])] = 1.0
    left, held = mass[0], stuck[0] == 1.0
    pivot[0] = 1.0 / left
    for i in range(n - 1):
        next_held = stuck[i + 1] == 1.0
        free = not (held or next_held)
        factor[i] = side_mass[i] / left if free else 0.0
        left = 1.0 if next_held else mass[i + 1] - factor[i] * side_mass[i]
        pivot[i + 1] = 1.0 / left
        held = next_held


@compiled
def margin_of(table: Any, k: int, speed: float, ratio: float, critical: float) -> float:
    """What is left until a node changes: a share of its friction, or a speed (rad/s)."""
    if table[MODE, k] == 0.0:
        friction = table[FRICTION, k]
        if friction == 0.0:
            return 1.0
        return 1.0 - abs(table[HOLDING, k]) / friction
    if table[MODE, k] == DRIFTS:
        if ratio == 1.0 or table[CRITICAL, k] == 0.0:
            return 1.0
        return to_critical(abs(speed), table[LEVEL, k], table[CRITICAL, k])
    ahead = table[MODE, k] * speed
    return least_margin(ahead, table[LEVEL, k], ratio, critical)


@compiled
def least_margin(ahead: float, level: float, ratio: float, critical: float) -> float:
    """That of a sliding node at a speed in its direction; exactly zero is where it came from."""
    tiny = 1e-300
    margin = ahead or tiny
    if ratio < 1.0:
        margin = min(margin, to_critical(ahead, level, critical))
    return margin


@compiled
def to_critical(ahead: float, level: float, critical: float) -> float:
    """What is left to the critical speed (rad/s)."""
    over = critical - ahead if level == 1.0 else ahead - critical
    return 1e-300 if abs(over) < CAME_FROM else over


@compiled
def turn_node(table: Any, k: int, speed: float, ratio: float, critical: float) -> float:
    """Change a node whose margin is used up; returns the speed that it has exactly (rad/s)."""
    mode = table[MODE, k]
    if mode == 0.0:
        table[MODE, k] = math.copysign(1.0, table[HOLDING, k])
        table[LEVEL, k] = 1.0
        return 0.0
    if mode == DRIFTS:
        table[LEVEL, k] = ratio if table[LEVEL, k] == 1.0 else 1.0
        return math.copysign(table[CRITICAL, k], speed)
    ahead = mode * speed
    if ratio < 1.0 and abs(ahead - critical) < abs(ahead):
        table[LEVEL, k] = ratio if table[LEVEL, k] == 1.0 else 1.0
        return mode * critical
    table[MODE, k], table[LEVEL, k] = 0.0, 1.0
    return 0.0


@compiled
def settle_node(table: Any, k: int, speed: float, push: float) -> bool:
    """Let a node go that its friction does not hold, or hold one that would turn back at once.

    `push`: its inertia times acceleration (N m); of a node just let go, zero but for rounding.
    """
    friction = table[FRICTION, k]
    if table[MODE, k] == DRIFTS:
        return False
    if table[MODE, k] == 0.0:
        if abs(table[HOLDING, k]) > friction * (1.0 + 1e-12):
            table[MODE, k] = math.copysign(1.0, table[HOLDING, k])
            table[LEVEL, k] = 1.0
            return True
    elif speed == 0.0 and table[MODE, k] * push < -SAME * friction:
        table[MODE, k], table[LEVEL, k] = 0.0, 1.0
        return True
    return False
