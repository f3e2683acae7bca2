"""Imports go down only: from a room to those below it, and in no circle."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import drillctl

PACKAGE = Path(drillctl.__file__).parent

# From the ground up. `drillctl/__init__.py` is under all of them: it looks names up when they are
# asked for, and imports nothing.
GROUND = (
    "arrays", "text", "units", "errors", "progress", "provenance", "registry", "catalog",
)  # fmt: skip
ROOMS = (
    "drillctl", "ground", "rig", "design", "store", "linear", "simulation", "logs", "ensemble",
    "plots", "studies", "reporting", "explorer", "cli", "__main__",
)  # fmt: skip


def name_of(path: Path) -> str:
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {name_of(path): path for path in sorted(PACKAGE.rglob("*.py"))}


def room_of(module: str) -> str:
    second = module.split(".")[1] if "." in module else module
    return second if second in ROOMS else "ground"


def running(node: ast.AST) -> Iterator[ast.AST]:
    """Every node that is run: inside functions as well, but not for the type checker only."""
    left = [node]
    while left:
        for child in ast.iter_child_nodes(left.pop()):
            typed = isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test)
            run = child.orelse if typed else [child]
            yield from run
            left += run


def imported(tree: ast.AST, package: str) -> set[str]:
    """Full names of what a module of a package imports; a name may be that of an object."""
    names: set[str] = set()
    for node in running(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) - node.level + 1]
            base = ".".join(above * bool(node.level) + [node.module] * bool(node.module))
            names |= {f"{base}.{alias.name}" for alias in node.names}
    return names


def module_of(name: str) -> str | None:
    """The module of this package that a name is, or is of."""
    while name and name not in MODULES:
        name = name.rpartition(".")[0]
    return name or None


def tree_of(module: str) -> ast.AST:
    return ast.parse(MODULES[module].read_text(encoding="utf-8"))


@cache  # not as this file is read: every worker of the tests reads all files
def graph() -> dict[str, set[str]]:
    """The modules of this package that each of them imports."""
    edges = {}
    for module, path in MODULES.items():
        package = module if path.name == "__init__.py" else module.rpartition(".")[0]
        found = {module_of(name) for name in imported(tree_of(module), package)}
        edges[module] = {other for other in found if other not in (None, module)}
    return edges


def circle(modules: set[str]) -> list[str]:
    """A circle among these modules; empty if there is none."""
    inside = {module: graph()[module] & modules for module in modules}
    try:
        TopologicalSorter(inside).prepare()
    except CycleError as error:
        return error.args[1]
    return []


def test_every_module_is_in_a_room():
    inside = {path.relative_to(PACKAGE).parts[0] for path in MODULES.values()}
    rooms = {room for room in inside if not room.endswith(".py")}
    assert rooms == set(ROOMS) - {"drillctl", "ground", "__main__"}
    files = {name.removesuffix(".py") for name in inside - rooms}
    assert files == {*GROUND, "__init__", "__main__"}


def test_imports_go_down_only():
    rank = {room: place for place, room in enumerate(ROOMS)}
    up: dict[tuple[str, str], list[str]] = {}
    for module, others in graph().items():
        for other in others:
            pair = room_of(module), room_of(other)
            if rank[pair[0]] < rank[pair[1]]:
                up.setdefault(pair, []).append(f"{module} -> {other}")
    assert not up, up


def test_no_room_holds_a_circle():
    circles = {room: circle({m for m in MODULES if room_of(m) == room}) for room in ROOMS}
    assert not any(circles.values()), circles


def test_of_the_package_itself_nothing_above_is_taken():
    """Its names are looked up as they are asked for: an import up that no list of imports shows."""
    for module in MODULES:
        tree = tree_of(module)
        taken = {name for name in imported(tree, module) if module_of(name) == "drillctl"}
        for node in ast.walk(tree):
            if isinstance(node, ast.Attribute) and getattr(node.value, "id", "") == "drillctl":
                taken |= {n for n in [f"drillctl.{node.attr}"] if module_of(n) == "drillctl"}
        if room_of(module) not in ("drillctl", "reporting", "cli", "__main__"):
            assert taken <= {"drillctl", "drillctl.__version__"}, module


def test_what_counts_as_an_import():
    source = """
import drillctl.units
from typing import TYPE_CHECKING
if TYPE_CHECKING:
    from drillctl.cli import app
else:
    from drillctl import errors
def later():
    from ..design import load
    from . import near
"""
    found = imported(ast.parse(source), "drillctl.linear")
    ours = {name for name in found if name.startswith("drillctl")}
    assert ours == {
        "drillctl.units", "drillctl.errors", "drillctl.design.load", "drillctl.linear.near",
    }  # fmt: skip
    assert module_of("drillctl.design.load") == "drillctl.design"
