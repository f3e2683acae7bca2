"""Designs of every kind: likely, absurd, broken; made from the tables that validate them."""

from __future__ import annotations

import copy
import datetime
import math
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal, get_args, get_origin

from drillctl import catalog, units
from drillctl.design.paths import kind_of, range_of
from drillctl.design.tables import DesignTables
from drillctl.rig.table import Table

TEXTS = (
    "", "a", "pipe", "5 in 19.5 lb/ft", "G-105", "controller.kp", "bit_rock.a1", "top", "9 rpm",
    "1e308 kN", "inf", "-inf N*m", "a\nb", "\x1b[2J\x07\0", "\u202eabc",
    "\U0001f469\u200d\U0001f680", "x" * 201, "k" * 10_000, "\u200b", '"', "1/0 in", "kN",
)  # fmt: skip
PATHS = ("bit_rock.a1", "bit_rock.a1_factor", "controller.kp", "a b", "top_drive.inertia")
JUNK: tuple[Any, ...] = (
    *TEXTS, True, -1, 0, 10**30, 1e300, -1e-300, math.nan, math.inf, [], [1, "a"], {}, {"law": 1},
    {"": 3}, [{}], datetime.date(2020, 1, 1), datetime.time(7, 32),
)  # fmt: skip
UNFIT: tuple[Any, ...] = ([], {}, "x", True, -1, [[]], [1, 2], {"a": 1})


def rigs() -> dict[str, dict[str, Any]]:
    """Every shipped model."""
    paths = {name: catalog.find(name, ("models",)) for name in catalog.names("models")}
    return {name: tomllib.loads(path.read_text("utf-8")) for name, path in paths.items()}


@dataclass(frozen=True)
class Chance:
    """Random choices, a share of which may be absurd."""

    source: Any  # as of the standard library or of hypothesis
    absurd: float = 1.0  # from none to all that there is

    def __getattr__(self, name: str) -> Any:
        return getattr(self.source, name)

    def rarely(self, share: float) -> bool:
        """Whether something absurd is due."""
        return bool(self.source.random() < self.absurd * share)


def spoilt(
    random: Any, rig: dict[str, Any], keys: tuple[str, ...] | None = None, absurd: float = 1.0
) -> dict[str, Any]:
    """A rig with up to four of its tables (of `keys`) changed."""
    tree, random = copy.deepcopy(rig), Chance(random, absurd)
    names = keys or tuple(info.alias or key for key, info in DesignTables.model_fields.items())
    for _ in range(random.randint(1, 4)):
        key = random.choice(names)
        info = DesignTables.model_fields["schema_version" if key == "schema" else key]
        tree[key] = _value(random, info, info.annotation, tree.get(key))
    return tree


