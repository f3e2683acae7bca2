"""Which of the uncertain parameters matters: Sobol indices."""

from __future__ import annotations

from drillctl import plots
from drillctl.reporting.blocks import Block, Figure, Table
from drillctl.reporting.gather import Gathered, NotThereError
from drillctl.reporting.words import NOTHING, number


def build(gathered: Gathered) -> tuple[Block, ...]:
    """Indices with their errors."""
    study = gathered.need("uncertainty")
    if "sensitivity" not in study.summary:
        if gathered.asked.tables.uncertainty.sensitivity is None:
            raise NotThereError("the design asks for no indices ([uncertainty.sensitivity])")
        raise NotThereError("indices are computed with --profile standard or full")
    found = study.result.sensitivity
    rows = []
    for one in found.indices:
        for k, path in enumerate(found.parameters):
            rows.append((
                one.of, path, _index(one.first[k], one.first_error[k]),
                _index(one.total[k], one.total_error[k]),
            ))  # fmt: skip
    caption = f"Sobol indices from {found.samples} points (95 % interval)"
    heads = ("of", "parameter", "first index", "total index")
    return (
        Figure(
            "sensitivity-indices", "First and total Sobol indices with their intervals.",
            "Bars of first and total index for each uncertain parameter.",
            lambda: plots.sensitivity_bars(study.result), ("uncertainty",),
        ),
        Table("sensitivity", caption, heads, tuple(rows)),
    )  # fmt: skip


def _index(value: float, error: float) -> str:
    if value != value:
        return NOTHING
    return number(value, 3) if error != error else f"{number(value, 3)} ± {number(error, 2)}"
