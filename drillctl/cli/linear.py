"""Verbs about the linear plant and loop, and about the limit cycle."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from drillctl.cli import console, running
from drillctl.cli.options import (
    Axes,
    Options,
    computing,
    with_axes,
)
from drillctl.errors import InputError

if TYPE_CHECKING:
    from drillctl.design import Design
    from drillctl.progress import Progress
    from drillctl.studies import LoopMap


@computing
def modes(
    design: Design,
    options: Options,
    count: Annotated[int, typer.Option("--count", help="How many modes.")] = 10,
) -> None:
    """Natural frequencies, damping and shapes of the string; Bode plot; friction curves."""
    from drillctl import linear, plots, printing, store

    folder = store.claim("modes", design, options.out, count=count)
    if running.shown_again(folder, options, lambda: printing.modes(folder.summary())):
        return
    with running.guarded(folder):
        result = linear.modes(design, count)
    summary = result.summary()
    store.write_data(result, folder.path)
    running.draw(plots.mode_shapes(result, system=options.units), folder.path / "modes.png")
    string, frequencies = design.string, linear.telling_frequencies(design.string)
    running.draw(
        plots.bode(linear.frequency_response(string, frequencies)), folder.path / "bode.png"
    )
    running.draw(plots.friction_curves(design, system=options.units), folder.path / "friction.png")
    if not options.json:
        printing.modes(summary)
    running.conclude(folder, summary, options)


@computing
def loop(design: Design, options: Options, axis: Axes = None) -> None:
    """Stability, margins and slope margin of the loop; Bode, Nyquist, impedance, gain maps."""
    from drillctl import linear, plots, printing, store, studies
    from drillctl.linear.export import write_matrices
    from drillctl.plots.loop_pictures import loop_figures, over_gains

    design = with_axes(design, axis)
    folder = store.claim("loop", design, options.out)
    if running.shown_again(
        folder, options, lambda: printing.loop(store.open(folder.path), options.units)
    ):
        return
    with running.guarded(folder), console.progress() as bar:
        result = linear.loop(design)
        found = _loop_map(design, bar)
    store.write_data(result, folder.path)
    for name in ("model.mat", "model.npz"):
        write_matrices(design, folder.path / name)
    for name, figure in loop_figures(result).items():
        running.draw(figure, folder.path / f"{name}.png")
    summary = result.summary()
    if found is not None:
        summary["map"] = found.summary()
        studies.write_loop_table(found, folder.path)
        boundary = None
        if over_gains(found.axes) and design.simple_drive:
            kp, ki = ((float(a.values[0]), float(a.values[-1])) for a in found.axes)
            boundary = linear.gain_boundary(design, window=(kp, ki))
        picture = plots.loop_map(found, boundary=boundary, system=options.units)
        running.draw(picture, folder.path / "slope-margin.png")
    if not options.json:
        printing.loop(result, options.units)
    running.conclude(folder, summary, options)


def _loop_map(design: Design, bar: Progress) -> LoopMap | None:
    """The map over the two axes of a design; None where its axes do not make one."""
    from drillctl import studies
    from drillctl.ensemble.grid import axes_of
    from drillctl.plots.loop_pictures import MOST_NODES

    try:
        axes = axes_of(design, design.tables.map.axes)
    except InputError as error:
        if "axes" in design.tree.get("map", {}):  # the default ones fit no drive without gains
            console.note(f"no map: {error}")
        return None
    if len(axes) != 2:
        console.note(f"no map: it runs over 2 parameters, the design's [map] has {len(axes)}")
        return None
    nodes = design.string.nodes
    if nodes > MOST_NODES:
        console.note(
            f"map of the slope margin alone, no root locus: {nodes} nodes; up to {MOST_NODES} the "
            "poles are computed for every cell"
        )
        return studies.loop_map(design, axes, ("slope_margin",), progress=bar)
    if not design.simple_loop:
        return studies.loop_map(design, axes, ("slope_margin",), progress=bar)
    return studies.loop_map(design, axes, progress=bar)


@computing
def cycle(design: Design, options: Options) -> None:
    """The limit cycle: by one harmonic, exact by shooting, and by a long run."""
    import drillctl
    from drillctl import plots, printing, store

    folder = store.claim("cycle", design, options.out)
    if running.shown_again(
        folder, options, lambda: printing.cycle(store.open(folder.path), options.units)
    ):
        return
    with running.guarded(folder), console.progress() as bar:
        bar.begin("following the motion", 1)
        result = drillctl.limit_cycle(design)
    store.write_data(result, folder.path)
    running.draw(plots.limit_cycle(result), folder.path / "limit-cycle.png")
    if not options.json:
        printing.cycle(result, options.units)
    running.conclude(folder, result.summary(), options)
