"""The verb of maps under uncertainty."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

import typer

from drillctl.cli import console, running
from drillctl.cli.options import (
    Axes,
    Options,
    Seed,
    computing,
    with_axes,
    with_values,
)

if TYPE_CHECKING:
    from drillctl.design import Design


@computing
def uncertainty(
    design: Design,
    options: Options,
    axis: Axes = None,
    realizations: Annotated[
        int | None, typer.Option("--realizations", help="Draws; more than before adds to a run.")
    ] = None,
    seed: Seed = None,
    sampling: Annotated[
        Literal["monte-carlo", "sobol", "latin-hypercube"] | None,
        typer.Option("--sampling", help="How they are drawn."),
    ] = None,
    full: Annotated[
        bool | None, typer.Option("--full", help="Run every lane to its end, for moments.")
    ] = None,
    sensitivity: Annotated[
        int | None, typer.Option("--sensitivity", help="Sobol indices from so many points.")
    ] = None,
    audit: Annotated[
        int | None, typer.Option("--audit", help="Lanes to audit with the reference solver.")
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with the run in --out, or else fail.")
    ] = False,
    allow_mixed: Annotated[
        bool, typer.Option("--allow-mixed", help="Go on on another type of processor.")
    ] = False,
    scheduler: Annotated[
        str | None, typer.Option("--scheduler", help="Address of a dask.distributed scheduler.")
    ] = None,
    interim: Annotated[
        float | None, typer.Option("--interim", min=0.0, help="Seconds between interim pictures.")
    ] = None,
) -> None:
    """A map at thousands of draws: regions by probability, intervals, best cells, indices."""
    from drillctl import printing, store, studies
    from drillctl.cli import uncertain_runs

    design = with_values(
        with_axes(design, axis),
        {
            "uncertainty.realizations": realizations,
            "uncertainty.seed": seed,
            "uncertainty.sampling": sampling,
            "uncertainty.full": full,
            "uncertainty.sensitivity.samples": sensitivity,
            "map.audit_cells": audit,
        },
    )
    how = uncertain_runs.How(resume, allow_mixed, scheduler, interim)
    if how.resume:
        uncertain_runs.refuse_nothing_to_resume(options.out)
    growing = store.growing_realizations(design)
    folder = store.claim("uncertainty", design, options.out, growing, how.allow_mixed)
    if running.shown_again(
        folder, options, lambda: printing.uncertainty(store.open(folder.path), options.units)
    ):
        return
    with running.guarded(folder), console.progress() as bar:
        result = uncertain_runs.computed(design, how, folder, bar, options.units)
    summary = result.summary()
    store.write_data(result, folder.path)
    studies.write_uncertainty_tables(result, folder.path)
    for name, figure in uncertain_runs.pictures(result, options.units):
        running.draw(figure, folder.path / f"{name}.png")
    if result.audit.verdict == "check":
        console.note("audit: check: the engines differ by more than 1 % in J1 in some lane")
    if not options.json:
        printing.uncertainty(result, options.units)
    running.conclude(folder, summary, options)
