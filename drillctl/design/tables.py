"""The tables of a design file, validated and frozen. One class a table, numbers in SI.

Keys that are not listed here are refused. Every rule that ties two keys together stands in
the class that holds both.
"""

from __future__ import annotations

import itertools
import math
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field, create_model, field_validator, model_validator

from drillctl import registry, units
from drillctl.design.uncertain_tables import (
    AxisTable,
    DistributionTable,
    UncertaintyTable,
    flattened,
)
from drillctl.errors import InputError, nearest, shown
from drillctl.rig import table as q
from drillctl.rig.axial import AxialTable
from drillctl.rig.bit_rock.law import friction_laws
from drillctl.rig.bit_rock.variation import RATE_OF_PENETRATION
from drillctl.rig.drillstring import GRADES, PIPES, Joint
from drillctl.rig.drillstring.catalogue import FOOT, find
from drillctl.rig.table import Table, one_of
from drillctl.rig.top_drive.ideal import PITable
from drillctl.rig.top_drive.law import DriveLimits, curve_limits, drive_laws
from drillctl.rig.weight_on_bit.law import ConstantWeightTable, weight_laws

if TYPE_CHECKING:  # a law's own keys are known to its file alone
    BitRockTable = Any
    ControllerTable = Any
    WeightOnBitTable = Any
else:
    BitRockTable = one_of(friction_laws().values())
    ControllerTable = one_of(drive_laws().values())
    WeightOnBitTable = one_of(weight_laws().values())


class OperatingPoint(Table):
    """Where the rig drills: final set speed and nominal weight on bit.

    `rate_of_penetration`: at which a rock that varies over depth passes by.
    """

    speed: q.PositiveSpeed = 100 * units.RPM
    weight_on_bit: q.Weight = 120e3
    rate_of_penetration: q.Penetration = RATE_OF_PENETRATION


RANGE_2 = 31.0 * FOOT  # length (m) of a joint of pipe where nothing else is given
JOINT = ("joint_outer_diameter", "joint_inner_diameter", "joint_length")


