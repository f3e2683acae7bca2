"""Options shared by all commands, and the design with the values set on the command line."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from drillctl.errors import InputError

if TYPE_CHECKING:
    from drillctl.design import Design

DesignName = Annotated[str, typer.Argument(metavar="DESIGN", help="Path or shipped name.")]
Sets = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="PATH=VALUE", help="Set a value: controller.kp=300; repeatable."),
]
Axes = Annotated[
    list[str] | None,
    typer.Option(
        "--axis", metavar="PATH=MIN:MAX:POINTS", help="Add an axis to the map; repeatable."
    ),
]
Draws = Annotated[
    int | None, typer.Option("--realizations", help="Number of draws of the uncertain parameters.")
]
Seed = Annotated[int | None, typer.Option("--seed", help="Seed of the draws.")]
Out = Annotated[Path | None, typer.Option("--out", help="Write results to this folder.")]
Json = Annotated[
    bool, typer.Option("--json", help="Print one JSON object on stdout, nothing else.")
]
Threads = Annotated[int | None, typer.Option("--threads", min=1, help="Number of threads to use.")]
Units = Annotated[
    Literal["si", "field"], typer.Option("--units", help="Units of tables and figures.")
]
Verbose = Annotated[bool, typer.Option("-v", "--verbose", help="Print more on stderr.")]
Debug = Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")]


@dataclass(frozen=True)
class Common:
    """Options of every command that computes."""

    out: Path | None
    json: bool
    units: Literal["si", "field"]
    verbose: bool


def common_options(
    out: Out = None,
    json: Json = False,
    threads: Threads = None,
    units: Units = "si",
    verbose: Verbose = False,
    debug: Debug = False,
) -> Common:
    """Options of every command that computes; `app.run` reads `debug`."""
    if threads is not None:
        _use(threads)
    return Common(out, json, units, verbose)


Options = Common
_shared_options = common_options


def computing(
    verb: Callable[..., None], system: Literal["si", "field"] = "si"
) -> Callable[..., None]:
    """The function that typer reads: design, values set, own options, shared options."""
    shared = dict(inspect.signature(_shared_options, eval_str=True).parameters)
    shared["units"] = shared["units"].replace(default=system)
    own = [
        parameter.replace(annotation=eval(parameter.annotation, verb.__globals__))
        for parameter in inspect.signature(verb).parameters.values()
        if parameter.name not in ("design", "options")
    ]

    def command(**given: Any) -> None:
        common = {name: given.pop(name) for name in shared}
        design = loaded(given.pop("design"), given.pop("sets"))
        verb(design=design, options=_shared_options(**common), **given)

    kind = inspect.Parameter.KEYWORD_ONLY
    parameters = [
        inspect.Parameter("design", kind, annotation=DesignName),
        inspect.Parameter("sets", kind, default=None, annotation=Sets),
        *(parameter.replace(kind=kind) for parameter in (*own, *shared.values())),
    ]
    command.__name__, command.__doc__ = verb.__name__, verb.__doc__
    command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {one.name: one.annotation for one in parameters}
    return command


def loaded(name: str, sets: list[str] | None) -> Design:
    """Load a design by name or path with the values set; print its warnings."""
    from drillctl.cli import console
    from drillctl.design import load, parse_setting

    design = load(name, **dict(parse_setting(text) for text in sets or []))
    for warning in design.warnings:
        console.note(f"warning: {warning}")
    return design


def with_axes(design: Design, axes: list[str] | None) -> Design:
    """The design with the axes of the command line, if given."""
    from drillctl.design.reading import parse_axis

    return design.replace({"map.axes": [parse_axis(text) for text in axes]}) if axes else design


def with_values(design: Design, given: dict[str, Any]) -> Design:
    """The design with the values of options; None means not given."""
    values = {path: value for path, value in given.items() if value is not None}
    return design.replace(values) if values else design


def with_draws(design: Design, realizations: int | None, seed: int | None) -> Design:
    """The design with the draws of the command line, if given."""
    return with_values(design, {"uncertainty.realizations": realizations, "uncertainty.seed": seed})


def _use(threads: int) -> None:
    import numba

    most = numba.config.NUMBA_NUM_THREADS
    if threads > most:
        raise InputError(
            f"must be <= {most}, the threads of this machine, not {threads}", "--threads"
        )
    numba.set_num_threads(threads)
