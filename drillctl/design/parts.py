"""The physical parts of a rig, built from the tables of its design."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from drillctl import units
from drillctl.design.tables import DesignTables, SectionTable, SpeedProgramTable, WeightProgramTable
from drillctl.errors import InputError
from drillctl.rig.axial import AxialString, axial_string
from drillctl.rig.bit_rock import BitRockLaw
from drillctl.rig.bit_rock.law import changed_rock, form_of, friction_laws
from drillctl.rig.bit_rock.variation import NoVariation, Variation, variation_of
from drillctl.rig.drillstring import (
    GRADES,
    PIPES,
    Drillstring,
    Parts,
    Section,
    assemble,
    polar_moment,
)
from drillctl.rig.drillstring.catalogue import HWDP_YIELD, Homogenised, homogenised
from drillctl.rig.drillstring.mesh import MeshedSection, meshed, what_was_done
from drillctl.rig.drillstring.mud import jointed_drag
from drillctl.rig.drillstring.section import torsional_yield
from drillctl.rig.program import MOST_RAMPS, STILL, Path, Program, Ramp
from drillctl.rig.table import MOST_TORQUE, SPRING, WHEEL
from drillctl.rig.top_drive.ideal import ConstantTorqueTable
from drillctl.rig.top_drive.law import DriveTable
from drillctl.rig.weight_on_bit.law import HEAVIEST, WeightLaw, weight_laws

STEEL_SHEAR_MODULUS = 79.3e9  # shear modulus (Pa) where a design gives none: drill-pipe steel
STEEL_DENSITY = 7850.0  # density (kg/m3) where a design gives none
STEEL_POISSON_RATIO = 0.3  # poisson's ratio where a design gives Young's modulus alone
REGENERATIVE = "richard-detournay"  # the law that cuts its own wake, with axial motion
MOST_ELEMENTS = 10_000
"""Elements of a whole string: some metres each; beyond, matrices outgrow the memory."""


_assembled = lru_cache(maxsize=4)(assemble)  # equal strings are one, which others remember


class _OfTheString:
    """Tables of a design; equal to others where all that the string comes from is shared.

    Thousands of draws of a rock share a string, which is read, checked and assembled once.
    """

    def __init__(self, tables: DesignTables) -> None:
        self.tables = tables
        self.shared = (tables.drillstring, tables.top_drive, tables.bha, tables.well)

    def __hash__(self) -> int:
        return hash(tuple(map(id, self.shared)))

    def __eq__(self, other: object) -> bool:
        assert isinstance(other, _OfTheString)
        return all(a is b for a, b in zip(self.shared, other.shared, strict=True))


def drillstring(tables: DesignTables) -> Drillstring:
    """Assemble the string of a design."""
    return _drillstring(_OfTheString(tables))


@lru_cache(maxsize=16)
def _drillstring(of: _OfTheString) -> Drillstring:
    tables = of.tables
    refuse_impossible_string(tables)
    made = parts_of(tables)
    count = sum(one.elements for one in made.sections)
    if count > MOST_ELEMENTS:
        raise InputError(
            f"{count} elements in all; allowed are {MOST_ELEMENTS}", "drillstring.sections"
        )
    return _assembled(**vars(made))


def parts_of(tables: DesignTables) -> Parts:
    """Sections with their elements, and ends."""
    made, free = _parts(tables), _free(tables)
    sections = meshed(made, free)
    if rubs(tables):
        given = {one.name for one, open_ in zip(pieces(tables), free, strict=True) if not open_}
        sections = tuple(
            one if one.name in given or one.inertia == 0.0 else replace(
                one, elements=max(one.elements, math.ceil(one.length / LONGEST_RUBBED))
            )
            for one in sections
        )  # fmt: skip
    return replace(made, sections=sections)


LONGEST_RUBBED = 20.0
"""Longest element (m) where the wall rubs and the design names none: fronts run along it."""


def rubs(tables: DesignTables) -> bool:
    """Whether the wall rubs in simulations."""
    well = tables.well
    factors = (well.friction_factor, *(hole.friction_factor for hole in well.holes))
    return any(factor is not None for factor in factors)


def mesh(tables: DesignTables, string: Drillstring) -> tuple[MeshedSection, ...]:
    """How many elements each section has, and which pieces were lumped."""
    names = (s.name for s in pieces(tables))
    return what_was_done(string.parts.sections, names, _free(tables))


def _free(tables: DesignTables) -> tuple[bool, ...]:
    """Whether the elements of each section are to be chosen."""
    return tuple(s.elements is None and s.stiffness is None for s in pieces(tables))


def pieces(tables: DesignTables) -> tuple[SectionTable, ...]:
    """Sections from top to bottom, equal ones with something at their ends one by one."""
    table = tables.drillstring
    return tuple(
        piece
        if piece.stiffness_damping is not None
        else piece.model_copy(update={"stiffness_damping": table.stiffness_damping})
        for one in table.sections
        for piece in one.pieces
    )


def _parts(tables: DesignTables) -> Parts:
    """Sections as they stand, each of one element where the design does not say how many."""
    table = tables.drillstring
    return Parts(
        sections=in_mud(tables, tuple(section(s) for s in pieces(tables))),
        top_inertia=tables.top_drive.at_pipe,
        bit_inertia=tables.bha.inertia,
        top_damping=tables.top_drive.damping,
        bit_damping=tables.bha.damping,
        modal_damping=table.modal_damping,
        mass=table.mass,
    )


def in_mud(tables: DesignTables, sections: tuple[Section, ...]) -> tuple[Section, ...]:
    """Sections with the viscous torque of the mud around them."""
    viscosity = tables.well.mud_viscosity
    if viscosity is None:
        return sections
    drag = [0.0] * len(sections)
    for number, table, length, hole in clearances(tables):
        outer = table.diameters[0] if table.diameters else 0.0
        try:
            each = jointed_drag(viscosity, outer, table.spacing, table.joint, hole)
        except InputError as error:
            where = f"drillstring.sections.{table.name}"
            raise InputError(error.problem, where) from None
        drag[number] += each * length
    return tuple(
        replace(one, drag=one.drag + more) if more else one
        for one, more in zip(sections, drag, strict=True)
    )


def clearances(tables: DesignTables) -> Iterator[tuple[int, SectionTable, float, float]]:
    """Runs of a section in one hole: its number and table, length and diameter of the hole (m)."""
    holes = tables.well.holes
    ends = [math.inf if hole.to is None else hole.to for hole in holes]
    top = 0.0
    for number, table in enumerate(pieces(tables)):
        bottom = top + table.span
        if holes and bottom > ends[-1] * (1.0 + 1e-9):
            raise InputError(
                f"end at {ends[-1]:g} m, above the lower end of {table.name}, {bottom:.6g} m",
                "well.holes",
            )
        if table.diameters is not None:
            for hole, above, below in zip(holes, (0.0, *ends), ends, strict=False):
                length = min(bottom, below) - max(top, above)
                if length > 0.0:
                    yield number, table, length, hole.diameter
        top = bottom


def section(table: SectionTable) -> Section:
    """The physical section that a table describes; of one element where it does not say."""
    damping = table.stiffness_damping or 0.0
    if table.stiffness is not None:
        return Section(
            name=table.name,
            elements=1,
            stiffness=table.stiffness,
            end_inertia=table.inertia or 0.0,
            coupling_damping=table.damping,
            stiffness_damping=damping,
            mass_damping=table.mass_damping,
        )
    stiffness, inertia = _body(table)
    return Section(
        name=table.name,
        elements=table.elements or 1,
        stiffness=stiffness,
        inertia=inertia * table.tool_joint_factor,
        end_inertia=table.inertia or 0.0,
        length=table.span,
        coupling_damping=table.damping,
        stiffness_damping=damping,
        mass_damping=table.mass_damping,
        drag=table.drag * table.span,
        yield_torque=_yield_torque(table),
    )


def _body(table: SectionTable) -> tuple[float, float]:
    """Stiffness (N m/rad) and inertia (kg m2) of a run of pipe with its tool joints."""
    tool = PIPES[table.pipe] if table.pipe is not None else None
    if tool is not None and tool.stiffness:  # as listed: mass and stiffness of no one cross-section
        share = table.span / tool.length
        return tool.stiffness / share, tool.inertia * share
    if table.polar_moment is not None:
        moment = table.polar_moment
    else:
        assert table.diameters is not None
        moment = polar_moment(*table.diameters)
    density = STEEL_DENSITY if table.density is None else table.density
    stiffness = shear_modulus(table) * moment / table.span
    inertia = density * moment * table.span
    factors = joint_factors(table)
    if factors is None:
        return stiffness, inertia
    return stiffness * factors.stiffness, inertia * factors.inertia


def joint_factors(table: SectionTable) -> Homogenised | None:
    """What its tool joints make of stiffness and inertia of a section's body; None without."""
    if not table.joint or table.diameters is None:
        return None
    return homogenised(*table.diameters, table.spacing, table.joint)


