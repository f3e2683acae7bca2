"""Design files in: TOML text, laid over its model, validated.

Designs out: the resolved design as TOML that reads back to the same object.
"""

from __future__ import annotations

import json
import re
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

from drillctl import catalog, units
from drillctl.design.design import Design
from drillctl.design.merging import Tree, overlay, with_values
from drillctl.design.paths import entries_of, kind_in, kind_of
from drillctl.design.tables import Table
from drillctl.design.tally import Tally, with_tally
from drillctl.design.uncertain_tables import with_samples
from drillctl.design.validation import validated
from drillctl.design.well import with_survey
from drillctl.errors import InputError, shown
from drillctl.text import one_line


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
    if "drillstring.tally" in values:
        tree = _without_sections(tree)
    try:
        tree = with_samples(with_values(tree, values), Path())
        tree = with_survey(with_tally(tree, Path()), Path())
    except InputError as error:
        raise error.within(str(path)) from None
    return Design(one_line(path.stem), validated(tree, str(path)), tree, str(path))


def _merged(path: Path, seen: tuple[Path, ...]) -> Tree:
    """Contents of a file laid over those of the model it names."""
    try:
        tree = with_samples(_read(path), path.parent)
        string = tree.get("drillstring")
        whole = isinstance(string, dict) and "tally" in string
        tree = with_survey(with_tally(tree, path.parent), path.parent)
    except InputError as error:
        raise (error if error.where.startswith(str(path)) else error.within(str(path))) from None
    model = tree.pop("model", None)
    if model is None:
        return tree
    if not isinstance(model, str):
        raise InputError(
            f"got {shown(model)}; a model is a name or a path in quotes", f"{path}: model"
        )
    try:
        below = catalog.find_model(model, path)
    except InputError as error:
        raise InputError(f"{shown(model)}: {error.problem}", f"{path}: model") from None
    if below in (*seen, path.resolve()):
        raise InputError(f"{model!r} leads back to this file", f"{path}: model")
    base = _merged(below, (*seen, path.resolve()))
    if whole:  # a tally is a string of its own
        base = _without_sections(base)
    try:
        return overlay(base, tree)
    except InputError as error:
        raise error.within(str(path)) from None


def _without_sections(tree: Tree) -> Tree:
    string = tree.get("drillstring")
    if not isinstance(string, dict):
        return tree
    return {**tree, "drillstring": {key: string[key] for key in string if key != "sections"}}


def _read(path: Path) -> Tree:
    text = catalog.read(path, str(path))
    try:
        tree: Tree = units.plain(tomllib.loads(text))
        return tree
    except RecursionError:
        raise InputError("broken TOML: nested too deeply", str(path)) from None
    except ValueError as error:  # TOMLDecodeError, or a whole number of thousands of digits
        raise InputError(f"broken TOML: {error}", str(path)) from None


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
    except (ValueError, RecursionError):
        return path.strip(), value.strip()


def parse_axis(text: str) -> Tree:
    """Read `path=min:max:points` of the command line into an axis table."""
    path, equals, ends = text.partition("=")
    parts = ends.split(":")
    if not equals or len(parts) != 3:
        raise InputError(f"{text!r} is not of the form path=min:max:points", "--axis")
    try:
        points = int(parts[2])
    except ValueError:
        raise InputError(f"{shown(parts[2])} is not a number of points", f"--axis {path}") from None
    low, high = (_number_or_text(part.strip()) for part in parts[:2])
    return {"path": path.strip(), "min": low, "max": high, "points": points}


