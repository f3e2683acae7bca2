"""The law of a drive for the drive itself: the same that is simulated, as text for a controller."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from drillctl import units
from drillctl.store.tables import Column, Quantity, Table, Unit
from drillctl.studies.base import Option, Recipe, Requested, Section, Study

if TYPE_CHECKING:
    from drillctl.design import Design
    from drillctl.studies.export.compute import Export


def tables(result: Export) -> Iterator[Table]:
    """Every number of the law, in units and per unit."""
    columns = (
        Column("symbol"), Column("value", digits=6), Column("unit", hidden=True),
        Column("per_unit", "per unit", digits=6), Column("meaning"),
    )  # fmt: skip
    rows: list[list[Any]] = [
        [one.name, Quantity(si, one.dimension.si), Unit(one.dimension.si), share, one.means]
        for one, _, si, share in result.rows()
    ]
    yield Table("symbols", "numbers of the drive", columns, rows)


def remarks(result: Export, system: units.System) -> Iterator[str]:
    """What a reader of the text must know."""
    for sentence in result.sentences():
        yield units.told(sentence, system)


def notes(result: Export) -> Iterator[str]:
    """The name of the text, and a sampling period that the design does not give."""
    yield f"written as {file_name(result)}"
    if result.assumed is not None:
        yield (
            f"the drive is in continuous time: written for a sampling period of "
            f"{result.assumed * 1e3:g} ms (export.sampling_period); to simulate it, --set "
            f'controller.drive.sampling_period="{result.assumed * 1e3:g} ms"'
        )


def file_name(result: Export) -> str:
    """Name of the file in the folder of the run."""
    from drillctl.studies.export.writers import FORMATS

    return f"drive.{FORMATS[result.format][1]}"


def files(result: Export, folder: Path, system: units.System) -> None:
    """The text."""
    from drillctl.store.json_files import write_text

    write_text(folder / file_name(result), result.text(system))


def of_recommended(request: Requested) -> Design:
    """The recommended design, where the report has one, else its own."""
    done = request.done["recommend"]
    return done.result.recommended.design if done.state == "done" else request.design


STUDY = Study(
    module=__name__,
    name="export",
    help="Write the drive's law for a PLC or in C",
    group="Hand over",
    options=(
        Option(
            "format", Literal["structured-text", "plcopen", "c", "json", "csv"],
            "Write in this format", "structured-text",
        ),
        Option("per_unit", bool, "Write in shares of rated torque and speed", False),
    ),
    python="export",
    recipes=(Recipe("export", "the law for the drive", variant=of_recommended, order=6),),
    sections=(
        Section(
            "export", "For the drive", ("export",), order=97,
            text="The numbers are those of the recommended setting, and the design's own where the "
            "report has no recommendation. drillctl export writes the law with them as IEC 61131-3 "
            "text, PLCopen XML or C.",
        ),
    ),
)  # fmt: skip
