"""The step of an observer of the bit, beside that of the string."""

from __future__ import annotations

from typing import Any, NamedTuple

from numba.extending import overload

from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.compiling import inlined, widest_vectors
from drillctl.simulation.kernels.rows import WIDTH


class NoObserver(NamedTuple):
    """Nothing is estimated.

    Attributes
    ----------
    unused : float
        numba wants a number.
    """

    unused: Any


class ObserverStep(NamedTuple):
    """`drillctl.linear.observer.Observer` for steps of one length.

    Attributes
    ----------
    free : ndarray, shape (states, states)
        Propagation over a step.
    by_torque, by_begin, by_end : ndarray, shape (states,)
        Change by a torque held over the step, and by top speeds at its ends with a straight line
        between.
    read : ndarray, shape (states,)
        Bit speed in the frame per state.
    start : ndarray, shape (states, lanes)
        State at time zero.
    """

    free: Any
    by_torque: Any
    by_begin: Any
    by_end: Any
    read: Any
    start: Any


def start_observer(observer: Any, memory: Any, first: int) -> None:
    """Put the observer's states at time zero in."""
    raise NotImplementedError("compiled only")


@overload(start_observer)
def _start_observer(observer, memory, first):
    if observer.instance_class is NoObserver:
        return lambda observer, memory, first: None
    return lambda observer, memory, first: _copy_start(observer, memory, first)


@inlined
def _copy_start(observer: Any, memory: Any, first: int) -> None:
    for i in range(observer.free.shape[0]):
        for lane in range(WIDTH):
            memory.estimate[i, lane] = observer.start[i, first + lane]


def move_observer(observer: Any, memory: Any, work: Any) -> None:
    """One step of the observer."""
    raise NotImplementedError("compiled only")


@overload(move_observer)
def _move_observer(observer, memory, work):
    if observer.instance_class is NoObserver:
        return lambda observer, memory, work: None
    return lambda observer, memory, work: _propagate(observer, memory, work)


@inlined
def _propagate(observer: Any, memory: Any, work: Any) -> None:
    widest_vectors()
    states = observer.free.shape[0]
    for i in range(states):
        torque, begin, end = observer.by_torque[i], observer.by_begin[i], observer.by_end[i]
        for lane in range(WIDTH):
            memory.moved[i, lane] = (
                torque * work[r.TOP_TORQUE + lane]
                + begin * work[r.TOP_SPEED_BEFORE + lane]
                + end * work[r.TOP_SPEED + lane]
            )
        for j in range(states):
            a = observer.free[i, j]
            for lane in range(WIDTH):
                memory.moved[i, lane] += a * memory.estimate[j, lane]
    for i in range(states):
        for lane in range(WIDTH):
            memory.estimate[i, lane] = memory.moved[i, lane]


def read_observer(observer: Any, memory: Any, work: Any) -> None:
    """Put the estimated bit speed in the place of the signal."""
    raise NotImplementedError("compiled only")


@overload(read_observer)
def _read_observer(observer, memory, work):
    if observer.instance_class is NoObserver:
        return lambda observer, memory, work: None
    return lambda observer, memory, work: _estimate(observer, memory, work)


@inlined
def _estimate(observer: Any, memory: Any, work: Any) -> None:
    for lane in range(WIDTH):
        speed = work[r.SET_SPEED + lane]
        for i in range(observer.free.shape[0]):
            speed += observer.read[i] * memory.estimate[i, lane]
        work[r.SIGNAL + lane] = abs(speed)
