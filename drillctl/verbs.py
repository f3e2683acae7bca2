"""What the verbs that compute do: claim a folder, compute, save, draw, print."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from drillctl import console
from drillctl.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.figure import Figure

    from drillctl.cli import Options
    from drillctl.design import Design
    from drillctl.progress import Progress
    from drillctl.store import RunFolder
    from drillctl.studies import LoopMap
    from drillctl.uncertain_runs import How

DPI = 150
RESUMED = ("map", "adaptive-map", "uncertainty")
"""Runs that go on from what was finished; the others have no finished parts to go on from."""


def _draw(figure: Figure, path: Path) -> None:
    figure.savefig(path, dpi=DPI)


def _shown_again(folder: RunFolder, options: Options, show: Callable[[], None]) -> bool:
    """Whether the folder held the finished run, whose summary is then shown once more."""
    if not folder.finished:
        return False
    if options.json:
        console.emit(folder.summary())
    else:
        show()
    console.note(f"already done: {folder.path}")
    return True


@contextmanager
def _running(folder: RunFolder) -> Iterator[None]:
    """A run in its folder: an impossible one leaves none, an interrupted map can go on."""
    try:
        yield
    except InputError:
        folder.discard()
        raise
    except KeyboardInterrupt:
        if folder.verb in RESUMED:
            console.note(f"what is finished is kept: the same with --out {folder.path} goes on")
        else:
            folder.discard()
        raise


def _conclude(folder: RunFolder, summary: dict[str, Any], options: Options) -> None:
    folder.finish(summary)
    if options.json:
        console.emit(summary)
        console.note(f"results: {folder.path}")
    else:
        console.line(f"results: {folder.path}")


def modes(design: Design, count: int, options: Options) -> None:
    """Modes with their figures, the Bode plot and the friction curves."""
    from drillctl import linear, plots, printing, store

    folder = store.claim("modes", design, options.out, count=count)
    if _shown_again(folder, options, lambda: printing.modes(folder.summary())):
        return
    with _running(folder):
        result = linear.modes(design, count)
    summary = result.summary()
    store.write_data(result, folder.path)
    _draw(plots.mode_shapes(result), folder.path / "modes.png")
    string, frequencies = design.string, linear.telling_frequencies(design.string)
    _draw(plots.bode(linear.frequency_response(string, frequencies)), folder.path / "bode.png")
    _draw(plots.friction_curves(design), folder.path / "friction.png")
    if not options.json:
        printing.modes(summary)
    _conclude(folder, summary, options)


def loop(design: Design, options: Options) -> None:
    """Loop figures, with their pictures, a map over the gains and the linear models."""
    from drillctl import linear, plots, printing, store, studies
    from drillctl.linear.export import write_matrices
    from drillctl.loop_pictures import loop_figures, over_gains

    folder = store.claim("loop", design, options.out)
    if _shown_again(folder, options, lambda: printing.loop(store.open(folder.path), options.units)):
        return
    with _running(folder), console.progress() as bar:
        result = linear.loop(design)
        found = _loop_map(design, bar)
    store.write_data(result, folder.path)
    for name in ("model.mat", "model.npz"):
        write_matrices(design, folder.path / name)
    for name, figure in loop_figures(result).items():
        _draw(figure, folder.path / f"{name}.png")
    summary = result.summary()
    if found is not None:
        summary["map"] = found.summary()
        studies.write_loop_table(found, folder.path)
        boundary = None
        if over_gains(found.axes) and design.simple_drive:
            kp, ki = ((float(a.values[0]), float(a.values[-1])) for a in found.axes)
            boundary = linear.gain_boundary(design, window=(kp, ki))
        picture = plots.loop_map(found, boundary=boundary, system=options.units)
        _draw(picture, folder.path / "slope-margin.png")
    if not options.json:
        printing.loop(result, options.units)
    _conclude(folder, summary, options)


def _loop_map(design: Design, bar: Progress) -> LoopMap | None:
    """The map over the two axes of a design; None where its axes do not make one."""
    from drillctl import studies
    from drillctl.loop_pictures import MOST_NODES
    from drillctl.studies.grid import axes_of

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


def cycle(design: Design, options: Options) -> None:
    """The limit cycle by describing function, shooting and a long run, with its figure."""
    import drillctl
    from drillctl import plots, printing, store

    folder = store.claim("cycle", design, options.out)
    if _shown_again(
        folder, options, lambda: printing.cycle(store.open(folder.path), options.units)
    ):
        return
    with _running(folder), console.progress() as bar:
        bar.begin("following the motion", 1)
        result = drillctl.limit_cycle(design)
    store.write_data(result, folder.path)
    _draw(plots.limit_cycle(result), folder.path / "limit-cycle.png")
    if not options.json:
        printing.cycle(result, options.units)
    _conclude(folder, result.summary(), options)


def regions(design: Design, options: Options) -> None:
    """Three regions over the same two parameters, with their figure."""
    from drillctl import plots, printing, store, studies

    folder = store.claim("regions", design, options.out)
    if _shown_again(folder, options, lambda: printing.regions(store.open(folder.path))):
        return
    with _running(folder), console.progress() as bar:
        if len(design.tables.map.axes) != 2:
            count = len(design.tables.map.axes)
            raise InputError(f"regions are shown over 2 parameters, got {count}", "map.axes")
        result = studies.three_regions(design, progress=bar)
    store.write_data(result, folder.path)
    _draw(plots.three_regions(result, system=options.units), folder.path / "three-regions.png")
    if not options.json:
        printing.regions(result)
    _conclude(folder, result.summary(), options)


def regularisation(design: Design, options: Options) -> None:
    """A map with set-valued friction beside the same with smoothed friction, with its figure."""
    from drillctl import plots, printing, store, studies

    folder = store.claim("regularisation", design, options.out)
    if _shown_again(folder, options, lambda: printing.regularisation(store.open(folder.path))):
        return
    with _running(folder), console.progress() as bar:
        result = studies.regularisation(design, progress=bar)
    store.write_data(result, folder.path)
    _draw(plots.regularisation(result), folder.path / "regularisation.png")
    if not options.json:
        printing.regularisation(result)
    _conclude(folder, result.summary(), options)


def delay(design: Design, options: Options) -> None:
    """A weight that follows the bit speed against the delay of its path, with figure and table."""
    from drillctl import plots, printing, store, studies

    folder = store.claim("delay", design, options.out)
    if _shown_again(
        folder, options, lambda: printing.weight_delay(store.open(folder.path), options.units)
    ):
        return
    with _running(folder), console.progress() as bar:
        result = studies.weight_delay(design, progress=bar)
    store.write_data(result, folder.path)
    studies.write_weight_delay(result, folder.path)
    _draw(plots.weight_delay(result, system=options.units), folder.path / "weight-delay.png")
    if not options.json:
        printing.weight_delay(result, options.units)
    _conclude(folder, result.summary(), options)


def compare(design: Design, options: Options) -> None:
    """Cases at the same draws, with their figures and tables."""
    import drillctl
    from drillctl import plots, printing, store, studies

    folder = store.claim("compare", design, options.out)
    if _shown_again(
        folder, options, lambda: printing.comparison(store.open(folder.path), options.units)
    ):
        return
    with _running(folder), console.progress() as bar:
        result = drillctl.compare(design, progress=bar)
    store.write_data(result, folder.path)
    studies.write_comparison(result, folder.path)
    _draw(plots.j1_distributions(result), folder.path / "distributions.png")
    picture = plots.j1_against_weight(result, system=options.units)
    _draw(picture, folder.path / "weight.png")
    picture = plots.compared_responses(result, system=options.units)
    _draw(picture, folder.path / "responses.png")
    if any(case.nominal.map is not None for case in result.cases):
        picture = plots.compared_regions(result, system=options.units)
        _draw(picture, folder.path / "regions.png")
    if len(result.cases) > 1:
        _draw(plots.paired_differences(result), folder.path / "differences.png")
    else:
        console.note("one case only: give others in compare.cases to compare it with")
    if not options.json:
        printing.comparison(result, options.units)
    _conclude(folder, result.summary(), options)


def uncertainty(design: Design, how: How, options: Options) -> None:
    """Regions of a map under uncertainty, with pictures and tables."""
    from drillctl import printing_uncertainty as printing
    from drillctl import store, studies, uncertain_runs

    if how.resume:
        uncertain_runs.refuse_nothing_to_resume(options.out)
    growing = store.growing_realizations(design)
    folder = store.claim("uncertainty", design, options.out, growing, how.allow_mixed)
    if _shown_again(
        folder, options, lambda: printing.uncertainty(store.open(folder.path), options.units)
    ):
        return
    with _running(folder), console.progress() as bar:
        result = uncertain_runs.computed(design, how, folder, bar, options.units)
    summary = result.summary()
    store.write_data(result, folder.path)
    studies.write_uncertainty_tables(result, folder.path)
    for name, figure in uncertain_runs.pictures(result, options.units):
        _draw(figure, folder.path / f"{name}.png")
    if result.audit.verdict == "look":
        console.note("audit: look: the engines differ by more than 1 % in J1 in some lane")
    if not options.json:
        printing.uncertainty(result, options.units)
    _conclude(folder, summary, options)


def simulate(design: Design, options: Options) -> None:
    """One run with its figure, signals and measures."""
    import drillctl
    from drillctl import plots, printing, store

    folder = store.claim("simulate", design, options.out)
    if _shown_again(
        folder, options, lambda: printing.simulation(store.open(folder.path), options.units)
    ):
        return
    with _running(folder), console.progress() as bar:
        bar.begin("simulating", 1)
        result = drillctl.simulate(design)
    store.write_data(result, folder.path)
    _draw(plots.time_response(result), folder.path / "time-response.png")
    summary = result.summary()
    share = result.share_of_yield
    if share is not None:
        summary["share_of_torsional_yield"] = share
    if not options.json:
        printing.simulation(result, options.units)
    _conclude(folder, summary, options)


def stability_map(design: Design, measures: list[str] | None, options: Options) -> None:
    """A sweep with its map, regions, audit and responses."""
    from drillctl import plots, printing, store, studies
    from drillctl.studies.sweeps import kept_measures

    try:
        kept = kept_measures(measures)
    except InputError as error:
        raise InputError(error.problem, "--measure") from None
    folder = store.claim("map", design, options.out, **store.asked_measures(kept))
    if _shown_again(
        folder, options, lambda: printing.sweep(store.open(folder.path), options.units)
    ):
        return
    with _running(folder), console.progress() as bar:
        result = studies.sweep(design, progress=bar, blocks=folder.blocks(), measures=kept)
    if result.minimum is None:
        console.note("warning: no cell gives a finite answer; see the statuses")
    store.write_data(result, folder.path)
    studies.write_tables(result, folder.path)
    if len(result.axes) == 2:
        _draw(plots.stability_map(result, system=options.units), folder.path / "map.png")
        runs = studies.responses(result)
        paths = [axis.path for axis in result.axes]
        _draw(plots.time_response(runs, paths=paths), folder.path / "responses.png")
    elif len(result.axes) == 1:
        _draw(plots.sweep_line(result, system=options.units), folder.path / "map.png")
    summary = result.summary()
    if not options.json:
        printing.sweep(result, options.units)
    if result.audit.verdict == "look":
        console.note("audit: look: the engines differ by more than 1 % in J1 in some cell")
    _conclude(folder, summary, options)


def adaptive_map(design: Design, full_grid: bool, options: Options) -> None:
    """The regions of a map from the cells near their contours, with checks, figure and tables."""
    from drillctl import plots, printing_adaptive, store, studies

    def told(result: studies.AdaptiveMap) -> None:
        printing_adaptive.adaptive_map(result, options.units)

    folder = store.claim("adaptive-map", design, options.out, full_grid=full_grid)
    if _shown_again(folder, options, lambda: told(store.open(folder.path))):
        return
    with _running(folder), console.progress() as bar:
        blocks = folder.blocks()
        result = studies.adaptive_map(design, full_grid=full_grid, progress=bar, blocks=blocks)
    if result.minimum is None:
        console.note("warning: no cell gives a finite answer; see the statuses")
    store.write_data(result, folder.path)
    studies.write_adaptive_tables(result, folder.path)
    _draw(plots.adaptive_map(result, system=options.units), folder.path / "map.png")
    if not options.json:
        told(result)
    if result.share == 1.0:
        console.note("every cell was simulated: cells are left out on axes of 81 points or more")
    for name, check, reason in (
        ("self-check", result.self_check, "a cell left out was in another band than said"),
        ("full audit", result.full_audit, "a region is not that of the full grid to one cell"),
        ("audit", result.audit, "the engines differ by more than 1 % in J1 in some cell"),
    ):
        if check is not None and check.verdict == "look":
            console.note(f"{name}: look: {reason}")
    _conclude(folder, result.summary(), options)


def doctor(design: Design, audit_cells: int, options: Options) -> None:
    """What the batch engine does with a design: scheme, errors, speed, with a figure."""
    import drillctl
    from drillctl import plots, printing_doctor, store

    folder = store.claim("doctor", design, options.out, audited=audit_cells)
    if _shown_again(folder, options, lambda: printing_doctor.doctor(store.open(folder.path))):
        return
    with _running(folder), console.progress() as bar:
        result = drillctl.doctor(design, audit_cells, progress=bar)
    store.write_data(result, folder.path)
    if len(result.cells):
        _draw(plots.error_estimate(result), folder.path / "errors.png")
    if not options.json:
        printing_doctor.doctor(result)
    _conclude(folder, result.summary(), options)
