"""Pipes, collars and tools by the names that drillers use: `catalogue.csv`, read once.

Each row has its source and what was checked of it.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drillctl.rig.drillstring.section import GRADES, PSI, polar_moment, torsional_yield

INCH = 0.0254
FOOT = 0.3048
POUND_PER_FOOT = 1.488163943569554  # kg/m
STEEL = 7850.0  # density (kg/m3)

HWDP_YIELD = 55e3 * PSI
"""Minimum yield strength (Pa) of the tube of conventional heavy weight pipe."""


@dataclass(frozen=True)
class Joint:
    """A tool joint, box and pin made up.

    Attributes
    ----------
    outer_diameter, inner_diameter, length : float
        Of box and pin together (m).
    """

    outer_diameter: float
    inner_diameter: float
    length: float

    @property
    def area(self) -> float:
        """Steel in its cross-section (m^2)."""
        return 0.25 * math.pi * (self.outer_diameter**2 - self.inner_diameter**2)


@dataclass(frozen=True)
class Pipe:
    """A component of the catalogue: pipe, collar or tool.

    Attributes
    ----------
    kind : str
        `drill pipe`, `HWDP`, `collar` or `tool`.
    outer_diameter, inner_diameter : float
        Of the body (m).
    weight : float
        Nominal mass per length (kg/m), by which it is called; 0 for a tool.
    joints : dict
        Its tool joint by grade.
    joint_spacing : float
        Length of a joint of pipe, shoulder to shoulder (m); 0 where it has none.
    upset : Joint or None
        Thick middle part of a heavy weight pipe, of the body's bore.
    length, mass, inertia, stiffness : float
        Of a tool (m, kg, kg m2, N m/rad); 0 for what has any length.
    connection, source, checked : str
        Thread, where the figures come from, and what of them was checked.
    """

    kind: str
    outer_diameter: float
    inner_diameter: float
    weight: float
    joints: dict[str, Joint]
    joint_spacing: float
    upset: Joint | None
    length: float
    mass: float
    inertia: float
    stiffness: float
    connection: str
    source: str
    checked: str

    def joint(self, grade: str | None) -> Joint | None:
        """The tool joint for a grade; of the lowest grade where none is given, or it has none."""
        if grade in self.joints:
            return self.joints[grade]
        return next(iter(self.joints.values()), None)

    @property
    def area(self) -> float:
        """Steel in the cross-section of the body (m^2)."""
        return 0.25 * math.pi * (self.outer_diameter**2 - self.inner_diameter**2)

    def thick(self, grade: str | None) -> tuple[Joint, ...]:
        """What is thicker than the body in each joint of pipe: tool joint and upset."""
        return tuple(one for one in (self.joint(grade), self.upset) if one is not None)


@dataclass(frozen=True)
class Homogenised:
    """A pipe with its tool joints over the body alone, for motion slow over a joint of pipe.

    Compliances in series and inertias summed over one joint of pipe are exact where a wave is long
    against it.

    Attributes
    ----------
    stiffness, inertia : float
        Factors on the torsional stiffness and on the inertia of the body.
    """

    stiffness: float
    inertia: float


def homogenised(
    outer_diameter: float, inner_diameter: float, spacing: float, pieces: tuple[Joint, ...]
) -> Homogenised:
    """Factors of a body with pieces of other cross-section in each `spacing` (all m)."""
    body = polar_moment(outer_diameter, inner_diameter)
    left = spacing - sum(piece.length for piece in pieces)
    moments = [(left, body)] + [
        (piece.length, polar_moment(piece.outer_diameter, piece.inner_diameter)) for piece in pieces
    ]
    compliance = sum(length / moment for length, moment in moments)
    inertia = sum(length * moment for length, moment in moments)
    return Homogenised(spacing / body / compliance, inertia / (spacing * body))


CATALOGUE = Path(__file__).with_name("catalogue.csv")


def _read() -> Iterator[tuple[str, Pipe]]:
    with CATALOGUE.open(encoding="utf-8", newline="") as stream:
        yield from map(_row, csv.DictReader(line for line in stream if line[0] != "#"))


def _row(row: dict[str, str]) -> tuple[str, Pipe]:
    def number(column: str, unit: float = 1.0) -> float:
        return float(row[column]) * unit if row[column] else 0.0

    joints = {}
    for grade in ("E-75", "X-95", "G-105", "S-135"):
        if row[grade]:
            outer, inner = (float(x) * INCH for x in row[grade].split("x"))
            joints[grade] = Joint(outer, inner, number("joint length [in]", INCH))
    inner = number("id [in]", INCH)
    upset = Joint(number("upset od [in]", INCH), inner, number("upset length [in]", INCH))
    return row["name"], Pipe(
        row["kind"], number("od [in]", INCH), inner, number("weight [lb/ft]", POUND_PER_FOOT),
        joints, number("joint spacing [ft]", FOOT), upset if upset.length else None,
        number("length [m]"), number("mass [kg]"), number("inertia [kg*m^2]"),
        number("stiffness [N*m/rad]"), row["connection"], row["source"], row["checked"],
    )  # fmt: skip


PIPES: dict[str, Pipe] = dict(_read())
"""Every component by name."""

_KINDS = {
    "HWDP": r"\bhw|hwdp|heavy|hevi|tungvekt|lourde|schwergest",
    "collar": r"collar|\bn?m?dcs?\b|monel|schwerstange|vektrør|masse-?tige|zwaarstang|"
    r"portamecha|lastbarrena",
    "jar": r"\bjar|schlagschere|coulisse", "stabiliser": r"stab",
    "MWD": r"\b[ml]wd\b", "motor": r"moto|moteur|\bpdm\b",
}  # fmt: skip
_SIZE = re.compile(
    r"""(?:(?P<whole>\d+)[ -])?(?P<over>\d+)/(?P<under>\d+)|(?P<decimal>\d+(?:\.\d+)?|\.\d+)"""
)


def sizes_in(text: str) -> list[float]:
    """Every number of a text, fractions as drillers write them: `4 1/2` is 4.5."""
    return [
        float(found["decimal"])
        if found["decimal"]
        else float(found["whole"] or 0) + int(found["over"]) / max(int(found["under"]), 1)
        for found in _SIZE.finditer(text)
    ]


def kind_in(text: str) -> str:
    """Which component a name speaks of: a key of `_KINDS`, or drill pipe."""
    lower = text.lower()
    return next((kind for kind, words in _KINDS.items() if re.search(words, lower)), "drill pipe")


def find(text: str) -> str | None:
    """The component that a text means, however it spells sizes: `4.5" 16.60#` in `4 1/2 in ...`."""
    if text in PIPES:
        return text
    kind, sizes = kind_in(text), sizes_in(text)
    if not sizes or (kind == "drill pipe" and len(sizes) < 2):
        return None
    for name, pipe in PIPES.items():
        if pipe.kind != kind and not (pipe.kind == "tool" and name.endswith(kind)):
            continue
        own = sizes_in(name)
        close = [abs(a - b) < 0.02 for a, b in zip(own, sizes, strict=False)]
        if all(close):
            return name
    return None


def drill_pipe(
    outer_diameter: float, weight: float | None, heavy: bool = False, bore: float = 0.0
) -> str | None:
    """The pipe of an outer diameter (m) and a nominal mass per length (kg/m) or a bore (m)."""
    for name, pipe in PIPES.items():
        if bore:  # a weight that stands beside it may be that with tool joints
            meant = abs(pipe.inner_diameter - bore) < 6e-4
        else:
            meant = weight is not None and abs(pipe.weight - weight) < 0.012 * pipe.weight
        if pipe.kind == ("HWDP" if heavy else "drill pipe") and (
            abs(pipe.outer_diameter - outer_diameter) < 3e-4 and (heavy or meant)
        ):
            return name
    return None


_THICK = re.compile(
    r"\bsub\b|\bx-?/?o\b|cross-? ?over|reamer|filter|float|\bl?rss\b|rotary steer|shock|saver|"
    r"circulat|hang"
)


def typical_bore(name: str, outer_diameter: float) -> float | None:
    """Bore (m) of the next collar or tool in size, of what is one by its name."""
    kind = kind_in(name)
    if kind in ("drill pipe", "HWDP") and not _THICK.search(name.lower()):
        return None
    collars = [pipe for pipe in PIPES.values() if pipe.kind == "collar"]
    # Of two bores of one size the larger.
    nearest = min(reversed(collars), key=lambda pipe: abs(pipe.outer_diameter - outer_diameter))
    return nearest.inner_diameter if nearest.inner_diameter < 0.6 * outer_diameter else None


def summary(pipe: Pipe) -> dict[str, Any]:
    """A component as strict JSON values, SI; of its highest grade; None for what it has not."""
    grade = next(reversed(pipe.joints), None)
    thick = pipe.thick(grade)
    sizes = (pipe.outer_diameter, pipe.inner_diameter)
    factors = homogenised(*sizes, pipe.joint_spacing, thick) if thick else None
    extra = sum((one.area - pipe.area) * one.length for one in thick)
    strength = {"drill pipe": GRADES["S-135"], "HWDP": HWDP_YIELD}.get(pipe.kind)
    tool = pipe.kind == "tool"
    return {
        "kind": pipe.kind,
        "outer_diameter": pipe.outer_diameter,
        "inner_diameter": pipe.inner_diameter,
        "mass_per_length": pipe.mass / pipe.length if tool else STEEL * pipe.area,
        "mass_per_length_with_joints": STEEL * (pipe.area + extra / pipe.joint_spacing)
        if thick
        else None,
        "joint_grade": grade,
        "inertia_factor": factors.inertia if factors else None,
        "stiffness_factor": factors.stiffness if factors else None,
        "yield_torque": torsional_yield(*sizes, strength) if strength else None,
        "length": pipe.length or None,
        "mass": pipe.mass or None,
        "inertia": pipe.inertia or None,
        "stiffness": pipe.stiffness or None,
        "connection": pipe.connection or None,
        "source": pipe.source,
        "checked": pipe.checked,
    }