def shear_modulus(table: SectionTable) -> float:
    """Shear modulus (Pa): given, or E / (2 (1 + nu)), or that of steel."""
    if table.shear_modulus is not None:
        return table.shear_modulus
    if table.youngs_modulus is not None:
        ratio = STEEL_POISSON_RATIO if table.poisson_ratio is None else table.poisson_ratio
        return table.youngs_modulus / (2.0 * (1.0 + ratio))
    return STEEL_SHEAR_MODULUS


def _yield_torque(table: SectionTable) -> float:
    """Torsional yield of the body (N m), infinite without a grade."""
    strength = GRADES[table.grade] if table.grade is not None else math.inf
    if table.pipe is not None and PIPES[table.pipe].kind == "HWDP":
        strength = HWDP_YIELD  # its tube is of no grade
    if table.diameters is None or math.isinf(strength):
        return math.inf
    return torsional_yield(*table.diameters, strength)


def refuse_impossible_string(tables: DesignTables) -> None:
    """Refuse (`InputError`) a string that cannot be computed.

    A node without inertia (its equation of motion would be singular), a section whose dimensions
    give a stiffness or inertia beyond the ranges of their keys, or more elements than fit.
    """
    _refuse_impossible_string(_OfTheString(tables))


@lru_cache(maxsize=16)
def _refuse_impossible_string(of: _OfTheString) -> None:
    tables = of.tables
    for table in pieces(tables):
        made = section(table)
        # That of a lumped spring is zero; its ends were checked with their keys.
        inertia = made.inertia if table.stiffness is None else WHEEL.most
        for name, value, limits, kind in (
            ("stiffness", made.stiffness, SPRING, units.STIFFNESS),
            ("inertia", inertia, WHEEL, units.INERTIA),
        ):
            if not limits.least <= value <= limits.most:
                raise InputError(
                    f"its dimensions give {name} = {value:g}; allowed: {limits.text(kind)}",
                    f"drillstring.sections.{table.name}",
                )
    count = sum(section(table).elements for table in pieces(tables))
    if count > MOST_ELEMENTS:
        raise InputError(
            f"{count} elements in all; allowed are {MOST_ELEMENTS}", "drillstring.sections"
        )
    in_mud(tables, tuple(map(section, pieces(tables))))
    refuse_massless_node(tables)


