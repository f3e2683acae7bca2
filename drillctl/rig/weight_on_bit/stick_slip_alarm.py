"""Weight taken off on a stick-slip alarm, as a driller does."""

from __future__ import annotations

import math
from typing import Any, Literal, NamedTuple

from pydantic import model_validator

from drillctl.errors import InputError
from drillctl.rig import table as q
from drillctl.rig.table import Table
from drillctl.rig.weight_on_bit.law import PathTable, WeightOnBitLaw, refuse_outside


class AlarmWeight(NamedTuple):
    r"""Weight taken off on a stick-slip alarm and put on again when it is calm.

    At the end of each window the stick-slip index SSI = (max - min) / (2 mean) of the bit speed
    within it is sent up. Over the alarm level the weight is lowered by a share, under the calm
    level it is raised by as much, never above the nominal weight and never below the least:

    .. math:: W_c \leftarrow \max(W_{min}, (1 - r) W_c) \;\text{if SSI} > s_a, \qquad
              W_c \leftarrow \min(W_n, W_c / (1 - r)) \;\text{if SSI} < s_c

    What a driller does with an alarm, as a state machine.

    Attributes
    ----------
    nominal : float
        Weight W_n without alarm (N).
    floor : float
        W_min over the nominal weight, above zero.
    delay : float
        From the end of a window to the driller (s), at most the window.
    sensor, hoist, rate : float
        As in `RealWeight`.
    window : float
        Length of a window (s).
    alarm, calm : float
        SSI s_a above which weight is taken off, s_c below which it is put on.
    reduction : float
        Share r taken off at a time.
    """

    nominal: Any
    floor: Any
    delay: Any
    sensor: Any
    hoist: Any
    rate: Any
    window: Any
    alarm: Any
    calm: Any
    reduction: Any

    @property
    def moves(self) -> bool:
        """Whether the weight changes at once with the bit speed: it does not."""
        return False

    def next_level(self, level: Any, low: Any, high: Any, mean: Any) -> Any:
        """Weight over its nominal value after a window.

        Parameters
        ----------
        level : float
            Before.
        low, high, mean : float
            Of the bit speed in the window (rad/s).
        """
        spread = 0.5 * (high - low)
        lower = level * (1.0 - self.reduction)
        lower = lower + (lower < self.floor) * (self.floor - lower)
        upper = level / (1.0 - self.reduction)
        upper = upper + (upper > 1.0) * (1.0 - upper)
        # Not as a quotient: a bit that stands still has no mean, and is cause for alarm.
        alarmed = (spread > self.alarm * mean) + (mean <= 0.0) > 0
        quiet = (spread < self.calm * mean) * (mean > 0.0) > 0
        return alarmed * lower + quiet * upper + (1 - alarmed) * (1 - quiet) * level


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
                "path.sampling_period is not allowed with windows, which sample by themselves"
            )
        return self


def _law(table: StickSlipAlarmTable, nominal: float, speed: float) -> AlarmWeight:
    refuse_outside(nominal, table.minimum, math.inf)
    path = table.path
    return AlarmWeight(
        nominal, table.minimum / nominal, path.delay, path.sensor_lag, *path.hoist(),
        table.window, table.alarm, table.calm, table.reduction,
    )  # fmt: skip


LAWS = (
    WeightOnBitLaw(
        StickSlipAlarmTable,
        _law,
        forms=(
            (
                AlarmWeight,
                '`law = "stick-slip-alarm"` (alarm, calm, reduction, window, minimum) with '
                "`[weight_on_bit.path]`",
                "What a driller does by hand.",
            ),
        ),
    ),
)
