"""What smoothing the friction does to a map of J1."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from drillctl import plots
from drillctl.store.tables import Column, Table
from drillctl.studies.base import Picture, Study

if TYPE_CHECKING:
    from drillctl.studies.regularisation.compute import Regularisation


def tables(result: Regularisation) -> Iterator[Table]:
    """What each width does to J1 and to the regions."""
    summary = result.summary()
    exact, total = summary["set_valued_cells"], result.j1.size
    columns = [
        Column("width", "tanh over", "rad/s"),
        Column("median_shift", "median change of J1", percent=True, digits=3),
        Column("worst_shift", "largest", percent=True, digits=3),
    ]
    for level in exact:
        columns.append(Column(f"cells_{level}", f"cells at or under {level} s"))
        columns.append(Column(f"changed_{level}", "of these or others changed"))
    rows: list[list[Any]] = [
        ["set-valued", None, None, *(x for level in exact for x in (exact[level], None))]
    ]
    for one in summary["widths"]:
        counts = [x for level in exact for x in (one["cells"][level], one["changed_side"][level])]
        rows.append([one["width"], one["median_shift"], one["worst_shift"], *counts])
    title = f"J1 under friction smoothed by tanh, {total} cells"
    yield Table("regularisation", title, tuple(columns), rows)


def pictures(result: Regularisation) -> Iterator[Picture]:
    """Shift of J1 against the width."""
    yield Picture(
        "regularisation", "Change of J1 by smoothing the friction, against the width of tanh.",
        "Median and largest change of J1 over the cells of the map against the width.",
        lambda system: plots.regularisation(result, system=system),
    )  # fmt: skip


STUDY = Study(
    module=__name__,
    name="regularisation",
    help="Compare the map with the map under smoothed friction",
    group="Simulate",
    axes=True,
    python="regularisation",
)