def misfits(table: type[Table], tree: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Each key at and below a table with each value that fits few keys; those of every law too."""
    for name, info in table.model_fields.items():
        key = info.alias or name
        for value in UNFIT:
            yield key, {**tree, key: value}
        for inner in _tables_in(info.annotation):
            old = tree.get(key)
            old = old[0] if isinstance(old, list) and old else old
            kept = isinstance(old, dict) and _law(inner) in ("", _law_of(old))
            start = dict(old) if kept else {"law": _law(inner)} if _law(inner) else {}
            for path, spoiled in misfits(inner, start):
                each = [spoiled] if _is_list(info.annotation) else spoiled
                yield f"{key}.{path}", {**tree, key: each}


def _tables_in(annotation: Any) -> list[type[Table]]:
    if isinstance(annotation, type) and issubclass(annotation, Table):
        return [annotation]
    return [table for inside in get_args(annotation) for table in _tables_in(inside)]


def _is_list(annotation: Any) -> bool:
    return any(get_origin(one) is tuple for one in (annotation, *get_args(annotation)))


def _value(random: Any, info: Any, annotation: Any, old: Any) -> Any:
    """A value of a field, likely one that it takes."""
    if random.rarely(0.03):
        return random.choice(JUNK)
    limits = range_of(info) if info is not None else None
    origin, inside = get_origin(annotation), get_args(annotation)
    if isinstance(annotation, type) and issubclass(annotation, Table):
        return _table(random, annotation, old)
    if origin is tuple:
        return _entries(random, inside, old)
    if limits is not None:
        return _number(random, limits, kind_of(info), old)
    if origin is Literal:
        return random.choice(inside)
    if origin is dict:
        key = random.choice(
            ("bit_rock.a1", "bit_rock.a1_factor", "controller.kp", "a b", "top_drive.inertia")
        )
        return {key: _value(random, None, inside[1], None)}
    choices = [one for one in inside if one is not type(None)]
    if choices and annotation is not Any:
        tables = [one for one in choices if _law(one) and _law(one) == _law_of(old)]
        kept = tables and random.random() < 0.7
        return _value(random, None, random.choice(tables if kept else choices), old)
    if annotation is bool:
        return random.random() < 0.5
    if annotation is float:
        return 10.0 ** random.uniform(-3, 3)
    return random.choice(TEXTS)


def _law(annotation: Any) -> str:
    law = getattr(annotation, "model_fields", {}).get("law")
    return str(get_args(law.annotation)[0]) if law else ""


def _law_of(old: Any) -> Any:
    return old.get("law") if isinstance(old, dict) else None


def _table(random: Any, table: type[Table], old: Any) -> Any:
    """The old table with some keys changed, or a new one."""
    fields = table.model_fields
    result = dict(old) if isinstance(old, dict) and _law(table) in ("", _law_of(old)) else {}
    new = not result
    share = 0.3 if new else random.randint(1, 3) / len(fields)
    for key, info in fields.items():
        name = info.alias or key
        if name == "law":
            result["law"] = _law(table)
        elif random.random() < share or (new and info.is_required()):
            result[name] = _value(random, info, info.annotation, result.get(name))
    if random.rarely(0.02):
        result[random.choice(TEXTS)] = random.choice(JUNK)
    if result and random.rarely(0.02):
        del result[random.choice(sorted(result))]
    return result


def _entries(random: Any, inside: tuple[Any, ...], old: Any) -> list[Any]:
    """A list with one entry changed, or a new one."""
    if inside[-1] is not Ellipsis:
        return [_value(random, None, one, None) for one in inside]
    if isinstance(old, list) and old and random.random() < 0.7:
        result = list(old)
        place = random.randrange(len(result))
        result[place] = _value(random, None, inside[0], result[place])
        return result
    return [_value(random, None, inside[0], None) for _ in range(random.randint(0, 3))]


def _number(random: Any, limits: Any, kind: units.Kind | None, old: Any) -> Any:
    """A number near the old one, anywhere in its range, at its end, or beyond."""
    si, way = _si(old, kind), random.random()
    if si and not random.rarely(0.5):
        si = si * 10.0 ** random.uniform(-0.5, 0.5)
    elif way < 0.6:
        most = max(abs(limits.least), abs(limits.most))
        least = max(abs(limits.least), most * 1e-12) if limits.least > 0.0 else most * 1e-12
        si = math.exp(random.uniform(math.log(least), math.log(most)))
        si = -si if limits.least < 0.0 and random.random() < 0.5 else si
    elif way < 0.85:
        si = random.choice((limits.least, limits.most, 0.0))
    else:
        si = random.choice((-1.0, 10.0 * limits.most, 1e300, 1e-300, math.inf, math.nan, 1.8e308))
    if isinstance(old, int) or (limits.most == 1e9 and random.random() < 0.5):
        si = round(si) if math.isfinite(si) else si
    if kind is None:
        return si
    unit = random.choice(kind.examples)
    return f"{si / units.factor(unit, kind)!r} {unit}"


def _si(old: Any, kind: units.Kind | None) -> float:
    try:
        return float(old) if kind is None else units.parse(old, kind)
    except (TypeError, ValueError):
        return 0.0
