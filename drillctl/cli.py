"""The command line: one verb a function, no numerics.

Every verb takes a design by path or shipped name. Exit codes: 0 done, 2 the input is wrong,
130 interrupted, 1 anything else.
"""

from __future__ import annotations

import traceback
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from drillctl import __version__
from drillctl.errors import DrillctlError, InputError

if TYPE_CHECKING:
    from drillctl.design import Design

app = typer.Typer(
    name="drillctl",
    help="Control design against torsional stick-slip of oil-well drillstrings.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # plain help: rich would double the time it takes to appear
    context_settings={"help_option_names": ["-h", "--help"]},
)

DesignName = Annotated[str, typer.Argument(metavar="DESIGN", help="Path or shipped name.")]
Sets = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="PATH=VALUE", help="Set a value, e.g. controller.kp=300."),
]
Axes = Annotated[
    list[str] | None,
    typer.Option("--axis", metavar="PATH=MIN:MAX:POINTS", help="Axis of a map; repeat for more."),
]
Out = Annotated[Path | None, typer.Option("--out", help="Folder for the results.")]
Json = Annotated[bool, typer.Option("--json", help="One JSON object on stdout, nothing else.")]
Threads = Annotated[int | None, typer.Option("--threads", min=1, help="Threads to use.")]
Units = Annotated[
    Literal["si", "field"], typer.Option("--units", help="kN, kN m, m or klbf, klbf ft, ft.")
]
Verbose = Annotated[bool, typer.Option("-v", "--verbose", help="Say more on stderr.")]
Debug = Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")]


@dataclass(frozen=True)
class Options:
    """What the verbs that compute have in common."""

    out: Path | None
    json: bool
    units: Literal["si", "field"]
    verbose: bool


def run(arguments: list[str]) -> int:
    """Run a command line and return its exit code; errors are told in one message."""
    usage_error: Any = typer.BadParameter.__mro__[1]
    try:
        code = app(arguments or ["--help"], prog_name="drillctl", standalone_mode=False)
        # Some versions of typer return 130 on an interruption, others raise Abort.
        return _told("interrupted", 130) if code == 130 else int(code or 0)
    except typer.Exit as stop:
        return int(stop.exit_code)
    except (KeyboardInterrupt, typer.Abort):
        return _told("interrupted", 130)
    except usage_error as error:
        return _told(error.format_message(), 2)
    except Exception as error:
        if "--debug" in arguments:
            traceback.print_exc()
        if isinstance(error, DrillctlError):
            return _told(str(error), 2 if isinstance(error, InputError) else 1)
        return _told(f"{type(error).__name__}: {error} (--debug shows where)", 1)


def _told(message: str, code: int) -> int:
    from drillctl import console

    console.note(f"drillctl: {message}")
    return code


def _version(asked: bool) -> None:
    if asked:
        from drillctl import console

        console.line(f"drillctl {__version__}")
        raise typer.Exit


@app.callback()
def common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print version.")
    ] = False,
) -> None:
    """Control design against torsional stick-slip of oil-well drillstrings."""


def _load(name: str, sets: list[str] | None) -> Design:
    from drillctl import console
    from drillctl.design import load, parse_setting

    found = load(name, **dict(parse_setting(text) for text in sets or []))
    for warning in found.warnings:
        console.note(f"warning: {warning}")
    return found


def _shelf(shelf: Literal["models", "designs"], as_json: bool) -> None:
    from drillctl import catalog, console

    found = catalog.entries(shelf)
    if as_json:
        keys = [{"name": e.name, "title": e.title, "path": str(e.path)} for e in found]
        console.emit({shelf: keys})
    else:
        console.table(shelf, ["name", "title"], [[e.name, e.title] for e in found])


@app.command()
def models(json: Json = False, debug: Debug = False) -> None:
    """List the shipped models (rigs)."""
    _shelf("models", json)


@app.command()
def designs(json: Json = False, debug: Debug = False) -> None:
    """List the shipped designs (cases to run)."""
    _shelf("designs", json)


@app.command()
def show(design: DesignName, sets: Sets = None, json: Json = False, debug: Debug = False) -> None:
    """Print a design with its model and all defaults put in."""
    from drillctl import console
    from drillctl.design import to_toml
    from drillctl.design.writing import to_tree

    found = _load(design, sets)
    if json:
        console.emit(to_tree(found.tables))
    else:
        console.line(to_toml(found).rstrip())


