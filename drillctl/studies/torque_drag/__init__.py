"""Tension, side force and torque of the string in its well."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from drillctl import plots, units
from drillctl.store.tables import Column, Table
from drillctl.studies.base import Option, Picture, Recipe, Section, Study

if TYPE_CHECKING:
    from drillctl.studies.torque_drag.compute import TorqueDrag

BUCKLING = (
    "The string has no bending stiffness, and does not buckle. Compression beyond "
    "2 sqrt(E I q sin i / r) (Dawson & Paslay 1984) is pointed out."
)


def tables(result: TorqueDrag) -> Iterator[Table]:
    """The cases at the rig; the sweep; all of it by depth."""
    from drillctl.studies.torque_drag.compute import CASES

    columns = (
        Column("case"), Column("hook_load", "hook load", "N", digits=6),
        Column("torque", "torque at the rig", "N*m", digits=6),
        Column("bit_torque", "torque at the bit", "N*m"),
    )  # fmt: skip
    cases = result.summary()["cases"]
    yield Table(
        "torque-drag", f"string in its well, friction factor {result.friction_factor:.4g}", columns,
        [[CASES[name], *one.values()] for name, one in cases.items()],
    )  # fmt: skip
    swept = (Column("friction_factor", "friction factor"), *(
        Column(f"{case}_{name}", f"{name.replace('_', ' ')}, {CASES[case]}", unit, digits=5)
        for case, name, unit in (
            ("off_bottom", "torque", "N*m"), ("pulling_out", "hook_load", "N"),
            ("running_in", "hook_load", "N"),
        )
    ))  # fmt: skip
    yield Table(
        "friction-factors", "sweep over friction factors", swept,
        list(zip(result.factors, result.torques["off_bottom"], result.hook_loads["pulling_out"],
                 result.hook_loads["running_in"], strict=True)),
    )  # fmt: skip


def pictures(result: TorqueDrag) -> Iterator[Picture]:
    """Tension, side force and torque by depth; the sweep."""
    yield Picture(
        "torque-drag", "Effective tension, side force and torque by measured depth.",
        "Three panels against measured depth: tension, force of the wall per length, torque, for a "
        "string that turns, is pulled out and run in.",
        lambda system: plots.torque_drag(result, system=system),
    )  # fmt: skip
    yield Picture(
        "friction-factors", "Hook load and off-bottom torque over the friction factor.",
        "Hook load rises with the friction factor where the string is pulled out and falls where "
        "it is run in; torque rises in proportion.",
        lambda system: plots.friction_sweep(result, system=system),
    )  # fmt: skip


def remarks(result: TorqueDrag, system: units.System) -> Iterator[str]:
    """What was left out."""
    yield BUCKLING


def notes(result: TorqueDrag) -> Iterator[str]:
    """Sharp bends and buckling."""
    yield from result.notes


STUDY = Study(
    module=__name__,
    name="torque-drag",
    help="Compute tension, side force and torque in the well",
    group="Describe a rig",
    options=(
        Option("off_bottom_torque", str, "Find the friction factor from this torque",
               sets="torque_drag.off_bottom_torque"),
        Option("friction_factor", float, "Set the friction factor of the wall",
               sets="well.friction_factor"),
    ),
    python="torque_drag",
    recipes=(
        Recipe(
            "torque-drag", "torque and drag", order=5,
            missing=lambda request: (
                "" if request.design.tables.well.survey else "the design has no survey"
            ),
        ),
    ),
    sections=(
        Section("torque-drag", "Torque and drag", ("torque-drag",), order=15),
    ),
)  # fmt: skip
