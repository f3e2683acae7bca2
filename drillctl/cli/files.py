"""Commands on files: list shipped ones, print, check or start a design."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from drillctl.cli.options import Debug, DesignName, Json, Sets, loaded


def _listed(kind: Literal["models", "designs"], as_json: bool) -> None:
    from drillctl import catalog
    from drillctl.cli import console

    entries = catalog.entries(kind)
    if as_json:
        keys = [{"name": e.name, "title": e.title, "path": str(e.path)} for e in entries]
        console.emit({kind: keys})
    else:
        console.table(kind, ["name", "title"], [[e.name, e.title] for e in entries])


def models(json: Json = False, debug: Debug = False) -> None:
    """List the shipped models (rigs)."""
    _listed("models", json)


def designs(json: Json = False, debug: Debug = False) -> None:
    """List the shipped designs (cases to run)."""
    _listed("designs", json)


def show(design: DesignName, sets: Sets = None, json: Json = False, debug: Debug = False) -> None:
    """Print a design with its model and every default."""
    from drillctl.cli import console
    from drillctl.design import to_toml
    from drillctl.design.reading import to_tree

    loaded_design = loaded(design, sets)
    if json:
        console.emit(to_tree(loaded_design.tables))
    else:
        console.line(to_toml(loaded_design).rstrip())


def validate(
    design: DesignName, sets: Sets = None, json: Json = False, debug: Debug = False
) -> None:
    """Check keys, units and ranges, axes, draws and cases."""
    from drillctl.cli import console
    from drillctl.studies.base import studies

    loaded_design = loaded(design, sets)
    for study in studies().values():
        study.check(loaded_design)
    if json:
        console.emit({"valid": True, "name": loaded_design.name, "path": loaded_design.origin})
    else:
        console.line(f"{loaded_design.origin}: valid")


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name or path of the new file.")],
    debug: Debug = False,
) -> None:
    """Write a commented design file to start from."""
    from drillctl.cli import console
    from drillctl.design.starter import write_starter

    console.line(f"written: {write_starter(name)}")
