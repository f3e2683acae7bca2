"""The step of a drive in CasADi's symbols: `kernels/drive_step.py` once more.

The mean torque of a step is offset - slope angle - speed_slope speed, with the top angle and speed
at its end, which the string then turns into a number. Limits are choices, as in the kernel.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from drillctl.rig.top_drive import RealDrive
from drillctl.simulation.kernels.drive_step import SLOWEST


class Line(NamedTuple):
    """Mean torque of a step, a line in the top's motion at its end; see `drive_step`."""

    offset: Any
    slope: Any
    speed_slope: Any


class Top(NamedTuple):
    """The top of the string in a step: what it was, and what it would be without torques."""

    # at the beginning, in the frame (rad, rad/s)
    angle: Any
    speed: Any
    # at the end, were the torques of drive and bit zero but the drag
    free_angle: Any
    free_speed: Any
    set_speed: Any  # rad/s
    bit_torque: Any  # mean of the last step (N m)


class Ideal:
    """A drive without memory."""

    size = 0

    def __init__(self, step: float) -> None:
        self.step = step

    def begin(self, law: Any, top_speed: Any, set_speed: Any) -> list[Any]:
        """Memory at time zero: none."""
        return []

    def line(self, law: Any, memory: Any, top: Top, string: Any) -> tuple[Line, list[Any]]:
        """Mean torque as a line, and what `follow` needs."""
        offset, slope = law.mean_torque(top.angle, 1.0 / self.step)
        return Line(offset, slope, 0.0), []

    def follow(
        self, law: Any, memory: Any, kept: list[Any], top: Top, after: tuple[Any, Any], torque: Any
    ) -> list[Any]:
        """Memory after the step: none."""
        return []