def refuse_massless_node(tables: DesignTables) -> None:
    """Refuse a node without inertia (`InputError`): its equation of motion would be singular."""
    above = tables.top_drive.at_pipe
    where = "top_drive.inertia"
    for section_ in map(section, pieces(tables)):
        if above == 0.0 and section_.inertia == 0.0:
            raise InputError("0 leaves a node without inertia; give it more than 0", where)
        above = section_.end_inertia + section_.inertia
        where = f"drillstring.sections.{section_.name}.inertia"
    if above + tables.bha.inertia == 0.0:
        raise InputError("0 leaves the bit without inertia; give it more than 0", "bha.inertia")


def bit_rock(tables: DesignTables) -> BitRockLaw:
    """Bit-rock law at the operating weight on bit."""
    table, weight = tables.bit_rock, tables.operating_point.weight_on_bit
    entry = friction_laws()[table.law]
    law = entry.make(table, weight, weight_moves(tables))
    _refuse_impossible_friction(law, weight)
    if entry.regularised is None or table.regularised_over is None:
        return law
    return entry.regularised(law, table)


def weight_on_bit(tables: DesignTables) -> WeightLaw:
    """Weight-on-bit law with its numbers."""
    table, point = tables.weight_on_bit, tables.operating_point
    return weight_laws()[table.law].make(table, point.weight_on_bit, point.speed)


def weight_moves(tables: DesignTables) -> bool:
    """Whether the weight on bit changes while the bit drills, by its law or by the clock."""
    by_law = weight_laws()[tables.weight_on_bit.law].moves
    return by_law or bool(_points(tables.scenario.weight_on_bit))


def bit_rock_before(tables: DesignTables) -> BitRockLaw:
    """Bit-rock law before the rock changes."""
    table = tables.scenario.bit_rock
    law = bit_rock(tables)
    if table.until == 0.0:
        return law
    factors = (table.static_factor, table.sliding_factor, table.decay_factor)
    try:
        return changed_rock(law, *factors)
    except InputError as error:
        raise InputError(error.problem, f"scenario.bit_rock.{error.where}") from None


