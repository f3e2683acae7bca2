"""Commands on files: list shipped ones, print, check or start a design, explore it, report it."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from drillctl.cli import console
from drillctl.cli.options import (
    Common,
    Debug,
    DesignName,
    Json,
    Sets,
    Threads,
    Units,
    command_of,
    common_options,
    loaded,
    warn,
    with_warnings,
)
from drillctl.errors import InputError
from drillctl.studies.base import Option
from drillctl.units import DIAMETERS, displayed, full, told, unit_name

if TYPE_CHECKING:
    from drillctl.design import Design
    from drillctl.rig.drillstring.catalogue import Homogenised


def _listed(kind: Literal["models", "designs"], as_json: bool) -> None:
    from drillctl import catalog

    entries = catalog.entries(kind)
    if as_json:
        keys = [{"name": e.name, "title": e.title, "path": str(e.path)} for e in entries]
        console.emit({kind: keys})
    else:
        console.table(kind, ["name", "title"], [[e.name, e.title] for e in entries])


def models(json: Json = False, debug: Debug = False) -> None:
    """List the shipped models (rigs)."""
    _listed("models", json)


def designs(json: Json = False, debug: Debug = False) -> None:
    """List the shipped designs (cases to run)."""
    _listed("designs", json)


def show(
    design: DesignName,
    sets: Sets = None,
    json: Json = False,
    units: Units = None,
    debug: Debug = False,
) -> None:
    """Print a design with its model and every default."""
    from drillctl.design import to_toml
    from drillctl.design.reading import to_tree

    loaded_design = loaded(design, sets)
    system = units or loaded_design.tables.units or "si"
    if json:
        found = {
            "mesh": [one.summary() for one in loaded_design.mesh],
            "tool_joints": {name: vars(one) for name, one in _joints(loaded_design)},
        }
        console.emit(with_warnings(to_tree(loaded_design.tables) | found, loaded_design))
    else:
        console.line(to_toml(loaded_design).rstrip())
        for text in _derived(loaded_design):
            console.line(told(text, system))
    warn(loaded_design, system)


def _derived(design: Design) -> Iterator[str]:
    """What follows from a design, as comments; quantities in full."""
    yield from _rock(design)
    yield from _drive(design)
    yield "\n# Elements of the sections:"
    for one in design.mesh:
        count = f"{one.elements} of {full(one.length, 'm', 4)}, " if one.length > 0.0 else ""
        yield f"# {one.name}: {count}{one.said}"
    for name, factors in _joints(design):
        yield (
            f"# tool joints of {name}: inertia of the body x {factors.inertia:.4f}, "
            f"stiffness x {factors.stiffness:.4f}"
        )
    yield from _mud(design)


def _rock(design: Design) -> Iterator[str]:
    """The rock as coefficients and in drillers' numbers."""
    from drillctl.rig.bit_rock import NavarroLopezSuarez
    from drillctl.rig.bit_rock.aggressiveness import EXAMPLE_BIT, drillers_numbers

    law, own = design.bit_rock, getattr(design.tables.bit_rock, "bit_diameter", None)
    whose = "" if own else " (an example: the design gives no size)"
    if not isinstance(law, NavarroLopezSuarez) or not (law.a2 > 0.0 and law.beta > 0.0):
        return
    size = EXAMPLE_BIT if own is None else own
    numbers = drillers_numbers(law, size)
    a1, a2, beta = full(law.a1, "m", 4), full(law.a2, "m", 4), full(law.beta, "s/rad", 4)
    yield f"\n# Rock: a1 = {a1}, a2 = {a2}, beta = {beta}"
    yield (
        f"# as a bit of {full(size, DIAMETERS)}{whose}: aggressiveness "
        f"{numbers.aggressiveness:.4g}, high-speed ratio "
        f"{numbers.high_speed_ratio:.4g}, speed scale {full(numbers.speed_scale, 'rad/s')}"
    )


