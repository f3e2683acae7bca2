"""The rig: a drawing by depth and tables of its parts; the glossary."""

from __future__ import annotations

from drillctl.design.tables import SectionTable
from drillctl.reporting.blocks import Block, Figure, Table, Text
from drillctl.reporting.gather import Gathered
from drillctl.reporting.rig_drawing import rig_drawing
from drillctl.reporting.words import NOTHING, Words, number
from drillctl.rig.drillstring import PIPES


def build(gathered: Gathered) -> tuple[Block, ...]:
    """Drawing, sections, bodies, source."""
    design, words = gathered.design, gathered.words
    parts = design.string.parts.sections
    tables = design.tables.drillstring.sections
    rows = tuple(
        (
            table.name, _kind(table),
            words.quantity(table.length, "m") if table.length else NOTHING,
            words.diameter(_diameters(table)[0]), words.diameter(_diameters(table)[1]),
            f"{number(part.stiffness)}", f"{number(part.inertia + part.end_inertia)}",
            str(part.elements),
        )
        for table, part in zip(tables, parts, strict=True)
    )  # fmt: skip
    heads = (
        "section", "given as", "length", "outer diameter", "inner diameter",
        "stiffness (N m/rad)", "inertia (kg m²)", "elements",
    )  # fmt: skip
    bodies = (
        ("top drive", number(design.tables.top_drive.inertia),
         number(design.tables.top_drive.damping)),
        ("BHA with bit", number(design.tables.bha.inertia), number(design.tables.bha.damping)),
    )  # fmt: skip
    blocks: list[Block] = [
        Figure(
            "rig", "The rig: sections by depth; widths are not to scale.",
            _alt(gathered), lambda: rig_drawing(design, words),
        ),
        Table("sections", "Sections from top to bottom", heads, rows),
        Table("bodies", "Bodies at the ends", ("body", "inertia (kg m²)",
              "damping to ground (N m s/rad)"), bodies),
        Text(f"Source: {design.tables.source}" if design.tables.source else "No source given."),
    ]  # fmt: skip
    if design.tables.notes:
        blocks.append(Text(f"Notes: {design.tables.notes}"))
    return tuple(blocks)


def _kind(table: SectionTable) -> str:
    if table.pipe is not None:
        return table.pipe
    if table.stiffness is not None:
        return "lumped spring"
    return "diameters" if table.outer_diameter is not None else "polar moment"


def _diameters(table: SectionTable) -> tuple[float | None, float | None]:
    if table.pipe is not None:
        return PIPES[table.pipe].outer_diameter, PIPES[table.pipe].inner_diameter
    return table.outer_diameter, table.inner_diameter


def _alt(gathered: Gathered) -> str:
    words: Words = gathered.words
    names = [
        f"{table.name} {words.quantity(table.length, 'm')}" if table.length else table.name
        for table in gathered.design.tables.drillstring.sections
    ]
    return f"Drawing of the drillstring from top drive to bit: {', '.join(names)}."


def entries(words: Words) -> tuple[tuple[str, str, str], ...]:
    """Symbol or word, meaning and unit."""
    speed, torque, force = (words.unit(unit) for unit in ("rad/s", "N*m", "N"))
    slope, length = words.unit("N*m*s/rad"), words.unit("m")
    return (
        ("J1", "integral of |bit speed − set speed| / set speed over the run; small is good", "s"),
        ("level", "value of J1 that bounds a region", "s"),
        ("region", "cells of the map with J1 at or under a level", "cells, %"),
        ("Kp", "proportional gain of the top drive: torque per speed error", "N m s"),
        ("Ki", "integral gain: torque per integral of the speed error", "N m"),
        ("ω", "speed; set speed: the speed that the drive controls to", speed),
        ("WOB", "weight on bit", force),
        ("bit torque", "of the rock on the bit, positive when it brakes", torque),
        ("top torque", "of the drive", torque),
        ("pipe torque", "in the uppermost element, positive when the top leads", torque),
        ("twist", "top angle minus bit angle", "rad"),
        ("D = −dT/dω", "falling slope of the bit torque at the operating speed", slope),
        ("D*", "slope margin: the falling slope at which steady drilling becomes unstable", slope),
        ("S", "sensitivity at the top torque; a high peak means little margin", "1"),
        ("disk margin", "simultaneous change of gain and phase at the top torque that the loop "
         "tolerates", "dB, °"),
        ("ζ", "impedance of the pipe, J √(G ρ): torque per speed of a travelling wave", slope),
        ("reflection", "share of the amplitude of a wave that the drive reflects", "1"),
        ("a1, a2, β", "friction: torque = [a1 + (a2 − a1) exp(−β |ω|)] x weight on bit",
         "m, m, s/rad"),
        ("set-valued", "a bit at rest takes any torque up to the static one", ""),
        ("stick-slip index", "(max − min) / (2 mean) of the bit speed over the last 20 s", "1"),
        ("settling time", "time after which the bit speed stays within 2 % of the set speed", "s"),
        ("ROP proxy", "mean of weight x |bit speed|, over nominal weight x set speed", "1"),
        ("work per turn", "work on the rock over the turns of the bit", "J"),
        ("cell", "one point of a map", ""),
        ("draw, realization", "one set of values of the uncertain parameters", ""),
        ("P(J1 ≤ level)", "share of the draws at or below the level", "%"),
        ("95 % interval", "of an estimate: Clopper-Pearson for shares, bootstrap for areas and "
         "means", ""),
        ("q95, cvar95", "95 % quantile of J1; mean of the worst 5 %", "s"),
        ("Sobol index", "share of the variance of J1 that a parameter explains alone (first) or "
         "with interactions (total)", "1"),
        ("status", "end of a run: ok (settled), sticking, stalled, not settled, censored "
         "(stopped early), failed", ""),
        ("reconstructed", "not printed in the source; chosen to reproduce its statements", ""),
        ("reference solver", "locates every stick and release; slow and accurate", ""),
        ("batch engine", "fixed step, thousands of runs at once; audited by the reference solver",
         ""),
        ("depth", "measured along the string", length),
    )  # fmt: skip


def build_glossary(gathered: Gathered) -> tuple[Block, ...]:
    """One table."""
    heads = ("symbol or term", "meaning", "unit")
    return (Table("glossary", "Symbols and terms", heads, entries(gathered.words)),)
