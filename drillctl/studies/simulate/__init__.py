"""One run of a design: time response, measures, energy balance."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from drillctl import plots, units
from drillctl.simulation.measures import AXIAL_MEASURES, MEASURES
from drillctl.store.tables import (
    Column,
    Quantity,
    Table,
    Unit,
    in_columns,
    number,
    percent,
    write_columns,
)
from drillctl.studies.base import Check, Option, Picture, Recipe, Requested, Run, Study, in_batch

if TYPE_CHECKING:
    from drillctl.design import Design
    from drillctl.simulation.run import Simulation

HIDDEN = (
    "j1_rate",
    "work_at_bit",
    "work_at_wall",
    "time_outside_table",
)  # measures that are in the summary alone
OF_LIMITS = ("time_at_torque_limit", "time_at_power_limit", "time_over_continuous")
TOLD_BY = dict.fromkeys((*OF_LIMITS, "peak_drive_power"), "peak_drive_power") | dict.fromkeys(
    AXIAL_MEASURES, "rate_of_penetration"
)
"""Which measure tells, by being undefined, that others mean nothing: an ideal drive has no limits
and no power of its own, most bits have no axial motion."""
BALANCED = 1e-6  # largest relative residual of a balanced run
FREE = 20.0  # interval (s) between the samples of a run that is kept for its measures alone
FINE = 0.05  # and of one that is drawn (s)


def computed(design: Design, run: Run) -> Simulation:
    """The run, by the design's engine."""
    from drillctl.simulation import simulate

    return simulate(design, interval=run.options.get("interval", 0.01), progress=run.progress)


def tables(result: Simulation) -> Iterator[Table]:
    """Measures, status and engine."""
    rows: list[list[Any]] = [
        [one.label, Quantity(getattr(result.measures, one.name), one.unit), Unit(one.unit)]
        for one in MEASURES.values()
        # Some are measured of compared cases alone.
        if hasattr(result.measures, one.name) and one.name not in HIDDEN
        if getattr(result.measures, TOLD_BY.get(one.name, "j1")) is not None
    ]
    if result.share_of_yield is not None:
        rows.append(["peak pipe torque over torsional yield", percent(result.share_of_yield), ""])
    if len(result.yields) > 1:
        rows += [[f"of {name}", percent(one["share"]), ""] for name, one in result.yields.items()]
    if result.energy is not None:
        residual = f"{result.energy.relative_residual:.0e} of the work"
        rows.append(["energy residual", residual, ""])
    rows.append(["status", result.status.replace("_", " "), ""])
    engine = result.engine
    if result.step is not None:
        engine = f"{engine} engine, step {result.step * 1e3:g} ms, {result.modes} modes"
    else:
        engine = f"{engine} solver, {result.method}"
    columns = (Column("measure"), Column("value"), Column("unit", hidden=True))
    yield Table("measures", f"one run ({engine})", columns, rows)
    if result.energy is not None:
        terms = (("work of the drive", "drive"), ("work on the rock", "bit"),
                 ("dissipated by damping", "damping"),
                 ("dissipated along the wall", "wall"),
                 ("change of stored energy", "stored"))  # fmt: skip
        work: list[list[Any]] = [[name, getattr(result.energy, key)] for name, key in terms]
        energy = Column("energy", unit="J", digits=6)
        title = "energy balance of the run"
        yield Table("energy", title, (Column("term"), energy), work, shown=False)


def checks(result: Simulation) -> Iterator[Check]:
    """Whether the energy balances."""
    if result.energy is not None:
        residual = result.energy.relative_residual
        detail = f"relative residual {number(residual, 2)}"
        yield Check("Does the energy of the run balance?", residual < BALANCED, detail)


def pictures(result: Simulation) -> Iterator[Picture]:
    """Speeds, torques and weight over time."""
    j1 = "undefined" if result.measures.j1 is None else f"{result.measures.j1:.4g} s"
    yield Picture(
        "time-response", "Speeds of bit and top drive over time; grey where the bit stands still.",
        f"Time response: {result.status.replace('_', ' ')}, J1 {j1}.",
        lambda system: plots.time_response(result, system=system),
    )  # fmt: skip

    if result.wall_stuck is not None:
        yield Picture(
            "sticking", "Which parts of the string the wall holds, over depth and time.",
            "Depth against time: dark where the string stands still; fronts of slip run along it.",
            lambda system: plots.sticking(result, system=system),
        )  # fmt: skip


