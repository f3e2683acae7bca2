"""Cases of a comparison: designs that differ only where they are meant to."""

from __future__ import annotations

from collections.abc import Mapping

from drillctl.design import Design, parameter
from drillctl.ensemble.parameters import Uncertain, uncertain_parameters
from drillctl.errors import InputError

ALONE = "as designed"
"""Name of the only case of a design without cases."""


def case_designs(design: Design) -> dict[str, Design]:
    """The cases of a design's `[compare]` table, the baseline first."""
    cases = design.tables.compare.cases
    if not cases:
        return {ALONE: design}
    found = {}
    for case in cases:
        try:
            found[case.name] = design.replace(case.values)
        except InputError as error:
            raise in_case(error, design, case.name) from None
    return found


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
    found = uncertain_parameters(design)
    if design.tables.uncertain != baseline.tables.uncertain or (
        [p.path for p in found] != [p.path for p in expected]
    ):
        raise InputError(
            f"the first case draws {', '.join(p.path for p in expected)}; every case must draw "
            "the same: name them in [uncertain] of the design",
            "uncertain",
        )
    for drawn in (p for p in found if not p.own_mean):
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
