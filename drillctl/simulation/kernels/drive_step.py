"""The step of a drive: the mean torque of a step as a line in the top's motion at its end.

With the top angle and speed at the end of a step still unknown, the mean torque of the step is

    T = offset - slope * angle_at_the_end - speed_slope * speed_at_the_end,

which string and bit then turn into a number. An ideal law gives the line outright. A real one is
a chain of first-order lags. Each is propagated exactly for an input that is straight over the
step, and its mean follows from its own equation, mean = mean input - tau (change / step): right
for lags far shorter and far longer than a step. Limits are judged on a forecast with the bit
torque of the last step; a limited torque is a number, its slopes are zero.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from numba.extending import overload

from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.compiling import inlined, widest_vectors
from drillctl.simulation.kernels.laws import at_lane, mean_torque, torque_at
from drillctl.simulation.kernels.observer_step import ObserverStep
from drillctl.simulation.kernels.rows import WIDTH
from drillctl.simulation.kernels.string_step import BlockString


class RealStep(NamedTuple):
    """`RealDrive` for steps of one length.

    Attributes
    ----------
    feedforward, kp, ki, mobility, inertia, least, most, power, rate, tracking : ndarray
        As in the law.
    encoder, filter : ndarray
        Time constants of encoder and torque filter (s).
    seen_keep, seen_ramp : ndarray
        Share of its value that the encoder keeps over a step; share of the change of a straight
        input that it has followed at the end.
    felt_keep : ndarray
        Share of its value that the torque filter keeps.
    slow_take, slow_mean : ndarray
        Share of the way to its input that the slow part goes; on the mean over the step.
    motor_keep, motor_mean : ndarray
        Share of the difference to its command that the motor keeps; on the mean.
    """

    feedforward: Any
    kp: Any
    ki: Any
    mobility: Any
    inertia: Any
    least: Any
    most: Any
    power: Any
    rate: Any
    tracking: Any
    encoder: Any
    filter: Any
    seen_keep: Any
    seen_ramp: Any
    felt_keep: Any
    slow_take: Any
    slow_mean: Any
    motor_keep: Any
    motor_mean: Any


class SampledStep(NamedTuple):
    """`SampledDrive` for steps of one length, a whole number of them to a period.

    Attributes
    ----------
    feedforward, kp, ki, mobility, inertia, least, most, power, rate, tracking : ndarray
        As in the law.
    encoder, seen_keep, seen_ramp, motor_keep, motor_mean : ndarray
        As in `RealStep`.
    felt_keep, slow_take : ndarray
        As there, for a whole period.
    period, late : ndarray
        As in the law.
    """

    feedforward: Any
    kp: Any
    ki: Any
    mobility: Any
    inertia: Any
    least: Any
    most: Any
    power: Any
    rate: Any
    tracking: Any
    encoder: Any
    seen_keep: Any
    seen_ramp: Any
    motor_keep: Any
    motor_mean: Any
    felt_keep: Any
    slow_take: Any
    period: Any
    late: Any


def has_memory(drive: Any) -> bool:
    """Whether a drive, as numba knows it, keeps a memory."""
    return drive.instance_class in (RealStep, SampledStep)


@inlined
def begin_drive(work: Any) -> None:
    """Memory at time zero; the top speed is in its row."""
    for lane in range(WIDTH):
        speed = work[r.TOP_SPEED + lane]
        work[r.SEEN + lane] = speed
        work[r.SEEN_LAST + lane] = speed
        for row in (r.FELT, r.SLOW, r.INTEGRAL, r.MOTOR, r.COMMAND, r.PENDING, r.IMPULSE):
            work[row + lane] = 0.0


@inlined
def _clip(value: float, low: float, high: float) -> float:
    value = low if value < low else value
    return high if value > high else value


@inlined
def _limits(law: Any, speed: float, work: Any, lane: int) -> None:
    """Limits of the torque in this step at an absolute speed (rad/s)."""
    turning = abs(speed)
    by_power = law.power / (turning if turning > 1e-9 else 1e-9)
    work[r.LEAST + lane] = law.least if law.least > -by_power else -by_power
    work[r.MOST + lane] = law.most if law.most < by_power else by_power


def drive_line(drive: Any, string: Any, work: Any, lane: int, rate: float) -> Any:
    """Offset, slope and speed slope of the mean torque of a step of length 1 / `rate`."""
    raise NotImplementedError("compiled only")


@overload(drive_line)
def _drive_line(drive, string, work, lane, rate):
    if drive.instance_class is RealStep:
        return lambda drive, string, work, lane, rate: _real_line(drive, string, work, lane, rate)
    if drive.instance_class is SampledStep:
        return lambda drive, string, work, lane, rate: _held_line(drive, work, lane, rate)
    return lambda drive, string, work, lane, rate: _ideal_line(drive, work, lane, rate)


@inlined
def _ideal_line(drive: Any, work: Any, lane: int, rate: float) -> Any:
    law = at_lane(drive, work, r.DRIVE, lane)
    offset, slope = mean_torque(law, work[r.ANGLE + lane] - work[r.SHIFT + lane], rate)
    return offset + slope * work[r.SHIFT_NEW + lane], slope, 0.0


@inlined
def _error_slopes(law: Any, rate: float) -> Any:
    """How the mean speed error, less what the torque takes, changes with speed and torque.

    The mean of the torque felt over a step is x = T - J (change of the speed seen) / step. It goes
    through filter and high-pass; all of it is affine in angle, speed and torque at the end:
    error = offset - rate * angle + by_speed * speed - by_torque * T.
    """
    passes = 1.0 - law.filter * (1.0 - law.felt_keep) * rate
    by_torque = law.mobility * (1.0 - law.slow_mean) * passes
    by_speed = (law.encoder + by_torque * law.inertia) * rate * law.seen_ramp
    return by_speed, by_torque


@inlined
def _error_offset(law: Any, work: Any, lane: int, rate: float) -> float:
    angle, speed = work[r.ANGLE + lane], work[r.TOP_SPEED + lane]
    _, by_torque = _error_slopes(law, rate)
    lead = (work[r.SHIFT_NEW + lane] - work[r.SHIFT + lane]) * rate
    # Change of the speed seen over the step, but for its part in the speed at the end.
    change = (law.seen_keep - 1.0) * work[r.SEEN + lane]
    change += (1.0 - law.seen_keep - law.seen_ramp) * speed
    held = law.filter * (1.0 - law.felt_keep) * rate * work[r.FELT + lane]
    through = law.mobility * (1.0 - law.slow_mean)
    offset = lead + (angle + law.encoder * change) * rate
    return offset - through * (held - work[r.SLOW + lane]) + by_torque * law.inertia * rate * change


@inlined
def _real_line(drive: Any, string: Any, work: Any, lane: int, rate: float) -> Any:
    law = at_lane(drive, work, r.DRIVE, lane)
    by_speed, by_torque = _error_slopes(law, rate)
    error = _error_offset(law, work, lane, rate)
    work[r.ERROR + lane] = error
    gain = law.kp + 0.5 * law.ki / rate
    fixed = law.feedforward + law.ki * work[r.INTEGRAL + lane]
    motor, mean = work[r.MOTOR + lane], law.motor_mean
    # T = (1 - mean) command + mean motor, the command itself acting on what is felt of T.
    follows = (1.0 - mean) * gain
    shrink = 1.0 / (1.0 + follows * by_torque)
    offset = ((1.0 - mean) * fixed + follows * error + mean * motor) * shrink
    slope = follows * rate * shrink
    speed_slope = follows * by_speed * shrink
    # A forecast of the step with the bit torque of the last one.
    top, bit = string.angle_by_top, string.angle_by_bit
    drag, torque = work[r.DRAG + lane], work[r.BIT_TORQUE + lane]
    angle_free = work[r.TOP_FREE + lane] - top * drag - bit * torque
    speed_free = (
        work[r.TOP_SPEED_FREE + lane]
        - string.top_speed_by_top * drag
        - string.top_speed_by_bit * torque
    )
    forecast = (offset - slope * angle_free + speed_slope * speed_free) / (
        1.0 + slope * top - speed_slope * string.top_speed_by_top
    )
    speed = (angle_free + top * forecast - work[r.ANGLE + lane]) * rate
    _limits(law, speed + work[r.SET_SPEED + lane], work, lane)
    command = (forecast - mean * motor) / (1.0 - mean)
    given = _clip(command, work[r.LEAST + lane], work[r.MOST + lane])
    wanted = (1.0 - law.motor_keep) * (given - motor)
    most = law.rate / rate
    moved = _clip(wanted, -most, most)
    limited = given != command or moved != wanted
    work[r.MOVED + lane] = moved if moved != wanted else 0.0
    # At its limit of rate the torque is straight over the step.
    at_rate = motor + 0.5 * moved
    at_limit = (1.0 - mean) * given + mean * motor
    number = at_rate if moved != wanted else at_limit
    return (
        number if limited else offset,
        0.0 if limited else slope,
        0.0 if limited else -speed_slope,
    )


@inlined
def _held_line(drive: Any, work: Any, lane: int, rate: float) -> Any:
    law = at_lane(drive, work, r.DRIVE, lane)
    motor, command = work[r.MOTOR + lane], work[r.COMMAND + lane]
    wanted = (1.0 - law.motor_keep) * (command - motor)
    most = law.rate / rate
    moved = _clip(wanted, -most, most)
    work[r.MOVED + lane] = moved if moved != wanted else 0.0
    mean = (1.0 - law.motor_mean) * command + law.motor_mean * motor
    return motor + 0.5 * moved if moved != wanted else mean, 0.0, 0.0


def sample_drive(drive: Any, work: Any, due: bool) -> None:
    """Let a sampled controller work, where it is due."""
    raise NotImplementedError("compiled only")


@overload(sample_drive)
def _sample_drive(drive, work, due):
    if drive.instance_class is SampledStep:
        return lambda drive, work, due: _sample(drive, work) if due else None
    return lambda drive, work, due: None


@inlined
def _sample(drive: Any, work: Any) -> None:
    widest_vectors()
    for lane in range(WIDTH):
        law = at_lane(drive, work, r.DRIVE, lane)
        speed = work[r.SEEN + lane]
        taken = law.inertia * (speed - work[r.SEEN_LAST + lane])
        felt = (work[r.IMPULSE + lane] - taken) / law.period
        felt = law.felt_keep * work[r.FELT + lane] + (1.0 - law.felt_keep) * felt
        slow = work[r.SLOW + lane]
        error = work[r.LEAD + lane] - speed - law.mobility * (felt - slow)
        wanted = law.feedforward + law.kp * error + law.ki * work[r.INTEGRAL + lane]
        _limits(law, work[r.TOP_SPEED + lane] + work[r.SET_SPEED + lane], work, lane)
        given = _clip(wanted, work[r.LEAST + lane], work[r.MOST + lane])
        back = law.tracking * (given - wanted) / law.ki if law.ki != 0.0 else 0.0
        work[r.FELT + lane] = felt
        work[r.SLOW + lane] = slow + law.slow_take * (felt - slow)
        work[r.INTEGRAL + lane] += law.period * (error + back)
        work[r.COMMAND + lane] = work[r.PENDING + lane] if law.late > 0.0 else given
        work[r.PENDING + lane] = given
        work[r.SEEN_LAST + lane] = speed
        work[r.IMPULSE + lane] = 0.0


def follow_drive(drive: Any, work: Any, rate: float) -> None:
    """Memory at the end of a step whose motion is known."""
    raise NotImplementedError("compiled only")


@overload(follow_drive)
def _follow_drive(drive, work, rate):
    if drive.instance_class is RealStep:
        return lambda drive, work, rate: _follow_real(drive, work, rate)
    if drive.instance_class is SampledStep:
        return lambda drive, work, rate: _follow_sampled(drive, work, rate)
    return lambda drive, work, rate: None


@inlined
def _see(law: Any, work: Any, lane: int) -> float:
    """Move the encoder; returns the change of the speed that it shows."""
    before, after = work[r.TOP_SPEED_BEFORE + lane], work[r.TOP_SPEED + lane]
    seen = work[r.SEEN + lane]
    new = law.seen_keep * seen + (1.0 - law.seen_keep) * before + law.seen_ramp * (after - before)
    work[r.SEEN + lane] = new
    return new - seen


@inlined
def _turn(law: Any, work: Any, lane: int, torque: float) -> None:
    """Move the motor under its mean torque, or by as much as its limit of rate allows."""
    motor, mean, at_rate = work[r.MOTOR + lane], law.motor_mean, work[r.MOVED + lane]
    command = (torque - mean * motor) / (1.0 - mean)
    moved = (1.0 - law.motor_keep) * (command - motor)
    work[r.MOTOR + lane] = motor + (at_rate if at_rate != 0.0 else moved)


@inlined
def _follow_real(drive: Any, work: Any, rate: float) -> None:
    widest_vectors()
    for lane in range(WIDTH):
        law = at_lane(drive, work, r.DRIVE, lane)
        torque = work[r.TOP_TORQUE + lane] + work[r.DRAG + lane]
        by_speed, by_torque = _error_slopes(law, rate)
        error = work[r.ERROR + lane] - rate * work[r.ANGLE + lane]
        error += by_speed * work[r.TOP_SPEED + lane] - by_torque * torque
        change = _see(law, work, lane)
        felt = torque - law.inertia * change * rate
        before = work[r.FELT + lane]
        shown = felt - law.filter * (1.0 - law.felt_keep) * rate * (felt - before)
        work[r.FELT + lane] = before + (1.0 - law.felt_keep) * (felt - before)
        work[r.SLOW + lane] += law.slow_take * (shown - work[r.SLOW + lane])
        _turn(law, work, lane, torque)
        # Back-calculation, implicit: command = wanted + (ki step / 2) rate of the integral.
        wanted = law.feedforward + law.kp * error + law.ki * work[r.INTEGRAL + lane]
        free = wanted + 0.5 * law.ki / rate * error
        limit = _clip(free, work[r.LEAST + lane], work[r.MOST + lane])
        back = law.tracking / law.ki * (limit - wanted) if law.ki != 0.0 else 0.0
        gives_in = (error + back) / (1.0 + 0.5 * law.tracking / rate)
        grows = gives_in if free != limit and law.ki != 0.0 else error
        work[r.INTEGRAL + lane] += grows / rate


@inlined
def _follow_sampled(drive: Any, work: Any, rate: float) -> None:
    widest_vectors()
    for lane in range(WIDTH):
        law = at_lane(drive, work, r.DRIVE, lane)
        torque = work[r.TOP_TORQUE + lane] + work[r.DRAG + lane]
        _see(law, work, lane)
        _turn(law, work, lane, torque)
        work[r.IMPULSE + lane] += torque / rate


def top_torque_now(drive: Any, work: Any, lane: int, speed: float) -> float:
    """Torque of the drive at the moment, top speed in the frame (rad/s) given."""
    raise NotImplementedError("compiled only")


@overload(top_torque_now)
def _top_torque_now(drive, work, lane, speed):
    if has_memory(drive):
        return lambda drive, work, lane, speed: work[r.MOTOR + lane]
    return lambda drive, work, lane, speed: torque_at(
        at_lane(drive, work, r.DRIVE, lane),
        work[r.ANGLE + lane] - work[r.SHIFT + lane],
        speed - work[r.LEAD + lane],
    )


def track_top(drive: Any, observer: Any, string: Any, state: Any, work: Any) -> None:
    """Sum the top speed at the end of the step under no torque, where something asks for it."""
    raise NotImplementedError("compiled only")


def follow_top(drive: Any, observer: Any, string: Any, work: Any) -> None:
    """Top speed at the end of the step, where something asks for it."""
    raise NotImplementedError("compiled only")


def _asked(drive: Any, observer: Any) -> bool:
    """Whether drive or observer needs the top speed at the ends of steps."""
    return has_memory(drive) or observer.instance_class is ObserverStep


@overload(track_top)
def _track_top(drive, observer, string, state, work):
    if not _asked(drive, observer):
        return lambda drive, observer, string, state, work: None
    if string.instance_class is BlockString:
        return lambda drive, observer, string, state, work: _sum_blocks(string, state, work)
    return lambda drive, observer, string, state, work: _sum_states(string, state, work)


@inlined
def _sum_blocks(string: Any, state: Any, work: Any) -> None:
    widest_vectors()
    for lane in range(WIDTH):
        work[r.TOP_SPEED_FREE + lane] = 0.0
    for block in range(string.top_speed.shape[0]):
        c1, c2 = string.top_speed[block, 0], string.top_speed[block, 1]
        at = 2 * block * WIDTH
        for lane in range(WIDTH):
            work[r.TOP_SPEED_FREE + lane] += c1 * state[at + lane] + c2 * state[at + WIDTH + lane]


@inlined
def _sum_states(string: Any, state: Any, work: Any) -> None:
    widest_vectors()
    for lane in range(WIDTH):
        work[r.TOP_SPEED_FREE + lane] = 0.0
    for i in range(string.top_speed.shape[0]):
        for lane in range(WIDTH):
            work[r.TOP_SPEED_FREE + lane] += string.top_speed[i] * state[i * WIDTH + lane]


@overload(follow_top)
def _follow_top(drive, observer, string, work):
    if not _asked(drive, observer):
        return lambda drive, observer, string, work: None
    return lambda drive, observer, string, work: _move_top(string, work)


@inlined
def _move_top(string: Any, work: Any) -> None:
    widest_vectors()
    for lane in range(WIDTH):
        work[r.TOP_SPEED_BEFORE + lane] = work[r.TOP_SPEED + lane]
        work[r.TOP_SPEED + lane] = (
            work[r.TOP_SPEED_FREE + lane]
            + string.top_speed_by_top * work[r.TOP_TORQUE + lane]
            - string.top_speed_by_bit * work[r.BIT_TORQUE + lane]
        )
