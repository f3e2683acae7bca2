"""What a design allows and probably does not mean: text, the key to set, and a usual value."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from drillctl import units
from drillctl.design.parts import drive_of
from drillctl.design.paths import values_of
from drillctl.design.tables import DesignTables
from drillctl.rig.bit_rock import BitRockLaw
from drillctl.rig.bit_rock.law import contact, friction_laws
from drillctl.rig.bit_rock.richard_detournay import RichardDetournay
from drillctl.rig.drillstring import Drillstring, Parts
from drillctl.rig.drillstring.frequencies import followed
from drillctl.rig.drillstring.mesh import off_the_line
from drillctl.rig.top_drive import TopDriveLaw
from drillctl.rig.top_drive.law import OFF_THE_CURVE
from drillctl.rig.top_drive.real_drive import KNOTS
from drillctl.rig.weight_on_bit import PATHS
from drillctl.rig.well.survey import path_of, sharp_bends

CHATTER = 0.03  # damping ratio that the rock may take from the fastest modes at the bit
# Modes share the mobility of the bit: damping ends its chatter at a twentieth of what the rock
# would take of one mode alone. Both numbers by sticks of the reference solver: docs/accuracy.md.
SHARED = 20.0
# Logarithm of the growth of a mode in a run. At 0.13 more elements move J1 by 1 to 6 %, at 0.013 by
# less than 0.1 %: docs/accuracy.md.
GROWTH = 0.1
COARSE = 0.02  # error of the first five frequencies that no shipped mesh reaches
MOST_VERIFIED = 1_000  # elements of a string up to which both engines are checked
LONGEST_STEP = 0.05  # longest step (s) of the batch engine that is checked over a map


class DesignWarning(NamedTuple):
    """What is allowed but probably not meant.

    Attributes
    ----------
    text : str
        What it is and what follows.
    key : str
        Dotted path of the key to set.
    usual : str
        A usual value of it.
    """

    text: str
    key: str
    usual: str

    def __str__(self) -> str:
        """One line."""
        return self.said("si")

    def said(self, system: units.System) -> str:
        """One line in the units of a reader; the parts have their quantities in SI, in full."""
        return units.told(f"{self.text}; set {self.key}, usually {self.usual}", system)


def warnings_of(
    tables: DesignTables, string: Callable[[], Drillstring], parts: Parts, rock: BitRockLaw,
    drive: TopDriveLaw, weight: Any,
) -> tuple[DesignWarning, ...]:  # fmt: skip
    """Every warning of a design; `drive` has no limits."""
    point = tables.operating_point
    at_rest = float(weight.weight(0.0)) if weight.moves else point.weight_on_bit
    fall = float(rock.steepest_fall(point.weight_on_bit))
    if isinstance(weight, PATHS):  # too slow for the modes of the mesh
        slope = rock.torque_and_slope(point.weight_on_bit, point.speed, math.exp)[1]
    else:
        slope = contact(rock, weight, point.speed, math.exp)[1]
    found = (
        *_implausible(tables),
        _assumed_rock(tables),
        _varying_rock(tables, rock),
        _weak_drive(tables, rock.static_torque(at_rest)),
        _drive_curve(tables),
        _growing(string, parts, -float(slope), drive, tables.simulation.duration),
        _light_bit(parts, fall),
        _mesh(parts),
        _step(tables),
        *_bends(tables),
    )
    return tuple(one for one in found if one is not None)


def _assumed_rock(tables: DesignTables) -> DesignWarning | None:
    """A rock whose numbers nobody has measured."""
    remark = friction_laws()[tables.bit_rock.law].remark(tables.bit_rock)
    if not remark:
        return None
    return DesignWarning(remark, "bit_rock.aggressiveness", "3 T / (W D) of a measured torque T")


def _varying_rock(tables: DesignTables, rock: BitRockLaw) -> DesignWarning | None:
    """A rock that varies over depth so slowly that a run meets one level of it, or at what rate."""
    table = getattr(tables.bit_rock, "variation", None)
    if table is None or table.cv == 0.0 or table.over != "depth":
        return None
    point, duration = tables.operating_point, tables.simulation.duration
    rate, given = point.rate_of_penetration, "rate_of_penetration" in point.model_fields_set
    if isinstance(rock, RichardDetournay):  # drills by itself
        rate, given = float(rock.rate(point.weight_on_bit, point.speed)), True
    told = f"{3600.0 * rate:.3g} m/h"
    drilled = rate * duration
    if table.length >= drilled:
        return DesignWarning(
            f"at {told} a run of {duration:g} s drills {drilled:.2g} m, less than the correlation "
            f"length of {table.length:g} m: its rock is of nearly one random level",
            "bit_rock.variation.length", "centimetres to decimetres within a run",
        )  # fmt: skip
    if given:
        return None
    return DesignWarning(
        f"no rate of penetration is given: the rock passes by at {told}",
        "operating_point.rate_of_penetration", "that of the rig",
    )  # fmt: skip


def _implausible(tables: DesignTables) -> Iterator[DesignWarning]:
    """Values far outside those of any rig: a slip of the pen, or of the unit."""
    for one in values_of(tables):
        if one.kind is None or not one.value:
            continue
        low, high = one.kind.usual
        if not low <= abs(one.value) <= high:
            unit = units.DIAMETERS if one.kind is units.DIAMETER else one.kind.si
            value, least, most = (units.full(x, unit) for x in (one.value, low, high))
            yield DesignWarning(
                f"{one.path} {value} is far from that of any rig",
                one.path, f"up to {most}" if low == 0.0 else f"{least} to {most}",
            )  # fmt: skip


def _weak_drive(tables: DesignTables, static: float) -> DesignWarning | None:
    """A drive that cannot free a stuck bit."""
    limit, own = drive_of(tables).torque_limit, tables.controller.drive.torque_limit
    if limit is None or limit >= static:
        return None
    key = "controller.drive.torque_limit" if own == limit else "top_drive.intermittent_torque"
    return DesignWarning(
        f"{key} {units.full(limit, 'N*m')} is less than the static torque of "
        f"the bit, {units.full(static, 'N*m')}: once stuck it cannot be freed (status stalled)",
        key,
        f"more than {units.full(static, 'N*m')}",
    )


def _drive_curve(tables: DesignTables) -> DesignWarning | None:
    """More points of a motor than count."""
    share, speed = tables.top_drive.limits.off
    if share <= OFF_THE_CURVE:
        return None
    return DesignWarning(
        f"the torque-speed curve counts as straight between {KNOTS} of its points, which is off by "
        f"{share:.0%} of its torque at {units.full(speed, 'rad/s')} of the pipe",
        "top_drive.torque_speed",
        f"at most {KNOTS} points",
    )


def _growing(
    string: Callable[[], Drillstring], parts: Parts, fall: float, drive: TopDriveLaw,
    duration: float,
) -> DesignWarning | None:  # fmt: skip
    """Modes of the mesh alone that grow: the rock gives them more than the drive takes."""
    sections = [x for x in parts.sections if x.inertia > 0.0]
    damped = parts.modal_damping > 0.0 or any(
        x.coupling_damping or x.stiffness_damping or x.mass_damping or x.drag
        for x in parts.sections
    )
    if damped or not sections:
        return None
    frequency, shapes = string().undamped_modes
    own = frequency > followed(parts)
    resistance = np.real(drive.impedance(1j * frequency[own])) + parts.top_damping
    given = (fall - parts.bit_damping) * shapes[-1, own] ** 2
    growth = 0.5 * duration * np.max(given - resistance * shapes[0, own] ** 2, initial=0.0)
    if growth <= GROWTH:
        return None
    more = f"{math.exp(min(growth, 700.0)):.2g}-fold"
    return DesignWarning(
        "the string has no damping, and the rock gives the highest modes of the mesh more than the "
        f"drive takes: they grow {more} in a run, so that the mesh decides sticks and J1",
        f"drillstring.sections.{sections[0].name}.stiffness_damping",
        "1e-3 s",
    )


def _light_bit(parts: Parts, fall: float) -> DesignWarning | None:
    """A bit that the rock shakes in the fastest mode of the elements at it.

    G is the mobility of the bit over the time of that mode: 1 / (inertia at the bit x frequency).
    """
    last = parts.sections[-1]
    if last.inertia == 0.0 or fall <= 0.0:
        return None
    element, spring = last.inertia / last.elements, last.stiffness * last.elements
    consistent = parts.mass == "consistent"
    # What a chain of elements resists at its end at once, and its cut-off.
    own = element * (1.0 / (2.0 * math.sqrt(3.0)) if consistent else 0.5)
    fastest = math.sqrt((12.0 if consistent else 4.0) * spring / element)
    inertia = parts.bit_inertia + last.end_inertia + own
    gained = 0.5 * (fall - parts.bit_damping) / (inertia * fastest)
    lost = 0.5 * fastest * (last.stiffness_damping + last.coupling_damping / last.stiffness)
    if gained <= CHATTER + SHARED * (lost + parts.modal_damping):
        return None
    more = lost + parts.modal_damping > 0.0
    return DesignWarning(
        f"the bit is light: {inertia:.3g} kg*m^2 against a friction that falls by {fall:.4g} "
        f"N*m*s/rad; it chatters with the fastest modes of the mesh, up to {fastest / 6.2832:.3g} "
        "Hz",
        "bha.inertia" if more else f"drillstring.sections.{last.name}.stiffness_damping",
        "50 kg*m^2 to 400 kg*m^2" if more else "1e-3 s",
    )  # fmt: skip


def _mesh(parts: Parts) -> DesignWarning | None:
    """Elements so few, or so many, that nothing was checked with their like."""
    count = sum(x.elements for x in parts.sections)
    longest = max(parts.sections, key=lambda x: x.travel_time / x.elements)
    key = f"drillstring.sections.{longest.name}.elements"
    if count > MOST_VERIFIED:
        return DesignWarning(
            f"{count} elements: neither engine was checked beyond {MOST_VERIFIED}",
            key, "left out: drillctl chooses",
        )  # fmt: skip
    if longest.inertia > 0.0 and off_the_line(parts, COARSE):
        return DesignWarning(
            f"the mesh is coarse: one of the first five frequencies is more than {COARSE:.0%} off "
            "that of the exact string",
            key, "left out: drillctl chooses",
        )  # fmt: skip
    return None


def _bends(tables: DesignTables) -> Iterator[DesignWarning]:
    """Sharp bends of the well."""
    if tables.well.survey:
        for depth, bend in sharp_bends(path_of(tables.well.survey)):
            yield DesignWarning(
                f"the well bends by {math.degrees(bend) * 30.0:.3g} deg/30 m below {depth:g} m: "
                "more than 15, where a string without bending stiffness says little",
                "well.survey", "stations between which the well bends by less",
            )  # fmt: skip


def _step(tables: DesignTables) -> DesignWarning | None:
    """A step that is longer than any that was checked over a map."""
    step = tables.simulation.step
    if step is None or step <= LONGEST_STEP:
        return None
    return DesignWarning(
        f"simulation.step {step * 1e3:g} ms is longer than the {LONGEST_STEP * 1e3:g} ms up to "
        "which the batch engine was checked",
        "simulation.step",
        "left out: simulation.accuracy decides",
    )
