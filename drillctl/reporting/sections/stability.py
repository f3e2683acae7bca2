"""J1 over the map: figure with values and responses, regions, audit."""

from __future__ import annotations

from drillctl.reporting import cells
from drillctl.reporting.blocks import Block, InteractiveMap, Table, Text, figure
from drillctl.reporting.gather import Gathered
from drillctl.reporting.sections.summary import regions_table
from drillctl.studies.map import STUDY


def build(gathered: Gathered) -> tuple[Block, ...]:
    """The map, its regions and the status of its cells."""
    study = gathered.need("map")
    found, words = study.summary, gathered.words
    blocks: list[Block] = []
    pictures = [figure(one, "map", words.system) for one in STUDY.pictures(study.result)][:1]
    place = gathered.have("cells")
    for one in pictures:
        if place is None:
            blocks.append(one)
        else:
            blocks.append(
                InteractiveMap(one, lambda: cells.shown(place.folder, study.result, words))
            )
    if not pictures:
        count = len(found["axes"])
        blocks.append(Text(f"The map has {count} parameters: see the tables."))
    if table := regions_table(gathered):
        blocks.append(table)
    total = sum(found["statuses"].values())
    rows = tuple(
        (name.replace("_", " "), str(cells_), f"{100.0 * cells_ / total:.1f} %")
        for name, cells_ in found["statuses"].items()
    )
    blocks.append(Table("statuses", "Status at the end of the runs", ("status", "cells", "share"),
                        rows))  # fmt: skip
    return tuple(blocks)
