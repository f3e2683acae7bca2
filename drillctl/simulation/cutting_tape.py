"""The tape of a bit that cuts its own wake, compiled: its motion, and the surface behind it."""

from __future__ import annotations

from typing import Any, NamedTuple

from numba.extending import register_jitable

from drillctl.simulation.law_calls import compiled

FIRST, LAST = 3, 27  # columns of the tape: of the polynomials, and behind them
FOLLOWED = LAST + 9  # of what the weight follows
COLUMNS = FOLLOWED + 4
CLOSE = 1e-14  # share of a step to which an event is located


class Memory(NamedTuple):
    """What a run has been through; arrays so that calls can go on."""

    now: Any  # shape (5,): time, next step; angle and depth at the start; energy of impacts (J)
    # shape (7,): axial phase, torsional one, steps, events; next break, next sample of the drive,
    # next reading of the weight
    count: Any
    rock: Any  # shape (4,): that of the hour
    # shape (room, 40): begin (s), length (s), 1 if in contact; value, slope and curvature at both
    # ends of bit angle, depth, top angle and angle of the node below; force on the bit and its
    # torque at both ends; phases; depth of cut, torque of the drive at both ends; what the weight
    # follows at both ends, its rate at both
    tape: Any
    events: Any  # shape (room, 2): time, kind
    state: Any
    # shape (9, states): rates of the seven stages, the state at the end of the step; rates that
    # nobody keeps
    work: Any


@register_jitable(fastmath={"contract"}, error_model="numpy")  # called from plain Python too
def _coefficients(h: float, a: float, va: float, aa: float, b: float, vb: float, ab: float
                  ) -> tuple[float, float, float, float, float]:  # fmt: skip
    """Of `hermite`, from the first power of the share to the fifth."""
    p, q = va * h, vb * h
    r, s = 0.5 * aa * h * h, 0.5 * ab * h * h
    d = b - a - p - r
    e = q - p - 2.0 * r
    f = s - r
    c3 = 10.0 * d - 4.0 * e + f
    c4 = -15.0 * d + 7.0 * e - 2.0 * f
    c5 = 6.0 * d - 3.0 * e + f
    return p, r, c3, c4, c5


@compiled
def hermite(x: float, h: float, a: float, va: float, aa: float, b: float, vb: float,
            ab: float) -> float:  # fmt: skip
    """Polynomial of degree five through value, slope and curvature at both ends of a step."""
    p, r, c3, c4, c5 = _coefficients(h, a, va, aa, b, vb, ab)
    return a + x * (p + x * (r + x * (c3 + x * (c4 + x * c5))))


@compiled
def hermite_slope(x: float, h: float, a: float, va: float, aa: float, b: float, vb: float,
                  ab: float) -> float:  # fmt: skip
    """Derivative of `hermite` with respect to the share."""
    p, r, c3, c4, c5 = _coefficients(h, a, va, aa, b, vb, ab)
    return p + x * (2.0 * r + x * (3.0 * c3 + x * (4.0 * c4 + x * 5.0 * c5)))


@compiled
def on_step(memory: Any, step: int, share: float, which: int) -> float:
    """Bit angle (0), depth (1), top angle (2) or that of the node below at a share of a step."""
    row, k = memory.tape[step], FIRST + 6 * which
    return hermite(
        share, row[1], row[k], row[k + 1], row[k + 2], row[k + 3], row[k + 4], row[k + 5]
    )


@compiled
def slope_on_step(memory: Any, step: int, share: float, which: int) -> float:
    """Rate of the same."""
    row, k, h = memory.tape[step], FIRST + 6 * which, memory.tape[step, 1]
    return (
        hermite_slope(share, h, row[k], row[k + 1], row[k + 2], row[k + 3], row[k + 4], row[k + 5])
        / h
    )


@compiled
def step_at(memory: Any, time: float) -> int:
    """The first step that ends at a time (s) or after it."""
    low, high = 0, memory.count[2] - 1
    while low < high:
        middle = (low + high) // 2
        if memory.tape[middle, 0] + memory.tape[middle, 1] >= time:
            high = middle
        else:
            low = middle + 1
    return low


@compiled
def surface(bit: Any, slope: float, memory: Any, angle: float) -> float:
    """Depth of the rock where the bit was at an angle, as it left it."""
    tape, begin = memory.tape, memory.now[2]
    while True:
        steps = memory.count[2]
        if steps == 0 or angle <= begin:
            return memory.now[3] + slope * (angle - begin)
        low, high = 0, steps - 1
        while low < high:  # the first step that ends at the angle or beyond
            middle = (low + high) // 2
            if tape[middle, FIRST + 3] >= angle:
                high = middle
            else:
                low = middle + 1
        if tape[low, 2] != 0.0:
            break
        angle -= bit.between  # not cut then: as a blade before has left it
    a, b = tape[low, FIRST], tape[low, FIRST + 3]
    if angle >= b or b <= a:
        return tape[low, FIRST + 9]
    left, right, x = 0.0, 1.0, (angle - a) / (b - a)
    for _ in range(60):
        value = on_step(memory, low, x, 0) - angle
        if value > 0.0:
            right = x
        else:
            left = x
        rise = slope_on_step(memory, low, x, 0) * tape[low, 1]
        new = x - value / rise if rise > 0.0 else 0.5 * (left + right)
        if not left < new < right:
            new = 0.5 * (left + right)
        if abs(new - x) < CLOSE:
            break
        x = new
    return on_step(memory, low, x, 1)
