"""Tables of the top-drive laws, and of what makes a drive real."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from drillctl.errors import InputError
from drillctl.rig import table as q
from drillctl.rig.table import Table


class DriveTable(Table):
    """What makes a drive real; the ideal drive where nothing is given.

    Lags and filters are time constants. Without `minimum_torque` a drive with a torque limit does
    not brake. A limit of `"inf"` is none. With `torque_rate_limit` the motor follows with a lag of
    10 ms at least. `anti_windup` takes effect where torque, power or rate is limited;
    `tracking_time` is by default kp / ki.
    """

    torque_limit: q.TorqueLimit = None
    minimum_torque: q.LeastTorque = None
    power_limit: q.PowerLimit = None
    torque_rate_limit: q.TorqueRateLimit = None
    anti_windup: Literal["back-calculation", "none"] = "back-calculation"
    tracking_time: q.Time | None = None
    sampling_period: q.SamplingPeriod = 0.0
    one_sample_delay: bool = False
    lag: q.Lag = 0.0
    encoder_lag: q.Lag = 0.0
    torque_lag: q.Lag = 0.0

    @model_validator(mode="after")
    def _late_samples(self) -> DriveTable:
        if self.one_sample_delay and self.sampling_period == 0.0:
            raise InputError("one_sample_delay needs a sampling_period")
        return self

    @property
    def ideal(self) -> bool:
        """Whether nothing of it acts."""
        limits = (self.torque_limit, self.minimum_torque, self.power_limit, self.torque_rate_limit)
        lags = (self.sampling_period, self.lag, self.encoder_lag, self.torque_lag)
        return all(limit is None for limit in limits) and not any(lags)


class PITable(Table):
    """Proportional-integral speed control."""

    law: Literal["pi"]
    kp: q.ProportionalGain
    ki: q.IntegralGain
    drive: DriveTable = DriveTable()


class StiffSpeedTable(Table):
    """Stiff speed control: kp = stiffness x pipe impedance, ki = rate x drive inertia.

    The defaults are those of a public drilling simulator (NORCE).
    """

    law: Literal["stiff-speed"]
    stiffness: q.PositiveNumber = 50.0
    rate: q.PositiveNumber = 5.0
    drive: DriveTable = DriveTable()


class SoftTorqueTable(Table):
    """Soft torque, a PI tuned to the string: kp = pipe impedance / share, ki = w_s^2 J_d.

    w_s is the lowest frequency of the string with the top held, J_d the inertia of the drive.
    """

    law: Literal["soft-torque"]
    share: q.PositiveNumber = 0.25
    drive: DriveTable = DriveTable()

    @field_validator("share")
    @classmethod
    def _up_to_one(cls, value: float) -> float:
        if value > 1.0:
            raise InputError(f"must be at most 1, got {value:g}")
        return value


class ConstantTorqueTable(Table):
    """A drive at constant torque."""

    law: Literal["constant-torque"]
    torque: q.Torque
    drive: DriveTable = DriveTable()


class ZTorqueTable(Table):
    """Z-torque (impedance matching): the set speed gives way to the pipe torque.

    The speed controller is that of `stiff-speed`. `absorption` 1 absorbs every wave from below,
    0 none. The pipe torque is felt without its slow part: `high_pass` is the period below which
    it passes (time constant: that over 2 pi).
    """

    law: Literal["z-torque"]
    absorption: q.Share = 1.0
    high_pass: q.Time = 20.0
    stiffness: q.PositiveNumber = 50.0
    rate: q.PositiveNumber = 5.0
    drive: DriveTable = DriveTable()


class TorsionalRectificationTable(Table):
    """Torsional rectification (after Tucker & Wang 1999): Z-torque that absorbs every wave.

    The ideal limit of impedance matching, on an ideal drive; `high_pass` as there.
    """

    law: Literal["torsional-rectification"]
    high_pass: q.Time = 20.0
    stiffness: q.PositiveNumber = 50.0
    rate: q.PositiveNumber = 5.0
    drive: DriveTable = DriveTable()


class ActiveDampingTable(Table):
    """Active damping (after Jansen & van den Steen 1995): the set speed gives way to the motor.

    The drive comes to look like a spring k_f and a damper c_f, by default those that make the
    lowest two pairs of poles of pipe, bit and drive coincide. The speed controller is that of
    `stiff-speed`.
    """

    law: Literal["active-damping"]
    spring: q.PositiveIntegralGain | None = None
    damper: q.PositiveProportionalGain | None = None
    stiffness: q.PositiveNumber = 50.0
    rate: q.PositiveNumber = 5.0
    drive: DriveTable = DriveTable()


ControllerTable = Annotated[
    PITable
    | ConstantTorqueTable
    | StiffSpeedTable
    | SoftTorqueTable
    | ZTorqueTable
    | TorsionalRectificationTable
    | ActiveDampingTable,
    Field(discriminator="law"),
]
