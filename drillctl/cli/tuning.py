"""The verb that searches robust gains."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from drillctl.cli import console, running
from drillctl.cli.options import Options, computing, with_values

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from matplotlib.figure import Figure

    from drillctl.design import Design
    from drillctl.studies.robust import Tune


@computing
def tune(
    design: Design,
    options: Options,
    realizations: Annotated[
        int | None, typer.Option("--realizations", help="Draws of the search.")
    ] = None,
    seed: Annotated[int | None, typer.Option("--seed", help="Seed of the search.")] = None,
    certificate: Annotated[
        int | None, typer.Option("--certificate", help="Fresh draws that certify the gains.")
    ] = None,
    exhaustive: Annotated[
        bool, typer.Option("--exhaustive", help="Go through a grid of 41 x 41 gains as well.")
    ] = False,
) -> None:
    """Robust gains: searched over realizations, certified at fresh ones, beside other gains."""
    import drillctl
    from drillctl import printing, store

    design = with_values(
        design,
        {
            "tune.realizations": realizations,
            "tune.seed": seed,
            "tune.certificate.realizations": certificate,
        },
    )
    settings: dict[str, Any] = {"exhaustive": True} if exhaustive else {}
    folder = store.claim("tune", design, options.out, **settings)
    if running.shown_again(
        folder, options, lambda: printing.tune(store.open(folder.path), options.units)
    ):
        _end(folder.summary()["passed"], folder.summary()["message"])
        return
    with running.guarded(folder), console.progress() as bar, running.library_output_on_stderr():
        result = drillctl.tune(design, exhaustive, progress=bar, verbose=options.verbose)
    _write(result, folder.path)
    for name, figure in _pictures(result, options):
        running.draw(figure, folder.path / f"{name}.png")
    if result.certificate.audit_verdict == "check":
        console.note("audit: check: the engines differ about the level at some realization")
    if not options.json:
        printing.tune(result, options.units)
    running.conclude(folder, result.summary(), options)
    _end(result.passed, result.message)


def _end(passed: bool, message: str) -> None:
    """Gains that are not certified are an answer, and no success."""
    if not passed:
        console.note(f"drillctl: {message}")
        raise typer.Exit(1)


def _write(result: Tune, folder: Path) -> None:
    from drillctl import store
    from drillctl.studies.robust.saving import tuned_file
    from drillctl.studies.robust.tune_tables import write_tune_tables

    store.write_data(result, folder)
    write_tune_tables(result, folder)
    tuned_file(result, folder / "tuned.toml")


def _pictures(result: Tune, options: Options) -> Iterable[tuple[str, Figure]]:
    from drillctl import plots

    yield "baselines", plots.tune_baselines(result)
    yield "neighbourhood", plots.tune_neighbourhood(result, system=options.units)
