"""The tables of a design file, validated and frozen. One class a table, numbers in SI.

Keys that are not listed here are refused. Every rule that ties two keys together stands in
the class that holds both.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from drillctl import units
from drillctl.bit_rock.over_weight import KNOTS as KNOTS_OVER_WEIGHT
from drillctl.bit_rock.tabulated import KNOTS
from drillctl.design import quantities as q
from drillctl.design.base import Table as Table
from drillctl.design.base import number_or_quantity
from drillctl.design.compare_tables import CompareTable
from drillctl.design.uncertain_tables import DistributionTable, UncertaintyTable, flattened
from drillctl.drillstring import GRADES, PIPES
from drillctl.errors import InputError, nearest, shown


class OperatingPoint(Table):
    """Where the rig drills: final set speed and nominal weight on bit."""

    speed: q.PositiveSpeed = 100 * units.RPM
    weight_on_bit: q.Weight = 120e3


class SectionTable(Table):
    """A section: a pipe by API name, or geometry, or polar moment, or a lumped spring."""

    name: str
    elements: q.Count | None = None
    length: q.Length | None = None
    pipe: str | None = None
    grade: str | None = None
    outer_diameter: q.Diameter | None = None
    inner_diameter: q.Bore | None = None
    polar_moment: q.PolarMoment | None = None
    shear_modulus: q.Modulus | None = None
    youngs_modulus: q.Modulus | None = None
    poisson_ratio: q.Number | None = None
    density: q.Density | None = None
    tool_joint_factor: q.PositiveNumber = 1.0
    stiffness: q.Stiffness | None = None
    inertia: q.Inertia | None = None
    damping: q.Damping = 0.0
    stiffness_damping: q.TimeOrZero = 0.0
    mass_damping: q.Rate = 0.0
    drag: q.Drag = 0.0

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
        return self

    def _only_lumped_keys(self) -> None:
        distributed = (
            "length", "grade", "inner_diameter", "shear_modulus", "youngs_modulus",
            "poisson_ratio", "density",
        )  # fmt: skip
        given = [key for key in distributed if getattr(self, key) is not None]
        given += ["drag"] if self.drag else []
        given += ["tool_joint_factor"] if self.tool_joint_factor != 1.0 else []
        for key in given:
            raise InputError(f"{key} does not go with stiffness (a lumped spring)")
        if (self.elements or 1) != 1:
            raise InputError("elements must be 1 for a lumped spring (stiffness)")

    def _enough_geometry(self) -> None:
        if self.length is None:
            raise InputError('length is missing, e.g. length = "3000 m"')
        if self.inertia is not None:
            raise InputError("inertia goes with stiffness (a lumped spring) only")
        if self.outer_diameter is None and self.inner_diameter is not None:
            raise InputError("inner_diameter goes with outer_diameter only")
        if self.outer_diameter is not None:
            if self.inner_diameter is None:
                raise InputError('inner_diameter is missing ("0 mm" for a solid bar)')
            if self.inner_diameter >= self.outer_diameter:
                raise InputError(
                    f"inner_diameter {self.inner_diameter * 1e3:g} mm must be less than "
                    f"outer_diameter {self.outer_diameter * 1e3:g} mm"
                )
        if self.grade is not None and self.polar_moment is not None:
            raise InputError("grade needs pipe or outer_diameter, not polar_moment")
        if self.shear_modulus is not None and self.youngs_modulus is not None:
            raise InputError("give shear_modulus or youngs_modulus, not both")
        if self.poisson_ratio is not None and self.youngs_modulus is None:
            raise InputError("poisson_ratio goes with youngs_modulus only")
        if self.poisson_ratio is not None and not -1.0 < self.poisson_ratio < 0.5:
            raise InputError(f"poisson_ratio {self.poisson_ratio:g} must lie between -1 and 0.5")


def refuse_same_names(names: list[str], where: str = "") -> None:
    """Refuse (`InputError`) two sections of one name: the name is the section's address."""
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"two sections are called {name!r}; names must differ", where)


