"""The inclusion at the bit against an integrator of scipy that parts the motion at its events."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from drillctl.logs.inclusion import EXPONENTIAL, POINTS, Exponentials, Rock, advance

INERTIA, IMPEDANCE, STATIC, SLIDING, DECAY = 300.0, 400.0, 9e3, 3e3, 0.3  # kg m2, N m s/rad, N m
CURVES = {
    "exponential": (EXPONENTIAL, [SLIDING, 8e3, DECAY], [0.0, 0.0]),
    "points": (POINTS, [8e3, 5e3, 3e3, 3e3], [0.0, 2.0, 6.0, 12.0]),
    "constant": (POINTS, [5e3, 5e3], [0.0, 1.0]),
}
STRING = Exponentials(*(np.array([x + 0j]) for x in (
    -IMPEDANCE / INERTIA, 2.0 / INERTIA, 1.0 / INERTIA, 1.0, 0.5,
)))  # fmt: skip


def drive(time):
    return 4.5e3 + 4.2e3 * np.sin(1.3 * time)


def rock_of(kind):
    number, numbers, knots = CURVES[kind]
    return Rock(number, STATIC, np.array(numbers), np.array(knots))


def torque(kind, speed):
    _, numbers, knots = CURVES[kind]
    if kind == "exponential":
        return numbers[0] + (numbers[1] - numbers[0]) * np.exp(-numbers[2] * speed)
    return np.interp(speed, knots, numbers)


def exact(kind, time, drive):
    """J w' = 2 u - Z w - T, at times, by pieces of slip and rest; how often the bit stopped."""
    now, speed, stops, speeds = 0.0, 0.0, 0, np.zeros(len(time))

    def left(t, _):
        return abs(2.0 * drive(t)) - STATIC

    def stopped(t, w):
        return w[0]

    left.terminal = stopped.terminal = True
    left.direction, stopped.direction = 1.0, -1.0
    while now < time[-1]:
        if speed == 0.0 and abs(2.0 * drive(now)) < STATIC:
            held = solve_ivp(lambda t, w: [0.0], (now, time[-1]), [0.0], events=left, max_step=0.01)
            now, speed = held.t[-1], 1e-12
            continue
        slid = solve_ivp(
            lambda t, w: (2.0 * drive(t) - IMPEDANCE * w - torque(kind, w)) / INERTIA,
            (now, time[-1]), [speed], events=stopped, rtol=1e-10, atol=1e-12, max_step=0.01,
            dense_output=True,
        )  # fmt: skip
        inside = (time > now) & (time <= slid.t[-1])
        speeds[inside] = slid.sol(time[inside])[0]
        now, speed = slid.t[-1], 0.0
        stops += now < time[-1]
    return speeds, stops


@pytest.mark.parametrize("kind", ["exponential", "points"])
def test_the_inclusion_is_of_second_order_through_stops_and_starts(kind):
    """Drives below and above what the bit can be held with: it stops and leaves again."""
    errors = []
    for step in (0.04, 0.02, 0.01):
        time = np.arange(0.0, 30.0, step)
        speeds, stops = exact(kind, time, drive)
        speed, other, held = advance(
            STRING, rock_of(kind), step, drive(time), True, np.zeros(1, complex)
        )
        assert stops > 3
        assert other == pytest.approx(0.5 * speed, abs=1e-9)
        resting = speed == 0.0
        assert 0.1 < resting.mean() < 0.9
        assert (np.abs(held[resting]) <= STATIC).all()
        assert held[~resting] == pytest.approx(torque(kind, speed[~resting]), rel=1e-12)
        errors.append(np.sqrt(np.mean((speed - speeds) ** 2)))
    assert errors[-1] < 2e-3
    assert errors[0] / errors[1] > 3.0
    assert errors[1] / errors[2] > 3.0


def test_a_step_is_parted_where_the_bit_stops_and_leaves():
    """Under constant friction a straight drive is followed exactly, however long the steps are."""
    time = np.arange(0.0, 30.0, 0.4)
    given = drive(time)
    speeds, stops = exact("constant", time, lambda t: np.interp(t, time, given))
    speed = advance(STRING, rock_of("constant"), 0.4, given, True, np.zeros(1, complex))[0]
    assert stops > 3
    assert speed == pytest.approx(speeds, abs=2e-5)  # of scipy at the kinks of the drive
