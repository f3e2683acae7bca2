"""Options shared by all commands, and the design with the values set on the command line."""

from __future__ import annotations

import inspect
import logging
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from drillctl.cli import console
from drillctl.errors import InputError, MultipleInputError
from drillctl.studies.base import Option

if TYPE_CHECKING:
    from drillctl import units
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
Out = Annotated[Path | None, typer.Option("--out", help="Write results to this folder.")]
Json = Annotated[
    bool, typer.Option("--json", help="Print one JSON object on stdout, nothing else.")
]
Threads = Annotated[int | None, typer.Option("--threads", min=1, help="Number of threads to use.")]
Units = Annotated[
    Literal["si", "field"] | None,
    typer.Option("--units", help="Units of tables and figures, in place of the design's."),
]
Verbose = Annotated[bool, typer.Option("-v", "--verbose", help="Print more on stderr.")]
Debug = Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")]


@dataclass(frozen=True)
class Common:
    """Options of every command that computes."""

    out: Path | None
    json: bool
    units: units.System
    verbose: bool


def common_options(
    out: Out = None,
    json: Json = False,
    threads: Threads = None,
    units: Units = None,
    verbose: Verbose = False,
    debug: Debug = False,
) -> Common:
    """Options of every command that computes; `app.run` reads `debug`."""
    if threads is not None:
        _use(threads)
    if verbose:
        logging.basicConfig(format="%(message)s", stream=sys.stderr)
        logging.getLogger("drillctl").setLevel(logging.INFO)
    return Common(out, json, units or "si", verbose)


_KEYWORD = inspect.Parameter.KEYWORD_ONLY


def command_of(
    name: str,
    meaning: str,
    own: Sequence[Option],
    perform: Callable[[Design, dict[str, Any], Common], None],
    axes: bool = False,
    system: Literal["si", "field"] = "si",
) -> Callable[..., None]:
    """The function that typer reads: design, values set, own options, shared options.

    `perform` takes the design, its own options by name and the shared ones; with `axes` the
    design has the axes of each `--axis`.
    """
    shared = dict(inspect.signature(common_options, eval_str=True).parameters)
    parameters = [
        inspect.Parameter("design", _KEYWORD, annotation=DesignName),
        inspect.Parameter("sets", _KEYWORD, default=None, annotation=Sets),
        *([inspect.Parameter("axis", _KEYWORD, default=None, annotation=Axes)] if axes else []),
        *map(_parameter, own),
        *(parameter.replace(kind=_KEYWORD) for parameter in shared.values()),
    ]

    def command(**given: Any) -> None:
        asked = {one: given.pop(one) for one in shared}
        design = with_axes(loaded(given.pop("design"), given.pop("sets")), given.pop("axis", None))
        asked["units"] = asked["units"] or design.tables.units or system
        common = common_options(**asked)
        perform(design, given, common)

    command.__name__, command.__doc__ = name, f"{meaning.rstrip('.')}."
    command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {one.name: one.annotation for one in parameters}
    return command


def _parameter(option: Option) -> inspect.Parameter:
    more: dict[str, Any] = {} if option.metavar is None else {"metavar": option.metavar}
    if option.least is not None:
        more["min"] = option.least
    if option.type is int and not option.sets:  # keys of a design have ranges of their own
        more["max"] = 10**9
    flag = f"{option.flag}/--{option.opposite}" if option.opposite else option.flag
    flags = [flag, option.formerly] if option.formerly else [flag]
    note = typer.Option(*flags, help=f"{option.help.rstrip('.')}.", **more)
    kind = option.type if option.default is not None else option.type | None
    return inspect.Parameter(
        option.name, _KEYWORD, default=option.default, annotation=Annotated[kind, note]
    )


def loaded(name: str, sets: list[str] | None) -> Design:
    """Load a design by name or path with the values set."""
    from drillctl.design import load, parse_setting

    values = dict(parse_setting(text) for text in sets or [])
    try:
        return load(name, **values)
    except MultipleInputError as error:
        raise MultipleInputError([_of_option(one, values) for one in error.errors]) from None
    except InputError as error:
        raise _of_option(error, values) from None


def _of_option(error: InputError, values: Iterable[str]) -> InputError:
    """An error whose key was set on the command line, named by the option and not the file."""
    key = error.where.partition(": ")[2]
    if any(key == path or key.startswith(f"{path}.") for path in values):
        return InputError(error.problem, f"--set {key}")
    return error


def warn(design: Design, system: units.System | None = None) -> None:
    """Print the warnings of a design, after what was asked for and not beside an error."""
    for warning in design.warnings:
        console.note(f"warning: {warning.said(system or design.tables.units or 'si')}")


def with_warnings(summary: dict[str, Any], design: Design) -> dict[str, Any]:
    """What JSON says of a design: a summary, and its warnings."""
    return summary | {"warnings": [one._asdict() for one in design.warnings]}


def with_axes(design: Design, axes: list[str] | None) -> Design:
    """The design with the axes of the command line, if given."""
    from drillctl.design.reading import parse_axis

    return design.replace({"map.axes": [parse_axis(text) for text in axes]}) if axes else design


def _use(threads: int) -> None:
    import numba

    most = numba.config.NUMBA_NUM_THREADS
    if threads > most:
        raise InputError(
            f"must be <= {most}, the threads of this machine, not {threads}", "--threads"
        )
    numba.set_num_threads(threads)
