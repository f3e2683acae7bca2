"""Laws with a memory, made ready for steps of one length: what the kernels take."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import scipy.linalg

from drillctl import units
from drillctl.arrays import Array
from drillctl.errors import InputError
from drillctl.linear.observer import Observer
from drillctl.rig.bit_rock.variation import NoVariation, paths
from drillctl.rig.program import Path
from drillctl.rig.top_drive import RealDrive, SampledDrive
from drillctl.rig.weight_on_bit import PATHS, AlarmWeight
from drillctl.simulation.lanes import Start

INSTANT = 700.0  # exponent of a hoist without lag: nothing is left


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


def drive_step(drive: Any, step: float, string: Any) -> Any:
    """The kernel's form of a drive law on a string made ready; an ideal one as it is."""
    if not isinstance(drive, RealDrive):
        return drive
    from drillctl.simulation.kernels.drive_step import CURVED, OF_A_CURVE

    if isinstance(drive, SampledDrive):
        made = _sampled_step(drive, step)
    else:
        made = _real_step(drive, step, string)
    if np.isfinite(drive.curve).any():
        made = CURVED[type(made)](*made, *(getattr(drive, key) for key in OF_A_CURVE))
    shape = drive.kp.shape
    return type(made)(*(np.ascontiguousarray(np.broadcast_to(x, shape), dtype=float) for x in made))


def _real_step(drive: RealDrive, step: float, string: Any) -> Any:
    from drillctl.simulation.kernels.drive_step import RealStep

    keep, ramp = kept(drive.encoder, step), ramp_followed(drive.encoder, step)
    filter_mean, motor_mean = mean_kept(drive.torque_filter, step), mean_kept(drive.lag, step)
    take = 1.0 - np.exp(-drive.corner * step)
    with np.errstate(invalid="ignore"):
        slow_mean = np.where(drive.corner > 0.0, 1.0 - take / (drive.corner * step), 0.0)
        back = np.where(drive.ki != 0.0, drive.tracking / drive.ki, 0.0)
    through = drive.mobility * (1.0 - slow_mean)
    by_torque = through * (1.0 - filter_mean)
    by_change = (drive.encoder + by_torque * drive.sensed_inertia) / step
    follows = (1.0 - motor_mean) * (drive.kp + 0.5 * drive.ki * step)
    shrink = 1.0 / (1.0 + follows * by_torque)
    slope, speed_slope = follows * shrink / step, follows * shrink * by_change * ramp
    forecast = 1.0 + slope * string.angle_by_top - speed_slope * string.top_speed_by_top
    return RealStep(
        feedforward=drive.feedforward, kp=drive.kp, ki=drive.ki, half=0.5 * drive.ki * step,
        by_seen=by_change * (keep - 1.0), by_begin=by_change * (1.0 - keep - ramp),
        by_felt=-through * filter_mean, by_slow=through,
        by_speed=by_change * ramp, by_torque=by_torque,
        of_fixed=(1.0 - motor_mean) * shrink, of_error=follows * shrink,
        of_motor=motor_mean * shrink, forecast=1.0 / forecast,
        mean=motor_mean, per_command=1.0 / (1.0 - motor_mean),
        least=drive.least, most=drive.most, power=drive.power, most_moved=drive.rate * step,
        back=back, back_shrink=1.0 / (1.0 + 0.5 * np.where(drive.ki != 0.0, drive.tracking, 0.0)
                                      * step),
        seen_keep=keep, seen_ramp=ramp, inertia=drive.sensed_inertia / step,
        felt_keep=kept(drive.torque_filter, step), felt_mean=filter_mean,
        slow_take=take, motor_take=1.0 - kept(drive.lag, step),
        slowness=drive.slowness, continuous=drive.continuous,
    )  # fmt: skip


def _sampled_step(drive: SampledDrive, step: float) -> Any:
    from drillctl.simulation.kernels.drive_step import SampledStep

    motor_mean = mean_kept(drive.lag, step)
    return SampledStep(
        feedforward=drive.feedforward, kp=drive.kp, ki=drive.ki, mobility=drive.mobility,
        sensed_inertia=drive.sensed_inertia, least=drive.least, most=drive.most,
        power=drive.power, tracking=drive.tracking, period=drive.period, late=drive.late,
        felt_keep=kept(drive.torque_filter, drive.period),
        slow_take=1.0 - np.exp(-drive.corner * drive.period),
        seen_keep=kept(drive.encoder, step), seen_ramp=ramp_followed(drive.encoder, step),
        mean=motor_mean, per_command=1.0 / (1.0 - motor_mean),
        motor_take=1.0 - kept(drive.lag, step), most_moved=drive.rate * step,
        slowness=drive.slowness, continuous=drive.continuous,
    )  # fmt: skip