@app.command()
def validate(
    design: DesignName, sets: Sets = None, json: Json = False, debug: Debug = False
) -> None:
    """Check a design: every key, unit and range, its axes, draws and cases."""
    from drillctl import console
    from drillctl.studies.cases import case_designs, refuse_unequal
    from drillctl.studies.delayed_lanes import following_design
    from drillctl.studies.draws import uncertain_parameters
    from drillctl.studies.grid import axes_of
    from drillctl.studies.uncertainty.study import map_axes, refuse_impossible

    found = _load(design, sets)
    if "axes" in found.tree.get("map", {}):  # the default ones need not fit every law
        axes_of(found, found.tables.map.axes)
    if found.tables.uncertain:
        uncertain_parameters(found)
    if "uncertainty" in found.tree:
        refuse_impossible(found, map_axes(found))
    if found.tables.compare.cases:
        refuse_unequal(case_designs(found))
    if "weight_delay" in found.tree:
        following_design(found)
    if json:
        console.emit({"valid": True, "name": found.name, "path": found.origin})
    else:
        console.line(f"{found.origin}: valid")


@app.command()
def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name or path of the new file.")],
    debug: Debug = False,
) -> None:
    """Write a commented design file to start from."""
    from drillctl import console
    from drillctl.design.starter import write_starter

    console.line(f"written: {write_starter(name)}")


