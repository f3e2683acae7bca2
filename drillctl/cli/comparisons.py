"""Verbs that set cases, or gains and delays, beside each other."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from drillctl.cli import console, running
from drillctl.cli.options import (
    Axes,
    Draws,
    Options,
    Seed,
    computing,
    with_axes,
    with_draws,
    with_values,
)

if TYPE_CHECKING:
    from drillctl.design import Design


@computing
def compare(
    design: Design,
    options: Options,
    realizations: Draws = None,
    seed: Seed = None,
    equal_mean_weight: Annotated[
        bool | None,
        typer.Option(
            "--equal-mean-weight/--nominal-weight",
            help="Shift the nominal weight of a moving weight on bit until means are equal.",
        ),
    ] = None,
    axis: Axes = None,
) -> None:
    """Cases at the same draws: distributions, paired differences, shares, regions, responses."""
    import drillctl
    from drillctl import plots, printing, store, studies

    design = with_draws(with_axes(design, axis), realizations, seed)
    design = with_values(design, {"compare.equal_mean_weight": equal_mean_weight})
    folder = store.claim("compare", design, options.out)
    if running.shown_again(
        folder, options, lambda: printing.comparison(store.open(folder.path), options.units)
    ):
        return
    with running.guarded(folder), console.progress() as bar:
        result = drillctl.compare(design, progress=bar)
    store.write_data(result, folder.path)
    studies.write_comparison(result, folder.path)
    running.draw(plots.j1_distributions(result), folder.path / "distributions.png")
    picture = plots.j1_against_weight(result, system=options.units)
    running.draw(picture, folder.path / "weight.png")
    picture = plots.compared_responses(result, system=options.units)
    running.draw(picture, folder.path / "responses.png")
    if any(case.nominal.map is not None for case in result.cases):
        picture = plots.compared_regions(result, system=options.units)
        running.draw(picture, folder.path / "regions.png")
    if len(result.cases) > 1:
        running.draw(plots.paired_differences(result), folder.path / "differences.png")
    else:
        console.note("one case only: give others in compare.cases to compare it with")
    if not options.json:
        printing.comparison(result, options.units)
    running.conclude(folder, result.summary(), options)


@computing
def delay(design: Design, options: Options, realizations: Draws = None, seed: Seed = None) -> None:
    """Dynamic weight on bit against the delay of its path: what is left of its benefit."""
    from drillctl import plots, printing, store, studies

    design = with_draws(design, realizations, seed)
    folder = store.claim("delay", design, options.out)
    if running.shown_again(
        folder, options, lambda: printing.weight_delay(store.open(folder.path), options.units)
    ):
        return
    with running.guarded(folder), console.progress() as bar:
        result = studies.weight_delay(design, progress=bar)
    store.write_data(result, folder.path)
    studies.write_weight_delay(result, folder.path)
    running.draw(plots.weight_delay(result, system=options.units), folder.path / "weight-delay.png")
    if not options.json:
        printing.weight_delay(result, options.units)
    running.conclude(folder, result.summary(), options)
