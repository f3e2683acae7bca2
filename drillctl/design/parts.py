"""The physical parts of a rig, built from the tables of its design."""

from __future__ import annotations

import math
from functools import lru_cache

from drillctl.design.bit_rock_tables import (
    BitRadiusFrictionTable,
    CoulombTable,
    FrictionCoefficients,
    FrictionRow,
    JansenVanDenSteenTable,
    NavarroLopezSuarezTable,
    PrintedThreeBranchTable,
    StribeckTable,
    TabulatedFrictionTable,
    TuckerWangTable,
)
from drillctl.design.tables import DesignTables, SectionTable
from drillctl.design.weight_tables import ConstantWeightTable
from drillctl.errors import InputError
from drillctl.rig.bit_rock import (
    BitRockLaw,
    JansenVanDenSteen,
    NavarroLopezSuarez,
    PrintedThreeBranch,
    Stribeck,
    TuckerWang,
    WeightTable,
    changed_rock,
    over_weight,
    tabulated,
)
from drillctl.rig.drillstring import GRADES, PIPES, Drillstring, Section, assemble, polar_moment
from drillctl.rig.drillstring.section import torsional_yield
from drillctl.rig.program import STILL, Program, Ramp

STEEL_SHEAR_MODULUS = 79.3e9
"""Shear modulus (Pa) where a design gives none: drill-pipe steel."""
HEAVIEST = 1e12
"""Weight on bit (N) where a law has no upper limit."""
STEEL_DENSITY = 7850.0
"""Density (kg/m3) where a design gives none."""
STEEL_POISSON_RATIO = 0.3
"""Poisson's ratio where a design gives Young's modulus alone."""
ELEMENT_LENGTH = 100.0
"""Longest element (m) where a design does not say how many."""
MOST_ELEMENTS = 10_000
"""Elements of a whole string: some metres each; beyond, matrices outgrow the memory."""


# Thousands of draws of a rock share a string, which nothing changes once it is assembled.
_assembled = lru_cache(maxsize=4)(assemble)


def drillstring(tables: DesignTables) -> Drillstring:
    """Assemble the string of a design."""
    table = tables.drillstring
    refuse_impossible_string(tables)
    return _assembled(
        tuple(section(s) for s in table.sections),
        top_inertia=tables.top_drive.inertia,
        bit_inertia=tables.bha.inertia,
        top_damping=tables.top_drive.damping,
        bit_damping=tables.bha.damping,
        modal_damping=table.modal_damping,
        mass=table.mass,
    )


def section(table: SectionTable) -> Section:
    """The physical section that a table describes."""
    if table.stiffness is not None:
        return Section(
            name=table.name,
            elements=1,
            stiffness=table.stiffness,
            end_inertia=table.inertia or 0.0,
            coupling_damping=table.damping,
            stiffness_damping=table.stiffness_damping,
            mass_damping=table.mass_damping,
        )
    assert table.length is not None
    moment, yield_torque = _cross_section(table)
    density = STEEL_DENSITY if table.density is None else table.density
    return Section(
        name=table.name,
        elements=table.elements or math.ceil(table.length / ELEMENT_LENGTH),
        stiffness=shear_modulus(table) * moment / table.length,
        inertia=density * moment * table.length * table.tool_joint_factor,
        length=table.length,
        coupling_damping=table.damping,
        stiffness_damping=table.stiffness_damping,
        mass_damping=table.mass_damping,
        drag=table.drag * table.length,
        yield_torque=yield_torque,
    )


def shear_modulus(table: SectionTable) -> float:
    """Shear modulus (Pa): given, or E / (2 (1 + nu)), or that of steel."""
    if table.shear_modulus is not None:
        return table.shear_modulus
    if table.youngs_modulus is not None:
        ratio = STEEL_POISSON_RATIO if table.poisson_ratio is None else table.poisson_ratio
        return table.youngs_modulus / (2.0 * (1.0 + ratio))
    return STEEL_SHEAR_MODULUS


def _cross_section(table: SectionTable) -> tuple[float, float]:
    """Polar moment (m^4) and torsional yield (N m), the latter infinite without a grade."""
    if table.polar_moment is not None:
        return table.polar_moment, math.inf
    if table.pipe is not None:
        outer, inner = PIPES[table.pipe].outer_diameter, PIPES[table.pipe].inner_diameter
    else:
        assert table.outer_diameter is not None
        assert table.inner_diameter is not None
        outer, inner = table.outer_diameter, table.inner_diameter
    limit = math.inf
    if table.grade is not None:
        limit = torsional_yield(outer, inner, GRADES[table.grade])
    return polar_moment(outer, inner), limit


