"""Verbs about maps over parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from drillctl.cli import console, running
from drillctl.cli.options import (
    Axes,
    Options,
    computing,
    with_axes,
    with_values,
)
from drillctl.errors import InputError

if TYPE_CHECKING:
    from drillctl.design import Design


@computing
def stability_map(
    design: Design,
    options: Options,
    axis: Axes = None,
    audit: Annotated[
        int | None, typer.Option("--audit", help="Cells to audit with the reference solver.")
    ] = None,
    measure: Annotated[
        list[str] | None,
        typer.Option(
            "--measure", metavar="NAME", help="Keep only J1 and this measure; repeatable."
        ),
    ] = None,
) -> None:
    """J1 over one or more parameters, with regions, audit and figures."""
    design = with_values(with_axes(design, axis), {"map.audit_cells": audit})
    _full_map(design, measure or None, options)


def _full_map(design: Design, measures: list[str] | None, options: Options) -> None:
    """A sweep with its map, regions, audit and responses."""
    from drillctl import plots, printing, store, studies
    from drillctl.ensemble.storing import Folder
    from drillctl.ensemble.sweeps import kept_measures
    from drillctl.store.kinds.maps import asked_measures

    try:
        kept = kept_measures(measures)
    except InputError as error:
        raise InputError(error.problem, "--measure") from None
    folder = store.claim("map", design, options.out, **asked_measures(kept))
    if running.shown_again(
        folder, options, lambda: printing.sweep(store.open(folder.path), options.units)
    ):
        return
    with running.guarded(folder), console.progress() as bar:
        result = studies.sweep(design, progress=bar, store=Folder(folder.path), measures=kept)
    if result.minimum is None:
        console.note("warning: no cell gives a finite answer; see the statuses")
    store.write_data(result, folder.path)
    studies.write_tables(result, folder.path)
    if len(result.axes) == 2:
        running.draw(plots.stability_map(result, system=options.units), folder.path / "map.png")
        runs = studies.responses(result)
        paths = [axis.path for axis in result.axes]
        running.draw(plots.time_response(runs, paths=paths), folder.path / "responses.png")
    elif len(result.axes) == 1:
        running.draw(plots.sweep_line(result, system=options.units), folder.path / "map.png")
    summary = result.summary()
    if not options.json:
        printing.sweep(result, options.units)
    if result.audit.verdict == "check":
        console.note("audit: check: the engines differ by more than 1 % in J1 in some cell")
    running.conclude(folder, summary, options)
