"""Cases of a comparison: designs on equal terms, and the map and motion of each without draws."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from drillctl import units
from drillctl.design import Design, parameter
from drillctl.ensemble.grid import axes_of
from drillctl.ensemble.parameters import Uncertain, uncertain_parameters
from drillctl.ensemble.sweeps import Sweep, sweep
from drillctl.errors import InputError
from drillctl.progress import Progress, Within
from drillctl.simulation import Simulation, simulate

if TYPE_CHECKING:
    from drillctl.design.tables import AxisTable

ALONE = "as designed"  # name of the only case of a design without cases
INTERVAL = 0.1  # sampling interval of the responses (s), rounded to a whole number of steps
NO_MAPS = "compare.maps is false"  # reason where no maps are requested
WEIGHT = "operating_point.weight_on_bit"  # what is shifted for the sake of equal mean weights


def case_designs(design: Design) -> dict[str, Design]:
    """The cases of a design's `[compare]` table, the baseline first."""
    cases = design.tables.compare.cases
    if not cases:
        return {ALONE: design}
    results = {}
    for case in cases:
        try:
            results[case.name] = design.replace(case.values)
        except InputError as error:
            raise in_case(error, design, case.name) from None
    return results


def refuse_unequal(cases: Mapping[str, Design]) -> tuple[Uncertain, ...]:
    """Refuse cases that are not on equal terms: other starts, other runs, other draws."""
    if not cases:
        raise InputError("at least one case is needed", "compare.cases")
    baseline = next(iter(cases.values()))
    expected = uncertain_parameters(baseline)
    for name, design in cases.items():
        try:
            _refuse_other_runs(design, baseline)
            _refuse_other_draws(design, baseline, expected)
        except InputError as error:
            raise in_case(error, design, name) from None
    return expected


def _refuse_other_runs(design: Design, baseline: Design) -> None:
    one, other = design.tables, baseline.tables
    if one.start != other.start:
        raise InputError("cases are compared from the same start as the first", "start")
    for key in ("duration", "j1_from"):
        if getattr(one.simulation, key) != getattr(other.simulation, key):
            raise InputError("cases are compared over the same run as the first",
                             f"simulation.{key}")  # fmt: skip


def _refuse_other_draws(design: Design, baseline: Design, expected: tuple[Uncertain, ...]) -> None:
    result = uncertain_parameters(design)
    if design.tables.uncertain != baseline.tables.uncertain or (
        [p.path for p in result] != [p.path for p in expected]
    ):
        raise InputError(
            f"the first case draws {', '.join(p.path for p in expected)}; every case must draw "
            "the same: name them in [uncertain] of the design",
            "uncertain",
        )
    for drawn in (p for p in result if not p.own_mean):
        if parameter(design, drawn.path).value != parameter(baseline, drawn.path).value:
            raise InputError(
                "is drawn, from one distribution in all cases, so that a value of its own has no "
                "effect; a distribution without mean is drawn about the value of each case",
                drawn.path,
            )


def in_case(error: InputError, design: Design, name: str) -> InputError:
    """The same error with the case in front of its key, after the file."""
    key = error.where.removeprefix(design.origin).removeprefix(": ")
    where = f"{design.origin}: " if design.origin else ""
    return InputError(error.problem, f"{where}compare.cases {name!r}: {key}".removesuffix(": "))


@dataclass(frozen=True, eq=False)
class Nominal:
    """A case at its own values, nothing drawn."""

    map: Sweep | None  # J1 and the other measures over the two axes of the comparison, not audited
    no_map: str | None  # why there is none; None where there is one
    response: Simulation  # by the batch engine, sampled about every `INTERVAL`

    def summary(self) -> dict[str, Any]:
        """Measures and scheme of the response, map or why there is none; SI."""
        result = None
        if self.map is not None:
            told = self.map.summary()
            # Regions stand with the case, at the levels of the comparison; of an audit that was
            # not made there is nothing to tell.
            result = {key: told[key] for key in told if key not in ("regions", "audit")}
        return {**self.response.summary(), "map": result, "no_map": self.no_map}


def shifted_design(design: Design, shift: float) -> Design:
    """The design with its nominal weight on bit shifted (N)."""
    if shift == 0.0:
        return design
    weight = design.tables.operating_point.weight_on_bit + shift
    values: dict[str, Any] = {WEIGHT: units.SI(weight)}
    low, high = design.table_range
    if not low <= weight <= high:
        # A weight that moves leaves the table in its draws too; only a design is asked first.
        values["bit_rock.outside_table"] = "extrapolate"
    return design.replace(values)


def cells_of(tables: tuple[AxisTable, ...] | None) -> int:
    """Cells of the map of each case."""
    return math.prod(table.points for table in tables) if tables else 0


def nominal_runs(
    design: Design, tables: tuple[AxisTable, ...] | None, progress: Progress
) -> Nominal:
    """Map and response of a case; without tables of axes no map."""
    result, reason = None, None
    try:
        result = _map(design, tables, progress)
    except InputError as error:  # the axes do not fit this case, or a value on them is impossible
        reason = str(error)
        progress.advance(cells_of(tables))
    return Nominal(result, reason, simulate(design, engine="batch", interval=INTERVAL))


def _map(design: Design, tables: tuple[AxisTable, ...] | None, progress: Progress) -> Sweep:
    if tables is None:
        raise InputError(NO_MAPS)
    if len(tables) != 2:
        raise InputError(f"a map runs over 2 parameters, [map] has {len(tables)}")
    return sweep(design, axes_of(design, tables), audit_cells=0, progress=Within(progress))
