"""Numbers of programs as the kernels take them; made in `simulation.step_laws`."""

from __future__ import annotations

from typing import Any, NamedTuple


class NoProgram(NamedTuple):
    """Nothing changes by the clock.

    Attributes
    ----------
    unused : float
        numba wants a number.
    """

    unused: Any


class Programs(NamedTuple):
    """`drillctl.program.Program` of every lane.

    Attributes
    ----------
    speed_first, speed_begin, speed_end : ndarray
        Set speed less the final one (rad/s) up to a time, zero from a time on (s).
    weight_first, weight_begin, weight_end : ndarray
        Nominal weight over the final one less one, likewise.
    rock_until : ndarray
        Time until which the rock is another one (s).
    """

    speed_first: Any
    speed_begin: Any
    speed_end: Any
    weight_first: Any
    weight_begin: Any
    weight_end: Any
    rock_until: Any
