"""The verb of a single run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

import typer

from drillctl.cli import console, running
from drillctl.cli.options import (
    Options,
    computing,
    with_values,
)

if TYPE_CHECKING:
    from drillctl.design import Design


@computing
def simulate(
    design: Design,
    options: Options,
    engine: Annotated[
        Literal["reference", "batch"] | None,
        typer.Option("--engine", help="Located events (default), or the fixed-step engine."),
    ] = None,
) -> None:
    """One run: time response, measures, energy balance."""
    import drillctl
    from drillctl import plots, printing, store

    design = with_values(design, {"simulation.engine": engine})
    folder = store.claim("simulate", design, options.out)
    if running.shown_again(
        folder, options, lambda: printing.simulation(store.open(folder.path), options.units)
    ):
        return
    with running.guarded(folder), console.progress() as bar:
        bar.begin("simulating", 1)
        result = drillctl.simulate(design)
    store.write_data(result, folder.path)
    running.draw(plots.time_response(result), folder.path / "time-response.png")
    summary = result.summary()
    share = result.share_of_yield
    if share is not None:
        summary["share_of_torsional_yield"] = share
    if not options.json:
        printing.simulation(result, options.units)
    running.conclude(folder, summary, options)
