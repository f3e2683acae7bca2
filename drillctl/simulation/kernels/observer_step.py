"""The step of an observer of the bit, beside that of the string."""

from __future__ import annotations

from typing import Any, NamedTuple

from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.arithmetic import at, by_type, inlined, put
from drillctl.simulation.kernels.rows import WIDTH


class NoObserver(NamedTuple):
    """Nothing is estimated."""

    unused: Any  # numba wants a number


class ObserverStep(NamedTuple):
    """`drillctl.linear.observer.Observer` for steps of one length."""

    free: Any  # shape (states, states): Propagation over a step
    # shape (states,): Change by a torque held over the step, and by top speeds at its ends with a
    # straight line between
    by_torque: Any
    by_begin: Any
    by_end: Any
    read: Any  # shape (states,): Bit speed in the frame per state
    start: Any  # shape (states, lanes): State at time zero


def start_observer(observer: Any, memory: Any, first: int) -> None:
    """Put the observer's states at time zero in."""
    raise NotImplementedError("compiled only")


@by_type(start_observer)
def _start_observer(observer, memory, first):
    if observer.instance_class is NoObserver:
        return lambda observer, memory, first: None
    return lambda observer, memory, first: _copy_start(observer, memory, first)


@inlined
def _copy_start(observer: Any, memory: Any, first: int) -> None:
    for i in range(observer.free.shape[0]):
        put(memory.estimate, i * WIDTH, at(observer.start[i], first))


def move_observer(observer: Any, memory: Any, work: Any, top_speed_before: Any) -> None:
    """One step of the observer."""
    raise NotImplementedError("compiled only")


@by_type(move_observer)
def _move_observer(observer, memory, work, top_speed_before):
    if observer.instance_class is NoObserver:
        return lambda observer, memory, work, top_speed_before: None
    return lambda observer, memory, work, top_speed_before: _propagate(
        observer, memory, work, top_speed_before
    )


@inlined
def _propagate(observer: Any, memory: Any, work: Any, before: Any) -> None:
    states = observer.free.shape[0]
    torque, after = at(work, r.TOP_TORQUE), at(work, r.TOP_SPEED)
    for i in range(states):
        moved = observer.by_torque[i] * torque + observer.by_begin[i] * before
        moved += observer.by_end[i] * after
        for j in range(states):
            moved += observer.free[i, j] * at(memory.estimate, j * WIDTH)
        put(memory.moved, i * WIDTH, moved)
    for i in range(states):
        put(memory.estimate, i * WIDTH, at(memory.moved, i * WIDTH))


def read_observer(observer: Any, memory: Any, work: Any) -> None:
    """Put the estimated bit speed in the place of the signal."""
    raise NotImplementedError("compiled only")


@by_type(read_observer)
def _read_observer(observer, memory, work):
    if observer.instance_class is NoObserver:
        return lambda observer, memory, work: None
    return lambda observer, memory, work: _estimate(observer, memory, work)


@inlined
def _estimate(observer: Any, memory: Any, work: Any) -> None:
    speed = at(work, r.SET_SPEED)
    for i in range(observer.free.shape[0]):
        speed += observer.read[i] * at(memory.estimate, i * WIDTH)
    put(work, r.SIGNAL, abs(speed))
