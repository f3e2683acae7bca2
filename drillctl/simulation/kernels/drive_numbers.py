"""Numbers of real drives as their steps take them; made in `simulation.step_laws`."""

from __future__ import annotations

from typing import Any, NamedTuple


class RealStep(NamedTuple):
    """`RealDrive` for steps of one length on one string: all that does not change in a run.

    The mean speed error of a step, less what the torque takes of it, is

        error = offset - angle_at_the_end / step + by_speed speed_at_the_end - by_torque T,
        offset = lead + angle / step + by_seen seen + by_begin speed + by_felt felt + by_slow slow,

    and the mean torque

        T = of_fixed (feedforward + ki integral) + of_error error + of_motor motor.

    Attributes
    ----------
    feedforward, kp, ki, half : ndarray
        Numbers of the controller; ki over half a step.
    by_seen, by_begin, by_felt, by_slow, by_speed, by_torque : ndarray
        Of the error, above.
    of_fixed, of_error, of_motor : ndarray
        Of the torque, above, T itself solved for.
    forecast : ndarray
        Shrinks a torque to what the string leaves of it within the step.
    mean, per_command : ndarray
        Share of its torque that the motor keeps on the mean over a step; 1 / (1 - mean).
    least, most, power, most_moved : ndarray
        Limits; of the change of the torque in a step.
    back, back_shrink : ndarray
        Of the anti-windup: by how much the integral gives in, implicitly.
    seen_keep, seen_ramp : ndarray
        Share of its value that the encoder keeps over a step; share of the change of a straight
        input that it has followed at the end.
    inertia : ndarray
        Torque that the sensed inertia takes per change of speed in a step (N m s/rad).
    felt_keep, felt_mean : ndarray
        Share of its value that the torque filter keeps, and on the mean.
    slow_take : ndarray
        Share of the way to its input that the slow part goes.
    motor_take : ndarray
        Share of the way to its command that the motor goes.
    """

    feedforward: Any
    kp: Any
    ki: Any
    half: Any
    by_seen: Any
    by_begin: Any
    by_felt: Any
    by_slow: Any
    by_speed: Any
    by_torque: Any
    of_fixed: Any
    of_error: Any
    of_motor: Any
    forecast: Any
    mean: Any
    per_command: Any
    least: Any
    most: Any
    power: Any
    most_moved: Any
    back: Any
    back_shrink: Any
    seen_keep: Any
    seen_ramp: Any
    inertia: Any
    felt_keep: Any
    felt_mean: Any
    slow_take: Any
    motor_take: Any


class SampledStep(NamedTuple):
    """`SampledDrive` for steps of one length, a whole number of them to a period.

    Attributes
    ----------
    feedforward, kp, ki, mobility, sensed_inertia, least, most, power, tracking : ndarray
        As in the law.
    period, late : ndarray
        As in the law.
    felt_keep, slow_take : ndarray
        As in `RealStep`, for a whole period.
    seen_keep, seen_ramp, mean, per_command, motor_take, most_moved : ndarray
        As in `RealStep`.
    """

    feedforward: Any
    kp: Any
    ki: Any
    mobility: Any
    sensed_inertia: Any
    least: Any
    most: Any
    power: Any
    tracking: Any
    period: Any
    late: Any
    felt_keep: Any
    slow_take: Any
    seen_keep: Any
    seen_ramp: Any
    mean: Any
    per_command: Any
    motor_take: Any
    most_moved: Any
