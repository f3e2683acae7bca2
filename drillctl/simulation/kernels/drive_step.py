"""Numbers of real drives as their steps take them; made in `simulation.step_laws`.

The step of a drive: the mean torque of a step as a line in the top's motion at its end.

With the top angle and speed at the end of a step still unknown, the mean torque of the step is

    T = offset - slope * angle_at_the_end - speed_slope * speed_at_the_end,

which string and bit then turn into a number. An ideal law gives the line outright. A real one is
a chain of first-order lags. Each is propagated exactly for an input that is straight over the
step, and its mean follows from its own equation, mean = mean input - tau (change / step): right
for lags far shorter and far longer than a step. Limits are judged on a forecast with the bit
torque of the last step; a limited torque is a number, its slopes are zero.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, NamedTuple

from drillctl.rig.top_drive.real_drive import FADE, RealDrive, curve_torque
from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.arithmetic import fma, law_at, most
from drillctl.simulation.kernels.observer_step import ObserverStep
from drillctl.simulation.kernels.program_step import NoProgram
from drillctl.simulation.kernels.vectors import at, each, pick, put, when
from drillctl.simulation.measures import AT_LIMIT


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
    # as in the law
    slowness: Any
    continuous: Any


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
    # as in the law
    slowness: Any
    continuous: Any


OF_A_CURVE = RealDrive._fields[RealDrive._fields.index("curve") :]
CurvedStep: Any = namedtuple("CurvedStep", [*RealStep._fields, *OF_A_CURVE])  # type: ignore[misc]
CurvedSampledStep: Any = namedtuple("CurvedSampledStep", [*SampledStep._fields, *OF_A_CURVE])  # type: ignore[misc]
REAL, SAMPLED = (RealStep, CurvedStep), (SampledStep, CurvedSampledStep)
CURVED: dict[Any, Any] = {RealStep: CurvedStep, SampledStep: CurvedSampledStep}
"""Steps of a drive whose motor has a curve; all others are spared its numbers."""

SLOWEST = 1e-9  # speed (rad/s) under which a limit of power no longer grows


class Reduced(NamedTuple):
    """String and drive eliminated: what the torque on the bit decides in a step."""

    # mean top torque of the step were the bit torque zero (N m), net of the drag of all damping to
    # ground at the set speed, and what each N m of the bit torque adds
    alone: Any
    share: Any
    # bit speed at its end were the bit torque zero (rad/s), its fall per bit torque (rad/s per N
    # m), and one over that
    free: Any
    gain: Any
    per_gain: Any


def begin_drive(drive: Any, string: Any, work: Any, rate: Any) -> None:
    """Memory at time zero, or constants of an ideal drive; the top speed is in its row."""
    if isinstance(drive, REAL):
        return _begin_real(drive, string, work, rate)
    if isinstance(drive, SAMPLED):
        return _begin(work)
    return _begin_ideal(drive, string, work, rate)


def _begin_real(drive: Any, string: Any, work: Any, rate: Any) -> None:
    """Memory, and what the drive's slopes make of a step in which nothing limits it.

    A motor without lag gives its torque from the first moment on.
    """
    _begin(work)
    law = law_at(drive, work, r.DRIVE)
    slope, by_speed = law.of_error * rate, -law.of_error * law.by_speed
    shrink = 1.0 / (1.0 + slope * string.angle_by_top + by_speed * string.top_speed_by_top)
    share = (slope * string.angle_by_bit + by_speed * string.top_speed_by_bit) * shrink
    gain = string.speed_by_bit - string.speed_by_top * share
    put(work, r.SHRINK, shrink)
    put(work, r.SHARE, share)
    put(work, r.GAIN, gain)
    put(work, r.PER_GAIN, 1.0 / gain)
    low, high = _limits(law, at(work, r.TOP_SPEED) + at(work, r.SET_SPEED))
    error = law.kp * (at(work, r.LEAD) - at(work, r.TOP_SPEED))
    wanted = (law.feedforward + error) / (1.0 + law.kp * law.by_torque)
    put(work, r.MOTOR, pick(law.mean == 0.0, _clip(wanted, low, high), 0.0))


def _begin(work: Any) -> None:
    put(work, r.SEEN, at(work, r.TOP_SPEED))
    put(work, r.SEEN_LAST, at(work, r.TOP_SPEED))


def _begin_ideal(drive: Any, string: Any, work: Any, rate: Any) -> None:
    """Constants of an ideal drive: its mean torque is a line in both angles of the step."""
    law = law_at(drive, work, r.DRIVE)
    level, slope = law.mean_torque(each(0.0), rate)
    level_of_one, _ = law.mean_torque(each(1.0), rate)
    drag = at(work, r.DRAG)
    shrink = 1.0 / (1.0 + slope * string.angle_by_top)
    share = slope * string.angle_by_bit * shrink
    gain = string.speed_by_bit - string.speed_by_top * share
    put(work, r.LINE_LEVEL, (level + slope * string.angle_by_top * drag) * shrink - drag)
    put(work, r.LINE_BACK, (level_of_one - level) * shrink)
    put(work, r.LINE_FORTH, -slope * shrink)
    put(work, r.SHARE, share)
    put(work, r.GAIN, gain)
    put(work, r.PER_GAIN, 1.0 / gain)


def _clip(value: Any, low: Any, high: Any) -> Any:
    value = pick(value < low, low, value)
    return pick(value > high, high, value)


def _limits(law: Any, speed: Any) -> Any:
    """Limits of the torque in this step at an absolute speed (rad/s)."""
    by_power = law.power / most(abs(speed), SLOWEST)
    low = pick(law.least > -by_power, law.least, -by_power)
    share = _clip((1.0 + FADE - abs(speed) * law.slowness) / FADE, 0.0, 1.0)
    high = _largest(law, speed)
    return low, pick(high < by_power, high, by_power) * share


def _largest(law: Any, speed: Any) -> Any:
    """Limit of the torque but for power at an absolute speed (rad/s)."""
    if type(law) not in CURVED.values():
        return law.most
    by_curve = curve_torque(law, speed)
    return pick(law.most < by_curve, law.most, by_curve)


def _limits_at(law: Any, string: Any, work: Any, turned: Any, torque: Any, rate: Any) -> Any:
    """Limits at the mean speed of a step, in which the top turns by an angle and by its torque."""
    speed = (turned + string.angle_by_top * torque) * rate
    return _limits(law, speed + at(work, r.SET_SPEED))


def eliminate(drive: Any, program: Any, string: Any, swing: Any, work: Any, rate: Any) -> Any:
    """What is left of string and drive for the bit: a `Reduced`; `rate` is 1 / step."""
    if isinstance(drive, REAL):
        return _by_real_drive(drive, string, swing, work, rate)
    if isinstance(drive, SAMPLED):
        return _by_held_torque(drive, string, swing, work)
    if isinstance(program, NoProgram):
        return _by_ideal_drive(string, swing, work, at(work, r.ANGLE), swing.top_angle)
    return _by_ideal_drive(
        string,
        swing,
        work,
        at(work, r.ANGLE) - at(work, r.SHIFT),
        swing.top_angle - at(work, r.SHIFT_NEW),
    )


def _by_ideal_drive(string: Any, swing: Any, work: Any, angle: Any, free_angle: Any) -> Any:
    alone = fma(at(work, r.LINE_BACK), angle, at(work, r.LINE_LEVEL))
    alone = fma(at(work, r.LINE_FORTH), free_angle, alone)
    free = at(work, r.SET_SPEED) + swing.bit_speed
    free = fma(string.speed_by_top, alone, free)
    return Reduced(alone, at(work, r.SHARE), free, at(work, r.GAIN), at(work, r.PER_GAIN))


def _by_number(string: Any, swing: Any, work: Any, torque: Any) -> Any:
    """A mean torque that is known beforehand."""
    free = at(work, r.SET_SPEED) + swing.bit_speed
    alone = torque - at(work, r.DRAG)
    free += string.speed_by_top * alone
    gain = string.speed_by_bit
    return Reduced(alone, each(0.0), free, each(gain), each(1.0 / gain))


def _by_real_drive(drive: Any, string: Any, swing: Any, work: Any, rate: Any) -> Any:
    law = law_at(drive, work, r.DRIVE)
    angle, motor = at(work, r.ANGLE), at(work, r.MOTOR)
    error = (at(work, r.SHIFT_NEW) - at(work, r.SHIFT) + angle) * rate
    error += law.by_seen * at(work, r.SEEN) + law.by_begin * at(work, r.TOP_SPEED)
    error += law.by_felt * at(work, r.FELT) + law.by_slow * at(work, r.SLOW)
    put(work, r.ERROR, error)
    fixed = law.feedforward + law.ki * at(work, r.INTEGRAL)
    offset = law.of_fixed * fixed + law.of_error * error + law.of_motor * motor
    slope, speed_slope = law.of_error * rate, law.of_error * law.by_speed
    # A forecast of the step with the bit torque of the last one.
    drag, torque = at(work, r.DRAG), at(work, r.BIT_TORQUE)
    angle_free = swing.top_angle - string.angle_by_top * drag - string.angle_by_bit * torque
    speed_free = swing.top_speed - string.top_speed_by_top * drag - string.top_speed_by_bit * torque
    forecast = (offset - slope * angle_free + speed_slope * speed_free) * law.forecast
    low, high = _limits_at(law, string, work, angle_free - angle, forecast, rate)
    # Limits depend on the speed, and that on what they leave of the torque.
    low, high = _limits_at(law, string, work, angle_free - angle, _clip(forecast, low, high), rate)
    put(work, r.LEAST, low)
    put(work, r.MOST, high)
    command = (forecast - law.mean * motor) * law.per_command
    given = _clip(command, low, high)
    wanted = law.motor_take * (given - motor)
    moved = _clip(wanted, -law.most_moved, law.most_moved)
    at_rate = moved != wanted
    limited = (given != command) | at_rate
    put(work, r.MOVED, pick(at_rate, moved, 0.0))
    # At its limit of rate the torque is straight over the step.
    number = pick(at_rate, motor + 0.5 * moved, given + law.mean * (motor - given))
    angle = swing.top_angle - string.angle_by_top * drag
    top_speed = swing.top_speed - string.top_speed_by_top * drag
    alone = (offset - slope * angle + speed_slope * top_speed) * at(work, r.SHRINK) - drag
    limits = _by_number(string, swing, work, number)
    free = at(work, r.SET_SPEED) + swing.bit_speed + string.speed_by_top * alone
    return Reduced(
        pick(limited, limits.alone, alone),
        pick(limited, 0.0, at(work, r.SHARE)),
        pick(limited, limits.free, free),
        pick(limited, limits.gain, at(work, r.GAIN)),
        pick(limited, limits.per_gain, at(work, r.PER_GAIN)),
    )


def _by_held_torque(drive: Any, string: Any, swing: Any, work: Any) -> Any:
    law = law_at(drive, work, r.DRIVE)
    motor, command = at(work, r.MOTOR), at(work, r.COMMAND)
    wanted = law.motor_take * (command - motor)
    moved = _clip(wanted, -law.most_moved, law.most_moved)
    put(work, r.MOVED, pick(moved != wanted, moved, 0.0))
    mean = command + law.mean * (motor - command)
    torque = pick(moved != wanted, motor + 0.5 * moved, mean)
    return _by_number(string, swing, work, torque)


def sample_drive(drive: Any, work: Any, due: Any) -> None:
    """Let a sampled controller work, where it is due."""
    if isinstance(drive, SAMPLED):
        with when(due):
            _sample(drive, work)


def _sample(drive: Any, work: Any) -> None:
    law = law_at(drive, work, r.DRIVE)
    speed = at(work, r.SEEN)
    taken = law.sensed_inertia * (speed - at(work, r.SEEN_LAST))
    felt = (at(work, r.IMPULSE) - taken) / law.period
    felt = law.felt_keep * at(work, r.FELT) + (1.0 - law.felt_keep) * felt
    slow = at(work, r.SLOW)
    error = at(work, r.LEAD) - speed - law.mobility * (felt - slow)
    wanted = law.feedforward + law.kp * error + law.ki * at(work, r.INTEGRAL)
    low, high = _limits(law, at(work, r.TOP_SPEED) + at(work, r.SET_SPEED))
    given = _clip(wanted, low, high)
    back = pick(law.ki != 0.0, law.tracking * (given - wanted) / law.ki, 0.0)
    put(work, r.FELT, felt)
    put(work, r.SLOW, slow + law.slow_take * (felt - slow))
    put(work, r.INTEGRAL, at(work, r.INTEGRAL) + law.period * (error + back))
    put(work, r.COMMAND, pick(law.late > 0.0, at(work, r.PENDING), given))
    put(work, r.PENDING, given)
    put(work, r.SEEN_LAST, speed)
    put(work, r.IMPULSE, 0.0)


def follow_drive(drive: Any, work: Any, top_speed_before: Any, rate: Any) -> None:
    """Memory at the end of a step whose motion is known."""
    if isinstance(drive, REAL):
        _follow_real(drive, work, top_speed_before, rate)
    elif isinstance(drive, SAMPLED):
        _follow_sampled(drive, work, top_speed_before, rate)
    else:
        return
    _measure_strain(drive, work, 1.0 / rate)


def _measure_strain(drive: Any, work: Any, step: Any) -> None:
    """Time of a step at the limits of the drive, and its power."""
    law = law_at(drive, work, r.DRIVE)
    torque = at(work, r.TOP_TORQUE) + at(work, r.DRAG)
    speed = at(work, r.TOP_SPEED) + at(work, r.SET_SPEED)
    power = torque * speed
    for row, there in (
        (r.AT_TORQUE_LIMIT, torque >= AT_LIMIT * _largest(law, speed)),
        (r.AT_POWER_LIMIT, power >= AT_LIMIT * law.power),
        (r.OVER_CONTINUOUS, torque > law.continuous),
    ):
        put(work, row, at(work, row) + pick(there, step, 0.0))
    put(work, r.PEAK_POWER, most(power, at(work, r.PEAK_POWER)))


def _see(law: Any, work: Any, before: Any) -> Any:
    """Move the encoder; returns the change of the speed that it shows."""
    after, seen = at(work, r.TOP_SPEED), at(work, r.SEEN)
    new = law.seen_keep * seen + (1.0 - law.seen_keep) * before + law.seen_ramp * (after - before)
    put(work, r.SEEN, new)
    return new - seen


def _turn(law: Any, work: Any, torque: Any) -> None:
    """Move the motor under its mean torque, or by as much as its limit of rate allows."""
    motor, at_rate = at(work, r.MOTOR), at(work, r.MOVED)
    command = (torque - law.mean * motor) * law.per_command
    moved = law.motor_take * (command - motor)
    put(work, r.MOTOR, motor + pick(at_rate != 0.0, at_rate, moved))


def _follow_real(drive: Any, work: Any, before: Any, rate: Any) -> None:
    step = 1.0 / rate
    law = law_at(drive, work, r.DRIVE)
    torque = at(work, r.TOP_TORQUE) + at(work, r.DRAG)
    error = at(work, r.ERROR) - rate * at(work, r.ANGLE)
    error += law.by_speed * at(work, r.TOP_SPEED) - law.by_torque * torque
    felt = torque - law.inertia * _see(law, work, before)
    felt_before = at(work, r.FELT)
    shown = felt + law.felt_mean * (felt_before - felt)
    put(work, r.FELT, felt + law.felt_keep * (felt_before - felt))
    slow, integral = at(work, r.SLOW), at(work, r.INTEGRAL)
    put(work, r.SLOW, slow + law.slow_take * (shown - slow))
    _turn(law, work, torque)
    # Back-calculation, implicit: command = wanted + (ki step / 2) rate of the integral.
    wanted = law.feedforward + law.kp * error + law.ki * integral
    free = wanted + law.half * error
    limit = _clip(free, at(work, r.LEAST), at(work, r.MOST))
    gives_in = (error + law.back * (limit - wanted)) * law.back_shrink
    put(work, r.INTEGRAL, integral + step * pick(free != limit, gives_in, error))


def _follow_sampled(drive: Any, work: Any, before: Any, rate: Any) -> None:
    law = law_at(drive, work, r.DRIVE)
    torque = at(work, r.TOP_TORQUE) + at(work, r.DRAG)
    _see(law, work, before)
    _turn(law, work, torque)
    put(work, r.IMPULSE, at(work, r.IMPULSE) + torque / rate)


def top_torque_now(drive: Any, work: Any, speed: Any) -> Any:
    """Torque of the drive at the moment, top speed in the frame (rad/s) given."""
    if isinstance(drive, REAL + SAMPLED):
        return at(work, r.MOTOR)
    angle = at(work, r.ANGLE) - at(work, r.SHIFT)
    return law_at(drive, work, r.DRIVE).torque(angle, speed - at(work, r.LEAD))


def asks_for_top(drive: Any, observer: Any) -> bool:
    """Whether drive or observer need the top speed."""
    return isinstance(drive, REAL + SAMPLED) or isinstance(observer, ObserverStep)


def move_top(drive: Any, observer: Any, string: Any, swing: Any, work: Any) -> None:
    """Top speed at the end of the step, where something asks for it."""
    if asks_for_top(drive, observer):
        top, bit = at(work, r.TOP_TORQUE), at(work, r.BIT_TORQUE)
        speed = swing.top_speed + string.top_speed_by_top * top - string.top_speed_by_bit * bit
        put(work, r.TOP_SPEED, speed)
