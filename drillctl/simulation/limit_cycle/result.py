"""Both methods beside the long simulation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drillctl.arrays import own_errstate
from drillctl.design import Design
from drillctl.errors import InputError
from drillctl.rig.bit_rock import PrintedThreeBranch
from drillctl.rig.weight_on_bit import PATHS
from drillctl.simulation.lanes import Kind
from drillctl.simulation.limit_cycle.describing import (
    MODES,
    HarmonicCycle,
    harmonic_cycles,
    rising_crossings,
)
from drillctl.simulation.limit_cycle.returns import Returns, judge, long_run
from drillctl.simulation.limit_cycle.shooting import Orbit
from drillctl.store.codec import label
from drillctl.store.result import Result

PERIODS = 40  # length of the long simulation in expected periods
FEWEST_PERIODS = 16
"""Fewest of them: half are thrown away, and some are needed to see whether they repeat."""

TOLERANCE = 1e-8  # of the reference solver in the long simulation


@dataclass(frozen=True, eq=False)
class LimitCycle(Result, kind="cycle"):
    """What a design does in the long run, by three methods."""

    design: Design = label(means="what was computed")
    status: str = label(means="one of `returns.STATUSES`")
    harmonic: tuple[HarmonicCycle, ...] = label(means="by harmonic balance, lowest frequency first")
    orbit: Orbit | None = label(
        flat=True, means="the exact periodic motion; None unless the status is `periodic`"
    )
    simulated: Returns = label(flat=True, means="the long simulation")
    settings: dict[str, Any] = label(
        default_factory=dict, means="what was requested that is not the usual"
    )

    @property
    def predicted(self) -> HarmonicCycle | None:
        """The stable harmonic cycle of lowest frequency; None if there is none."""
        return next((cycle for cycle in self.harmonic if cycle.stable), None)

    def summary(self) -> dict[str, Any]:
        """Status and numbers of each method; SI units, None where undefined."""
        return {
            "status": self.status,
            "period": None if self.orbit is None else self.orbit.period,
            "harmonic": [cycle.summary() for cycle in self.harmonic],
            "orbit": None if self.orbit is None else self.orbit.summary(),
            "simulated": self.simulated.summary(),
        }

    def derived(self) -> dict[str, Any]:
        """The harmonic prediction over the time of the orbit, or of the last simulated cycle."""
        if self.predicted is None:
            return {}
        time = self.simulated.time if self.orbit is None else self.orbit.time
        about = {"units": "rad/s", "long_name": "bit speed, one harmonic"}
        return {
            "time": ("time", time, {"units": "s"}),
            "harmonic_bit_speed": ("time", self.predicted.bit_speed(time), about),
        }

    def requested(self) -> tuple[Design, dict[str, Any]]:
        """The rig, and what else was requested."""
        return self.design, self.settings


@own_errstate()
def limit_cycle(
    design: Design,
    periods: int = PERIODS,
    start: Kind | None = "wound_up",
    modes: int = MODES,
    tolerance: float = TOLERANCE,
) -> LimitCycle:
    """The stick-slip cycle of a design: by one harmonic, exactly, and by a long simulation.

    Parameters
    ----------
    design : Design
        Rig and control; its own duration is not used.
    periods : int
        Length of the simulation in expected periods: those of the lowest harmonic cycle.
    start : {'wound_up', 'rest', 'turning'} or None
        Where the simulation starts; None for the design's own start.
    modes : int
        Crossings that harmonic balance looks at, from the lowest frequency on.
    tolerance : float
        Of the reference solver in the long simulation.

    Returns
    -------
    LimitCycle
        A motion that does not repeat is a status, not an error. With a drive or a weight that has a
        memory the orbit is not followed; with a weight that comes late there is no harmonic
        cycle either.

    Raises
    ------
    InputError
        Too few periods, an unknown start, or the printed friction.
    SimulationError
        The reference solver could not finish.
    """
    _refuse_printed_law(design)
    if periods < FEWEST_PERIODS:
        raise InputError(f"at least {FEWEST_PERIODS} periods, not {periods}", "periods")
    moves_late = isinstance(design.weight_on_bit, PATHS)  # not a function of the bit speed
    harmonic = () if moves_late else harmonic_cycles(design, modes)
    simulated = long_run(design, expected_period(design, harmonic), periods, start, tolerance)
    status, orbit = judge(design, simulated)
    usual = {"periods": PERIODS, "start": "wound_up", "modes": MODES, "tolerance": TOLERANCE}
    chosen = {"periods": periods, "start": start, "modes": modes, "tolerance": tolerance}
    settings = {name: value for name, value in chosen.items() if value != usual[name]}
    return LimitCycle(design, status, harmonic, orbit, simulated, settings)


def _refuse_printed_law(design: Design) -> None:
    """A bit that creeps along an edge has more phases than cycles are followed through."""
    if isinstance(design.bit_rock, PrintedThreeBranch) or design.axial is not None:
        raise InputError(
            f"cycles are not found under {design.tables.bit_rock.law!r}; use "
            "'navarro-lopez-suarez', or simulate it with the reference engine",
            "bit_rock.law",
        )
    if design.wall is not None:
        raise InputError(
            "cycles are not found where the wall rubs: simulate a long run", "well.friction_factor"
        )


def expected_period(design: Design, harmonic: tuple[HarmonicCycle, ...]) -> float:
    """A period to measure time by (s): of the lowest cycle, else of the lowest oscillation."""
    if harmonic:
        return harmonic[0].period
    lowest = rising_crossings(design)
    if lowest:
        return 2.0 * np.pi / lowest[0][0]
    frequency, _ = design.string.undamped_modes
    return float(2.0 * np.pi / frequency[1])
