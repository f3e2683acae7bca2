"""Tables of the weight-on-bit laws, and of the way from the bit to the hoist and back."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from drillctl.errors import InputError
from drillctl.rig import table as q
from drillctl.rig.table import Table


class PathTable(Table):
    """From the bit speed to the weight on the bit; at once where nothing is given.

    `delay`: until the driller knows. `sampling_period`: between two readings. `sensor_lag`,
    `hoist_lag`: time constants of the filter downhole and of the hoist. With `rate_limit` the
    hoist follows with a lag of 0.1 s at least.
    """

    delay: q.TimeOrZero = 0.0
    sampling_period: q.SamplingPeriod = 0.0
    sensor_lag: q.Lag = 0.0
    hoist_lag: q.Lag = 0.0
    rate_limit: q.WeightRateLimit = None

    @property
    def ideal(self) -> bool:
        """Whether nothing of it acts."""
        lags = (self.delay, self.sampling_period, self.sensor_lag, self.hoist_lag)
        return self.rate_limit is None and not any(lags)


class ConstantWeightTable(Table):
    """Weight on bit held at the operating point's value; its path waits for another law."""

    law: Literal["constant"] = "constant"
    path: PathTable = PathTable()


class FollowingSpeedTable(Table):
    """Weight on bit W = W_n + gain (|bit speed| - set speed) within limits, ideal."""

    law: Literal["navarro-lopez-suarez"]
    gain: q.WeightGain
    minimum: q.Weight = 0.0
    maximum: q.Weight | None = None
    path: PathTable = PathTable()

    @model_validator(mode="after")
    def _in_order(self) -> FollowingSpeedTable:
        if self.maximum is not None and self.maximum <= self.minimum:
            raise InputError(
                f"maximum {self.maximum / 1e3:g} kN must be more than minimum "
                f"{self.minimum / 1e3:g} kN"
            )
        return self


class SurfaceObserverTable(FollowingSpeedTable):
    """The same with the bit speed estimated from top speed and top torque by an observer."""

    law: Literal["surface-observer"]  # type: ignore[assignment]
    observer_modes: q.Count = 4

    @model_validator(mode="after")
    def _no_sensor(self) -> SurfaceObserverTable:
        if self.path.sensor_lag:
            raise InputError(
                "sensor_lag does not go with an observer, which has no sensor downhole"
            )
        return self


class StickSlipAlarmTable(Table):
    """Weight taken off on a stick-slip alarm, put on again when it is calm.

    The stick-slip index of each `window` decides; `reduction` is the share taken off at a time.
    """

    law: Literal["stick-slip-alarm"]
    alarm: q.PositiveNumber = 0.8
    calm: q.PositiveNumber = 0.3
    reduction: q.Share = 0.1
    window: q.Time = 10.0
    minimum: q.PositiveWeight = 20e3
    path: PathTable = PathTable()

    @model_validator(mode="after")
    def _makes_sense(self) -> StickSlipAlarmTable:
        if not self.calm < self.alarm:
            raise InputError(f"calm = {self.calm:g} must be less than alarm = {self.alarm:g}")
        if self.reduction in (0.0, 1.0):
            raise InputError(f"reduction = {self.reduction:g} must be more than 0 and less than 1")
        if self.path.delay > self.window:
            raise InputError(
                f"path.delay {self.path.delay:g} s must not exceed window {self.window:g} s"
            )
        if self.path.sampling_period:
            raise InputError(
                "path.sampling_period does not go with windows, which sample by themselves"
            )
        return self


WeightOnBitTable = Annotated[
    ConstantWeightTable | FollowingSpeedTable | SurfaceObserverTable | StickSlipAlarmTable,
    Field(discriminator="law"),
]
