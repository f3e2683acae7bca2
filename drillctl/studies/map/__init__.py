"""J1 over parameters of a design: its map, regions and audit."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drillctl import plots, units
from drillctl.store.tables import Column, Table, percent, place
from drillctl.studies.base import (
    Check,
    Option,
    Picture,
    Recipe,
    Run,
    Section,
    Study,
    audit_tables,
    audited,
    doubted,
    levels_any_run_keeps,
    mapped_in_batch,
)

if TYPE_CHECKING:
    from drillctl.design import Design
    from drillctl.ensemble.sweeps import Sweep


def computed(design: Design, run: Run) -> Sweep:
    """The map, from the blocks that its folder may hold."""
    from drillctl.ensemble.storing import Folder
    from drillctl.ensemble.sweeps import kept_measures, sweep

    kept = kept_measures(run.options["measure"] or None, "--measure")
    store = None if run.folder is None else Folder(run.folder)
    return sweep(design, progress=run.progress, store=store, measures=kept)


def tables(result: Sweep) -> Iterator[Table]:
    """Bounds of the regions."""
    columns = [
        Column("level", "J1 at or under", "s"), Column("cells"),
        Column("area_fraction", "share of the map", percent=True),
    ]  # fmt: skip
    for axis in result.axes:
        columns.append(Column(f"{axis.path} min", f"{axis.path} from", axis.unit))
        columns.append(Column(f"{axis.path} max", "to", axis.unit))
    rows: list[list[Any]] = []
    for level, region in result.regions.items():
        ends = [end for axis in result.axes for end in region.bounds.get(axis.path, (None, None))]
        rows.append([level, region.cells, region.area_fraction, *ends])
    title = "regions of the map, bounds between the centres of their outermost cells"
    yield Table("regions", title, tuple(columns), rows)
    counts = result.summary()["statuses"]
    yield Table(
        "statuses", "status at the end of the runs",
        (Column("status"), Column("cells"), Column("share", percent=True)),
        [[name.replace("_", " "), n, n / result.j1.size] for name, n in counts.items()],
        shown=False,
    )  # fmt: skip
    from drillctl.ensemble.grid import place_of

    unit_of = {axis.path: axis.unit for axis in result.axes}
    yield from audit_tables(result.audit, lambda cell: place(place_of(result.axes, cell), unit_of))


def pictures(result: Sweep) -> Iterator[Picture]:
    """The map, and responses at some of its cells."""
    axes, minimum = result.axes, result.minimum
    if len(axes) > 2:
        return
    draw = plots.stability_map if len(axes) == 2 else plots.sweep_line
    alt = f"Map of J1 over {' and '.join(axis.path for axis in axes)}."
    if minimum is not None:
        alt += f" Least J1 {minimum[0]:.4g} s."
    for level, region in result.regions.items():
        alt += f" {region.cells} cells at or under {level:g} s."
    marked = [
        *(["regions"] if any(region.cells for region in result.regions.values()) else []),
        *(["minimum"] if minimum is not None else []),
        *(["audited cells"] if len(result.audit.cells) else []),
    ]
    yield Picture(
        "map", f"J1 over the map{', with ' * bool(marked)}{', '.join(marked)}.", alt,
        lambda system: draw(result, system=system), paper=len(axes) == 2,
    )  # fmt: skip
    if len(axes) == 2 and minimum is not None:
        yield Picture(
            "responses", "Speeds of bit and top drive at cells of growing J1.",
            "Time responses at the best cell and at cells of growing J1.",
            lambda system: _responses(result, system),
        )  # fmt: skip


def _responses(result: Sweep, system: units.System) -> Any:
    from drillctl.ensemble.sweeps import responses

    paths = [axis.path for axis in result.axes]
    return plots.time_response(responses(result), paths=paths, system=system)


def remarks(result: Sweep, system: units.System) -> Iterator[str]:
    """Minimum, audit and time."""
    if result.minimum is not None:
        value, at = result.minimum
        where = place(at, {axis.path: axis.unit for axis in result.axes})
        yield f"minimum J1 {value:.3f} s at {units.told(where, system)}"
    for name, one in result.over_yield.items():
        yield (
            f"peak torque in {name}: up to {percent(one['largest_share'])} of its torsional yield, "
            f"above it in {one['cells']} cells"
        )
    yield result.audit.sentence("cells")
    yield (
        f"{result.j1.size} cells: {result.seconds:.3f} s in the lanes, "
        f"{result.total_seconds:.1f} s in all"
    )


def checks(result: Sweep) -> Iterator[Check]:
    """Whether the reference solver agrees."""
    yield from audited(result.audit, "the map", "cells")


def notes(result: Sweep) -> Iterator[str]:
    """What deserves attention."""
    if result.minimum is None:
        yield "warning: no cell gives a finite answer; see the statuses"
    yield from levels_any_run_keeps(result.design, result.levels)
    yield from doubted(result.audit)


def files(result: Sweep, folder: Path, system: units.System) -> None:
    """Every cell with its measures."""
    from drillctl.ensemble.sweeps import write_cells

    write_cells(result, folder / "map.csv", system)


def check(design: Design) -> None:
    """Refuse (`InputError`) axes that do not fit the design; defaults need not fit every law."""
    if "axes" in design.tree.get("map", {}):
        from drillctl.ensemble.grid import axes_of

        axes_of(design)


STUDY = Study(
    module=__name__,
    name="map",
    help="Map J1 over parameters, with regions and an audit",
    group="Simulate",
    options=(
        Option(
            "audit", int, "Audit this many cells with the reference solver", sets="map.audit_cells"
        ),
        Option(
            "measure", list[str], "Keep only J1 and this measure; repeatable", metavar="NAME"
        ),
    ),
    axes=True,
    python="stability_map",
    call="drillctl.ensemble.sweeps:stability_map",
    resumes=True,
    recipes=(Recipe("map", "the J1 map", mapped_in_batch, order=40),),
    sections=(
        Section("map", "J1 over the map", ("map", "cells"), order=50,
                shows=("map", "regions", "statuses", "verge")),
    ),
)  # fmt: skip