def _drive(design: Design) -> Iterator[str]:
    """A drive behind a gear as it counts at the pipe."""
    drive = design.tables.top_drive
    if drive.gear_ratio is None:
        return
    limits = drive.limits
    told = (
        ("torque to", limits.torque, "N*m"),
        ("power to", limits.power, "W"),
        ("speed to", limits.speed, "rad/s"),
        ("continuous torque", limits.continuous, "N*m"),
    )
    known = [f", {name} {full(value, unit)}" for name, value, unit in told if math.isfinite(value)]
    yield f"\n# Drive at the pipe: inertia {full(drive.at_pipe, 'kg*m^2')}{''.join(known)}"


def _mud(design: Design) -> Iterator[str]:
    """Drag of the mud on each section, and whether its flow is laminar there."""
    from drillctl.design.parts import clearances
    from drillctl.rig.drillstring.mud import LAMINAR, jointed_drag, taylor_number

    well = design.tables.well
    if well.mud_viscosity is None:
        return
    for _, one, length, hole in clearances(design.tables):
        outer = one.diameters[0] if one.diameters else 0.0
        drag = jointed_drag(well.mud_viscosity, outer, one.spacing, one.joint, hole)
        hole_, drag_ = full(hole, DIAMETERS), full(drag, "N*s/rad", 4)
        text = f"# mud at {one.name}, {full(length, 'm', 4)} in {hole_}: {drag_}"
        if well.mud_density is not None and drag > 0.0:
            number = taylor_number(well.mud_viscosity, well.mud_density, outer, hole, design.speed)
            less = "" if number < LAMINAR else ", so that vortices take more"
            text += f", Taylor number {number:.3g} (laminar under {LAMINAR:g}){less}"
        yield text


def _joints(design: Design) -> list[tuple[str, Homogenised]]:
    """Sections with tool joints, and what these make of the body."""
    from drillctl.design.parts import joint_factors

    made = ((one.name, joint_factors(one)) for one in design.tables.drillstring.sections)
    return [(name, factors) for name, factors in made if factors is not None]


COLUMNS = (
    ("od", "outer_diameter", DIAMETERS, ".5g"),
    ("id", "inner_diameter", DIAMETERS, ".5g"),
    ("mass", "mass_per_length", "kg/m", ".1f"),
    ("with joints", "mass_per_length_with_joints", "kg/m", ".1f"),
    ("inertia x", "inertia_factor", "1", ".3f"),
    ("stiffness x", "stiffness_factor", "1", ".3f"),
    ("yield", "yield_torque", "N*m", ".1f"),
)
"""Head, key in JSON, SI unit and digits of what `catalog` prints."""


def catalog(json: Json = False, units: Units = None, debug: Debug = False) -> None:
    """List pipes, collars and tools known by name."""
    from drillctl.rig.drillstring import GRADES, PIPES
    from drillctl.rig.drillstring.catalogue import CATALOGUE, summary

    rows = [{"name": name} | summary(pipe) for name, pipe in PIPES.items()]
    if json:
        console.emit({"components": rows, "grades": GRADES})
        return
    system = units or "si"
    heads = [f"{head} {unit_name(unit, system)}".rstrip() for head, _, unit, _ in COLUMNS]
    cells = [
        [
            "" if row[key] is None else f"{displayed(row[key], unit, system)[0]:{form}}"
            for _, key, unit, form in COLUMNS
        ]
        for row in rows
    ]
    console.table(
        "components; with tool joints of the highest grade listed; yield of S-135",
        ["name", *heads],
        [[row["name"], *texts] for row, texts in zip(rows, cells, strict=True)],
    )
    console.line(f"Sources and what was checked of each: {CATALOGUE}")
    console.line(f"Grades: {', '.join(GRADES)}")


