"""J1 over the map: picture with values and responses, regions, audit."""

from __future__ import annotations

from drillctl import plots
from drillctl.reporting import cells
from drillctl.reporting.blocks import Block, Figure, InteractiveMap, Table, Text
from drillctl.reporting.gather import Gathered
from drillctl.reporting.sections.summary import regions_table
from drillctl.reporting.words import number


def build(gathered: Gathered) -> tuple[Block, ...]:
    """The map, its regions and what its cells end as."""
    study = gathered.need("map")
    found, words = study.summary, gathered.words
    count = len(found["axes"])
    blocks: list[Block] = []
    if count in (1, 2):
        draw = plots.stability_map if count == 2 else plots.sweep_line
        figure = Figure(
            "map", "J1 over the map with its regions, its minimum and the audited cells.",
            _alt(gathered), lambda: draw(study.result, system=words.system), ("map",), count == 2,
        )  # fmt: skip
        place = gathered.have("cells")
        if place is None:
            blocks.append(figure)
        else:
            blocks.append(
                InteractiveMap(figure, lambda: cells.shown(place.folder, study.result, words))
            )
    else:
        blocks.append(Text(f"The map has {count} parameters: its numbers are in the tables."))
    if table := regions_table(gathered):
        blocks.append(table)
    total = sum(found["statuses"].values())
    rows = tuple(
        (name.replace("_", " "), str(cells_), f"{100.0 * cells_ / total:.1f} %")
        for name, cells_ in found["statuses"].items()
    )
    blocks.append(Table("statuses", "How the runs of the cells end", ("status", "cells", "share"),
                        rows))  # fmt: skip
    return tuple(blocks)


def _alt(gathered: Gathered) -> str:
    found, words = gathered.need("map").summary, gathered.words
    axes = " and ".join(words.head(gathered.design, path) for path in found["axes"])
    told = f"Map of J1 over {axes}."
    if found["minimum"] is not None:
        place = words.place(gathered.design, found["minimum"]["at"])
        told += f" Least J1 {number(found['minimum']['j1'])} s at {place}."
    for level, one in found["regions"].items():
        told += f" {one['cells']} cells at or under {level} s."
    return told
