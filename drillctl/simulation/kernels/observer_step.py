"""The step of an observer of the bit, beside that of the string."""

from __future__ import annotations

from typing import Any, NamedTuple

from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.rows import WIDTH
from drillctl.simulation.kernels.vectors import Variable, at, loop, put


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


def start_observer(observer: Any, memory: Any, first: Any) -> None:
    """Put the observer's states at time zero in."""
    if isinstance(observer, NoObserver):
        return None
    return _copy_start(observer, memory, first)


def _copy_start(observer: Any, memory: Any, first: Any) -> None:
    with loop(observer.free.shape[0]) as states:
        i = states.index
        put(memory.estimate, i * WIDTH, at(observer.start[i], first))


def move_observer(observer: Any, memory: Any, work: Any, top_speed_before: Any) -> None:
    """One step of the observer."""
    if isinstance(observer, NoObserver):
        return None
    return _propagate(observer, memory, work, top_speed_before)


def _propagate(observer: Any, memory: Any, work: Any, before: Any) -> None:
    count = observer.free.shape[0]
    torque, after = at(work, r.TOP_TORQUE), at(work, r.TOP_SPEED)
    with loop(count) as states:
        i = states.index
        pushed = observer.by_torque[i] * torque + observer.by_begin[i] * before
        moved = Variable(pushed + observer.by_end[i] * after)
        with loop(count) as others:
            j = others.index
            moved.set(moved.get() + observer.free[i, j] * at(memory.estimate, j * WIDTH))
        put(memory.moved, i * WIDTH, moved.get())
    with loop(count) as states:
        put(memory.estimate, states.index * WIDTH, at(memory.moved, states.index * WIDTH))


def read_observer(observer: Any, memory: Any, work: Any) -> None:
    """Put the estimated bit speed in the place of the signal."""
    if isinstance(observer, NoObserver):
        return None
    return _estimate(observer, memory, work)


def _estimate(observer: Any, memory: Any, work: Any) -> None:
    speed = Variable(at(work, r.SET_SPEED))
    with loop(observer.free.shape[0]) as states:
        i = states.index
        speed.set(speed.get() + observer.read[i] * at(memory.estimate, i * WIDTH))
    put(work, r.SIGNAL, abs(speed.get()))
