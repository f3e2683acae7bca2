"""A string in its well: what the tables of a design say of path, weight and friction."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Mapping
from functools import lru_cache
from itertools import pairwise
from pathlib import Path as File
from typing import Any

import numpy as np

from drillctl import catalog, units
from drillctl.arrays import Array
from drillctl.design import parts
from drillctl.design.tables import DesignTables, SectionTable
from drillctl.design.tally_heads import is_unit_of, rows_of
from drillctl.errors import InputError, shown
from drillctl.rig.drillstring import PIPES, Drillstring, polar_moment
from drillctl.rig.drillstring.catalogue import STEEL
from drillctl.rig.well.soft_string import Line, Run, lay
from drillctl.rig.well.survey import Path, path_of
from drillctl.rig.well.wall import Wall, choose_nodes, lumped

YOUNGS_MODULUS = 206.8e9  # of steel (Pa), where a design gives none

# The survey of a file.

_HEADS = (
    ("measured depth", units.LENGTH, ("md", "measured depth", "depth")),
    ("inclination", units.ANGLE, ("inc", "incl", "inclination", "dip")),
    ("azimuth", units.ANGLE, ("az", "azi", "azim", "azimuth", "direction")),
)


def with_survey(tree: dict[str, Any], folder: File) -> dict[str, Any]:
    """A design's tree with the file of a survey, or its lines, replaced by the stations."""
    well = tree.get("well")
    if not isinstance(well, Mapping) or not isinstance(well.get("survey"), str):
        return tree
    return {**tree, "well": {**well, "survey": _stations(well["survey"], folder)}}


def _stations(source: str, folder: File) -> list[list[str]]:
    where = "well.survey"
    if "\n" in source.strip():
        place, text = where, source.lstrip("\n")
    else:
        path = folder / File(source).expanduser()
        place, text = str(path), catalog.read(path, f"{where}: {path}")
    try:
        rows = [row for row in rows_of(text) if any(row)]
    except csv.Error as error:
        raise InputError(str(error), place) from None
    if len(rows) < 2:
        raise InputError("holds no stations below its heads", place)
    columns = [_column(rows[0], name, kind, words, place) for name, kind, words in _HEADS]
    if all(column is not None and not column[1] for column in columns):
        below = rows.pop(1)  # of units, where heads have none
        columns = [(k, below[k].strip("()[] ")) for k, _ in columns]
    for (name, kind, _), (_, unit) in zip(_HEADS, columns, strict=True):
        if not is_unit_of(unit, kind):
            raise InputError(
                f"{name} in {shown(unit)}: its head or the line below needs a unit, "
                f"{' or '.join(kind.examples)}", place,
            )  # fmt: skip
    return [
        [f"{_cell(row, k, number, place)} {unit}" for k, unit in columns]
        for number, row in enumerate(rows[1:], 2)
    ]


def _cell(row: list[str], column: int, number: int, place: str) -> str:
    if column >= len(row) or not row[column]:
        raise InputError(f"line {number} has no column {column + 1}", place)
    return row[column]


def _column(
    heads: list[str], name: str, kind: units.Kind, words: tuple[str, ...], place: str
) -> tuple[int, str]:
    """Number and unit of a column by its head, as `Inc (deg)` or `MD [m]`."""
    for number, head in enumerate(heads):
        text, _, unit = head.lower().replace("[", "(").partition("(")
        plain = text.replace("_", " ").replace(".", " ").strip()
        word, _, last = plain.rpartition(" ")
        if not unit and word in words and is_unit_of(last, kind):
            return number, last
        if plain in words:
            return number, unit.strip(")] ")
    raise InputError(f"no column is the {name}; there are {', '.join(map(repr, heads))}", place)


# The string in the well.


def path(tables: DesignTables) -> Path:
    """The well; a vertical one without a survey."""
    return path_of(tables.well.survey or ((0.0, 0.0, 0.0),))


def runs(tables: DesignTables) -> tuple[Run, ...]:
    """Sections from top to bottom, cut where a hole ends.

    For a string of lumped springs, which has no length, stands a metre without weight.
    """
    return tuple(_runs(tables)) or (Run("no length", 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0),)


def _runs(tables: DesignTables) -> Iterator[Run]:
    ends = [math.inf if hole.to is None else hole.to for hole in tables.well.holes]
    top = 0.0
    for table in parts.pieces(tables):
        bottom = top + table.span
        if bottom > top:
            stops = [top, *(end for end in ends if top < end < bottom), bottom]
            for above, below in pairwise(stops):
                hole = _hole(tables, 0.5 * (above + below))
                yield _run(table, above, below, None if hole is None else hole.diameter)
        top = bottom


