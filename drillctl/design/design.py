"""A design: one rig, complete and frozen, from which everything else is computed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

from drillctl import registry, units
from drillctl.design import parts, well
from drillctl.design.lines import place, without_place
from drillctl.design.merging import Tree, with_values
from drillctl.design.tables import DesignTables
from drillctl.design.validation import validated
from drillctl.design.warnings import DesignWarning, warnings_of
from drillctl.errors import InputError
from drillctl.rig.axial import AxialString
from drillctl.rig.bit_rock import BitRockLaw
from drillctl.rig.bit_rock.variation import NoVariation, Variation
from drillctl.rig.drillstring import Drillstring
from drillctl.rig.drillstring.assembly import with_dampers
from drillctl.rig.drillstring.mesh import MeshedSection
from drillctl.rig.program import Program
from drillctl.rig.top_drive import PI, ConstantTorque, TopDriveLaw
from drillctl.rig.top_drive.law import top_drive
from drillctl.rig.weight_on_bit import RealWeight, WeightLaw
from drillctl.rig.well.wall import Wall

if TYPE_CHECKING:
    import control


@dataclass(frozen=True)
class Design:
    """A validated rig with its control and what is to be computed of it.

    Made by `drillctl.load`. Two designs are equal when their tables are.

    Attributes
    ----------
    name : str
        Name of the file it came from.
    tables : DesignTables
        Every key of the design file with its value, SI numbers.
    tree : dict
        The same as plain TOML data before validation, from which variants are made.
    origin : str
        The file, for messages.
    """

    name: str = field(compare=False)
    tables: DesignTables
    tree: Tree = field(compare=False, repr=False)
    origin: str = field(compare=False, default="")

    def __repr__(self) -> str:
        law, point = self.tables.controller.law, self.tables.operating_point
        return (
            f"Design {self.name!r}: {self.tables.title}; {law}, {point.speed / units.RPM:.4g} rpm, "
            f"{point.weight_on_bit / 1e3:.4g} kN; every key in .tables"
        )

    def __hash__(self) -> int:
        return hash(self.tables.model_dump_json())

    def replace(self, values: dict[str, Any]) -> Design:
        """A new design with some values changed.

        Parameters
        ----------
        values : dict
            Dotted path to value, as it would stand in the file (`"120 rpm"`), or a
            `units.SI` number. Changing a `law` drops the old law's own numbers.

        Raises
        ------
        InputError
            Unknown path or impossible value.
        """
        try:
            tree = with_values(self.tree, values)
        except InputError as error:
            raise (error.within(self.origin) if self.origin else error) from None
        tables = validated(tree, self.origin, (self.tree, self.tables))
        return Design(self.name, tables, tree, self.origin)

    def where(self, key: str) -> str:
        """A key after the file and line that it is in, for messages."""
        return place(self.origin, key, self.tree) if self.origin else key

    @contextmanager
    def within(self, inside: str) -> Iterator[None]:
        """Name a place of the file in front of the key of an `InputError`."""
        try:
            yield
        except InputError as error:
            key = f"{inside}: {without_place(error.where, self.origin)}".removesuffix(": ")
            where = f"{self.origin}: {key}" if self.origin else key
            raise InputError(error.problem, where) from None

    @property
    def speed(self) -> float:
        """Final set speed (rad/s)."""
        return self.tables.operating_point.speed

    @cached_property
    def string(self) -> Drillstring:
        """The assembled drillstring."""
        return parts.drillstring(self.tables)

    @cached_property
    def wall(self) -> Wall | None:
        """Friction of the wall on the string; None without any."""
        return well.wall(self.tables, self.string)

    @cached_property
    def sliding_string(self) -> Drillstring:
        """The string as linear analysis takes it: a wall that it slides along damps it.

        That is the string itself, unless it moves along the well: the torque of the wall then
        grows with the speed, by the slope at the set speed.
        """
        wall = self.wall
        if wall is None or not wall.drifts:
            return self.string
        return with_dampers(self.string, wall.nodes, wall.slopes(self.speed))

    @property
    def mesh(self) -> tuple[MeshedSection, ...]:
        """Elements of each section, given or chosen, and which pieces were lumped."""
        return parts.mesh(self.tables, self.string)

    @cached_property
    def bit_rock(self) -> BitRockLaw:
        """Bit-rock law at the operating weight on bit."""
        return parts.bit_rock(self.tables)

    @cached_property
    def top_drive(self) -> TopDriveLaw:
        """Top-drive law."""
        return top_drive(parts.controller_of(self.tables), lambda: self.string)

    @cached_property
    def linear_drive(self) -> TopDriveLaw:
        """Top-drive law within its limits, which is what a linear loop is closed with."""
        table = parts.controller_of(self.tables)
        free = table.drive.unlimited
        if free == table.drive:
            return self.top_drive
        return top_drive(table.model_copy(update={"drive": free}), lambda: self.string)

    @cached_property
    def weight_on_bit(self) -> WeightLaw:
        """Weight-on-bit law."""
        return parts.weight_on_bit(self.tables)

    @cached_property
    def bit_rock_before(self) -> BitRockLaw:
        """Bit-rock law before the rock changes."""
        return parts.bit_rock_before(self.tables)

    @cached_property
    def axial(self) -> AxialString | None:
        """The axial string of a bit that cuts its own wake; None under any other law."""
        return parts.axial(self.tables)

    @cached_property
    def variation(self) -> Variation | NoVariation:
        """How the rock varies along the way."""
        return parts.variation(self.tables)

    @cached_property
    def program(self) -> Program:
        """What changes by the clock."""
        return parts.program(self.tables)

    @cached_property
    def warnings(self) -> tuple[DesignWarning, ...]:
        """What is allowed but probably not meant, reported once when a design is used."""
        line = parts.parts_of(self.tables)
        return warnings_of(
            self.tables, lambda: self.string, line, self.bit_rock, self.linear_drive,
            self.weight_on_bit,
        )  # fmt: skip

    @property
    def simple_drive(self) -> bool:
        """Whether two gains, or a constant torque, describe the drive within its limits."""
        return isinstance(self.linear_drive, (PI, ConstantTorque))

    @property
    def simple_loop(self) -> bool:
        """Whether two gains describe the linear loop: no memory in drive or weight.

        An alarm, which drilling steadily never sets off, is none.
        """
        return self.simple_drive and not isinstance(self.weight_on_bit, RealWeight)

    @property
    def table_range(self) -> tuple[float, float]:
        """Lowest and highest weight (N) of the friction table; any weight without a table."""
        return parts.table_range(self.tables)

    def plant(self) -> control.StateSpace:
        """The string without control, see `drillctl.linear.plant`."""
        system: control.StateSpace = registry.resolve("drillctl.linear:plant")(self.string)
        return system

    def loop(self) -> control.StateSpace:
        """The string closed with its controller, see `drillctl.linear.closed_loop`."""
        system: control.StateSpace = registry.resolve("drillctl.linear:closed_loop")(self)
        return system