def _number_or_text(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def to_toml(design: Design) -> str:
    """The whole design, model and defaults included, as the text of a design file."""
    import tomli_w

    return tomli_w.dumps(to_tree(design.tables))


def to_tree(table: Table) -> Tree:
    """A table as plain TOML data, quantities as text with units; what is not set is left out."""
    tree: Tree = {}
    for key, name, kind, annotation, required in _fields(type(table)):
        value = _plain(getattr(table, key), kind or table.kind_by_key(key), annotation)
        if value is not None and (required or value not in ("", {}, [])):
            tree[name] = value
    return tree


@cache
def _fields(table: type[Table]) -> tuple[tuple[str, str, units.Kind | None, Any, bool], ...]:
    """Keys of a table: in Python and in a file, kind, type, whether it is written when empty.

    It is where nothing else would be read in its place: a key that must be there, or whose default
    is not empty.
    """
    return tuple(
        (key, info.alias or key, kind_of(info), info.annotation,
         info.is_required() or (isinstance(info.default, (str, tuple)) and len(info.default) > 0))
        for key, info in table.model_fields.items()
    )  # fmt: skip


def _plain(value: Any, kind: units.Kind | None, annotation: Any = None) -> Any:
    if isinstance(value, Table):
        return to_tree(value)
    if isinstance(value, tuple):
        of_each = entries_of(annotation, len(value))
        return [_plain(item, kind_in(one), one) for item, one in zip(value, of_each, strict=True)]
    if isinstance(value, dict):
        return {key: _plain(item, None) for key, item in value.items()}
    if kind is not None and isinstance(value, float):
        return units.write(value, kind)
    return value


def write_starter(name: str, tally: Tally | None = None, like: str | None = None) -> Path:
    """Write a commented file to start one's own rig from: with its tally, or like a shipped one."""
    path = Path(name)
    if not path.name or not name.isprintable():
        raise InputError(f"{shown(name)} is not a file name")
    path = path if path.suffix == ".toml" else path.with_name(f"{path.name}.toml")
    source = Path(__file__).with_name("starter.toml") if like is None else catalog.find(like)
    text = catalog.read(source, str(source))
    if tally is not None:
        text = _BLOCK.sub(lambda _: _with_lines(tally), text)
        text = _BODY.sub(
            '[bha]\ninertia = "0 kg*m^2"              # all of it is in the tally\n', text
        )
        text = _of_tally(text, tally)
    title = path.stem.replace("\\", "").replace('"', "")
    text = re.sub(r'^title = ".*"$', lambda _: f'title = "{title}"', text, count=1, flags=re.M)
    try:
        with path.open("x", encoding="utf-8") as stream:
            stream.write(re.sub("^# string: (begin|end)\n", "", text, flags=re.M))
    except FileExistsError:
        raise InputError("exists already; it is not overwritten", str(path)) from None
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror}", str(path)) from None
    return path


_BLOCK = re.compile("^# string: begin\n.*^# string: end\n", flags=re.M | re.S)
_BODY = re.compile(r"^\[bha\]\ninertia = .*\n", flags=re.M)
_DAMPING = re.compile("^# Typical internal damping.*?^stiffness_damping.*?\n", flags=re.M | re.S)


TYPICAL_BIT = 0.2159  # diameter (m) that the weight of the starter is typical of


def _of_tally(text: str, tally: Tally) -> str:
    """A new file with the bit and the units of its tally."""

    def put(key: str, value: str, why: str) -> None:
        nonlocal text
        line = f'{key} = "{value}"'
        text = re.sub(f"^{key} = .*$", lambda _: f"{line:<34}# {why}", text, count=1, flags=re.M)

    size, kind = tally.bit
    if tally.in_feet:
        text = re.sub("^(source = .*\n)", r'\1units = "field"\n', text, count=1, flags=re.M)
        put("units", "field", 'in which results are; or "si"')
    if size is not None:
        across = f"{size / 0.0254:.6g} in" if tally.in_feet else units.write(size, units.DIAMETER)
        put("bit_diameter", across, "of the tally")
        share = size / TYPICAL_BIT
        weight = f"{27 * share:.0f} klbf" if tally.in_feet else f"{5 * round(24 * share)} kN"
        put("weight_on_bit", weight, f"typical for a bit of {across}")
    if kind is not None:
        put("bit_type", kind, 'of the tally; "pdc", "hybrid" or "roller-cone"')
    return text


def _with_lines(tally: Tally) -> str:
    """The string of a new file: the tally as it came, with the usual damping and its reason."""
    starter = Path(__file__).with_name("starter.toml").read_text(encoding="utf-8")
    damping = _DAMPING.search(starter)
    assert damping is not None
    plain = "'''" not in tally.text
    quoted = f"'''\n{tally.text}'''" if plain else json.dumps(tally.text)
    return (
        "# The tally as it came; [[drillstring.sections]] with a name of it changes that section.\n"
        f'[drillstring]\n{damping[0]}tally_from = "{tally.begins}"\ntally = {quoted}\n'
    )