class Real(Ideal):
    """A `RealDrive`: speed seen, torque felt, its slow part, integral, motor torque."""

    size = 5

    def __init__(self, step: float, lags: tuple[bool, bool, bool]) -> None:
        super().__init__(step)
        self.lags = lags

    def _lag(self, time: Any, lagging: bool) -> tuple[Any, Any]:
        """Share kept over a step, and on the mean over it; `simulation.step_laws`."""
        import casadi as ca

        if not lagging:
            return 0.0, 0.0
        keep = ca.exp(-self.step / time)
        return keep, time * (1.0 - keep) / self.step

    def _numbers(self, law: RealDrive) -> dict[str, Any]:
        """What `simulation.step_laws` makes of a drive for steps of one length."""
        import casadi as ca

        step = self.step
        (keep, encoder_mean), (felt_keep, felt_mean), (motor_keep, mean) = (
            self._lag(time, lagging)
            for time, lagging in zip(
                (law.encoder, law.torque_filter, law.lag), self.lags, strict=True
            )
        )
        ramp = 1.0 - encoder_mean
        take = 1.0 - ca.exp(-law.corner * step)
        passes = law.corner > 0
        slow_mean = ca.if_else(passes, 1.0 - take / ca.if_else(passes, law.corner * step, 1.0), 0.0)
        through = law.mobility * (1.0 - slow_mean)
        by_torque = through * (1.0 - felt_mean)
        by_change = (law.encoder + by_torque * law.sensed_inertia) / step
        follows = (1.0 - mean) * (law.kp + 0.5 * law.ki * step)
        shrink = 1.0 / (1.0 + follows * by_torque)
        return {
            "keep": keep, "ramp": ramp, "felt_keep": felt_keep, "felt_mean": felt_mean,
            "motor_take": 1.0 - motor_keep, "mean": mean, "take": take, "through": through,
            "by_torque": by_torque, "by_change": by_change, "by_speed": by_change * ramp,
            "of_fixed": (1.0 - mean) * shrink, "of_error": follows * shrink,
            "of_motor": mean * shrink,
        }  # fmt: skip

    def begin(self, law: Any, top_speed: Any, set_speed: Any) -> list[Any]:
        """A motor without lag gives its torque from the first moment on."""
        n = self._numbers(law)
        low, high = _limits(law, top_speed + set_speed)
        wanted = (law.feedforward - law.kp * top_speed) / (1.0 + law.kp * n["by_torque"])
        return [top_speed, 0.0, 0.0, 0.0, 0.0 if self.lags[2] else _clip(wanted, low, high)]

    def line(self, law: Any, memory: Any, top: Top, string: Any) -> tuple[Line, list[Any]]:
        """Mean torque as a line, or as a number where it is limited; and what `follow` needs."""
        import casadi as ca

        n, rate = self._numbers(law), 1.0 / self.step
        seen, felt, slow, integral, motor = (memory[k] for k in range(5))
        error = top.angle * rate + n["by_change"] * (n["keep"] - 1.0) * seen
        error += n["by_change"] * (1.0 - n["keep"] - n["ramp"]) * top.speed
        error += -n["through"] * n["felt_mean"] * felt + n["through"] * slow
        offset = n["of_fixed"] * (law.feedforward + law.ki * integral)
        offset += n["of_error"] * error + n["of_motor"] * motor
        slope, speed_slope = n["of_error"] * rate, -n["of_error"] * n["by_speed"]
        # A forecast of the step with the bit torque of the last one.
        angle = top.free_angle - string.angle_by_bit * top.bit_torque
        speed = top.free_speed - string.top_speed_by_bit * top.bit_torque
        whole = 1.0 + slope * string.angle_by_top + speed_slope * string.top_speed_by_top
        forecast = (offset - slope * angle - speed_slope * speed) / whole
        turning = (angle + string.angle_by_top * forecast - top.angle) * rate
        low, high = _limits(law, turning + top.set_speed)
        command = (forecast - n["mean"] * motor) / (1.0 - n["mean"])
        given = _clip(command, low, high)
        wanted = n["motor_take"] * (given - motor)
        most = law.rate * self.step
        moved = _clip(wanted, -most, most)
        at_rate = moved != wanted
        limited = ca.logic_or(given != command, at_rate)
        number = ca.if_else(at_rate, motor + 0.5 * moved, given + n["mean"] * (motor - given))
        line = Line(
            ca.if_else(limited, number, offset),
            ca.if_else(limited, 0.0, slope),
            ca.if_else(limited, 0.0, speed_slope),
        )
        return line, [error, low, high, at_rate, moved]

    def follow(
        self, law: Any, memory: Any, kept: list[Any], top: Top, after: tuple[Any, Any], torque: Any
    ) -> list[Any]:
        """Memory after a step whose motion (angle, speed at its end) and mean torque are known."""
        import casadi as ca

        n, rate = self._numbers(law), 1.0 / self.step
        error, low, high, at_rate, moved = kept
        angle, speed = after
        seen, felt_before, slow, integral, motor = (memory[k] for k in range(5))
        error = error - rate * angle + n["by_speed"] * speed - n["by_torque"] * torque
        new_seen = n["keep"] * seen + (1.0 - n["keep"]) * top.speed
        new_seen += n["ramp"] * (speed - top.speed)
        felt = torque - law.sensed_inertia * rate * (new_seen - seen)
        shown = felt + n["felt_mean"] * (felt_before - felt)
        command = (torque - n["mean"] * motor) / (1.0 - n["mean"])
        moved = ca.if_else(at_rate, moved, n["motor_take"] * (command - motor))
        wanted = law.feedforward + law.kp * error + law.ki * integral
        free = wanted + 0.5 * law.ki * self.step * error
        limit = _clip(free, low, high)
        back = law.tracking / ca.if_else(law.ki != 0, law.ki, 1.0)
        gives_in = (error + back * (limit - wanted)) / (1.0 + 0.5 * law.tracking * self.step)
        return [
            new_seen,
            felt + n["felt_keep"] * (felt_before - felt),
            slow + n["take"] * (shown - slow),
            integral + self.step * ca.if_else(free != limit, gives_in, error),
            motor + moved,
        ]


def _limits(law: Any, speed: Any) -> tuple[Any, Any]:
    """Limits of the torque at an absolute speed (rad/s)."""
    import casadi as ca

    by_power = law.power / ca.fmax(ca.fabs(speed), SLOWEST)
    return ca.fmax(law.least, -by_power), ca.fmin(law.most, by_power)


def _clip(value: Any, low: Any, high: Any) -> Any:
    import casadi as ca

    return ca.fmin(ca.fmax(value, low), high)
