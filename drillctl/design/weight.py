"""The weight-on-bit law of a design, and what changes by the clock."""

from __future__ import annotations

import math

from drillctl.design.parts import HEAVIEST
from drillctl.design.tables import DesignTables
from drillctl.design.weight_tables import (
    ConstantWeightTable,
    FollowingSpeedTable,
    PathTable,
    StickSlipAlarmTable,
    SurfaceObserverTable,
)
from drillctl.errors import InputError
from drillctl.rig.weight_on_bit import (
    AlarmWeight,
    ConstantWeight,
    FollowingSpeed,
    ObservedWeight,
    RealWeight,
    WeightLaw,
)

SHORTEST_LAG = 0.1
"""Time constant (s) of a hoist whose rate is limited, where the design gives a shorter one."""


def weight_on_bit(tables: DesignTables) -> WeightLaw:
    """Weight-on-bit law with its numbers."""
    table, nominal = tables.weight_on_bit, tables.operating_point.weight_on_bit
    match table:
        case ConstantWeightTable():
            return ConstantWeight(nominal)
        case StickSlipAlarmTable():
            _refuse_outside(nominal, table.minimum, math.inf)
            rate, hoist = _hoist(table.path)
            return AlarmWeight(
                nominal, table.minimum / nominal, table.path.delay, table.path.sensor_lag, hoist,
                rate, table.window, table.alarm, table.calm, table.reduction,
            )  # fmt: skip
        case FollowingSpeedTable():
            return _following(table, nominal, tables.operating_point.speed)


def _following(table: FollowingSpeedTable, nominal: float, speed: float) -> WeightLaw:
    most = math.inf if table.maximum is None else table.maximum
    _refuse_outside(nominal, table.minimum, most)
    # A number that no weight reaches: infinity times zero would be none.
    numbers = (nominal, table.gain, speed, table.minimum, min(most, HEAVIEST))
    observed = isinstance(table, SurfaceObserverTable)
    path = table.path
    if path.ideal and not observed:
        return FollowingSpeed(*numbers)
    rate, hoist = _hoist(path)
    law = ObservedWeight if observed else RealWeight
    return law(*numbers, path.delay, path.sampling_period, path.sensor_lag, hoist, rate)


def _hoist(path: PathTable) -> tuple[float, float]:
    """Largest rate (N/s) and lag (s) of the hoist."""
    if path.rate_limit is None:
        return HEAVIEST, path.hoist_lag
    return path.rate_limit, max(path.hoist_lag, SHORTEST_LAG)


def _refuse_outside(nominal: float, least: float, most: float) -> None:
    if not least <= nominal <= most:
        raise InputError(
            f"{nominal / 1e3:g} kN lies outside the limits of the weight-on-bit law, "
            f"{least / 1e3:g} to {most / 1e3:g} kN",
            "operating_point.weight_on_bit",
        )
