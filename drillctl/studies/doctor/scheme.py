"""Why the batch engine takes its step and modes, and how far off it is by its own estimate.

`choose_scheme` is what chooses. Here each of its bounds is computed once more and named, from the
same constants and helpers, and the outcome is compared with what was chosen. Errors are estimated
from the same lanes at finer schemes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from drillctl.arrays import Array
from drillctl.design.tables import SimulationTable
from drillctl.rig.drillstring import Drillstring
from drillctl.rig.top_drive import SampledDrive
from drillctl.simulation.batch import Prepared, _shared, _turns
from drillctl.simulation.kernels.string_step import BlockString, UndampedString
from drillctl.simulation.lanes import Lanes
from drillctl.simulation.propagator import string_step
from drillctl.simulation.scheme import (
    ACCURACIES,
    ROUNDING,
    SMALLEST,
    STEEPEST,
    Scheme,
    _whole_steps,
    bit_inertia,
)
from drillctl.store.codec import label

SHORTENED = 1e-3
"""Share by which a step must be shorter than its bound for whole steps to be the reason."""
FORMS = {"undamped": "undamped modes", "blocks": "2 x 2 blocks", "dense": "a dense matrix"}
"""Forms of the string, in words."""


class Bound(NamedTuple):
    """A bound on the step."""

    name: str  # 'accuracy', 'elastic_mode', 'friction' or 'given'
    step: float  # longest step that it allows (s)
    reason: str  # in words


def explain(lanes: Lanes, table: SimulationTable, prepared: Prepared) -> dict[str, Any]:
    """A scheme and why it was chosen, as strict JSON values; SI units."""
    scheme, string = prepared.scheme, lanes.string
    bounds = _bounds(string, table, lanes.steepest_fall)
    asked = min(bound.step for bound in bounds)
    period = _shared(lanes.drive.period) if isinstance(lanes.drive, SampledDrive) else None
    steps, sampling = _whole_steps(table.duration, asked, period, _turns(lanes))
    modes, modes_by = _modes(string, table, scheme.step)
    if (steps, sampling, modes) != (scheme.steps, scheme.sampling, scheme.modes):
        raise RuntimeError(
            f"reasons for {steps} steps, {sampling} to a sample, {modes} modes; chosen was {scheme}"
        )
    highest = float(string.undamped_modes[0][modes - 1])
    return {
        "accuracy": table.accuracy,
        "step": scheme.step,
        "steps": scheme.steps,
        "modes": scheme.modes,
        "sampling": scheme.sampling,
        # A bound, or 'sampling' or 'program' where the step is shorter for whole steps to a period
        # of the controller, or to what changes by the clock.
        "decided_by": _decided(bounds, asked, table.duration, scheme),
        "bounds": {bound.name: bound.step for bound in bounds},  # a given step stands alone
        "reasons": {bound.name: bound.reason for bound in bounds},
        # Modes that turn little enough in a step, all of the string, two, or as given.
        "modes_by": modes_by,
        "highest_frequency_hz": highest / (2.0 * math.pi),
        "turn": highest * scheme.step,  # of that mode in a step (rad)
        # Modes that are not carried; their static share of the pipe torque is.
        "modes_left_out": string.nodes - modes,
        "string": form_of(prepared.stepper.string),
    }


def form_of(string: Any) -> str:
    """Name of the form of a string made ready: a key of `FORMS`."""
    if isinstance(string, UndampedString):
        return "undamped"
    return "blocks" if isinstance(string, BlockString) else "dense"


def _bounds(string: Drillstring, table: SimulationTable, fall: float) -> tuple[Bound, ...]:
    if table.step is not None:
        return (Bound("given", table.step, "simulation.step"),)
    accuracy = ACCURACIES[table.accuracy]
    elastic = float(2.0 * math.pi / string.undamped_modes[0][1])
    bounds = [
        Bound("accuracy", accuracy.step, f"the longest step of '{table.accuracy}'"),
        Bound(
            "elastic_mode",
            elastic / accuracy.steps_per_period,
            f"{accuracy.steps_per_period:g} steps in a period of the first elastic mode, "
            f"{elastic:.3g} s",
        ),
    ]
    if fall > 0.0:
        reason = f"the friction falls by up to {fall:.4g} N m s/rad: one root at the bit"
        bounds.append(Bound("friction", STEEPEST * bit_inertia(string) / fall, reason))
    return tuple(bounds)


def _decided(bounds: tuple[Bound, ...], asked: float, duration: float, scheme: Scheme) -> str:
    plain = max(1, math.ceil(duration / asked * (1.0 - 1e-12)))
    if scheme.sampling and scheme.step < asked * (1.0 - SHORTENED):
        return "sampling"
    if not scheme.sampling and scheme.steps > plain:
        return "program"
    return min(bounds, key=lambda bound: bound.step).name


def _modes(string: Drillstring, table: SimulationTable, step: float) -> tuple[int, str]:
    if table.modes is not None:
        return min(max(table.modes, 2), string.nodes), "given"
    frequency, _ = string.undamped_modes
    turning = int((frequency * step <= ACCURACIES[table.accuracy].phase).sum())
    if turning < 2:
        return min(2, string.nodes), "fewest"
    return turning, "all" if turning == string.nodes else "turn"


REFINEMENTS = (1, 2, 4)  # parts into which the step of the scheme is divided
ORDER_TWO = 4.0 / 3.0
"""Error of a scheme of order 2 per difference to the same at half the step (Richardson)."""
ENOUGH = 8  # fewest lanes from which an order is computed


class Errors(NamedTuple):
    """Relative errors of J1 over a sample of lanes."""

    median: float
    p90: float
    p99: float
    worst: float


def errors_of(values: Array) -> Errors:
    """Percentiles of those relative errors that are numbers; all NaN if none is."""
    known = values[np.isfinite(values)]
    if not known.size:
        return Errors(np.nan, np.nan, np.nan, np.nan)
    median, p90, p99 = map(float, np.percentile(known, (50, 90, 99)))
    return Errors(median, p90, p99, float(known.max()))


@dataclass(frozen=True, eq=False)
class ErrorEstimate:
    """J1 of a sample of lanes at a scheme and at finer ones."""

    # shape (3, lanes): At the scheme, at half and at a quarter of its step (s); NaN where a lane
    # failed
    j1: Array = label("refinement", "lane", unit="s")

    @cached_property
    def best(self) -> Array:
        """J1 extrapolated from the two finest, shape (lanes,) (s)."""
        return self.j1[2] + (ORDER_TWO - 1.0) * (self.j1[2] - self.j1[1])

    @cached_property
    def of_lanes(self) -> Array:
        """Estimated relative error of each lane at the scheme, shape (lanes,)."""
        return self._between(0)

    @property
    def errors(self) -> Errors:
        """At the scheme."""
        return errors_of(self.of_lanes)

    @property
    def of_lanes_at_half(self) -> Array:
        """At half its step, shape (lanes,)."""
        return self._between(1)

    def _between(self, row: int) -> Array:
        apart = ORDER_TWO * np.abs(self.j1[row] - self.j1[row + 1])
        return apart / np.maximum(np.abs(self.best), SMALLEST)

    def of_other(self, j1: Array) -> Array:
        """Errors of J1 by another scheme, shape (lanes,), beside the best known."""
        return np.abs(j1 - self.best) / np.maximum(np.abs(self.best), SMALLEST)

    @property
    def order(self) -> float | None:
        """Median over lanes of the order that three steps show; None where it cannot be seen."""
        first, second = np.abs(np.diff(self.j1, axis=0)) / np.maximum(np.abs(self.best), SMALLEST)
        seen = (first > ROUNDING) & (second > ROUNDING)
        if seen.sum() < ENOUGH:
            return None
        return float(np.median(np.log2(first[seen] / second[seen])))


def refined(string: Drillstring, table: SimulationTable, prepared: Prepared, parts: int) -> Any:
    """The same run with each step in parts, and as many times the modes."""
    if parts == 1:
        return prepared
    old = prepared.scheme
    step = old.step / parts
    followed = int((string.undamped_modes[0] * step <= ACCURACIES[table.accuracy].phase).sum())
    modes = min(string.nodes, max(parts * old.modes, followed))
    scheme = Scheme(step, parts * old.steps, modes, parts * old.sampling)
    stepper = string_step(string, step, modes)
    return Prepared(stepper, scheme, prepared.duration, prepared.j1_from)
