"""From plain TOML data to validated tables, with errors in the user's own words."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import suppress
from difflib import get_close_matches
from typing import Any, get_args, get_origin

from pydantic import BaseModel, ValidationError

from drillctl.design.lines import ALTERNATIVES, dotted, place
from drillctl.design.merging import Tree
from drillctl.design.tables import DesignTables
from drillctl.errors import InputError, MultipleInputError, nearest, shown
from drillctl.rig.bit_rock.law import friction_laws
from drillctl.rig.table import Table
from drillctl.rig.top_drive.law import drive_laws, top_drive
from drillctl.rig.weight_on_bit.law import weight_laws

_LAWS: dict[str, Callable[[], dict[str, Any]]] = {
    "bit_rock": friction_laws,
    "controller": drive_laws,
    "weight_on_bit": weight_laws,
}

_TYPES = {
    "tuple_type": "it must be a list",
    "model_type": "it must be a table",
    "model_attributes_type": "it must be a table",
    "dict_type": "it must be a table",
    "string_type": "it must be text in quotes",
    "bool_type": "it must be true or false",
    "bool_parsing": "it must be true or false",
}
"""What is due, by pydantic's name of the error."""


def validated(
    tree: Tree, origin: str, like: tuple[Tree, DesignTables] | None = None
) -> DesignTables:
    """Validate plain TOML data; up to ten errors are told at once, each with its line.

    What the data share with others of which the tables are known, `like`, is not read again: of
    thousands of draws each changes a number or two.
    """
    try:
        tables = _read(tree, like)
    except ValidationError as error:
        problems = [_reported(one, tree) for one in _telling(error.errors())]
    else:
        problems = list(_impossible(tables))
    if not problems:
        return tables
    if origin:
        problems = [InputError(one.problem, place(origin, one.where, tree)) for one in problems]
    raise problems[0] if len(problems) == 1 else MultipleInputError(problems)


def _read(tree: Tree, like: tuple[Tree, DesignTables] | None) -> DesignTables:
    if like is not None:
        with suppress(ValidationError):  # told in terms of the data below
            return DesignTables.model_validate(_with_tables(tree, *like))
    return DesignTables.model_validate(tree)


def _with_tables(tree: Tree, before: Tree, table: Any) -> Tree:
    """Plain data with the tables in it of what is the same object as before."""
    result = dict(tree)
    for key, value in tree.items():
        old, held = before.get(key), getattr(table, key, None)
        if value is old and _is_read(held):
            result[key] = held
        elif isinstance(held, Table) and isinstance(value, dict) and isinstance(old, dict):
            result[key] = _with_tables(value, old, held)
    return result


def _is_read(held: object) -> bool:
    some = held if isinstance(held, tuple) else (held,)
    return bool(some) and all(isinstance(one, Table) for one in some)


def _impossible(tables: DesignTables) -> Iterator[InputError]:
    """What no rig can be, of tables that are valid each for itself."""
    from drillctl.design import parts
    from drillctl.design.well import refuse_impossible_well

    each = (
        parts.refuse_impossible_string, refuse_impossible_well, parts.bit_rock_before,
        parts.weight_on_bit, parts.program, parts.refuse_weight_of_moving_top,
    )  # fmt: skip
    found = False
    for check in (*each, _refuse_impossible_drive):
        if found and check is _refuse_impossible_drive:  # it rests on the others
            return
        try:
            check(tables)
        except InputError as error:
            found = True
            yield error


def _refuse_impossible_drive(tables: DesignTables) -> None:
    from drillctl.design import parts
    from drillctl.design.well import wall

    if drive_laws()[tables.controller.law].tuned_to_string:
        top_drive(tables.controller, lambda: parts.drillstring(tables))
    if not parts.drive_of(tables).ideal:
        string, torque = parts.drillstring(tables), parts.torque_at_set_speed(tables)
        rubbing = wall(tables, string)
        sliding = 0.0 if rubbing is None else float(rubbing.at_speed(tables.operating_point.speed))
        parts.refuse_weak_drive(tables, string, torque, sliding)