class SectionTable(Table):
    """A section: a component by name, or geometry, or polar moment, or a lumped spring.

    Without `elements` they are chosen: the first five frequencies of the string, top free and
    held, are those of the exact line to 0.3 %, and short pieces are lumped into neighbours that
    name no elements either. `pipe` is a name of `drillctl catalog`, sizes spelt in any way; a tool
    has its length there. `length` is that of one piece, of which there are `repeat`. `inertia` is a
    point inertia at the lower end of each. Tool joints, one in each `joint_spacing` (a piece, or
    31 ft), enter by their compliance and inertia: those given, or with `tool_joints` those of the
    catalogue for this pipe and grade. `tool_joint_factor` multiplies the inertia by hand. In a well
    count also `linear_mass`, of its steel per length, and `contact_diameter`, at which it touches
    the wall: by default those of the body with its tool joints.
    """

    name: q.Name
    elements: q.Count | None = None
    length: q.Length | None = None
    repeat: q.Count = 1
    pipe: str | None = None
    grade: str | None = None
    outer_diameter: q.Diameter | None = None
    inner_diameter: q.Bore | None = None
    polar_moment: q.PolarMoment | None = None
    tool_joints: bool = False
    joint_outer_diameter: q.Diameter | None = None
    joint_inner_diameter: q.Bore | None = None
    joint_length: q.Length | None = None
    joint_spacing: q.Length | None = None
    shear_modulus: q.Modulus | None = None
    youngs_modulus: q.Modulus | None = None
    poisson_ratio: q.PoissonRatio | None = None
    density: q.Density | None = None
    linear_mass: q.LinearMass | None = None
    contact_diameter: q.Diameter | None = None
    tool_joint_factor: q.Factor = 1.0
    stiffness: q.Stiffness | None = None
    inertia: q.Inertia | None = None
    damping: q.Damping = 0.0
    stiffness_damping: q.TimeOrZero | None = None
    mass_damping: q.Rate = 0.0
    drag: q.Drag = 0.0

    @property
    def span(self) -> float:
        """Length of all its pieces (m); 0 for a lumped spring."""
        return (self.length or 0.0) * self.repeat

    @property
    def diameters(self) -> tuple[float, float] | None:
        """Outer and inner diameter of the body (m), where it has them."""
        if self.pipe is not None:
            return PIPES[self.pipe].outer_diameter, PIPES[self.pipe].inner_diameter
        if self.outer_diameter is None or self.inner_diameter is None:
            return None
        return self.outer_diameter, self.inner_diameter

    @property
    def pieces(self) -> tuple[SectionTable, ...]:
        """Sections of their own: equal pieces with something at their ends, else the one run."""
        if self.repeat == 1 or (self.stiffness is None and self.inertia is None):
            return (self,)
        numbers = range(1, self.repeat + 1)
        return tuple(
            self.model_copy(update={"name": f"{self.name} {n}", "repeat": 1}) for n in numbers
        )

    @property
    def joint(self) -> tuple[Joint, ...]:
        """What is thicker than the body in each joint spacing: tool joint and upset."""
        if self.tool_joints:
            return PIPES[self.pipe or ""].thick(self.grade)
        if self.joint_length is None:
            return ()
        assert self.joint_outer_diameter is not None
        assert self.joint_inner_diameter is not None
        return (Joint(self.joint_outer_diameter, self.joint_inner_diameter, self.joint_length),)

    @property
    def spacing(self) -> float:
        """Length of a joint of pipe (m)."""
        if self.joint_spacing is not None:
            return self.joint_spacing
        own = PIPES[self.pipe].joint_spacing if self.pipe else RANGE_2
        return (self.length or own) if self.repeat > 1 else min(own, self.length or own)

    @model_validator(mode="before")
    @classmethod
    def _by_name(cls, data: Any) -> Any:
        """The component's own name, and its length where it has one."""
        name = data.get("pipe") if isinstance(data, dict) else None
        found = find(name) if isinstance(name, str) else None
        if found is None:
            return data
        length = PIPES[found].length
        return {**({"length": units.SI(length)} if length else {}), **data, "pipe": found}

    @field_validator("pipe")
    @classmethod
    def _known_pipe(cls, value: str | None) -> str | None:
        if value is not None and value not in PIPES:
            raise InputError(f"no API pipe {value!r}; {nearest(value, PIPES)}")
        return value

    @field_validator("grade")
    @classmethod
    def _known_grade(cls, value: str | None) -> str | None:
        if value is not None and value not in GRADES:
            raise InputError(f"no grade {value!r}; {nearest(value, GRADES)}")
        return value

    @model_validator(mode="after")
    def _one_description(self) -> SectionTable:
        ways = {
            "pipe": self.pipe,
            "outer_diameter": self.outer_diameter,
            "polar_moment": self.polar_moment,
            "stiffness": self.stiffness,
        }
        given = [way for way, value in ways.items() if value is not None]
        if len(given) != 1:
            came = " and ".join(given) or "none of them"
            raise InputError(f"needs exactly one of {', '.join(ways)}; got {came}")
        if self.stiffness is not None:
            self._only_lumped_keys()
        else:
            self._enough_geometry()
            self._whole_joints()
        if len(self.name) and self.repeat > MOST_PIECES:
            raise InputError(f"repeat {self.repeat} is not allowed: at most {MOST_PIECES}")
        return self

    def _only_lumped_keys(self) -> None:
        distributed = (
            "length", "grade", "inner_diameter", "shear_modulus", "youngs_modulus",
            "poisson_ratio", "density", "linear_mass", "contact_diameter", *JOINT,
            "joint_spacing",
        )  # fmt: skip
        given = [key for key in distributed if getattr(self, key) is not None]
        given += ["drag"] if self.drag else []
        given += ["tool_joint_factor"] if self.tool_joint_factor != 1.0 else []
        given += ["tool_joints"] if self.tool_joints else []
        for key in given:
            raise InputError(f"{key} is not allowed with stiffness (a lumped spring)")
        if (self.elements or 1) != 1:
            raise InputError("elements must be 1 for a lumped spring (stiffness)")

    def _enough_geometry(self) -> None:
        if self.length is None:
            raise InputError('length is missing, e.g. length = "3000 m"')
        if self.outer_diameter is None and self.inner_diameter is not None:
            raise InputError("inner_diameter requires outer_diameter")
        if self.outer_diameter is not None:
            if self.inner_diameter is None:
                raise InputError('inner_diameter is missing ("0 mm" for a solid bar)')
            _refuse_thick("", self.outer_diameter, self.inner_diameter)
        if self.grade is not None and self.polar_moment is not None:
            raise InputError("grade needs pipe or outer_diameter, not polar_moment")
        if self.shear_modulus is not None and self.youngs_modulus is not None:
            raise InputError("give shear_modulus or youngs_modulus, not both")
        if self.poisson_ratio is not None and self.youngs_modulus is None:
            raise InputError("poisson_ratio requires youngs_modulus")
        if self.poisson_ratio is not None and not -1.0 < self.poisson_ratio < 0.5:
            raise InputError(f"poisson_ratio {self.poisson_ratio:g} must lie between -1 and 0.5")

    def _whole_joints(self) -> None:
        given = [key for key in JOINT if getattr(self, key) is not None]
        if given and len(given) < len(JOINT):
            missing = next(key for key in JOINT if key not in given)
            raise InputError(f"{missing} is missing: a tool joint has {', '.join(JOINT)}")
        if self.joint_spacing is not None and not (given or self.tool_joints):
            raise InputError("joint_spacing is of tool joints: give them, or tool_joints = true")
        if given and (self.diameters is None or self.tool_joints):
            other = "tool_joints = true" if self.tool_joints else "polar_moment"
            raise InputError(f"{given[0]} is not allowed with {other}")
        if self.tool_joints and (self.pipe is None or not self.joint):
            raise InputError("tool_joints = true needs a pipe that has some in the catalogue")
        for one in self.joint:
            _refuse_thick("joint_", one.outer_diameter, one.inner_diameter)
        length = sum(one.length for one in self.joint)
        if self.joint and length >= self.spacing:
            raise InputError(
                f"joint_length {length:g} m must be less than joint_spacing {self.spacing:g} m"
            )


