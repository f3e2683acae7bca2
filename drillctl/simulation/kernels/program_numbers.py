"""Numbers of programs as the kernels take them; made in `simulation.step_laws`."""

from __future__ import annotations

from typing import Any, NamedTuple


class NoProgram(NamedTuple):
    """Nothing changes by the clock."""

    unused: Any  # numba wants a number


class Programs(NamedTuple):
    """`drillctl.program.Program` of every lane."""

    # set speed less the final one (rad/s) up to a time, zero from a time on (s)
    speed_first: Any
    speed_begin: Any
    speed_end: Any
    # nominal weight over the final one less one, likewise
    weight_first: Any
    weight_begin: Any
    weight_end: Any
    rock_until: Any  # time until which the rock is another one (s)
