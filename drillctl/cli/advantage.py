"""The verb that tunes two policies of the weight on bit and sets them beside each other."""

from __future__ import annotations

from typing import TYPE_CHECKING

from drillctl import console
from drillctl.cli import running
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
        ("cases.png", plots.advantage_cases),
        ("front.png", plots.advantage_front),
        ("map.png", plots.advantage_map),
        ("delays.png", plots.advantage_delay),
    ):
        running.draw(picture(result, system=options.units), folder.path / name)
    if not options.json:
        printing.advantage(result, options.units)
    running.conclude(folder, result.summary(), options)
