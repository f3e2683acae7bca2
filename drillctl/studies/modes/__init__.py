"""Natural frequencies, damping and shapes of the string, without control and rock."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from drillctl import plots, units
from drillctl.store.tables import Column, Table
from drillctl.studies.base import Option, Picture, Recipe, Section, Study

if TYPE_CHECKING:
    from drillctl.linear.modal import Modes


STICK_SLIP = (
    "Stick-slip has the period of the lowest mode with the top held, or longer: a stiff drive "
    "makes the top a fixed end."
)


def tables(result: Modes) -> Iterator[Table]:
    """Frequencies and damping ratios, the two end conditions side by side; the elements."""
    columns = [Column("mode")]
    for name, head in (("free_free", "top free"), ("fixed_top", "top held")):
        columns.append(Column(f"{name}_frequency", f"{head}: frequency", "Hz", digits=6))
        columns.append(Column(f"{name}_damping_ratio", f"{head}: damping", percent=True))
    most = max(len(result.free_free), len(result.fixed_top))
    rows = [
        [order + 1, *_cells(result.free_free, order), *_cells(result.fixed_top, order)]
        for order in range(most)
    ]
    yield Table("modes", "natural frequencies of the string", tuple(columns), rows)
    if result.design is not None:
        heads = (
            Column("section"), Column("elements"), Column("element_length", "of", "m"),
            Column("choice", "how"),
        )  # fmt: skip
        cells = [[x.name, x.elements, x.length, x.said] for x in result.design.mesh]
        yield Table("mesh", "elements of the string", heads, cells)


def _cells(result: tuple[Any, ...], order: int) -> list[Any]:
    if order >= len(result):
        return [None, None]
    mode = result[order]
    if mode.overdamped:
        return [mode.frequency_hz, "overdamped"]
    if mode.frequency_hz == 0.0:
        return [0.0, "rigid body"]
    return [mode.frequency_hz, mode.damping_ratio]


def pictures(result: Modes) -> Iterator[Picture]:
    """Shapes of the modes, response of the ends, friction of the bit."""
    from drillctl.linear.response import frequency_response, telling_frequencies

    design = result.design
    assert design is not None
    first = f"{result.fixed_top[0].frequency_hz:.4g} Hz" if result.fixed_top else "no frequency"
    yield Picture(
        "modes", "Angle and torque of the lowest modes along the string.",
        "Shapes of the lowest modes with the top free and held; the first with the top held is at "
        f"{first}, its angle largest at the bit.",
        lambda system: plots.mode_shapes(result, system=system),
    )  # fmt: skip
    yield Picture(
        "bode", "Bode plot of the string without control, from the top torque to both speeds.",
        "Magnitude and phase of top speed and bit speed per top torque over frequency.",
        lambda system: plots.bode(
            frequency_response(design.string, telling_frequencies(design.string)), system=system
        ),
    )  # fmt: skip
    tabled = getattr(design.tables.bit_rock, "table", None)
    weight, rock = design.tables.operating_point.weight_on_bit, design.bit_rock
    slow, fast = (rock.torque_and_slope(weight, x * design.speed, math.exp)[0] for x in (0.1, 1.0))
    falls = slow > fast
    each = "each weight of the friction table" if tabled else "the weight on bit"
    yield Picture(
        "friction", f"Bit torque against bit speed, at {each}.",
        "Curves of bit torque over bit speed"
        + (": the torque is largest at rest and falls as the bit turns faster, which is what "
           "drives stick-slip." if falls else "."),
        lambda system: plots.friction_curves(design, system=system),
    )  # fmt: skip


def remarks(result: Modes, system: units.System) -> Iterator[str]:
    """What the modes have to do with stick-slip."""
    yield STICK_SLIP


STUDY = Study(
    module=__name__,
    name="modes",
    help="Compute natural frequencies, damping and mode shapes",
    group="Analyse the loop",
    options=(Option("count", int, "Compute this many modes of each end condition", 10),),
    python="modes",
    call="drillctl.linear.modal:modes",
    recipes=(Recipe("modes", "the modes", order=0),),
    sections=(
        Section("modes", "Modes of the string", ("modes",), order=30,
                shows=("modes", "mesh", "bode"),
                text=STICK_SLIP),
    ),
)  # fmt: skip
