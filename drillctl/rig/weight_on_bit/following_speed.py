"""Weight on bit that follows the bit speed (Navarro-Lopez & Suarez 2004), ideal and as on a rig.

On a rig a signal that stands for the bit speed comes up: measured at the bit behind a filter, or
estimated at the surface. It arrives late, perhaps sampled. A command follows from it, and the hoist
follows the command with a lag and at a limited rate:

    tau_s s' = |w_b| - s,   seen(t) = s(t - delay)  or  s(k period) from k period + delay on,
    W' = (command - W) / tau_h,  |W'| <= rate.
"""

from __future__ import annotations

import math
from typing import Any, Literal, NamedTuple

from pydantic import model_validator

from drillctl.errors import InputError
from drillctl.rig import table as q
from drillctl.rig.table import Table
from drillctl.rig.weight_on_bit.law import (
    HEAVIEST,
    PathTable,
    WeightLaw,
    WeightOnBitLaw,
    refuse_outside,
)


class FollowingSpeed(NamedTuple):
    r"""More weight on a fast bit, less on a slow one.

    .. math:: W = W_n + K_w (|\omega_b| - \Omega), \qquad W_{min} \le W \le W_{max}

    After Navarro-Lopez & Suarez, Proc. IEEE CCA (2004) 1454-1460, who write
    :math:`W = K_w |\omega_b| + W_0`; here W_n is the weight at the set speed, so that laws are
    compared at equal nominal weight. The ideal law: the bit speed is known at once and the hoist
    follows at once.

    Attributes
    ----------
    nominal : float
        Weight at the set speed W_n (N).
    gain : float
        K_w (N s/rad), not negative.
    set_speed : float
        Omega (rad/s).
    least, most : float
        Limits (N).
    """

    nominal: Any
    gain: Any
    set_speed: Any
    least: Any
    most: Any

    @property
    def moves(self) -> bool:
        """Whether the weight changes with the bit speed."""
        return True

    def weight(self, speed: Any) -> Any:
        """Weight on bit (N) at bit speed `speed` >= 0 (rad/s)."""
        free = self.nominal + self.gain * (speed - self.set_speed)
        kept = free + (free < self.least) * (self.least - free)
        return kept + (kept > self.most) * (self.most - kept)

    def slope(self, speed: Any) -> Any:
        """Weight per bit speed (N s/rad): the gain, none beyond the limits."""
        free = self.nominal + self.gain * (speed - self.set_speed)
        return self.gain * (free > self.least) * (free < self.most)


class RealWeight(NamedTuple):
    r"""Weight that follows a bit speed measured downhole, as a rig can do it.

    .. math:: W_c = W_n + K_w (s(t - \tau_d) - \Omega), \quad W_{min} \le W_c \le W_{max}, \qquad
              \tau_h \dot W = W_c - W, \quad |\dot W| \le R

    The law of Navarro-Lopez & Suarez (2004) with s the bit speed behind a filter of time constant
    tau_s: measured downhole, sent up with a delay, sampled if `period` is not zero, followed by a
    hoist. A bit speed is not known at the surface at once; mud pulses take seconds, wired pipe a
    fraction of one.

    Attributes
    ----------
    nominal : float
        Weight at the set speed W_n (N).
    gain : float
        K_w (N s/rad), not negative.
    set_speed : float
        Omega (rad/s).
    least, most : float
        Limits of the command (N).
    delay : float
        tau_d, from the bit to the driller (s).
    period : float
        Between two readings (s); 0 for a continuous signal.
    sensor : float
        tau_s (s).
    hoist : float
        tau_h (s); 0 for a hoist that follows at once.
    rate : float
        R (N/s); infinite for none, else with a lag of the hoist.
    """

    nominal: Any
    gain: Any
    set_speed: Any
    least: Any
    most: Any
    delay: Any
    period: Any
    sensor: Any
    hoist: Any
    rate: Any

    @property
    def moves(self) -> bool:
        """Whether the weight changes at once with the bit speed: it does not."""
        return False

    def command(self, seen: Any, nominal: Any) -> Any:
        """Commanded weight (N) at a measured speed (rad/s) and the present nominal weight (N)."""
        free = nominal + self.gain * (seen - self.set_speed)
        kept = free + (free < self.least) * (self.least - free)
        return kept + (kept > self.most) * (self.most - kept)


class ObservedWeight(RealWeight):
    """The law of `RealWeight` with a bit speed estimated at the surface.

    An observer of the string reads top speed and top torque and estimates the bit speed (see
    `drillctl.linear.observer`); no signal comes up from the bit. What the bit does reaches the
    top, and the estimate, one travel time of the pipe later. The delay is that of the computation;
    `sensor` is not used, as the observer filters by itself.
    """

    __slots__ = ()


# Keys of a design.


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
                "sensor_lag is not allowed with an observer, which has no sensor downhole"
            )
        return self


def _following(table: FollowingSpeedTable, nominal: float, speed: float) -> WeightLaw:
    most = math.inf if table.maximum is None else table.maximum
    refuse_outside(nominal, table.minimum, most)
    # A number that no weight reaches: infinity times zero would be none.
    numbers = (nominal, table.gain, speed, table.minimum, min(most, HEAVIEST))
    observed, path = isinstance(table, SurfaceObserverTable), table.path
    if path.ideal and not observed:
        return FollowingSpeed(*numbers)
    law = ObservedWeight if observed else RealWeight
    return law(*numbers, path.delay, path.sampling_period, path.sensor_lag, *path.hoist())


LAWS = (
    WeightOnBitLaw(
        FollowingSpeedTable,
        _following,
        forms=(
            (
                FollowingSpeed,
                '`law = "navarro-lopez-suarez"` (gain, minimum, maximum)',
                "What dynamic weight on bit could do at best: no delay, no hoist.",
            ),
            (
                RealWeight,
                '`law = "navarro-lopez-suarez"` with `[weight_on_bit.path]` (delay, '
                "sampling_period, sensor_lag, hoist_lag, rate_limit)",
                "What it can do on a rig.",
            ),
        ),
    ),
    WeightOnBitLaw(
        SurfaceObserverTable,
        _following,
        forms=(
            (
                ObservedWeight,
                '`law = "surface-observer"` (gain, minimum, maximum, observer_modes) with '
                "`[weight_on_bit.path]`",
                "Where nothing is sent up from the bit.",
            ),
        ),
    ),
)