def validate(
    design: DesignName, sets: Sets = None, json: Json = False, debug: Debug = False
) -> None:
    """Check keys, units and ranges, axes, draws and cases."""
    from drillctl.studies.base import studies

    loaded_design = loaded(design, sets)
    for study in studies().values():
        study.check(loaded_design)
    if json:
        found = {"valid": True, "name": loaded_design.name, "path": loaded_design.origin}
        console.emit(with_warnings(found, loaded_design))
    else:
        console.line(f"{loaded_design.origin}: valid")
    warn(loaded_design)


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name or path of the new file.")],
    tally: Annotated[
        str | None, typer.Option(metavar="FILE", help="Take the string from a CSV or .xlsx tally.")
    ] = None,
    begins: Annotated[
        str | None,
        typer.Option("--from", metavar="top|bit", help="End that the tally's first line is at."),
    ] = None,
    like: Annotated[
        str | None, typer.Option(metavar="NAME", help="Begin with a shipped model or design.")
    ] = None,
    debug: Debug = False,
) -> None:
    """Write a commented design file to start from."""
    from drillctl.design.reading import load, write_starter
    from drillctl.design.tally import read
    from drillctl.design.well import mass_in_air
    from drillctl.rig.well.soft_string import GRAVITY

    if tally is None:
        if begins is not None:
            raise InputError("is of a --tally, and there is none", "--from")
        console.line(f"written: {write_starter(name, like=like)}")
        return
    if like is not None:
        raise InputError("is not allowed with --tally: add the tally to the new file", "--like")
    made = read(tally, begins, Path(), "--tally")
    path = write_starter(name, made)
    console.table(f"columns of {made.place}", ["column", "read as", "unit"], list(made.columns))
    for note in made.notes:
        console.line(note)
    design = load(path)
    sections, system = design.tables.drillstring.sections, design.tables.units or "si"
    weight = full(GRAVITY * mass_in_air(design.tables), "N")
    console.line(
        f"{len(sections)} sections from the top, {sections[0].name}, to {sections[-1].name}: "
        + told(f"{full(sum(one.span for one in sections), 'm')} in all, {weight} in air", system)
    )
    console.line(f"written: {path}")


def explore(
    design: DesignName,
    sets: Sets = None,
    port: Annotated[
        int | None, typer.Option(min=1, max=65535, help="Use this port, not a random one.")
    ] = None,
    browser: Annotated[bool, typer.Option(help="Open a page in the browser.")] = True,
    threads: Threads = None,
    units: Units = None,
    debug: Debug = False,
) -> None:
    """Turn gains on a local page and watch the region move."""
    try:
        from drillctl.explorer.server import serve
    except ImportError:
        raise InputError('needs Tornado: pip install "drillctl[explore]"', "explore") from None
    from drillctl.design import parse_setting

    common_options(threads=threads)
    set_design = loaded(design, sets)  # refuses impossible values in words of the command line
    system = units or set_design.tables.units or "si"
    warn(set_design, system)
    settings = dict(parse_setting(text) for text in sets or [])
    serve(loaded(design, None), settings, system, port, browser, console.line)


OPTIONS = (
    Option("profile", Literal["quick", "standard", "full"], "Set how much to compute.", "quick"),
    Option("sections", str, "Write only these sections.", metavar="NAME,NAME"),
    Option("title", str, "Set the title of the report."),
    Option("format", list[str], "Write this format; repeatable.", metavar="html|pdf|md"),
)


def _report(design: Design, given: dict[str, Any], common: Common) -> None:
    from drillctl.reporting import report as write_report

    sections = given["sections"]
    with console.progress() as bar, console.library_output_on_stderr():
        result = write_report(
            design,
            common.out,
            profile=given["profile"],
            sections=None if sections is None else sections.split(","),
            title=given["title"],
            formats=given["format"] or ["html"],
            system=common.units,
            progress=bar,
            processes=os.cpu_count() or 1,
        )
    for problem in result.problems:
        console.note(f"warning: {problem}")
    for reason in result.unwritten.values():
        console.note(f"warning: {reason}")
    if common.json:
        console.emit(with_warnings(result.summary(), design))
        console.note(f"results: {result.folder}")
    else:
        console.line(f"the current setting {result.content['verdict']['current_setting']}")
        for path in result.files.values():
            console.line(f"report: {path}")
        console.line(f"results: {result.folder}")
    warn(design, common.units)
    if result.interrupted:
        raise typer.Exit(130)
    if result.problems or result.unwritten:
        raise typer.Exit(1)


report = command_of(
    "report", "Full report: verdict, figures, accuracy audit", OPTIONS, _report, system="field"
)
