"""Design files in: TOML text, laid over its model, validated."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from drillctl import catalog
from drillctl.design.design import Design
from drillctl.design.merging import Tree, branch, overlay
from drillctl.design.validation import validated
from drillctl.errors import InputError


def load(name_or_path: str | Path, **values: Any) -> Design:
    """Read a design.

    Parameters
    ----------
    name_or_path : str or Path
        A shipped design or model by name, or a TOML file.
    **values
        Dotted path to value, laid over the file: `load("paper", **{"controller.kp": 300})`.

    Returns
    -------
    Design
        Complete and frozen.

    Raises
    ------
    InputError
        Missing file, broken TOML (with its line), unknown key or name, impossible value.
    """
    path = catalog.find(str(name_or_path))
    tree = _merged(path, seen=())
    for key, value in values.items():
        try:
            tree = overlay(tree, branch(key, value, tree))
        except InputError as error:
            raise error.within(str(path)) from None
    return Design(path.stem, validated(tree, str(path)), tree, str(path))


def _merged(path: Path, seen: tuple[Path, ...]) -> Tree:
    """Contents of a file laid over those of the model it names."""
    tree = _read(path)
    model = tree.pop("model", None)
    if model is None:
        return tree
    if not isinstance(model, str):
        raise InputError(f"got {model!r}; a model is a name or a path in quotes", f"{path}: model")
    try:
        below = _model_path(model, path)
    except InputError as error:
        raise InputError(f"{model!r}: {error.problem}", f"{path}: model") from None
    if below in (*seen, path.resolve()):
        raise InputError(f"{model!r} leads back to this file", f"{path}: model")
    return overlay(_merged(below, (*seen, path.resolve())), tree)


def _model_path(model: str, design: Path) -> Path:
    """A model given as a path is looked for beside the design first."""
    beside = design.parent / model
    if beside.suffix == ".toml" and beside.is_file():
        return beside.resolve()
    return catalog.find(model, ("models", "designs")).resolve()


def _read(path: Path) -> Tree:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"broken TOML: {error}", str(path)) from None
    except UnicodeDecodeError as error:
        raise InputError(f"not UTF-8 text: {error}", str(path)) from None
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", str(path)) from None


def parse_setting(text: str) -> tuple[str, Any]:
    """Split `path=VALUE` of the command line; VALUE as in TOML, or text without quotes.

    Raises
    ------
    InputError
        There is no `=`.
    """
    path, equals, value = text.partition("=")
    if not equals or not path.strip():
        raise InputError(f"{text!r} is not of the form dotted.path=VALUE", "--set")
    try:
        return path.strip(), tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return path.strip(), value.strip()
