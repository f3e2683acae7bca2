"""The verb that tunes two policies of the weight on bit and sets them beside each other."""

from __future__ import annotations

from typing import TYPE_CHECKING

from drillctl.cli import console, running
from drillctl.cli.options import Options, computing

if TYPE_CHECKING:
    from drillctl.design import Design


@computing
def advantage(design: Design, options: Options) -> None:
    """PI against PI with dynamic weight on bit, each at its own robust optimum."""
    import drillctl
    from drillctl import plots, printing, store
    from drillctl.studies.advantage import write_advantage

    folder = store.claim("advantage", design, options.out)
    if running.shown_again(
        folder, options, lambda: printing.advantage(store.open(folder.path), options.units)
    ):
        return
    with running.guarded(folder), console.progress() as bar:
        result = drillctl.advantage(design, progress=bar)
    store.write_data(result, folder.path)
    write_advantage(result, folder.path)
    for name, picture in (
        ("cases", plots.advantage_cases(result)),
        ("front", plots.advantage_front(result, system=options.units)),
        ("map", plots.advantage_map(result, system=options.units)),
        ("delays", plots.advantage_delay(result)),
    ):
        running.draw(picture, folder.path / f"{name}.png")
    if not options.json:
        printing.advantage(result, options.units)
    running.conclude(folder, result.summary(), options)