def _telling(problems: list[Any]) -> list[Any]:
    """All errors but missing keys of a table with an unknown one, probably misspelt.

    Nor that a quantity is not the word that may stand for it.
    """
    misspelt = {one["loc"][:-1] for one in problems if one["type"] == "extra_forbidden"}
    quantity = ALTERNATIVES[1]
    words = {one["loc"][:-1] for one in problems if str(*one["loc"][-1:]).startswith(quantity)}
    but = {"missing": misspelt, "literal_error": words}
    return [one for one in problems if one["loc"][:-1] not in but.get(one["type"], ())]


_RATED = "power|rated|rating|rpm|speed|hp|kw"
_OF_A_MOTOR = (
    "power and speeds of a motor are points of torque_speed, torque being power over speed: 400 kW "
    "at 1150 rpm are 3.32 kN*m; "
)


def _reported(problem: Any, tree: Tree) -> InputError:
    """A pydantic error as one of ours."""
    where = dotted(problem["loc"], tree)
    kind = problem["type"]
    if kind == "extra_forbidden":
        *parents, key = problem["loc"]
        allowed = sorted(_keys_at(tuple(parents)))
        here = ".".join(map(str, parents))
        misspelt = get_close_matches(str(key), allowed, n=1, cutoff=0.85)
        homes = [] if misspelt else _homes(DesignTables, str(key))
        homes = [f"[{home}]" for home in homes if home != here]
        elsewhere = f"; it stands in {' or '.join(homes[:3])}" if homes else ""
        hint = _OF_A_MOTOR if here == "top_drive" and re.search(_RATED, str(key)) else ""
        return InputError(f"unknown key{elsewhere}; {hint}{nearest(str(key), allowed)}", where)
    if kind == "missing":
        return InputError("is missing", where)
    if kind == "value_error":
        return InputError(str(problem["ctx"]["error"]), where)
    if kind in ("union_tag_invalid", "union_tag_not_found"):
        laws = sorted(_LAWS[str(problem["loc"][0])]())
        if kind == "union_tag_not_found":
            return InputError(f"law is missing; allowed: {', '.join(laws)}", where)
        came = problem["input"]["law"]
        return InputError(f"no law {shown(came)}; {nearest(str(came), laws)}", f"{where}.law")
    if kind == "literal_error":
        allowed = problem["ctx"]["expected"].replace(" or ", ", ").replace("'", "").split(", ")
        return InputError(
            f"got {shown(problem['input'])}; {nearest(str(problem['input']), allowed)}", where
        )
    due = _TYPES.get(kind, problem["msg"])
    if where.endswith("drillstring.sections") and kind == "tuple_type":
        due = "it must be a list of tables, each under [[drillstring.sections]]"
    return InputError(f"got {shown(problem['input'])}; {due}", where)


def _keys_at(loc: tuple[str | int, ...]) -> list[str]:
    """Keys that the table at `loc` may hold."""
    model: Any = DesignTables
    steps = iter(loc)
    for step in steps:
        if isinstance(step, int):
            continue
        fields = getattr(model, "model_fields", {})
        if step in fields:
            model = fields[step].annotation
            if get_origin(model) is dict:
                next(steps, None)  # the name of a table, which may be that of a field
        model = _table_class(model, step)
    return [f.alias or key for key, f in model.model_fields.items()]


def _homes(table: Any, key: str, path: str = "") -> list[str]:
    """Tables by dotted path that hold a key of this name."""
    found = [path] if path and key in table.model_fields else []
    for name, field in table.model_fields.items():
        inner = field.annotation
        if isinstance(inner, type) and issubclass(inner, BaseModel):
            found += _homes(inner, key, f"{path}.{name}" if path else name)
    return found


def _table_class(annotation: Any, step: str) -> Any:
    """The table class inside an annotation: itself, an item of a tuple, or the law `step`."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    if get_origin(annotation) is dict:  # of tables by name
        return get_args(annotation)[1]
    classes = [a for a in get_args(annotation) if a is not Ellipsis and a is not type(None)]
    for cls in classes:
        law = getattr(cls, "model_fields", {}).get("law")
        if law is not None and step in get_args(law.annotation):
            return cls
    if len(classes) == 1:
        return _table_class(classes[0], step)
    tuples = [c for c in classes if get_args(c)]
    return _table_class(tuples[0], step) if tuples else annotation