MOST_PIECES = 10_000  # equal pieces of a section


def _refuse_thick(prefix: str, outer: float, inner: float) -> None:
    if inner >= outer:
        raise InputError(
            f"{prefix}inner_diameter {inner * 1e3:g} mm must be less than "
            f"{prefix}outer_diameter {outer * 1e3:g} mm"
        )


def refuse_same_names(names: list[str], where: str = "") -> None:
    """Refuse (`InputError`) two sections of one name: the name is the section's address."""
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"two sections are called {name!r}; names must differ", where)


class DrillstringTable(Table):
    """The string: its sections from top to bottom.

    `stiffness_damping`: of every section that gives none of its own. `tally`: a file (CSV or .xlsx)
    or its lines, which are read into sections; those under `sections` are laid over them by name.
    `tally_from`: which end its first line is at.
    """

    mass: Literal["consistent", "lumped"] = "consistent"
    modal_damping: q.DampingRatio = 0.0
    stiffness_damping: q.TimeOrZero = 0.0
    tally: str | None = None
    tally_from: Literal["top", "bit"] | None = None
    sections: tuple[SectionTable, ...]

    @field_validator("sections")
    @classmethod
    def _named_once(cls, sections: tuple[SectionTable, ...]) -> tuple[SectionTable, ...]:
        if not sections:
            raise InputError("a drillstring needs at least one section")
        refuse_same_names([section.name for section in sections])
        if any(section.repeat > 1 for section in sections):
            refuse_same_names([piece.name for section in sections for piece in section.pieces])
        return sections