@app.command()
def modes(
    design: DesignName,
    sets: Sets = None,
    count: Annotated[int, typer.Option("--count", help="How many modes.")] = 10,
    out: Out = None,
    json: Json = False,
    threads: Threads = None,
    units: Units = "si",
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """Natural frequencies, damping and shapes of the string; Bode plot; friction curves."""
    from drillctl import verbs

    _use(threads)
    verbs.modes(_load(design, sets), count, Options(out, json, units, verbose))


@app.command()
def loop(
    design: DesignName,
    sets: Sets = None,
    axis: Axes = None,
    out: Out = None,
    json: Json = False,
    threads: Threads = None,
    units: Units = "si",
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """Stability, margins and slope margin of the loop; Bode, Nyquist, impedance, gain maps."""
    from drillctl import verbs

    _use(threads)
    verbs.loop(_with_axes(_load(design, sets), axis), Options(out, json, units, verbose))


@app.command()
def cycle(
    design: DesignName,
    sets: Sets = None,
    out: Out = None,
    json: Json = False,
    units: Units = "si",
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """The limit cycle: by one harmonic, exact by shooting, and by a long run."""
    from drillctl import verbs

    verbs.cycle(_load(design, sets), Options(out, json, units, verbose))


@app.command()
def regions(
    design: DesignName,
    sets: Sets = None,
    axis: Axes = None,
    out: Out = None,
    json: Json = False,
    threads: Threads = None,
    units: Units = "si",
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """Locally stable, J1 under a level, attracted: three regions over two parameters."""
    from drillctl import verbs

    _use(threads)
    verbs.regions(_with_axes(_load(design, sets), axis), Options(out, json, units, verbose))


@app.command()
def regularisation(
    design: DesignName,
    sets: Sets = None,
    axis: Axes = None,
    out: Out = None,
    json: Json = False,
    threads: Threads = None,
    units: Units = "si",
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """The same map with friction smoothed by tanh: what regularising costs."""
    from drillctl import verbs

    _use(threads)
    verbs.regularisation(_with_axes(_load(design, sets), axis), Options(out, json, units, verbose))


@app.command()
def delay(
    design: DesignName,
    sets: Sets = None,
    realizations: Annotated[
        int | None, typer.Option("--realizations", help="Draws of what is uncertain.")
    ] = None,
    seed: Annotated[int | None, typer.Option("--seed", help="Seed of the draws.")] = None,
    out: Out = None,
    json: Json = False,
    threads: Threads = None,
    units: Units = "si",
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """Dynamic weight on bit against the delay of its path: what is left of its benefit."""
    from drillctl import verbs

    _use(threads)
    found = _with_draws(_load(design, sets), realizations, seed)
    verbs.delay(found, Options(out, json, units, verbose))


@app.command()
def compare(
    design: DesignName,
    sets: Sets = None,
    realizations: Annotated[
        int | None, typer.Option("--realizations", help="Draws of what is uncertain.")
    ] = None,
    seed: Annotated[int | None, typer.Option("--seed", help="Seed of the draws.")] = None,
    equal_mean_weight: Annotated[
        bool | None,
        typer.Option(
            "--equal-mean-weight/--nominal-weight",
            help="Shift the nominal weight of a moving weight on bit until means are equal.",
        ),
    ] = None,
    axis: Axes = None,
    out: Out = None,
    json: Json = False,
    threads: Threads = None,
    units: Units = "si",
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """Cases at the same draws: distributions, paired differences, shares, regions, responses."""
    from drillctl import verbs

    _use(threads)
    found = _with_draws(_with_axes(_load(design, sets), axis), realizations, seed)
    if equal_mean_weight is not None:
        found = found.replace({"compare.equal_mean_weight": equal_mean_weight})
    verbs.compare(found, Options(out, json, units, verbose))


@app.command()
def uncertainty(
    design: DesignName,
    sets: Sets = None,
    axis: Axes = None,
    realizations: Annotated[
        int | None, typer.Option("--realizations", help="Draws; more than before adds to a run.")
    ] = None,
    seed: Annotated[int | None, typer.Option("--seed", help="Seed of the draws.")] = None,
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
    out: Out = None,
    json: Json = False,
    threads: Threads = None,
    units: Units = "si",
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """A map at thousands of draws: regions by probability, intervals, best cells, indices."""
    from drillctl import verbs
    from drillctl.uncertain_runs import How

    _use(threads)
    found = _with_axes(_load(design, sets), axis)
    given = {
        "uncertainty.realizations": realizations, "uncertainty.seed": seed,
        "uncertainty.sampling": sampling, "uncertainty.full": full,
        "uncertainty.sensitivity.samples": sensitivity, "map.audit_cells": audit,
    }  # fmt: skip
    asked = {path: value for path, value in given.items() if value is not None}
    how = How(resume, allow_mixed, scheduler, interim)
    verbs.uncertainty(
        found.replace(asked) if asked else found, how, Options(out, json, units, verbose)
    )


@app.command()
def simulate(
    design: DesignName,
    sets: Sets = None,
    engine: Annotated[
        Literal["reference", "batch"] | None,
        typer.Option("--engine", help="Located events (default), or the fixed-step engine."),
    ] = None,
    out: Out = None,
    json: Json = False,
    threads: Threads = None,
    units: Units = "si",
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """One run: time response, measures, energy balance."""
    from drillctl import verbs

    _use(threads)
    values = list(sets or []) + ([f"simulation.engine={engine}"] if engine else [])
    verbs.simulate(_load(design, values), Options(out, json, units, verbose))


@app.command(name="map")
def map_(
    design: DesignName,
    sets: Sets = None,
    axis: Axes = None,
    audit: Annotated[
        int | None, typer.Option("--audit", help="Cells to audit with the reference solver.")
    ] = None,
    adaptive: Annotated[
        bool, typer.Option("--adaptive", help="Simulate the cells near the contours alone.")
    ] = False,
    full_audit: Annotated[
        bool, typer.Option("--full-audit", help="Set an adaptive map beside the full grid.")
    ] = False,
    measure: Annotated[
        list[str] | None,
        typer.Option("--measure", metavar="NAME", help="Keep this one and J1 alone; repeatable."),
    ] = None,
    out: Out = None,
    json: Json = False,
    threads: Threads = None,
    units: Units = "si",
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """J1 over one or more parameters, with regions, audit and figures."""
    from drillctl import verbs

    _use(threads)
    found = _with_axes(_load(design, sets), axis)
    if audit is not None:
        found = found.replace({"map.audit_cells": audit})
    options = Options(out, json, units, verbose)
    if adaptive and measure:
        raise InputError("goes with the full grid, not with --adaptive", "--measure")
    if adaptive:
        verbs.adaptive_map(found, full_audit, options)
    elif full_audit:
        raise InputError("goes with --adaptive: any other map is the full grid", "--full-audit")
    else:
        verbs.stability_map(found, measure or None, options)


@app.command()
def doctor(
    design: DesignName,
    sets: Sets = None,
    axis: Axes = None,
    audit: Annotated[
        int, typer.Option("--audit", min=0, help="Lanes to audit with the reference solver.")
    ] = 4,
    out: Out = None,
    json: Json = False,
    threads: Threads = None,
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """Step and modes of the batch engine and why; its estimated and audited error; its speed."""
    from drillctl import verbs

    _use(threads)
    found = _with_axes(_load(design, sets), axis)
    verbs.doctor(found, audit, Options(out, json, "si", verbose))


def _with_axes(design: Design, axes: list[str] | None) -> Design:
    from drillctl.design.reading import parse_axis

    return design.replace({"map.axes": [parse_axis(text) for text in axes]}) if axes else design


def _with_draws(design: Design, realizations: int | None, seed: int | None) -> Design:
    given = {"uncertainty.realizations": realizations, "uncertainty.seed": seed}
    asked = {path: value for path, value in given.items() if value is not None}
    return design.replace(asked) if asked else design


def _use(threads: int | None) -> None:
    if threads is not None:
        import numba

        if threads > numba.config.NUMBA_NUM_THREADS:
            most = numba.config.NUMBA_NUM_THREADS
            raise InputError(f"{threads} is more than this machine's {most}", "--threads")
        numba.set_num_threads(threads)
