"""Write `design-file.md` from the tables that validate design files.

python docs/make_design_file.py
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args, get_origin

from drillctl import units
from drillctl.design.paths import kind_of, range_of
from drillctl.design.tables import DesignTables
from drillctl.rig.table import Table

HEAD = """# Keys of a design file

Generated from the code by `docs/make_design_file.py`; a test keeps it up to date. TOML,
`schema = 1`. Keys at the top level: `schema`, `model` (a shipped name or a path, whose values the
design overrides), `title`, `author` (named by a report), `source`, `status`, `notes`, and `units`:
`"field"` (rpm, klbf, klbf ft, ft, in, lb ft²; klbf ft/rpm for slopes and Kp, klbf ft/rev for Ki and
stiffness) or `"si"`, in which tables, pictures, sentences, CSV files and the report are, unless
`--units` asks for others. All tables below are optional in a design that names a model.

A key with a unit takes text with any unit of the same kind. Gains may be bare numbers. Ranges are
wide, a thousand times beyond any rig: what lies outside is a slip of the pen. Sections of
a design and of its model are merged by name. A table whose `law` changes drops the numbers of the
old law, and of a drive law also the axes of the map and the bounds of `tune` over them;
`controller.drive` and `weight_on_bit.path` are kept. `tune.parameters` of a design replace those of
its model.

Without `map.axes` a map runs over the two numbers that the drive law is tuned by, in ranges that
follow from pipe and drive (a PI: kp to 6 zeta, ki to 1.5 w_s^2 J_d); over one and the set speed
where the law has one. `tune` searches the same ranges by default.
"""


def tables_in(annotation: Any, path: str) -> Iterator[tuple[str, type[Table]]]:
    """Every table inside a type of a design's keys, with the words that stand for it in a file."""
    if isinstance(annotation, type) and issubclass(annotation, Table):
        law = annotation.model_fields.get("law")
        named = f' law = "{get_args(law.annotation)[0]}"' if law else ""
        yield (path if path.startswith("[") else f"[{path}]") + named, annotation
        inside = path.strip("[]")
        for key, info in annotation.model_fields.items():
            yield from tables_in(info.annotation, f"{inside}.{key}" if inside else key)
        return
    kind = get_origin(annotation)
    path = {tuple: f"[[{path}]]", dict: f'[{path}."dotted.path"]'}.get(kind, path)
    for argument in get_args(annotation):
        yield from tables_in(argument, path)


def tables() -> dict[type[Table], str]:
    """Every table that a design may hold, in the order of the file, each once."""
    found: dict[type[Table], str] = {}
    for name, table in tables_in(DesignTables, ""):
        found.setdefault(table, name)
    del found[DesignTables]
    return found


def main() -> None:
    """Write the page beside this file."""
    Path(__file__).with_name("design-file.md").write_text(page(), encoding="utf-8")


def page() -> str:
    """The whole page."""
    return "\n".join([HEAD, _units(), *(_section(name, table) for table, name in tables().items())])


UNITS = (
    "Capitals count as small letters where that has no other meaning (`RPM`, `KN`). Between units",
    "`-`, `.`, a space, or nothing in `Nm` and `ftlb`, are as good as `*`: `ft-lbf/rpm`, `Nms`,",
    "`kg-m²`. Numbers may be fractions (`4 1/2`, `5½`) and have a decimal comma (`171,45 mm`) or",
    "marks between thousands (`9,842.5 ft`, `4 500 m`, `4.500,5 m`); `13,360 ft`, which may be",
    "either, is refused, as `lbs` of a force and `ton` are.",
)


def _units() -> str:
    """Every spelling of a unit, by what is measured."""
    kinds = {kind.si: kind for kind in vars(units).values() if isinstance(kind, units.Kind)}
    lines = ["## Units", "", *UNITS, "", "| quantity | read as |", "|---|---|"]
    for kind in kinds.values():
        written = ", ".join(f"`{unit}`" for unit in units.spellings(kind))
        lines.append(f"| {kind.name} | {written} |")
    return "\n".join([*lines, ""])


def _section(name: str, table: type[Table]) -> str:
    lines = [f"## `{name}`", "", inspect.getdoc(table) or "", ""]
    lines += ["| key | unit | range | default |", "|---|---|---|---|"]
    for key, info in table.model_fields.items():
        kind = kind_of(info)
        unit = ", ".join(kind.examples) if kind else _values(info.annotation)
        limits = range_of(info)
        ends = limits.text(kind) if limits else ""
        lines.append(f"| `{info.alias or key}` | {unit} | {ends} | {_default(info, kind)} |")
    return "\n".join([*lines, ""])


def _values(annotation: Any) -> str:
    """Words that a key may take, if it takes words."""
    words = [w for part in (annotation, *get_args(annotation)) for w in get_args(part)]
    return " or ".join(f"`{w}`" for w in dict.fromkeys(words) if isinstance(w, str))


def _default(info: Any, kind: Any) -> str:
    if info.is_required():
        return "required"
    value = info.default
    if value is None or info.default_factory is not None:
        return ""
    if isinstance(value, Table):
        return "its own table, below"
    if kind is not None:
        values = value if isinstance(value, tuple) else (value,)
        return ", ".join(units.write(one, kind) for one in values)
    if isinstance(value, tuple):
        return ", ".join(str(getattr(item, "path", item)) for item in value)
    return str(value)


if __name__ == "__main__":
    main()