def axial(tables: DesignTables) -> AxialString | None:
    """The axial string; None under a law that needs none."""
    if tables.bit_rock.law != REGENERATIVE:
        return None
    table = tables.axial
    sections = parts_of(tables).sections
    if table.model == "lumped" and table.mass is not None:
        springs = np.array([1.0])
        if table.top == "velocity":
            springs = np.array([1.0 / sum(1.0 / k for k, _ in _axial_pieces(tables).values())])
        return axial_string(table, springs, np.array([table.mass]), consistent=False)
    each_spring: list[float] = []
    each_mass: list[float] = []
    of_pieces = _axial_pieces(tables)
    for one in sections:  # with the short pieces that are lumped into it
        held = [of_pieces[name] for name in (one.name, *one.lumped)]
        spring, mass = 1.0 / sum(1.0 / k for k, _ in held), sum(m for _, m in held)
        each_spring += [spring * one.elements] * one.elements
        each_mass += [mass / one.elements] * one.elements
    k, m = np.array(each_spring), np.array(each_mass)
    if table.model == "lumped":
        k, m = np.array([1.0 / np.sum(1.0 / k)]), np.array([m.sum()])
    return axial_string(table, k, m, tables.drillstring.mass == "consistent")


def refuse_weight_of_moving_top(tables: DesignTables) -> None:
    """Refuse a weight that changes where no hook sets a force."""
    if tables.bit_rock.law != REGENERATIVE or tables.axial.top != "velocity":
        return
    if weight_moves(tables):
        raise InputError(
            "'velocity': the top moves at a speed of its own and no hook sets a force, so no law "
            "or program of the weight on bit can act; with 'force' it can",
            "axial.top",
        )


def _axial_pieces(tables: DesignTables) -> dict[str, tuple[float, float]]:
    """Axial stiffness (N/m) and mass (kg) of the body of each section, by name."""
    results = {}
    for one in pieces(tables):
        if one.diameters is None:
            raise InputError(
                f"{one.name} has no diameters to find its mass and axial stiffness from: give "
                'model = "lumped", top = "force" and a mass',
                "axial.mass",
            )
        outer, inner = one.diameters
        area = 0.25 * math.pi * (outer**2 - inner**2)
        density = STEEL_DENSITY if one.density is None else one.density
        modulus = one.youngs_modulus or tables.axial.youngs_modulus
        results[one.name] = modulus * area / one.span, density * area * one.span
    return results


def variation(tables: DesignTables) -> Variation | NoVariation:
    """How the rock varies along the way."""
    table = getattr(tables.bit_rock, "variation", None)
    rate = tables.operating_point.rate_of_penetration
    if getattr(table, "over", "") == "depth" and tables.bit_rock.law == REGENERATIVE:
        return variation_of(table, 0.0, tables.uncertainty.seed).sinking()
    return variation_of(table, rate, tables.uncertainty.seed)


def _refuse_impossible_friction(law: BitRockLaw, weight: float) -> None:
    """Refuse coefficients that overflow, or turn negative far outside a table."""
    form = form_of(law)
    groups = (form.sliding, form.static, form.decay)
    numbers = [(names[0], getattr(law, names[0])) for names in groups if len(names) == 1]
    for name, value in (*numbers, ("static torque", law.static_torque(weight))):
        if not 0.0 <= value <= MOST_TORQUE:
            raise InputError(
                f"its numbers give {name} = {value:g} at {weight / 1e3:g} kN", "bit_rock"
            )


def table_range(tables: DesignTables) -> tuple[float, float]:
    """Lowest and highest weight (N) of the friction table; any weight without a table."""
    rows = getattr(tables.bit_rock, "weights", ())
    return (rows[0], rows[-1]) if rows else (0.0, HEAVIEST)


def torque_at_set_speed(tables: DesignTables) -> float:
    """Torque of the rock at set speed and nominal weight (N m)."""
    point = tables.operating_point
    return float(bit_rock(tables).torque_and_slope(point.weight_on_bit, point.speed, math.exp)[0])