class DrillstringTable(Table):
    """The string: its sections from top to bottom."""

    mass: Literal["consistent", "lumped"] = "consistent"
    modal_damping: q.NonNegativeNumber = 0.0
    sections: tuple[SectionTable, ...]

    @field_validator("sections")
    @classmethod
    def _named_once(cls, sections: tuple[SectionTable, ...]) -> tuple[SectionTable, ...]:
        if not sections:
            raise InputError("a drillstring needs at least one section")
        refuse_same_names([section.name for section in sections])
        return sections


class TopDriveTable(Table):
    """The top drive (rotary table) as a body."""

    inertia: q.Inertia
    damping: q.Damping = 0.0


class BhaTable(Table):
    """The bottom-hole assembly with the bit, as a body."""

    inertia: q.Inertia = 0.0
    damping: q.Damping = 0.0


class FrictionRow(Table):
    """Friction coefficients at one weight on bit."""

    weight_on_bit: q.Weight
    a1: q.NonNegativeNumber
    a2: q.NonNegativeNumber
    beta: q.NonNegativeNumber

    @model_validator(mode="after")
    def _falling(self) -> FrictionRow:
        _refuse_rising(self.a1, self.a2)
        return self


MOST_ROWS = KNOTS_OVER_WEIGHT + 1
"""Most rows of a friction table over the weight on bit."""


def _refuse_rising(a1: float, a2: float) -> None:
    if a2 < a1:
        raise InputError(f"a2 = {a2:g} must not be less than a1 = {a1:g}")


class NavarroLopezSuarezTable(Table):
    """Friction of Navarro-Lopez & Suarez: coefficients, or a table of them over WOB."""

    law: Literal["navarro-lopez-suarez"]
    a1: q.NonNegativeNumber | None = None
    a2: q.NonNegativeNumber | None = None
    beta: q.NonNegativeNumber | None = None
    table: tuple[FrictionRow, ...] | None = None
    a1_factor: q.PositiveNumber = 1.0
    a2_factor: q.PositiveNumber = 1.0
    beta_factor: q.PositiveNumber = 1.0
    regularised_over: q.PositiveSpeed | None = None
    outside_table: Literal["refuse", "extrapolate"] = "refuse"

    @field_validator("table")
    @classmethod
    def _increasing(cls, table: tuple[FrictionRow, ...] | None) -> tuple[FrictionRow, ...] | None:
        if table is not None:
            if len(table) < 2:
                raise InputError("a table needs two rows or more; give a1, a2 and beta instead")
            if len(table) > MOST_ROWS:
                raise InputError(f"a table has at most {MOST_ROWS} rows, got {len(table)}")
            weights = [row.weight_on_bit for row in table]
            if weights[0] <= 0.0:
                raise InputError("weight_on_bit of the first row must be more than 0")
            if any(b <= a for a, b in pairwise(weights)):
                raise InputError("weight_on_bit must increase from row to row")
        return table

    @model_validator(mode="after")
    def _coefficients_or_table(self) -> NavarroLopezSuarezTable:
        numbers = {"a1": self.a1, "a2": self.a2, "beta": self.beta}
        given = [key for key, value in numbers.items() if value is not None]
        if self.table is not None and given:
            raise InputError(f"give table, or a1, a2 and beta; got table and {', '.join(given)}")
        if self.table is None and len(given) < 3:
            missing = [key for key in numbers if key not in given]
            raise InputError(f"{', '.join(missing)} missing: give a1, a2 and beta, or a table")
        if self.table is None:
            assert self.a1 is not None
            assert self.a2 is not None
            _refuse_rising(self.a1 * self.a1_factor, self.a2 * self.a2_factor)
        return self


class BitRadiusFrictionTable(Table):
    """The same law with a bit radius and friction coefficients (Navarro-Lopez & Cortes 2007).

    T = W R_b [mu_c + (mu_s - mu_c) exp(-gamma |w| / v_f)].
    """

    law: Literal["bit-radius-friction"]
    bit_radius: q.Diameter
    static_coefficient: q.NonNegativeNumber
    sliding_coefficient: q.NonNegativeNumber
    decay: q.NonNegativeNumber
    reference_speed: q.PositiveSpeed = 1.0
    regularised_over: q.PositiveSpeed | None = None

    @model_validator(mode="after")
    def _falling(self) -> BitRadiusFrictionTable:
        if self.static_coefficient < self.sliding_coefficient:
            raise InputError(
                f"static_coefficient = {self.static_coefficient:g} must not be less than "
                f"sliding_coefficient = {self.sliding_coefficient:g}"
            )
        return self


