"""The top-drive law of a design: gains given or tuned to the string, ideal or as it is built."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from drillctl.design.controller_tables import (
    ActiveDampingTable,
    ConstantTorqueTable,
    DriveTable,
    PITable,
    SoftTorqueTable,
    StiffSpeedTable,
    TorsionalRectificationTable,
    ZTorqueTable,
)
from drillctl.design.tables import DesignTables
from drillctl.errors import InputError
from drillctl.rig.drillstring import Drillstring
from drillctl.rig.top_drive import PI, ConstantTorque, RealDrive, SampledDrive, TopDriveLaw

SHORTEST_LAG = 0.01
"""Time constant (s) of a motor whose torque rate is limited, where the design gives a shorter
one: a rate is limited on its way to a command, which takes a way."""


@dataclass(frozen=True)
class Controller:
    """Numbers of a speed controller before the drive around it; see `RealDrive`."""

    kp: float
    ki: float
    feedforward: float = 0.0
    mobility: float = 0.0
    sensed_inertia: float = 0.0
    corner: float = 0.0


def top_drive(tables: DesignTables, string: Callable[[], Drillstring]) -> TopDriveLaw:
    """Top-drive law with its numbers; `string` is asked for by a law that is tuned to it."""
    table = tables.controller
    try:
        controller = _controller(tables, string)
    except InputError as error:
        raise InputError(
            f"{table.law} is tuned to the pipe: {error.problem}", "controller.law"
        ) from None
    if table.drive.ideal and controller.mobility == 0.0:
        if isinstance(table, ConstantTorqueTable):
            return ConstantTorque(controller.feedforward)
        return PI(controller.kp, controller.ki)
    return _real(controller, table.drive)


def _controller(tables: DesignTables, string: Callable[[], Drillstring]) -> Controller:
    table, inertia = tables.controller, tables.top_drive.inertia
    match table:
        case PITable():
            return Controller(table.kp, table.ki)
        case ConstantTorqueTable():
            return Controller(0.0, 0.0, feedforward=table.torque)
        case SoftTorqueTable():
            from drillctl.linear.tuning import soft_torque

            return Controller(*soft_torque(string(), table.share))
        case StiffSpeedTable():
            return Controller(*_stiff(table, string))
        case ZTorqueTable():
            from drillctl.linear.tuning import z_torque

            return _matched(table, string, z_torque(string(), table.absorption), inertia)
        case TorsionalRectificationTable():
            from drillctl.linear.tuning import torsional_rectification

            return _matched(table, string, torsional_rectification(string()), inertia)
        case ActiveDampingTable():
            from drillctl.linear.tuning import active_damping

            damper, spring = active_damping(string())
            damper = damper if table.damper is None else table.damper
            spring = spring if table.spring is None else table.spring
            return Controller(*_stiff(table, string), mobility=1.0 / damper, corner=spring / damper)


def _matched(
    table: ZTorqueTable | TorsionalRectificationTable,
    string: Callable[[], Drillstring],
    mobility: float,
    inertia: float,
) -> Controller:
    """A stiff controller that gives way to the torque of the pipe."""
    corner = 2.0 * math.pi / table.high_pass
    return Controller(
        *_stiff(table, string), mobility=mobility, sensed_inertia=inertia, corner=corner
    )


def _stiff(
    table: StiffSpeedTable | ZTorqueTable | TorsionalRectificationTable | ActiveDampingTable,
    string: Callable[[], Drillstring],
) -> tuple[float, float]:
    from drillctl.linear.tuning import stiff_speed

    return stiff_speed(string(), table.stiffness, table.rate)


def _real(controller: Controller, drive: DriveTable) -> RealDrive | SampledDrive:
    least, most = limits(drive)
    rate = math.inf if drive.torque_rate_limit is None else drive.torque_rate_limit
    numbers = {
        "feedforward": controller.feedforward,
        "kp": controller.kp,
        "ki": controller.ki,
        "mobility": controller.mobility,
        "sensed_inertia": controller.sensed_inertia,
        "corner": controller.corner,
        "encoder": drive.encoder_lag,
        "torque_filter": drive.torque_lag,
        "lag": drive.lag if math.isinf(rate) else max(drive.lag, SHORTEST_LAG),
        "least": least,
        "most": most,
        "power": math.inf if drive.power_limit is None else drive.power_limit,
        "rate": rate,
        "tracking": float(tracking(controller.kp, controller.ki, drive)),
    }
    if drive.sampling_period == 0.0:
        return RealDrive(**numbers)
    late = float(drive.one_sample_delay)
    return SampledDrive(**numbers, period=drive.sampling_period, late=late)


def limits(drive: DriveTable) -> tuple[float, float]:
    """Least and largest torque (N m); a drive with a torque limit does not brake by default."""
    most = math.inf if drive.torque_limit is None else drive.torque_limit
    unlimited = -math.inf if drive.torque_limit is None else 0.0
    return (unlimited if drive.minimum_torque is None else drive.minimum_torque), most


def tracking(kp: Any, ki: Any, drive: DriveTable) -> Any:
    """Rate (1/s) at which a limited integral gives in, for gains that may be arrays."""
    if drive.anti_windup == "none":
        return np.zeros(np.broadcast_shapes(np.shape(kp), np.shape(ki)))
    if drive.tracking_time is not None:
        rate: Any = 1.0 / drive.tracking_time
    else:
        rate = np.where(np.greater(kp, 0.0), ki / np.where(np.greater(kp, 0.0), kp, 1.0), 1.0)
    return np.where(np.equal(ki, 0.0), 0.0, rate)


def refuse_weak_drive(tables: DesignTables, string: Drillstring, torque: float) -> None:
    """Refuse a drive that cannot hold its set speed."""
    drive, speed = tables.controller.drive, tables.operating_point.speed
    if isinstance(tables.controller, ConstantTorqueTable):
        return
    needed = torque + float(string.ground_damping.sum()) * speed
    for key, limit in (
        ("torque_limit", drive.torque_limit),
        ("power_limit", None if drive.power_limit is None else drive.power_limit / speed),
    ):
        if limit is not None and limit < needed:
            raise InputError(
                f"gives {limit / 1e3:.4g} kN*m at the set speed, less than the "
                f"{needed / 1e3:.4g} kN*m that rock and drag take there",
                f"controller.drive.{key}",
            )


def warnings(tables: DesignTables, static: float) -> tuple[str, ...]:
    """What a user should know of a drive: that it cannot free a stuck bit."""
    limit = tables.controller.drive.torque_limit
    if limit is None or limit >= static:
        return ()
    return (
        f"controller.drive.torque_limit {limit / 1e3:.4g} kN*m is less than the static torque of "
        f"the bit, {static / 1e3:.4g} kN*m: once stuck it cannot be freed (status stalled)",
    )
