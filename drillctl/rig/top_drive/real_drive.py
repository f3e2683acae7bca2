"""A drive as it is built: filters, torque feedback, limits, lag; in continuous or sampled time.

How it moves, torque and rates of its memory, is written once: the reference solver integrates these
equations, the linear side reads its matrices off them.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from drillctl.arrays import Array


class RealDrive(NamedTuple):
    r"""Speed control with what makes a drive real, in continuous time.

    The encoder signal lags the speed, the torque fed back is that of the motor less what an
    inertia takes, the command is limited, and the motor follows with a lag:

    .. math:: \tau_e \dot\omega_e = \omega - \omega_e, \quad
              \tau_x \dot x = T - J_x \dot\omega_e - x, \quad
              \dot l = \omega_c (x - l)

    .. math:: e = \Omega - \omega_e - m\,(x - l), \quad
              c = T_0 + K_p e + K_i I, \quad
              \dot I = e + \frac{k_t}{K_i} (\mathrm{sat}\,c - c)

    .. math:: \mathrm{sat}\,c = \max(T_{min}, -P/|\omega|) \ldots
              \min(T_{max}, P/|\omega|, T_c(|\omega|)), \quad
              \dot T = \frac{\mathrm{sat}\,c - T}{\tau_T}, \; |\dot T| \le R

    With `mobility` m = 0 it is a PI. With J_x the inertia of the drive x is the torque that the
    pipe takes, and m = a / zeta is Z-torque (impedance matching; a = 1 the torsional
    rectification of Tucker & Wang 1999 in its ideal limit). With J_x = 0 it is the motor torque,
    and m = 1 / c_f, corner k_f / c_f is active damping (after Jansen & van den Steen 1995): the
    drive acts as a spring k_f and a damper c_f. Anti-windup is by back-calculation (Astrom &
    Hagglund, PID Controllers, 1995).

    Attributes
    ----------
    feedforward : float
        T_0, torque at no error (N m): the level of a drive at constant torque, else 0.
    kp, ki : float
        Gains (N m s/rad, N m/rad).
    mobility : float
        m, by how much the torque fed back lowers the set speed (rad/s per N m).
    sensed_inertia : float
        J_x, whose torque is taken off that of the motor (kg m2).
    corner : float
        omega_c of the high-pass on the torque fed back (rad/s).
    encoder, torque_filter, lag : float
        Time constants tau_e, tau_x, tau_T (s); zero for none.
    least, most : float
        Torque limits (N m); infinite for none.
    power : float
        Power limit P (W); infinite for none.
    rate : float
        Limit R of the torque's rate (N m/s); infinite for none, else with a lag.
    tracking : float
        k_t (1/s), rate of back-calculation of a limited integral; 0 without anti-windup.
    period : float
        h, between two samples of a `SampledDrive` (s).
    late : float
        Periods that its command waits before it is given out: 0 or 1.
    slowness : float
        One over the maximum speed, beyond which the largest torque fades to zero (s/rad); 0 for
        none.
    continuous : float
        Torque that it bears for any time (N m): limits nothing, is measured against.
    curve : float
        Torque limit T_c at rest of a motor with a curve (N m), which falls from knot to knot;
        infinite for none.
    w1, ..., w12, c1, ..., c12 : float
        Speeds at which its slope changes (rad/s), and by how much (N m s/rad).
    """

    feedforward: Any
    kp: Any
    ki: Any
    mobility: Any
    sensed_inertia: Any
    corner: Any
    encoder: Any
    torque_filter: Any
    lag: Any
    least: Any
    most: Any
    power: Any
    rate: Any
    tracking: Any
    period: Any = 0.0
    late: Any = 0.0
    slowness: Any = 0.0
    continuous: Any = math.inf
    curve: Any = math.inf
    w1: Any = 0.0
    w2: Any = 0.0
    w3: Any = 0.0
    w4: Any = 0.0
    w5: Any = 0.0
    w6: Any = 0.0
    w7: Any = 0.0
    w8: Any = 0.0
    w9: Any = 0.0
    w10: Any = 0.0
    w11: Any = 0.0
    w12: Any = 0.0
    c1: Any = 0.0
    c2: Any = 0.0
    c3: Any = 0.0
    c4: Any = 0.0
    c5: Any = 0.0
    c6: Any = 0.0
    c7: Any = 0.0
    c8: Any = 0.0
    c9: Any = 0.0
    c10: Any = 0.0
    c11: Any = 0.0
    c12: Any = 0.0

    def gains(self) -> tuple[Any, Any]:
        """Proportional (N m s/rad) and integral (N m/rad) gain of the speed controller."""
        return self.kp, self.ki

    def torque(self, angle: Any, speed: Any) -> Any:
        """Torque (N m) in steady motion at `angle` (rad) and `speed` (rad/s) in the frame."""
        return self.feedforward - self.kp * speed - self.ki * angle

    def impedance(self, s: Any) -> Any:
        """Torque that the drive takes per speed of the string (N m s/rad) at `s` (1/s)."""
        return _impedance(self, s, 1.0)


class SampledDrive(RealDrive):
    """The drive of `RealDrive` with a controller that works at equal intervals.

    At the times k h the controller reads speed and torque, computes its command and holds it for
    one period; the filters of the torque work on the mean torque of the last period, the encoder
    and the motor stay what they are. With `late` the command is given out one period later.
    """

    __slots__ = ()

    def impedance(self, s: Any) -> Any:
        """Impedance (N m s/rad) at `s` (1/s); sampling counts as its mean delay.

        A command held over a period is half a period late on the mean: a good account of the
        sampled loop well below the sampling frequency.
        """
        return _impedance(self, s, np.exp(-s * (0.5 + self.late) * self.period))


def _impedance(drive: RealDrive, s: Any, held: Any) -> Any:
    """Torque per speed with the command passed on by the factor `held`.

    T = -g (c - loss), with the command's response to speed and to the torque itself eliminated.
    """
    seen = 1.0 / (1.0 + s * drive.encoder)
    controller = drive.kp + drive.ki / s
    felt = drive.mobility * s / (s + drive.corner) / (1.0 + s * drive.torque_filter)
    follows = held / (1.0 + s * drive.lag)
    # T = -follows C [seen w + felt (T - J s seen w)]
    given = follows * controller
    return given * seen * (1.0 - felt * drive.sensed_inertia * s) / (1.0 + given * felt)


KNOTS = 12  # most points of a curve of torque over speed
FADE = 0.1  # share of the maximum speed over which the largest torque falls to zero beyond it

MEMORY = ("speed seen", "torque felt", "its slow part", "integral", "motor torque")
"""Memory of a `RealDrive` (rad/s, N m, N m, rad, N m)."""
SAMPLED_MEMORY = (*MEMORY, "command", "next command", "speed last seen", "impulse since")
"""Memory of a `SampledDrive` (... N m, N m, rad/s, N m s)."""


def respond(
    drive: RealDrive,
    memory: Array,
    speed: float,
    lead: float,
    absolute: float,
    acceleration: tuple[float, float],
) -> tuple[float, tuple[float, float, float, float, float]]:
    """Torque of a `RealDrive` and the rates of its memory."""
    encoder, filtered, slow, integral, motor = memory[0], memory[1], memory[2], memory[3], memory[4]
    seen = encoder if drive.encoder > 0.0 else speed
    # The torque fed back is a T + b: the motor's, less what the sensed inertia takes.
    a, b = _felt(drive, speed, encoder, acceleration)
    error = lead - seen + drive.mobility * slow
    fixed = drive.feedforward + drive.kp * error + drive.ki * integral
    by_motor = 0.0
    if drive.torque_filter > 0.0:
        fixed -= drive.kp * drive.mobility * filtered
    elif drive.lag > 0.0:
        fixed -= drive.kp * drive.mobility * (a * motor + b)
    else:  # the command acts on the torque that it follows from
        fixed -= drive.kp * drive.mobility * b
        by_motor = drive.kp * drive.mobility * a
    given = clipped(fixed / (1.0 + by_motor), *limits(drive, absolute))
    torque = motor if drive.lag > 0.0 else given
    command = fixed - by_motor * torque
    felt = a * torque + b
    shown = filtered if drive.torque_filter > 0.0 else felt
    error -= drive.mobility * shown
    return torque, (
        (speed - encoder) / drive.encoder if drive.encoder > 0.0 else 0.0,
        (felt - filtered) / drive.torque_filter if drive.torque_filter > 0.0 else 0.0,
        drive.corner * (shown - slow),
        _integral_rate(drive, error, command, given),
        _motor_rate(drive, given, motor) if drive.lag > 0.0 else 0.0,
    )


def _felt(
    drive: RealDrive, speed: float, encoder: float, acceleration: tuple[float, float]
) -> tuple[float, float]:
    inertia = drive.sensed_inertia
    if drive.encoder > 0.0:
        return 1.0, -inertia * (speed - encoder) / drive.encoder
    free, gain = acceleration
    return 1.0 - inertia * gain, -inertia * free


def respond_held(
    drive: SampledDrive, memory: Array, speed: float
) -> tuple[float, float, float, float]:
    """Torque of a `SampledDrive` between two samples, and rates: speed seen, motor, impulse.

    `memory`, shape (9,), by `SAMPLED_MEMORY`; `speed` of the top drive in the frame (rad/s).
    """
    encoder, motor, command = memory[0], memory[4], memory[5]
    torque = motor if drive.lag > 0.0 else command
    seen = (speed - encoder) / drive.encoder if drive.encoder > 0.0 else 0.0
    turned = _motor_rate(drive, command, motor) if drive.lag > 0.0 else 0.0
    return torque, seen, turned, torque


def sample(
    drive: SampledDrive, memory: Array, speed: float, lead: float, absolute: float
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Memory of a `SampledDrive` after its controller has worked; arguments as in `respond`."""
    encoder, filtered, slow, integral, motor = memory[0], memory[1], memory[2], memory[3], memory[4]
    pending, last, impulse = memory[6], memory[7], memory[8]
    seen = encoder if drive.encoder > 0.0 else speed
    felt = (impulse - drive.sensed_inertia * (seen - last)) / drive.period
    fade = math.exp(-drive.period / drive.torque_filter) if drive.torque_filter > 0.0 else 0.0
    filtered = fade * filtered + (1.0 - fade) * felt
    error = lead - seen - drive.mobility * (filtered - slow)
    slow += (1.0 - math.exp(-drive.corner * drive.period)) * (filtered - slow)
    wanted = drive.feedforward + drive.kp * error + drive.ki * integral
    given = clipped(wanted, *limits(drive, absolute))
    integral += drive.period * _integral_rate(drive, error, wanted, given)
    command = pending if drive.late > 0.0 else given
    return encoder, filtered, slow, integral, motor, command, given, seen, 0.0