class TopDriveTable(Table):
    """The top drive (rotary table): a body at the pipe, or motors behind a gear, and their limits.

    Inertia counts at the pipe: `inertia`, or the motors' times the gear ratio squared and that of
    the gear, `motors motor_inertia gear_ratio^2 + gearbox_inertia`. `limits_at` says whether the
    limits are of one motor, or at the pipe. From motor to pipe torque counts `motors gear_ratio
    efficiency` times, speed one over `gear_ratio` times. `torque_speed`: points [speed, torque] of
    constant torque, then constant power, up to the maximum speed, beyond which the torque falls to
    zero over a tenth of it. Where no constant power goes through the points within 3 %, the limit
    is straight between them.
    `intermittent_torque` limits the torque as well; `continuous_torque` is measured against.
    Narrower limits of `[controller.drive]` hold.
    """

    inertia: q.Inertia | None = None
    motor_inertia: q.Inertia | None = None
    gear_ratio: q.Factor | None = None
    motors: q.Count = 1
    gearbox_inertia: q.Inertia = 0.0
    efficiency: q.Share = 1.0
    limits_at: Literal["motor", "pipe"] | None = None
    continuous_torque: q.TorqueLimit = None
    intermittent_torque: q.TorqueLimit = None
    torque_speed: tuple[tuple[q.SpeedOrZero, q.TorqueOrZero], ...] = ()
    damping: q.Damping = 0.0

    @field_validator("gear_ratio", mode="before")
    @classmethod
    def _to_one(cls, value: Any) -> Any:
        """A ratio as it stands on a plate, `7.2:1`."""
        first, _, second = value.partition(":") if isinstance(value, str) else ("", "", "")
        whole = second.strip() == "1" and units.bare(first)
        return float(units.pointed(first)) if whole else value

    @property
    def at_pipe(self) -> float:
        """Inertia at the pipe (kg m2)."""
        if self.inertia is not None:
            return self.inertia
        assert self.motor_inertia is not None
        assert self.gear_ratio is not None
        return self.motors * self.motor_inertia * self.gear_ratio**2 + self.gearbox_inertia

    @property
    def limits(self) -> DriveLimits:
        """What it can give at the pipe."""
        ratio = (self.gear_ratio or 1.0) if self.limits_at == "motor" else 1.0
        gain = ratio * self.motors * self.efficiency if self.limits_at == "motor" else 1.0
        curve = curve_limits(tuple((w / ratio, gain * torque) for w, torque in self.torque_speed))
        intermittent, continuous = (
            math.inf if torque is None else gain * torque
            for torque in (self.intermittent_torque, self.continuous_torque)
        )
        return curve._replace(torque=min(curve.torque, intermittent), continuous=continuous)

    @model_validator(mode="after")
    def _one_inertia(self) -> TopDriveTable:
        behind = [key for key in ("motor_inertia", "gear_ratio") if getattr(self, key) is not None]
        behind += ["gearbox_inertia"] if self.gearbox_inertia else []
        if self.inertia is not None and behind:
            raise InputError(
                f"{behind[0]} is not allowed with inertia, which counts at the pipe already: the "
                "motors' times gear_ratio^2; give motor_inertia, gear_ratio, motors and "
                "gearbox_inertia in its place"
            )
        if self.inertia is None and not behind:
            raise InputError("inertia is missing, or motor_inertia with its gear_ratio")
        for key in ("motor_inertia", "gear_ratio"):
            if self.inertia is None and key not in behind:
                raise InputError(
                    f"{key} is missing beside {behind[0]}; an inertia that counts at the pipe "
                    "already (the motors' times gear_ratio^2) needs neither"
                )
        refusal = q.WHEEL.refusal(self.at_pipe, units.INERTIA)
        if refusal:
            raise InputError(f"an inertia of {self.at_pipe:g} kg*m^2 at the pipe: {refusal}")
        if self.efficiency == 0.0:
            raise InputError("efficiency 0 is not allowed: it must be greater than 0")
        return self

    @model_validator(mode="after")
    def _where_limits_count(self) -> TopDriveTable:
        keys = ("continuous_torque", "intermittent_torque", "torque_speed")
        given = [key for key in keys if getattr(self, key)]
        if given and self.limits_at is None:
            raise InputError(f'limits_at is missing: {given[0]} at the "motor" or at the "pipe"?')
        if self.limits_at == "motor" and self.gear_ratio is None:
            raise InputError('limits_at = "motor" needs motor_inertia and gear_ratio')
        _ = self.limits
        return self


class HoleTable(Table):
    """A run of hole or casing of one inner diameter, down to `to`; the last, to the bit.

    `friction_factor`: of this run, in place of that of the well.
    """

    to: q.Length | None = None
    diameter: q.Diameter
    friction_factor: q.FrictionFactor | None = None


class WellTable(Table):
    """The well: its path, its holes from the top down, the mud in it, the friction of its wall.

    `survey`: a CSV file, its lines, or stations [measured depth, inclination, azimuth]; a well
    without one is vertical. With `mud_viscosity` the mud takes a viscous torque from every section
    with an outer diameter, that of laminar flow between concentric cylinders. `mud_density` does
    not enter it; it lightens the string (`drillctl torque-drag`), and says whether the flow is
    laminar (`drillctl show` prints the Taylor number).

    `friction_factor` times the side force of a soft string is the dry friction of the wall, at
    rest up to that, and beyond `critical_speed` a `friction_ratio` of it. It acts at
    `friction_nodes` nodes, the bit among them. `tension = false` leaves the tension out of the side
    force. `axial_speed`: downwards while drilling ahead or running in, negative while pulled out;
    it turns part of the friction along the well, and no node sticks.
    """

    survey: tuple[tuple[q.Depth, q.Angle, q.Angle], ...] = ()
    holes: tuple[HoleTable, ...] = ()
    mud_density: q.MudDensity | None = None
    mud_viscosity: q.Viscosity | None = None
    friction_factor: q.FrictionFactor | None = None
    friction_ratio: q.Share = 1.0
    critical_speed: q.SpeedOrZero = 1.5
    friction_nodes: q.Count = 12
    tension: bool = True
    axial_speed: q.Velocity = 0.0

    @model_validator(mode="after")
    def _downwards(self) -> WellTable:
        ends = [hole.to for hole in self.holes[:-1] if hole.to is not None]
        if len(ends) < len(self.holes) - 1 or ends != sorted(set(ends)):
            raise InputError("holes: each but the last ends at a depth, below the one above")
        if self.mud_viscosity is not None and not self.holes:
            raise InputError("mud_viscosity needs holes: the torque depends on the clearance")
        return self


