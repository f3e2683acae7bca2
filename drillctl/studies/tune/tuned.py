"""What is tuned: paths of a design with their bounds, and the drive's numbers that follow.

A design's controller holds numbers such as `share` or `absorption`, and a law made of it holds
gains. `drive_numbers` is that step, by the same function of the law, for arrays and symbols.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from drillctl import units
from drillctl.arrays import Array
from drillctl.design import Design, parameter, to_toml, tuned_ranges
from drillctl.ensemble.parameters import Draws
from drillctl.errors import InputError, nearest
from drillctl.rig.drillstring import Drillstring
from drillctl.rig.top_drive.law import StringNumbers, drive_laws, tracking
from drillctl.store.codec import documented, label
from drillctl.store.folder import resolved
from drillctl.store.json_files import write_json, write_text
from drillctl.studies.tune.settings import RangeTable

WEIGHT_KEYS = ("weight_on_bit.gain", "weight_on_bit.path.delay")
"""Numbers of a weight on bit that follows the bit speed that may be tuned."""


@dataclass(frozen=True)
class Tuned:
    """A tuned parameter."""

    path: str  # dotted path
    unit: str  # unit of its values, empty for factors
    # bounds (SI)
    low: float
    high: float


def tuned_parameters(design: Design) -> tuple[Tuned, ...]:
    """What the `[tune]` table of a design names, or the numbers of its controller."""
    table = design.tables.tune
    if table.parameters:
        result = tuple(_named(design, path, entry) for path, entry in table.parameters.items())
    else:
        result = default_ranges(design)
    for path in (t.path for t in result if t.path in design.tables.uncertain):
        raise InputError(
            "is drawn in [uncertain], and cannot be tuned as well",
            design.where(f"tune.parameters.{path}"),
        )
    return result


def _named(design: Design, path: str, entry: RangeTable) -> Tuned:
    try:
        return _read(design, path, entry)
    except InputError as error:
        end = f".{error.where}" if error.where in ("min", "max") else ""
        raise InputError(error.problem, design.where(f"tune.parameters.{path}{end}")) from None


def _read(design: Design, path: str, entry: RangeTable) -> Tuned:
    target = parameter(design, path)
    low, high = target.parse(entry.min), target.parse(entry.max)
    if path.startswith("simulation.") or target.whole:
        raise InputError("is not a number of the rig that can be tuned")
    if not low < high:
        raise InputError(
            f"min {entry.min} must be less than max {entry.max}: the bounds are "
            + ("reversed" if high < low else "equal")
        )
    for key, end in (("min", low), ("max", high)):
        try:
            design.replace({path: units.SI(end)})
        except InputError as error:
            raise InputError(f"no design has it: {error.problem}", key) from None
    return Tuned(path, target.si_unit, low, high)


def default_ranges(design: Design) -> tuple[Tuned, ...]:
    """The numbers of its controller, within what fits the rig."""
    return tuple(
        Tuned(path, parameter(design, path).si_unit, low, high)
        for path, (low, high) in tuned_ranges(design).items()
    )


def controller_paths(design: Design) -> tuple[str, ...]:
    """Paths of a design's controller that may be tuned."""
    return tuple(f"controller.{key}" for key in drive_laws()[design.tables.controller.law].tuned)


def put(design: Design, tuned: tuple[Tuned, ...], values: Array) -> Design:
    """The design with values (SI) of its tuned parameters, shape (parameters,)."""
    return design.replace({t.path: units.SI(float(v)) for t, v in zip(tuned, values, strict=True)})


def middle(design: Design, tuned: tuple[Tuned, ...]) -> Design:
    """The design with every tuned parameter halfway: it has the types that its laws have within.

    An absorption or a delay of zero would make laws of another type.
    """
    return put(design, tuned, np.array([0.5 * (t.low + t.high) for t in tuned]))


def by_path(tuned: tuple[Tuned, ...], values: Array) -> dict[str, float]:
    """Values (SI), shape (parameters,), by path."""
    return {t.path: float(v) for t, v in zip(tuned, values, strict=True)}