def _hole(tables: DesignTables, depth: float) -> Any:
    """The hole at a depth (m); the last one below its end, None without holes."""
    for hole in tables.well.holes:
        if hole.to is None or depth < hole.to:
            return hole
    return tables.well.holes[-1] if tables.well.holes else None


def _run(table: SectionTable, top: float, bottom: float, hole: float | None) -> Run:
    mass, displaced = _steel(table)
    contact = _contact(table)
    bending = 0.0
    if table.diameters is not None:
        modulus = YOUNGS_MODULUS if table.youngs_modulus is None else table.youngs_modulus
        bending = 0.5 * modulus * polar_moment(*table.diameters)
    clearance = 0.0 if hole is None else max(0.0, 0.5 * (hole - contact))
    return Run(table.name, top, bottom, mass, displaced, 0.5 * contact, bending, clearance)


def mass_in_air(tables: DesignTables) -> float:
    """Mass of the string (kg)."""
    return sum(_steel(one)[0] * one.span for one in tables.drillstring.sections)


def _steel(table: SectionTable) -> tuple[float, float]:
    """Mass of the steel per length (kg/m), and outer less inner area (m2)."""
    tool = PIPES[table.pipe] if table.pipe is not None else None
    if tool is not None and tool.mass:
        return tool.mass / tool.length, tool.mass / tool.length / STEEL
    density = parts.STEEL_DENSITY if table.density is None else table.density
    if table.diameters is None:
        if table.linear_mass is None:
            raise InputError(
                "is missing: a polar_moment says nothing of the weight",
                f"drillstring.sections.{table.name}.linear_mass",
            )
        return table.linear_mass, table.linear_mass / STEEL
    outer, inner = table.diameters
    area = 0.25 * math.pi * (outer**2 - inner**2)
    if table.joint:
        area += sum((one.area - area) * one.length for one in table.joint) / table.spacing
    return (density * area if table.linear_mass is None else table.linear_mass), area


def _contact(table: SectionTable) -> float:
    """Diameter (m) at which the wall is touched."""
    if table.contact_diameter is not None:
        return table.contact_diameter
    if table.diameters is None:
        raise InputError(
            "is missing: a polar_moment says nothing of where the wall is touched",
            f"drillstring.sections.{table.name}.contact_diameter",
        )
    return max(table.diameters[0], *(one.outer_diameter for one in table.joint), 0.0)


def friction_factors(tables: DesignTables, line_runs: tuple[Run, ...], other: float) -> Array:
    """Friction factor of each run: of its hole, else of the well, else `other`."""
    well = tables.well
    usual = other if well.friction_factor is None else well.friction_factor
    holes = [_hole(tables, 0.5 * (run.top + run.bottom)) for run in line_runs]
    return np.array([
        usual if hole is None or hole.friction_factor is None else hole.friction_factor
        for hole in holes
    ])  # fmt: skip


@lru_cache(maxsize=16)
def laid(path: Path, line_runs: tuple[Run, ...], mud_density: float) -> Line:
    """A string laid into its well; thousands of draws of a friction share it."""
    return lay(path, line_runs, mud_density)


def line(tables: DesignTables) -> tuple[Line, tuple[Run, ...]]:
    """The string in its well."""
    made = runs(tables)
    return laid(path(tables), made, tables.well.mud_density or 0.0), made


def wall(tables: DesignTables, string: Drillstring) -> Wall | None:
    """Friction of the wall at nodes of the string; None without any."""
    if not parts.rubs(tables):
        return None
    well = tables.well
    placed, made = line(tables)
    bare = laid(path(tables), made, 0.0)
    nodes = choose_nodes(bare, tuple(string.depth), well.friction_nodes, well.tension)
    factor = friction_factors(tables, made, 0.0)[placed.run]
    point = tables.operating_point
    return lumped(placed, string.depth, nodes, factor, point.weight_on_bit, point.speed, well)


def refuse_impossible_well(tables: DesignTables) -> None:
    """Refuse (`InputError`) a path that is none, or friction of a string without weight."""
    if tables.well.survey:
        path(tables)
    if parts.rubs(tables):
        line(tables)
        if parts.axial(tables) is not None:
            raise InputError(
                "is not allowed with a bit that cuts its own wake: no solver has both",
                "well.friction_factor",
            )
        if tables.bit_rock.law == "printed-three-branch":
            raise InputError(
                "is not allowed with the printed friction of the bit", "well.friction_factor"
            )