def limits(drive: RealDrive, speed: float) -> tuple[float, float]:
    """Least and largest torque (N m) that a drive gives at an absolute speed (rad/s)."""
    by_power = drive.power / max(abs(speed), 1e-9)
    share = clipped((1.0 + FADE - abs(speed) * drive.slowness) / FADE, 0.0, 1.0)
    most = min(drive.most, by_power)
    if math.isfinite(drive.curve):
        most = min(most, curve_torque(drive, speed))
    return max(drive.least, -by_power), most * share


def curve_torque(drive: Any, speed: Any) -> Any:
    """Torque (N m) under a motor's curve at a speed (rad/s); its numbers are the last of `drive`.

    Of floats, arrays and the rows of kernels.
    """
    torque, first = drive.curve + 0.0 * speed, len(drive) - 24  # twice KNOTS
    for knot in range(12):
        torque = torque + drive[first + 12 + knot] * above(abs(speed) - drive[first + knot])
    return torque


def above(value: Any) -> Any:
    """The value where it is above zero, else zero."""
    return 0.5 * (value + abs(value))


def curve_numbers(points: tuple[tuple[float, float], ...]) -> dict[str, float]:
    """Fields of a `RealDrive` for a curve straight between points, level before and after."""
    speeds, torques = np.array(points).T
    slopes = np.concatenate([[0.0], np.diff(torques) / np.diff(speeds), [0.0]])
    results = {"curve": float(torques[0])}
    for k, (speed, change) in enumerate(zip(speeds, np.diff(slopes), strict=True), 1):
        results |= {f"w{k}": float(speed), f"c{k}": float(change)}
    return results


def clipped(value: float, low: float, high: float) -> float:
    """The value within its limits."""
    return min(max(value, low), high)


def _integral_rate(drive: RealDrive, error: float, command: float, given: float) -> float:
    """Rate of the integral (rad/s) at an error (rad/s), a command and what is given of it (N m)."""
    if drive.ki == 0.0:
        return error
    return error + drive.tracking * (given - command) / drive.ki


def _motor_rate(drive: RealDrive, command: float, torque: float) -> float:
    """Rate of the motor torque (N m/s) of a drive with a lag."""
    wanted = (command - torque) / drive.lag
    return clipped(wanted, -drive.rate, drive.rate) if math.isfinite(drive.rate) else wanted