MOST_REMEMBERED = 2**22  # steps of a weight that comes late: half a GiB a thread


def weight_step(weight: Any, step: float) -> Any:
    """The kernel's form of a weight law; one that acts at once as it is."""
    if not isinstance(weight, PATHS):
        return weight
    from drillctl.simulation.kernels.weight_step import (
        AlarmWeightStep,
        ReadWeightStep,
        RealWeightStep,
    )

    seen = (kept(weight.sensor, step), ramp_followed(weight.sensor, step))
    hoist = (kept(weight.hoist, step), ramp_followed(weight.hoist, step))
    if isinstance(weight, AlarmWeight):
        made: Any = AlarmWeightStep(
            weight.nominal, weight.floor, weight.delay, weight.window, weight.alarm, weight.calm,
            weight.reduction, *seen, *hoist, weight.rate * step,
        )  # fmt: skip
    elif np.any(weight.period > 0.0):
        with np.errstate(divide="ignore"):
            decay = np.minimum(step / weight.hoist, INSTANT)
        made = ReadWeightStep(
            *weight[:5], weight.delay / step, weight.period / step, decay, *seen, *hoist,
            weight.rate * step,
        )  # fmt: skip
    else:
        # Seen at the end of step n is the signal at n + 1 - delay, at n - back + share.
        late = weight.delay / step - 1.0
        back = np.maximum(np.ceil(late - 1e-9), 1.0)
        made = RealWeightStep(
            *weight[:5], back, back - late, *seen, *hoist, weight.rate * step
        )  # fmt: skip
    return type(made)(*(np.ascontiguousarray(x, dtype=float) for x in made))


def within_run(weight: Any, duration: float) -> Any:
    """A weight law with a delay no longer than the run, at the end of which it is the same."""
    if not isinstance(weight, PATHS) or isinstance(weight, AlarmWeight):
        return weight
    return weight._replace(delay=np.minimum(weight.delay, duration))


def remembered(weight: Any, step: float, duration: float) -> int:
    """Steps whose signals a weight law may ask for."""
    if not isinstance(weight, PATHS):
        return 0
    if isinstance(weight, AlarmWeight):
        return 1
    longest = float(np.max(weight.delay + np.minimum(weight.period, duration)))
    steps = math.ceil(longest / step) + 3
    if steps > MOST_REMEMBERED:
        raise InputError(
            f"{units.full(longest, 's', 3)} are {steps:.1e} steps of {units.full(step, 's', 3)}, "
            f"whose signals it would remember; at most {MOST_REMEMBERED:.1e}",
            "weight_on_bit.path",
        )
    return 1 << (steps - 1).bit_length()  # a power of two


def observer_step(observer: Observer | None, step: float, start: Start) -> Any:
    """The kernel's form of an observer."""
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
    still = np.zeros(len(start.twists[0][0]))
    return ObserverStep(
        np.ascontiguousarray(propagated[:n, :n]),
        np.ascontiguousarray(propagated[:n, n]),
        np.ascontiguousarray(propagated[:n, n + 1] - by_end),
        np.ascontiguousarray(by_end),
        np.ascontiguousarray(observer.read),
        np.asarray(
            sum(
                [np.outer(observer.state(shape, still), x) for shape, x in start.twists]
                + [np.outer(observer.state(still, shape), x) for shape, x in start.turns]
            )
        ),
    )


def variation_step(
    variation: Any, duration: float, set_speed: Array, rate: float | Array = 0.0
) -> Any:
    """The kernel's form of a rock that varies along the way, with its paths.

    `rate`: of penetration (m/s) of a bit that drills by itself.
    """
    from drillctl.simulation.kernels.variation_step import SameRock, VariationStep

    if isinstance(variation, NoVariation):
        return SameRock(np.zeros(1))
    nodes = int(np.max(variation.nodes(duration, set_speed, rate)))
    table, row = paths(variation, nodes)
    begin, last = row * float(nodes), np.array([nodes - 2.0])
    per_spacing = 1.0 / variation.spacing
    return VariationStep(
        table.ravel(), last, begin, variation.advance, variation.turns, variation.sinks,
        per_spacing, variation.spread,
    )  # fmt: skip


def program_step(program: Any) -> Any:
    """The kernel's form of the programs of all lanes; nothing where none moves."""
    from drillctl.simulation.kernels.program_step import LongPrograms, NoProgram, Programs

    if not program.moves:
        return NoProgram(np.zeros(1))
    kind: Any = LongPrograms if isinstance(program.speed, Path) else Programs
    return kind(*program.speed, *program.weight, program.rock_until)