def refuse_impossible_string(tables: DesignTables) -> None:
    """Refuse (`InputError`) a string that cannot be computed.

    A node without inertia (its equation of motion would be singular), a section so extreme
    that its stiffness or inertia is no number, or more elements than fit.
    """
    for table in tables.drillstring.sections:
        where = f"drillstring.sections.{table.name}"
        try:
            made = section(table)
        except OverflowError:
            raise InputError("its dimensions are too large to compute with", where) from None
        for name, value in (("stiffness", made.stiffness), ("inertia", made.inertia)):
            least = math.inf if table.stiffness is None or name == "stiffness" else -1.0
            if not math.isfinite(value) or (value == 0.0 and least > 0.0):
                raise InputError(f"its dimensions give a {name} of {value:g}", where)
    count = sum(section(table).elements for table in tables.drillstring.sections)
    if count > MOST_ELEMENTS:
        raise InputError(
            f"{count} elements in all; allowed are {MOST_ELEMENTS}", "drillstring.sections"
        )
    refuse_massless_node(tables)


def refuse_massless_node(tables: DesignTables) -> None:
    """Refuse a node without inertia (`InputError`): its equation of motion would be singular."""
    above = tables.top_drive.inertia
    where = "top_drive.inertia"
    for section_ in map(section, tables.drillstring.sections):
        if above == 0.0 and section_.inertia == 0.0:
            raise InputError("0 leaves a node without inertia; give it more than 0", where)
        above = section_.end_inertia + section_.inertia
        where = f"drillstring.sections.{section_.name}.inertia"
    if above + tables.bha.inertia == 0.0:
        raise InputError("0 leaves the bit without inertia; give it more than 0", "bha.inertia")


def bit_rock(tables: DesignTables) -> BitRockLaw:
    """Bit-rock law at the operating weight on bit."""
    law = _friction(tables)
    _refuse_impossible_friction(law, tables)
    over = getattr(tables.bit_rock, "regularised_over", None)
    if over is None or isinstance(tables.bit_rock, StribeckTable):
        return law
    if not isinstance(law, NavarroLopezSuarez):
        raise InputError(
            "does not go with a weight on bit that moves over a friction table",
            "bit_rock.regularised_over",
        )
    return Stribeck(static=law.a2, sliding=law.a1, decay=law.beta, sharpness=1.0 / over)


def weight_moves(tables: DesignTables) -> bool:
    """Whether the weight on bit changes while the bit drills, by its law or by the clock."""
    by_law = not isinstance(tables.weight_on_bit, ConstantWeightTable)
    return by_law or tables.scenario.weight_on_bit.start is not None


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


def _friction(tables: DesignTables) -> BitRockLaw:
    table = tables.bit_rock
    match table:
        case NavarroLopezSuarezTable():
            fixed = _navarro_lopez_suarez(table, tables.operating_point.weight_on_bit)
            if table.table is None or not weight_moves(tables):
                return fixed
            factors = (table.a1_factor, table.a2_factor, table.beta_factor)
            return over_weight(_rows(table.table), *factors)
        case PrintedThreeBranchTable():
            if table.table is not None and weight_moves(tables):
                raise InputError(
                    f"does not go with a weight on bit that moves under {table.law!r}; "
                    "give a1, a2 and beta",
                    "bit_rock.table",
                )
            turning = _navarro_lopez_suarez(table, tables.operating_point.weight_on_bit)
            return PrintedThreeBranch(*turning, table.tolerance)
        case BitRadiusFrictionTable():
            return NavarroLopezSuarez(
                a1=table.bit_radius * table.sliding_coefficient,
                a2=table.bit_radius * table.static_coefficient,
                beta=table.decay / table.reference_speed,
            )
        case JansenVanDenSteenTable():
            return JansenVanDenSteen(table.a1, table.a2)
        case CoulombTable():
            return JansenVanDenSteen(table.a, table.a)
        case TuckerWangTable():
            return TuckerWang(table.a, table.b1, table.b2, table.b3)
        case StribeckTable():
            return Stribeck(
                static=table.bit_radius * table.static_coefficient,
                sliding=table.bit_radius * table.sliding_coefficient,
                decay=1.0 / table.stribeck_speed,
                sharpness=1.0 / table.regularised_over,
            )
        case TabulatedFrictionTable():
            arms = tuple(point.a for point in table.points)
            static = arms[0] if table.static is None else table.static
            return tabulated(static, tuple(point.speed for point in table.points), arms)


