"""What holds of every module: cheap imports, docstrings, and documented parameters."""

from __future__ import annotations

import ast
import dataclasses
import importlib
import inspect
import pkgutil
import re
import subprocess
import sys
import time

import pytest

import drillctl

HEAVY = ("numpy", "scipy", "numba", "control", "casadi", "matplotlib", "xarray", "pint", "pydantic")
MODULES = sorted(
    found.name
    for found in pkgutil.walk_packages(drillctl.__path__, "drillctl.")
    if not found.name.endswith("__main__")
)


def loaded_by(statement):
    """Heavy packages that a statement imports in a fresh process, and what it prints."""
    script = f"{statement}\nimport sys\nprint('loaded:', *(m for m in {HEAVY} if m in sys.modules))"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stderr == ""
    assert done.stdout.startswith("loaded:")  # nothing else is printed
    return done.stdout.split()[1:]


def test_import_is_cheap_and_silent():
    begin = time.perf_counter()
    assert loaded_by("import drillctl") == []
    assert time.perf_counter() - begin < 5.0  # a hundredth of that on an idle machine


@pytest.mark.parametrize("module", ["drillctl.cli", "drillctl.__main__", "drillctl.catalog"])
def test_the_command_starts_light(module):
    assert loaded_by(f"import {module}") == []


def test_lists_of_names_need_nothing_heavy():
    run = "import io, contextlib\nfrom drillctl.cli import run\n"
    quiet = "with contextlib.redirect_stdout(io.StringIO()): run(['designs', '--json'])"
    assert set(loaded_by(run + quiet)) <= {"pydantic"}  # which typer itself may use


def test_map_needs_neither_control_nor_casadi():
    assert not {"control", "casadi", "matplotlib"} & set(loaded_by("import drillctl.studies"))


def test_the_search_for_gains_takes_casadi_when_it_needs_it():
    assert "casadi" not in loaded_by("import drillctl.studies.tune")


def test_pyplot_is_never_imported():
    for name in MODULES:
        source = inspect.getsource(importlib.import_module(name))
        imports = [
            n for n in ast.walk(ast.parse(source)) if isinstance(n, ast.Import | ast.ImportFrom)
        ]
        for node in imports:
            assert "pyplot" not in ast.unparse(node), name


def test_modules_are_documented_and_their_names_resolve():
    for name in MODULES:
        importlib.import_module(name)
    for name in ["drillctl", *MODULES]:
        module = importlib.import_module(name)
        assert (module.__doc__ or "").strip(), name
        names = getattr(module, "__all__", [])
        assert len(names) == len(set(names)), name
        for public in names:
            value = getattr(module, public)
            assert value is not None, name
            # A module that holds a thing of its own name hides that thing once it is imported.
            assert not inspect.ismodule(value) or public not in vars(value), public
        assert set(names) <= set(dir(module)), name


def test_unknown_names_are_attribute_errors():
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        drillctl.simulat  # noqa: B018
    with pytest.raises(AttributeError, match=r"'cycle'; in Python it is drillctl\.limit_cycle"):
        drillctl.cycle  # noqa: B018


def test_modules_load_at_the_first_use_of_their_name():
    assert loaded_by("import drillctl\ndrillctl.rig, drillctl.catalog, drillctl.units") == []
    assert drillctl.linear.root_locus


# --- numpydoc --------------------------------------------------------------------------------


def section(text, title):
    """Names of the entries of a numpydoc section; None if there is no such section."""
    found = re.search(rf"^{title}\n-+\n(.*?)(?=^\S[^\n]*\n-+\n|\Z)", text, re.M | re.S)
    if found is None:
        return None
    heads = re.findall(r"^(\*{0,2}\w[^:\n]*?)(?:\s:\s.*)?$", found[1], re.M)
    return [name.strip().lstrip("*") for head in heads for name in head.split(",")]


def own(module):
    """Public functions, classes and methods that a module defines."""
    for name, value in list(vars(module).items()):
        value = inspect.unwrap(value) if callable(value) else value
        if name.startswith("_") or getattr(value, "__module__", None) != module.__name__:
            continue
        if inspect.isfunction(value) and "<locals>" not in value.__qualname__:
            yield name, value
        elif inspect.isclass(value):
            yield name, value
            for inner, method in list(vars(value).items()):
                method = getattr(method, "__func__", method)
                named = getattr(method, "__name__", "") == inner  # no function that a field holds
                if inspect.isfunction(method) and named and not inner.startswith("_"):
                    yield f"{name}.{inner}", method


def documented_as_it_is(value):
    """Whether a class or function has a docstring, whose names are those that it has."""
    text = inspect.cleandoc(value.__doc__ or "")
    if inspect.isclass(value):
        listed, real = section(text, "Attributes"), None
        if dataclasses.is_dataclass(value):
            real = [field.name for field in dataclasses.fields(value)]
            own_fields = [name for name in real if name in vars(value).get("__annotations__", ())]
            if listed == own_fields:  # a class that adds to another lists what it adds
                return bool(text)
    else:
        listed = section(text, "Parameters")
        real = [name for name in inspect.signature(value).parameters if name not in ("self", "cls")]
    return bool(text) and (listed is None or real is None or listed == real)


def test_public_names_are_documented_as_they_are():
    every = {
        f"{name}.{label}": value
        for name in MODULES
        for label, value in own(importlib.import_module(name))
    }
    assert len(every) > 1000
    wrong = [name for name, value in every.items() if not documented_as_it_is(value)]
    assert wrong == []


def test_a_docstring_that_names_what_is_not_there_is_seen():
    def right(a, b):
        """One.

        Parameters
        ----------
        a, b : float
            Two of them.
        """

    def wrong(a, c):
        pass

    assert documented_as_it_is(right)
    assert not documented_as_it_is(wrong)
    wrong.__doc__ = right.__doc__
    assert not documented_as_it_is(wrong)


def test_the_parser_of_docstrings_sees_what_is_there():
    text = inspect.cleandoc("""One.

    Parameters
    ----------
    a, b : float
        Two of them (s):
        and more.
    **rest
        Others.

    Returns
    -------
    c : int
        No parameter.
    """)
    assert section(text, "Parameters") == ["a", "b", "rest"]
    assert section(text, "Returns") == ["c"]
    assert section(text, "Raises") is None


def test_a_design_is_loaded_without_heavy_packages():
    light = {"numpy", "pydantic"}
    assert set(loaded_by("import drillctl; drillctl.load('monteiro-trindade-140kn')")) <= light