def program(tables: DesignTables) -> Program:
    """What changes by the clock in a run."""
    scenario, point = tables.scenario, tables.operating_point
    duration = tables.simulation.duration
    for name, table in (("speed", scenario.speed), ("weight_on_bit", scenario.weight_on_bit)):
        if table.start is None and table.end > 0.0:
            raise InputError("is missing: what the program starts from", f"scenario.{name}.start")
        key, end = ("points", table.points[-1][0]) if table.points else ("end", table.end)
        if end >= duration:
            raise InputError(
                f"{end:g} s: the run ends at {duration:g} s, before the final value",
                f"scenario.{name}.{key}",
            )
    _refuse_rock_program(tables)
    period = tables.controller.drive.sampling_period
    if period >= duration:
        raise InputError(
            f"{period:g} s: the run ends at {duration:g} s", "controller.drive.sampling_period"
        )
    if point.weight_on_bit == 0.0 and _points(scenario.weight_on_bit):
        raise InputError(
            "must be > 0: final weight of the program", "operating_point.weight_on_bit"
        )
    load = point.weight_on_bit
    speed = _ramps(scenario.speed, point.speed, 1.0, "speed")
    weight = _ramps(scenario.weight_on_bit, load, load, "weight_on_bit")
    until, lag = scenario.bit_rock.until, scenario.speed.lag if speed else 0.0
    if len(speed) > 1 or len(weight) > 1 or lag:
        return Program(Path.of(speed, lag), Path.of(weight), until)
    return Program((speed or [STILL])[0], (weight or [STILL])[0], until)


def _refuse_rock_program(tables: DesignTables) -> None:
    rock, duration = tables.scenario.bit_rock, tables.simulation.duration
    if rock.until >= duration:
        raise InputError(
            f"{rock.until:g} s: the run ends at {duration:g} s", "scenario.bit_rock.until"
        )
    factors = (rock.static_factor, rock.sliding_factor, rock.decay_factor)
    if rock.until == 0.0 and factors != (1, 1, 1):
        raise InputError(
            "is missing: when the rock becomes the design's own", "scenario.bit_rock.until"
        )


AnyProgram = SpeedProgramTable | WeightProgramTable


def _points(table: AnyProgram) -> tuple[tuple[float, Any], ...]:
    """Points of a program, `set` the last; none where nothing moves."""
    if table.start is not None:
        return (table.begin, table.start), (table.end, "set")
    return table.points


def _ramps(table: AnyProgram, final: float, unit: float, where: str) -> list[Ramp]:
    """What the way of a value to the final one is the sum of, in a unit.

    A piece is a ramp to zero from what it changes by, as what follows it adds up to the rest.
    """
    points = [(time, final if value == "set" else value) for time, value in _points(table)]
    if points and not math.isclose(points[-1][1], final, rel_tol=1e-9):
        raise InputError(
            f"the last value must be that of operating_point.{where}; write it as 'set'",
            f"scenario.{where}.points",
        )
    ramps = [
        Ramp(a / unit - b / unit, begin, end)
        for (begin, a), (end, b) in itertools.pairwise(points)
        if a != b
    ]
    if len(ramps) > MOST_RAMPS:
        raise InputError(
            f"{len(ramps)} changes; allowed are {MOST_RAMPS}", f"scenario.{where}.points"
        )
    return ramps


def drive_of(tables: DesignTables) -> DriveTable:
    """What makes the drive real, within the limits of its motors."""
    drive: DriveTable = tables.controller.drive
    return tables.top_drive.limits.within(drive)


def controller_of(tables: DesignTables) -> Any:
    """The table of the controller with this drive."""
    return tables.controller.model_copy(update={"drive": drive_of(tables)})


def refuse_weak_drive(
    tables: DesignTables, string: Drillstring, torque: float, of_wall: float = 0.0
) -> None:
    """Refuse a drive that cannot hold its set speed under rock, drag and sliding along the wall."""
    drive, speed = drive_of(tables), tables.operating_point.speed
    fastest = drive.maximum_speed
    if fastest is not None and speed > fastest:
        raise InputError(
            f"{speed / units.RPM:.4g} rpm is beyond the {fastest / units.RPM:.4g} rpm that the "
            "drive turns at most",
            "operating_point.speed",
        )
    if isinstance(tables.controller, ConstantTorqueTable):  # holds no speed
        return
    needed = torque + float(string.ground_damping.sum()) * speed + of_wall
    curve = tables.top_drive.limits.curve
    for key, limit in (
        ("torque_limit", drive.torque_limit),
        ("power_limit", None if drive.power_limit is None else drive.power_limit / speed),
        ("curve", np.interp(speed, *np.array(curve).T) if curve else None),
    ):
        if limit is not None and limit < needed:
            raise InputError(
                f"gives {limit / 1e3:.4g} kN*m at the set speed, less than the "
                f"{needed / 1e3:.4g} kN*m that rock and drag take there",
                f"controller.drive.{key}"
                if getattr(drive, key) == getattr(tables.controller.drive, key, None)
                else "top_drive",
            )