def files(result: Simulation, folder: Path, system: units.System) -> None:
    """Every signal over time."""
    from drillctl.simulation.run import OF_WALL, SIGNALS

    about = SIGNALS | OF_WALL
    figures = [("time", result.time, "s")]
    figures += [(name, values, about[name][0]) for name, values in result.signals.items()]
    write_columns(folder / "signals.csv", in_columns(figures, system))


def summary(result: Simulation) -> dict[str, Any]:
    """The result's own, and the share of the torsional yield where the grade is known."""
    own: dict[str, Any] = result.summary()
    if result.share_of_yield is not None:
        own["share_of_torsional_yield"] = result.share_of_yield
    return own


def _cell(which: str, request: Requested) -> Design:
    """The design of the best or of a bad cell of the map."""
    at = request.summary("cells")[which]
    values = {path: units.SI(value) for path, value in at.items()}
    return request.design.replace({**values, "simulation.engine": "batch"})


def _no_such_cell(which: str, request: Requested) -> str:
    return "" if request.summary("cells")[which] else f"the map has no {which} cell"


def _finer_mesh(parts: int, request: Requested) -> Design:
    """The design by the batch engine with its elements divided."""
    design = request.design.replace({"simulation.engine": "batch"})
    if parts == 1:
        return design
    counts = {part.name: part.elements for part in design.string.parts.sections}
    counts |= {  # of equal pieces with something at their ends: of each
        table.name: counts[table.pieces[0].name]
        for table in design.tables.drillstring.sections
        if table.pieces[0].name in counts
    }
    return design.replace({
        f"drillstring.sections.{table.name}.elements": parts * counts[table.name]
        for table in design.tables.drillstring.sections
        if table.stiffness is None and table.name in counts  # not lumped into a neighbour
    })  # fmt: skip


def _finer_step(parts: int, request: Requested) -> Design:
    """The design by the batch engine with its step divided."""
    step = units.SI(request.summary("mesh-1")["step"] / parts)
    return request.design.replace({"simulation.engine": "batch", "simulation.step": step})


def _without_mesh(request: Requested) -> str:
    if all(table.stiffness is not None for table in request.design.tables.drillstring.sections):
        return "a lumped string has no mesh"
    return in_batch(request)


def _recipes() -> Iterator[Recipe]:
    """The run at the current setting, at cells of the map, with finer steps and meshes."""
    drawn, numbers = {"interval": FINE}, {"interval": FREE}
    yield Recipe("simulate", "the run at the current setting", options=drawn, order=20)
    for order, which, title in ((60, "best", "the best cell"), (70, "bad", "a bad cell")):
        yield Recipe(
            which, f"the run at {title}", partial(_no_such_cell, which), partial(_cell, which),
            ("cells",), drawn, order=order,
        )  # fmt: skip
    for order, parts, how, missing in (
        (140, 1, "by the batch engine", in_batch),
        (141, 2, "with twice the elements", _without_mesh),
        (142, 4, "with four times the elements", _without_mesh),
    ):
        yield Recipe(
            f"mesh-{parts}", f"the run {how}", missing, partial(_finer_mesh, parts),
            options=numbers, order=order,
        )  # fmt: skip
    for order, parts, title in ((143, 2, "half the step"), (144, 4, "a quarter of the step")):
        yield Recipe(
            f"step-{parts}", f"the run with {title}", in_batch, partial(_finer_step, parts),
            ("mesh-1",), numbers, order=order,
        )  # fmt: skip


STUDY = Study(
    module=__name__,
    name="simulate",
    help="Simulate one run: time response, measures, energy",
    group="Simulate",
    options=(
        Option(
            "engine", Literal["reference", "batch"], "Locate events, or take fixed steps",
            sets="simulation.engine",
        ),
    ),
    python="simulate",
    call="drillctl.simulation:simulate",
    recipes=tuple(_recipes()),
)  # fmt: skip
