"""Laws with a memory, made ready for steps of one length: what the kernels take."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from drillctl.linear.observer import Observer
from drillctl.top_drive import RealDrive, SampledDrive
from drillctl.weight_on_bit import PATHS, AlarmWeight

Array = NDArray[np.float64]


INSTANT = 700.0
"""Exponent of a hoist without lag: nothing is left."""


def kept(lag: Array, step: float | Array) -> Array:
    """Share of its value that a first-order lag (s) keeps over a step (s)."""
    with np.errstate(divide="ignore"):
        return np.asarray(np.exp(-step / np.asarray(lag, dtype=float)))


def mean_kept(lag: Array, step: float) -> Array:
    """Share of its value that it keeps on the mean over the step."""
    return np.asarray(lag * (1.0 - kept(lag, step)) / step)


def ramp_followed(lag: Array, step: float) -> Array:
    """Share of the change of a straight input that it has followed at the end of the step."""
    return 1.0 - mean_kept(lag, step)


def drive_step(drive: Any, step: float) -> Any:
    """The kernel's form of a drive law; an ideal one as it is."""
    if not isinstance(drive, (RealDrive, SampledDrive)):
        return drive
    from drillctl.simulation.kernels.drive_step import RealStep, SampledStep

    numbers = (
        drive.feedforward, drive.kp, drive.ki, drive.mobility, drive.sensed_inertia,
        drive.least, drive.most, drive.power, drive.rate, drive.tracking,
    )  # fmt: skip
    seen = (kept(drive.encoder, step), ramp_followed(drive.encoder, step))
    motor = (kept(drive.lag, step), mean_kept(drive.lag, step))
    if isinstance(drive, RealDrive):
        take = 1.0 - np.exp(-drive.corner * step)
        with np.errstate(invalid="ignore"):
            mean = np.where(drive.corner > 0.0, 1.0 - take / (drive.corner * step), 0.0)
        made: Any = RealStep(
            *numbers, drive.encoder, drive.torque_filter, *seen,
            kept(drive.torque_filter, step), take, mean, *motor,
        )  # fmt: skip
    else:
        made = SampledStep(
            *numbers, drive.encoder, *seen, *motor,
            kept(drive.torque_filter, drive.period), 1.0 - np.exp(-drive.corner * drive.period),
            drive.period, drive.late,
        )  # fmt: skip
    return type(made)(*(np.ascontiguousarray(x, dtype=float) for x in made))


def weight_step(weight: Any, step: float) -> Any:
    """The kernel's form of a weight law; one that acts at once as it is."""
    if not isinstance(weight, PATHS):
        return weight
    from drillctl.simulation.kernels.weight_step import AlarmWeightStep, RealWeightStep

    seen = (kept(weight.sensor, step), ramp_followed(weight.sensor, step))
    hoist = (kept(weight.hoist, step), ramp_followed(weight.hoist, step))
    if isinstance(weight, AlarmWeight):
        made: Any = AlarmWeightStep(
            weight.nominal, weight.least, weight.delay, weight.window, weight.alarm, weight.calm,
            weight.reduction, *seen, *hoist, weight.rate * step,
        )  # fmt: skip
    else:
        with np.errstate(divide="ignore"):
            decay = np.minimum(step / weight.hoist, INSTANT)
        made = RealWeightStep(
            *weight[:5], weight.delay / step, weight.period / step, *seen, *hoist, decay,
            weight.rate * step,
        )  # fmt: skip
    return type(made)(*(np.ascontiguousarray(x, dtype=float) for x in made))


def remembered(weight: Any, step: float) -> int:
    """Steps whose signals a weight law may ask for."""
    if not isinstance(weight, PATHS):
        return 0
    if isinstance(weight, AlarmWeight):
        return 1
    return math.ceil(float(np.max(weight.delay + weight.period)) / step) + 3


def observer_step(observer: Observer | None, step: float, start: Array) -> Any:
    """The kernel's form of an observer.

    Parameters
    ----------
    observer : Observer or None
        Its continuous form.
    step : float
        Length of a step (s).
    start : ndarray, shape (states, lanes)
        States at time zero.
    """
    from drillctl.simulation.kernels.observer_step import NoObserver, ObserverStep

    if observer is None:
        return NoObserver(np.zeros(1))
    n = observer.states
    # Torque held, speed straight: x' = A x + b T + c w, w' = rise.
    augmented = np.zeros((n + 3, n + 3))
    augmented[:n, :n] = observer.free * step
    augmented[:n, n] = observer.by_torque * step
    augmented[:n, n + 1] = observer.by_speed * step
    augmented[n + 1, n + 2] = 1.0
    propagated = scipy.linalg.expm(augmented)
    by_end = propagated[:n, n + 2]
    return ObserverStep(
        np.ascontiguousarray(propagated[:n, :n]),
        np.ascontiguousarray(propagated[:n, n]),
        np.ascontiguousarray(propagated[:n, n + 1] - by_end),
        np.ascontiguousarray(by_end),
        np.ascontiguousarray(observer.read),
        np.ascontiguousarray(start),
    )


def program_step(program: Any) -> Any:
    """The kernel's form of the programs of all lanes; nothing where none moves."""
    from drillctl.simulation.kernels.program_step import NoProgram, Programs

    moves = np.any(program.speed.first != 0.0) or np.any(program.weight.first != 0.0)
    if not moves and not np.any(program.rock_until > 0.0):
        return NoProgram(np.zeros(1))
    return Programs(*(*program.speed, *program.weight, program.rock_until))