class JansenVanDenSteenTable(Table):
    """A static peak over a constant sliding torque (after Jansen & van den Steen 1995)."""

    law: Literal["jansen-van-den-steen"]
    a1: q.NonNegativeNumber
    a2: q.NonNegativeNumber

    @model_validator(mode="after")
    def _peak(self) -> JansenVanDenSteenTable:
        _refuse_rising(self.a1, self.a2)
        return self


class CoulombTable(Table):
    """The same torque at rest and at any speed: a x weight on bit."""

    law: Literal["coulomb"]
    a: q.NonNegativeNumber


class TuckerWangTable(Table):
    """Smooth friction with a hump (Tucker & Wang family); defaults of a public model."""

    law: Literal["tucker-wang"]
    a: q.NonNegativeNumber = 0.0239
    b1: q.PositiveNumber = 1.91
    b2: q.NonNegativeNumber = 8.5
    b3: q.NonNegativeNumber = 5.47


class StribeckTable(Table):
    """Stribeck friction regularised by tanh, smooth; defaults of a public simulator."""

    law: Literal["stribeck"]
    bit_radius: q.Diameter
    static_coefficient: q.NonNegativeNumber = 0.8
    sliding_coefficient: q.NonNegativeNumber = 0.5
    stribeck_speed: q.PositiveSpeed = 1.0
    regularised_over: q.PositiveSpeed = 0.05

    @model_validator(mode="after")
    def _falling(self) -> StribeckTable:
        if self.static_coefficient < self.sliding_coefficient:
            raise InputError(
                f"static_coefficient = {self.static_coefficient:g} must not be less than "
                f"sliding_coefficient = {self.sliding_coefficient:g}"
            )
        return self


class FrictionPoint(Table):
    """Torque over weight on bit at one speed."""

    speed: q.Speed
    a: q.NonNegativeNumber


class TabulatedFrictionTable(Table):
    """Measured points of torque over weight, straight lines between them."""

    law: Literal["tabulated"]
    points: tuple[FrictionPoint, ...]
    static: q.NonNegativeNumber | None = None

    @model_validator(mode="after")
    def _ordered(self) -> TabulatedFrictionTable:
        if not 2 <= len(self.points) <= KNOTS + 1:
            raise InputError(f"needs 2 to {KNOTS + 1} points, got {len(self.points)}")
        speeds = [point.speed for point in self.points]
        if speeds[0] != 0.0 or any(b <= a for a, b in pairwise(speeds)):
            raise InputError("speeds of the points must begin at 0 and increase")
        if self.static is not None and self.static < self.points[0].a:
            raise InputError(
                f"static = {self.static:g} must not be less than the first a = {self.points[0].a:g}"
            )
        return self


class PITable(Table):
    """Proportional-integral speed control."""

    law: Literal["pi"]
    kp: q.ProportionalGain
    ki: q.IntegralGain


class StiffSpeedTable(Table):
    """Stiff speed control: kp = stiffness x pipe impedance, ki = rate x drive inertia.

    The defaults are those of a public drilling simulator (NORCE).
    """

    law: Literal["stiff-speed"]
    stiffness: q.PositiveNumber = 50.0
    rate: q.PositiveNumber = 5.0


class SoftTorqueTable(Table):
    """Soft torque, a PI tuned to the string: kp = pipe impedance / share, ki = w_s^2 J_d.

    w_s is the lowest frequency of the string with the top held, J_d the inertia of the drive.
    """

    law: Literal["soft-torque"]
    share: q.PositiveNumber = 0.25

    @field_validator("share")
    @classmethod
    def _up_to_one(cls, value: float) -> float:
        if value > 1.0:
            raise InputError(f"must be at most 1, got {value:g}")
        return value