def _navarro_lopez_suarez(table: FrictionCoefficients, weight: float) -> NavarroLopezSuarez:
    law = _coefficients(table, weight)
    law = NavarroLopezSuarez(
        law.a1 * table.a1_factor, law.a2 * table.a2_factor, law.beta * table.beta_factor
    )
    if law.a2 < law.a1:
        raise InputError(
            f"the factors give a2 = {law.a2:g}, less than a1 = {law.a1:g}", "bit_rock.a2_factor"
        )
    return law


def _refuse_impossible_friction(law: BitRockLaw, tables: DesignTables) -> None:
    """Refuse coefficients that overflow, or turn negative far outside a table."""
    weight = tables.operating_point.weight_on_bit
    numbers = law._asdict() if isinstance(law, (NavarroLopezSuarez, PrintedThreeBranch)) else {}
    for name, value in (*numbers.items(), ("static torque", law.static_torque(weight))):
        if not 0.0 <= value < math.inf:
            raise InputError(
                f"its numbers give {name} = {value:g} at {weight / 1e3:g} kN", "bit_rock"
            )


def table_range(tables: DesignTables) -> tuple[float, float]:
    """Lowest and highest weight (N) of the friction table; any weight without a table."""
    table = tables.bit_rock
    if not isinstance(table, FrictionCoefficients) or table.table is None:
        return 0.0, HEAVIEST
    return table.table[0].weight_on_bit, table.table[-1].weight_on_bit


def _rows(table: tuple[FrictionRow, ...]) -> WeightTable:
    return WeightTable(
        weight=tuple(row.weight_on_bit for row in table),
        a1=tuple(row.a1 for row in table),
        a2=tuple(row.a2 for row in table),
        beta=tuple(row.beta for row in table),
    )


def _coefficients(table: FrictionCoefficients, weight: float) -> NavarroLopezSuarez:
    if table.table is None:
        return NavarroLopezSuarez(table.a1, table.a2, table.beta)
    rows = _rows(table.table)
    if not rows.covers(weight) and table.outside_table == "refuse":
        raise InputError(
            f"{weight / 1e3:g} kN lies outside the friction table "
            f"({rows.weight[0] / 1e3:g} to {rows.weight[-1] / 1e3:g} kN); "
            'allowed with bit_rock.outside_table = "extrapolate"',
            "operating_point.weight_on_bit",
        )
    return rows.at(weight)


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
        if table.end >= duration:
            raise InputError(
                f"{table.end:g} s: the run ends at {duration:g} s, before the final value",
                f"scenario.{name}.end",
            )
    if scenario.bit_rock.until >= duration:
        raise InputError(
            f"{scenario.bit_rock.until:g} s: the run ends at {duration:g} s",
            "scenario.bit_rock.until",
        )
    rock = scenario.bit_rock
    if rock.until == 0.0 and (rock.static_factor, rock.sliding_factor, rock.decay_factor) != (
        1,
        1,
        1,
    ):
        raise InputError(
            "is missing: when the rock becomes the design's own", "scenario.bit_rock.until"
        )
    period = tables.controller.drive.sampling_period
    if period >= duration:
        raise InputError(
            f"{period:g} s: the run ends at {duration:g} s", "controller.drive.sampling_period"
        )
    speed = weight = STILL
    if scenario.speed.start is not None:
        first = scenario.speed.start - point.speed
        speed = Ramp(first, scenario.speed.begin, scenario.speed.end)
    if scenario.weight_on_bit.start is not None:
        if point.weight_on_bit == 0.0:
            raise InputError(
                "0 leads nowhere: a program needs a final weight", "operating_point.weight_on_bit"
            )
        first = scenario.weight_on_bit.start / point.weight_on_bit - 1.0
        weight = Ramp(first, scenario.weight_on_bit.begin, scenario.weight_on_bit.end)
    return Program(speed, weight, scenario.bit_rock.until)