class BhaTable(Table):
    """The bottom-hole assembly with the bit, as a body."""

    inertia: q.Inertia = 0.0
    damping: q.Damping = 0.0


class StartTable(Table):
    """State of the string at time zero.

    `rest`: still, untwisted, bit stuck. `turning`: every node at `speed`, untwisted.
    `wound_up`: bit stuck, twisted to the static torque, top at the set speed. `steady`: drilling at
    the set speed with its twist, the rock cut accordingly; `bit_speed` is that of the bit alone.
    """

    kind: Literal["rest", "turning", "wound_up", "steady"] = "turning"
    speed: q.Speed | None = None
    bit_speed: q.Speed | None = None

    @model_validator(mode="after")
    def _speed_when_turning(self) -> StartTable:
        if self.kind != "turning" and self.speed is not None:
            raise InputError(f"speed is not allowed with kind = {self.kind!r}, only with 'turning'")
        if self.kind != "steady" and self.bit_speed is not None:
            raise InputError(
                f"bit_speed is not allowed with kind = {self.kind!r}, only with 'steady'"
            )
        return self


class ProgramTable(Table):
    """How a value comes to that of the operating point."""

    @model_validator(mode="before")
    @classmethod
    def _points_alone(cls, value: object) -> object:
        return {"points": value} if isinstance(value, list | tuple) else value

    @model_validator(mode="after")
    def _in_order(self) -> ProgramTable:
        start, begin, end, points = (
            getattr(self, key) for key in ("start", "begin", "end", "points")
        )
        if end < begin:
            raise InputError(f"end {end:g} s must not come before begin {begin:g} s")
        if points and (begin or end or start is not None):
            raise InputError("points is not allowed with start, begin and end: give one of the two")
        for (before, _), (time, _) in itertools.pairwise(points):
            if time < before:
                raise InputError(f"points: {time:g} s must not come after {before:g} s")
        return self


class SpeedProgramTable(ProgramTable):
    """Set speed: `start` up to `begin`, the operating speed from `end` on, straight between.

    Or `points` of time and speed, straight between them, a step where a time stands twice; the
    last is the operating speed, which may be written `set`. `[scenario] speed = [["0 s", "0 rpm"],
    ["30 s", "set"]]` is the same. `lag`: time constant of first order behind which the drive
    follows all that.
    """

    start: q.Speed | None = None
    begin: q.TimeOrZero = 0.0
    end: q.TimeOrZero = 0.0
    points: tuple[tuple[q.TimeOrZero, Literal["set"] | q.Speed], ...] = ()
    lag: q.Lag = 0.0


class WeightProgramTable(ProgramTable):
    """Nominal weight: `start` up to `begin`, that of the operating point from `end` on.

    Or `points` of time and weight, as with the speed.
    """

    start: q.Weight | None = None
    begin: q.TimeOrZero = 0.0
    end: q.TimeOrZero = 0.0
    points: tuple[tuple[q.TimeOrZero, Literal["set"] | q.Weight], ...] = ()


class RockProgramTable(Table):
    """Rock: torques and decay times these factors before the time `until`."""

    until: q.TimeOrZero = 0.0
    static_factor: q.Factor = 1.0
    sliding_factor: q.Factor = 1.0
    decay_factor: q.Factor = 1.0


class ScenarioTable(Table):
    """What was before: the design's own values are those that a run ends with."""

    speed: SpeedProgramTable = SpeedProgramTable()
    weight_on_bit: WeightProgramTable = WeightProgramTable()
    bit_rock: RockProgramTable = RockProgramTable()


