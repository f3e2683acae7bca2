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

from typing import Any

from numba.extending import overload

from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.compiling import inlined, widest_vectors
from drillctl.simulation.kernels.drive_numbers import RealStep, SampledStep
from drillctl.simulation.kernels.laws import at_lane, mean_torque, torque_at
from drillctl.simulation.kernels.rows import WIDTH


def begin_drive(drive: Any, work: Any) -> None:
    """Memory at time zero; the top speed is in its row."""
    raise NotImplementedError("compiled only")


@overload(begin_drive)
def _begin_drive(drive, work):
    if drive.instance_class is RealStep:
        return lambda drive, work: _begin_real(drive, work)
    return lambda drive, work: _begin(work)


@inlined
def _begin_real(drive: Any, work: Any) -> None:
    """A motor without lag gives its torque from the first moment on."""
    _begin(work)
    for lane in range(WIDTH):
        law = at_lane(drive, work, r.DRIVE, lane)
        _limits(law, work[r.TOP_SPEED + lane] + work[r.SET_SPEED + lane], work, lane)
        error = law.kp * (work[r.LEAD + lane] - work[r.TOP_SPEED + lane])
        wanted = (law.feedforward + error) / (1.0 + law.kp * law.by_torque)
        given = _clip(wanted, work[r.LEAST + lane], work[r.MOST + lane])
        work[r.MOTOR + lane] = given if law.mean == 0.0 else 0.0


@inlined
def _begin(work: Any) -> None:
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
def _real_line(drive: Any, string: Any, work: Any, lane: int, rate: float) -> Any:
    law = at_lane(drive, work, r.DRIVE, lane)
    angle, motor = work[r.ANGLE + lane], work[r.MOTOR + lane]
    error = (work[r.SHIFT_NEW + lane] - work[r.SHIFT + lane] + angle) * rate
    error += law.by_seen * work[r.SEEN + lane] + law.by_begin * work[r.TOP_SPEED + lane]
    error += law.by_felt * work[r.FELT + lane] + law.by_slow * work[r.SLOW + lane]
    work[r.ERROR + lane] = error
    fixed = law.feedforward + law.ki * work[r.INTEGRAL + lane]
    offset = law.of_fixed * fixed + law.of_error * error + law.of_motor * motor
    slope, speed_slope = law.of_error * rate, law.of_error * law.by_speed
    # A forecast of the step with the bit torque of the last one.
    drag, torque = work[r.DRAG + lane], work[r.BIT_TORQUE + lane]
    angle_free = work[r.TOP_FREE + lane] - string.angle_by_top * drag - string.angle_by_bit * torque
    speed_free = (
        work[r.TOP_SPEED_FREE + lane]
        - string.top_speed_by_top * drag
        - string.top_speed_by_bit * torque
    )
    forecast = (offset - slope * angle_free + speed_slope * speed_free) * law.forecast
    speed = (angle_free + string.angle_by_top * forecast - angle) * rate
    _limits(law, speed + work[r.SET_SPEED + lane], work, lane)
    command = (forecast - law.mean * motor) * law.per_command
    given = _clip(command, work[r.LEAST + lane], work[r.MOST + lane])
    wanted = law.motor_take * (given - motor)
    moved = _clip(wanted, -law.most_moved, law.most_moved)
    at_rate = moved != wanted
    limited = given != command or at_rate
    work[r.MOVED + lane] = moved if at_rate else 0.0
    # At its limit of rate the torque is straight over the step.
    number = motor + 0.5 * moved if at_rate else given + law.mean * (motor - given)
    return (
        number if limited else offset,
        0.0 if limited else slope,
        0.0 if limited else -speed_slope,
    )


@inlined
def _held_line(drive: Any, work: Any, lane: int, rate: float) -> Any:
    law = at_lane(drive, work, r.DRIVE, lane)
    motor, command = work[r.MOTOR + lane], work[r.COMMAND + lane]
    wanted = law.motor_take * (command - motor)
    moved = _clip(wanted, -law.most_moved, law.most_moved)
    work[r.MOVED + lane] = moved if moved != wanted else 0.0
    mean = command + law.mean * (motor - command)
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
        taken = law.sensed_inertia * (speed - work[r.SEEN_LAST + lane])
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
    motor, at_rate = work[r.MOTOR + lane], work[r.MOVED + lane]
    command = (torque - law.mean * motor) * law.per_command
    moved = law.motor_take * (command - motor)
    work[r.MOTOR + lane] = motor + (at_rate if at_rate != 0.0 else moved)


@inlined
def _follow_real(drive: Any, work: Any, rate: float) -> None:
    widest_vectors()
    step = 1.0 / rate
    for lane in range(WIDTH):
        law = at_lane(drive, work, r.DRIVE, lane)
        torque = work[r.TOP_TORQUE + lane] + work[r.DRAG + lane]
        error = work[r.ERROR + lane] - rate * work[r.ANGLE + lane]
        error += law.by_speed * work[r.TOP_SPEED + lane] - law.by_torque * torque
        felt = torque - law.inertia * _see(law, work, lane)
        before = work[r.FELT + lane]
        shown = felt + law.felt_mean * (before - felt)
        work[r.FELT + lane] = felt + law.felt_keep * (before - felt)
        work[r.SLOW + lane] += law.slow_take * (shown - work[r.SLOW + lane])
        _turn(law, work, lane, torque)
        # Back-calculation, implicit: command = wanted + (ki step / 2) rate of the integral.
        wanted = law.feedforward + law.kp * error + law.ki * work[r.INTEGRAL + lane]
        free = wanted + law.half * error
        limit = _clip(free, work[r.LEAST + lane], work[r.MOST + lane])
        gives_in = (error + law.back * (limit - wanted)) * law.back_shrink
        work[r.INTEGRAL + lane] += step * (gives_in if free != limit else error)


@inlined
def _follow_sampled(drive: Any, work: Any, rate: float) -> None:
    widest_vectors()
    step = 1.0 / rate
    for lane in range(WIDTH):
        law = at_lane(drive, work, r.DRIVE, lane)
        torque = work[r.TOP_TORQUE + lane] + work[r.DRAG + lane]
        _see(law, work, lane)
        _turn(law, work, lane, torque)
        work[r.IMPULSE + lane] += torque * step


def top_torque_now(drive: Any, work: Any, lane: int, speed: float) -> float:
    """Torque of the drive at the moment, top speed in the frame (rad/s) given."""
    raise NotImplementedError("compiled only")


@overload(top_torque_now)
def _top_torque_now(drive, work, lane, speed):
    if drive.instance_class in (RealStep, SampledStep):
        return lambda drive, work, lane, speed: work[r.MOTOR + lane]
    return lambda drive, work, lane, speed: torque_at(
        at_lane(drive, work, r.DRIVE, lane),
        work[r.ANGLE + lane] - work[r.SHIFT + lane],
        speed - work[r.LEAD + lane],
    )
