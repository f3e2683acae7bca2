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
    """

    # numbers of the controller; ki over half a step
    feedforward: Any
    kp: Any
    ki: Any
    half: Any
    # of the error, above
    by_seen: Any
    by_begin: Any
    by_felt: Any
    by_slow: Any
    by_speed: Any
    by_torque: Any
    # of the torque, above, T itself solved for
    of_fixed: Any
    of_error: Any
    of_motor: Any
    forecast: Any  # shrinks a torque to what the string leaves of it within the step
    # share of its torque that the motor keeps on the mean over a step; 1 / (1 - mean)
    mean: Any
    per_command: Any
    # limits; of the change of the torque in a step
    least: Any
    most: Any
    power: Any
    most_moved: Any
    # of the anti-windup: by how much the integral gives in, implicitly
    back: Any
    back_shrink: Any
    # share of its value that the encoder keeps over a step; share of the change of a straight
    # input that it has followed at the end
    seen_keep: Any
    seen_ramp: Any
    inertia: Any  # torque that the sensed inertia takes per change of speed in a step (N m s/rad)
    # share of its value that the torque filter keeps, and on the mean
    felt_keep: Any
    felt_mean: Any
    slow_take: Any  # share of the way to its input that the slow part goes
    motor_take: Any  # share of the way to its command that the motor goes


class SampledStep(NamedTuple):
    """`SampledDrive` for steps of one length, a whole number of them to a period."""

    # as in the law
    feedforward: Any
    kp: Any
    ki: Any
    mobility: Any
    sensed_inertia: Any
    least: Any
    most: Any
    power: Any
    tracking: Any
    # as in the law
    period: Any
    late: Any
    # as in `RealStep`, for a whole period
    felt_keep: Any
    slow_take: Any
    # as in `RealStep`
    seen_keep: Any
    seen_ramp: Any
    mean: Any
    per_command: Any
    motor_take: Any
    most_moved: Any