MOST_STEPS = 1e9  # of a run of the batch engine: an hour's work


class SimulationTable(Table):
    """How long and how finely to simulate."""

    duration: q.Duration = 100.0
    j1_from: q.TimeOrZero = 0.0
    step: q.Time | None = None
    modes: q.Count | None = None
    accuracy: Literal["fast", "standard", "fine"] = "standard"
    engine: Literal["reference", "batch"] | None = None

    @model_validator(mode="after")
    def _window(self) -> SimulationTable:
        if self.j1_from >= self.duration:
            raise InputError(
                f"j1_from {self.j1_from:g} s must be less than duration {self.duration:g} s"
            )
        if self.step is not None and self.step > self.duration:
            raise InputError(f"step {self.step:g} s must not exceed duration {self.duration:g} s")
        if self.step is not None and self.duration / self.step > MOST_STEPS:
            raise InputError(
                f"step {self.step:g} s: more than {MOST_STEPS:g} steps in the duration"
            )
        return self


class MapTable(Table):
    """The map over gains or any other parameters.

    Without `axes` it runs over the two numbers that the drive's law is tuned by, or over one and
    the set speed, in the ranges that fit the rig, 41 x 41.
    """

    axes: tuple[AxisTable, ...] = ()
    levels: tuple[q.PositiveNumber, ...] = (20.0, 30.0, 40.0, 50.0)
    audit_cells: q.CountOrZero = 48

    @field_validator("levels")
    @classmethod
    def _sorted_levels(cls, levels: tuple[float, ...]) -> tuple[float, ...]:
        if not levels:
            raise InputError("a map needs at least one level")
        return tuple(sorted(set(levels)))

    @field_validator("axes")
    @classmethod
    def _axes(cls, axes: tuple[AxisTable, ...]) -> tuple[AxisTable, ...]:
        if not axes:
            raise InputError("a map needs at least one axis")
        paths = [axis.path for axis in axes]
        for path in paths:
            if paths.count(path) > 1:
                raise InputError(f"two axes run over {path!r}")
        return axes


class OwnTables(Table):
    """A whole design file, but for the tables of studies."""

    schema_version: Literal[1] = Field(default=1, alias="schema")
    title: str = ""
    author: str = ""
    source: str = ""
    status: str = ""
    notes: str = ""
    units: Literal["si", "field"] | None = None
    operating_point: OperatingPoint = OperatingPoint()
    drillstring: DrillstringTable
    top_drive: TopDriveTable
    bha: BhaTable = BhaTable()
    axial: AxialTable = AxialTable()
    well: WellTable = WellTable()
    bit_rock: BitRockTable
    controller: ControllerTable = PITable(law="pi", kp=200.0, ki=100.0)
    weight_on_bit: WeightOnBitTable = ConstantWeightTable()
    start: StartTable = StartTable()
    scenario: ScenarioTable = ScenarioTable()
    simulation: SimulationTable = SimulationTable()
    map: MapTable = MapTable()
    uncertain: dict[str, DistributionTable] = Field(default_factory=dict)
    uncertainty: UncertaintyTable = UncertaintyTable()

    @field_validator("uncertain", mode="before")
    @classmethod
    def _paths(cls, value: object) -> object:
        return flattened(value) if isinstance(value, dict) else value

    @model_validator(mode="before")
    @classmethod
    def _has_schema(cls, data: Any) -> Any:
        if isinstance(data, dict) and "schema" in data:
            came = data["schema"]
            if came != 1 or not isinstance(came, int) or isinstance(came, bool):
                raise InputError(
                    f"schema = {shown(came)} is not known; this version reads schema = 1"
                )
        return data


def settings_of_studies() -> dict[str, type[Table]]:
    """Tables of the studies by key: `KEY` and `Settings` of the `settings.py` beside each."""
    results: dict[str, type[Table]] = {}
    for study in registry.STUDIES:
        if find_spec(f"{study}.settings") is not None:
            settings = import_module(f"{study}.settings")
            results[settings.KEY] = settings.Settings
    return results


if TYPE_CHECKING:

    class DesignTables(OwnTables):
        """A whole design file after it was merged over its model."""

        def __getattr__(self, name: str) -> Any: ...

else:
    DesignTables = create_model(
        "DesignTables",
        __base__=OwnTables,
        __module__=__name__,
        __doc__="A whole design file after it was merged over its model.",
        **{key: (table, table()) for key, table in settings_of_studies().items()},
    )