def spread(tuned: tuple[Tuned, ...], count: int) -> Array:
    """Points (SI), shape (count, parameters), none of them on a bound.

    Additive recurrence on the generalised golden ratio: low discrepancy in any dimension, and the
    first points of a longer sequence are those of a shorter one (Roberts 2018, after Weyl).
    """
    dimension = len(tuned)
    ratio = 2.0
    for _ in range(60):  # the root of x^(d+1) = x + 1
        ratio = (1.0 + ratio) ** (1.0 / (dimension + 1.0))
    strides = ratio ** -np.arange(1.0, dimension + 1.0)
    share = (0.5 + np.outer(np.arange(1, count + 1), strides)) % 1.0
    low = np.array([t.low for t in tuned])
    return np.asarray(low + share * (np.array([t.high for t in tuned]) - low))


def designs_at(design: Design, draws: Draws) -> Iterator[Design]:
    """The design at every draw that a rig can have; impossible ones are left out."""
    for number in range(len(draws)):
        values = {path: units.SI(column[number]) for path, column in draws.values.items()}
        try:
            variant = design.replace(values)
            _ = variant.bit_rock, variant.string
        except InputError:
            continue
        yield variant


@dataclass(frozen=True, eq=False)
@documented
class TunedGains:
    """What every design of gains has."""

    design: Design = label(means="with the gains put in")
    tuned: tuple[Tuned, ...] = label(means="what was tuned")
    values: Array = label(
        "parameter", means="tuned values (SI); of an infeasible problem the closest ones"
    )
    violations: dict[str, float] = label(
        means="requirements that are missed, with how far; empty for a feasible design. Slopes "
        "count over the steepest slope of the rock, damping ratios as they are, all else over the "
        "limit"
    )
    message: str = label(means="the result, or what could not be met")
    seconds: float = label(unit="s", means="time that it took")
    processor_seconds: float = label(unit="s", means="processor time that it took")

    @property
    def feasible(self) -> bool:
        """Whether every requirement is kept."""
        return not self.violations

    @property
    def gains(self) -> dict[str, float]:
        """Values by path (SI)."""
        return by_path(self.tuned, self.values)

    def summary(self) -> dict[str, Any]:
        """Strict JSON values, SI."""
        raise NotImplementedError

    def save(self, folder: str | Path) -> Path:
        """Write `design.toml`, ready to run, and `summary.json` into a folder, which is made."""
        folder = resolved(folder, "folder")
        folder.mkdir(parents=True, exist_ok=True)
        write_text(folder / "design.toml", to_toml(self.design))
        write_json(folder / "summary.json", self.summary())
        return folder


def spelled(tuned: tuple[Tuned, ...], values: Array) -> str:
    """Tuned values in words, in full units."""
    return ", ".join(
        f"{one.path} = {units.full(float(value), one.unit)}"
        for one, value in zip(tuned, values, strict=True)
    )


def unmet(at: str, missed: Mapping[str, float]) -> str:
    """A sentence about requirements that are missed at the closest point."""
    worst = max(missed, key=lambda key: missed[key])
    return (
        "the requirements cannot all be met between these bounds: at the closest point, "
        f"{at}, {', '.join(missed)} {'is' if len(missed) == 1 else 'are'} missed, {worst} by "
        f"{missed[worst]:.3g}"
    )


def string_numbers(string: Drillstring) -> StringNumbers:
    """What drives are tuned to of a string."""
    lumped = string.parts.sections[0].inertia == 0.0
    pipe = math.nan if lumped else string.pipe_impedance
    return StringNumbers(pipe, string.top_inertia, string.drive_spring, string.drive_damper)


def drive_numbers(
    design: Design, values: Mapping[str, Any], string: StringNumbers
) -> dict[str, Any]:
    """Numbers of the drive law of a design with some of the controller's numbers replaced.

    Values may be floats, arrays or symbols. The inertia that a drive senses is the rig's own.
    """
    table = design.tables.controller
    allowed = controller_paths(design)
    given = {path: value for path, value in values.items() if path.startswith("controller.")}
    for path in given:
        if path not in allowed:
            raise InputError(
                f"{path!r} is not tuned here; {nearest(path, allowed)}", "tune.parameters"
            )
    replaced = {path.removeprefix("controller."): value for path, value in given.items()}
    numbers = SimpleNamespace(**(dict(table) | replaced))
    result = drive_laws()[table.law].controller(numbers, string)._asdict()
    del result["sensed_inertia"]
    return result | {"level": result["feedforward"]}


def tracked(design: Design, numbers: dict[str, Any]) -> dict[str, Any]:
    """Numbers of a drive with the rate of its anti-windup, which follows from the gains."""
    drive = design.tables.controller.drive
    return numbers | {"tracking": tracking(numbers["kp"], numbers["ki"], drive)}