class ConstantTorqueTable(Table):
    """A drive at constant torque."""

    law: Literal["constant-torque"]
    torque: q.Torque


class ConstantWeightTable(Table):
    """Weight on bit held at the operating point's value."""

    law: Literal["constant"] = "constant"


class FollowingSpeedTable(Table):
    """Weight on bit W = W_n + gain (|bit speed| - set speed) within limits, ideal."""

    law: Literal["navarro-lopez-suarez"]
    gain: q.WeightGain
    minimum: q.Weight = 0.0
    maximum: q.Weight | None = None

    @model_validator(mode="after")
    def _in_order(self) -> FollowingSpeedTable:
        if self.maximum is not None and self.maximum <= self.minimum:
            raise InputError(
                f"maximum {self.maximum / 1e3:g} kN must be more than minimum "
                f"{self.minimum / 1e3:g} kN"
            )
        return self


class StartTable(Table):
    """State of the string at time zero.

    `rest`: still, untwisted, bit stuck. `turning`: every node at `speed`, untwisted.
    `wound_up`: bit stuck, twisted to the static torque, top at the set speed.
    """

    kind: Literal["rest", "turning", "wound_up"] = "turning"
    speed: q.Speed | None = None

    @model_validator(mode="after")
    def _speed_when_turning(self) -> StartTable:
        if self.kind != "turning" and self.speed is not None:
            raise InputError(f"speed does not go with kind = {self.kind!r}, only with 'turning'")
        return self


class SimulationTable(Table):
    """How long and how finely to simulate."""

    duration: q.Time = 100.0
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
        return self


class AxisTable(Table):
    """One axis of a map; `min` and `max` as they would be written at `path`."""

    path: str
    min: float | str
    max: float | str
    points: q.Count

    @field_validator("min", "max", mode="before")
    @classmethod
    def _number_or_quantity(cls, value: object) -> object:
        return number_or_quantity(value)

    @field_validator("points")
    @classmethod
    def _two_or_more(cls, value: int) -> int:
        if value < 2:
            raise InputError(f"an axis needs 2 points or more, got {value}")
        return value


PAPER_AXES = (
    AxisTable(path="controller.kp", min=0.0, max=1000.0, points=41),
    AxisTable(path="controller.ki", min=0.0, max=500.0, points=41),
)


class MapTable(Table):
    """The map over gains or any other parameters."""

    axes: tuple[AxisTable, ...] = PAPER_AXES
    levels: tuple[q.PositiveNumber, ...] = (20.0, 30.0, 40.0, 50.0)
    audit_cells: q.CountOrZero = 12

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


BitRockTable = Annotated[
    NavarroLopezSuarezTable
    | BitRadiusFrictionTable
    | JansenVanDenSteenTable
    | CoulombTable
    | TuckerWangTable
    | StribeckTable
    | TabulatedFrictionTable,
    Field(discriminator="law"),
]
WeightOnBitTable = Annotated[ConstantWeightTable | FollowingSpeedTable, Field(discriminator="law")]
ControllerTable = Annotated[
    PITable | ConstantTorqueTable | StiffSpeedTable | SoftTorqueTable, Field(discriminator="law")
]


class DesignTables(Table):
    """A whole design file after it was merged over its model."""

    schema_version: Literal[1] = Field(default=1, alias="schema")
    title: str = ""
    source: str = ""
    status: str = ""
    notes: str = ""
    operating_point: OperatingPoint = OperatingPoint()
    drillstring: DrillstringTable
    top_drive: TopDriveTable
    bha: BhaTable = BhaTable()
    bit_rock: BitRockTable
    controller: ControllerTable = PITable(law="pi", kp=200.0, ki=100.0)
    weight_on_bit: WeightOnBitTable = ConstantWeightTable()
    start: StartTable = StartTable()
    simulation: SimulationTable = SimulationTable()
    map: MapTable = MapTable()
    uncertain: dict[str, DistributionTable] = Field(default_factory=dict)
    uncertainty: UncertaintyTable = UncertaintyTable()
    compare: CompareTable = CompareTable()

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
