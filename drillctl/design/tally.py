"""Tallies: the list of components that a rig keeps of its string, read into sections.

One line a component, columns in any order under the names in use, units in the heads, in a second
row or in each cell. Nothing is guessed that changes a number: which end a tally begins at is told,
and what was read how is reported.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import ValidationError

from drillctl import catalog, units
from drillctl.design.tables import SectionTable
from drillctl.errors import InputError, shown
from drillctl.rig.drillstring import GRADES, PIPES
from drillctl.rig.drillstring.catalogue import drill_pipe, find, kind_in

STEEL = 7850.0  # density (kg/m3) by which a bore follows from a weight
ENDS = ("top", "bit")


class Field(NamedTuple):
    """What a column may hold."""

    key: str  # of a section; empty where it only helps to find others
    kind: units.Kind | None
    heads: str  # pattern of the heads, in lower case, without unit


_JOINT = r"(?=.*\b(tj|tool ?joints?|joint|connection|conn)\b).*"
_OUTER, _INNER = r"\b(od|o d|outer|outside|external)\b", r"\b(id|i d|inner|inside|internal|bore)\b"
_UNUSED = r"\b(cum\w*|accum\w*|running|depth|from|to|max|blade|gauge|neck|drift|remarks?)\b"
_EACH = r"length (per|of (a|each)) |each length|avg length"
_COUNT = r"\b(count|qty|quantity|number|no|nos|nr|joints|jts|pieces|pcs)\b|^#$"
_NAME = r"\b(name|component|item|description|tool|element|section|type|bha)\b"
_LENGTH = r"\b(length|len)\b"
_TOTAL = r"\b(total|sum|section) (length|len)\b|\blength total\b"
FIELDS = {
    "not used": Field("", None, _UNUSED),
    "joint od": Field("joint_outer_diameter", units.DIAMETER, _JOINT + _OUTER),
    "joint id": Field("joint_inner_diameter", units.DIAMETER, _JOINT + _INNER),
    "joint spacing": Field("joint_spacing", units.LENGTH, _JOINT + r"\b(spacing|pitch)\b"),
    "length of a piece": Field("length", units.LENGTH, _EACH),
    "joint length": Field("joint_length", units.LENGTH, _JOINT + _LENGTH),
    "total length": Field("", units.LENGTH, _TOTAL),
    "weight": Field("", units.LINEAR_MASS, r"\b(weight|wt|ppf|mass|lb ft|kg m)\b"),
    "grade": Field("grade", None, r"\bgrade\b"),
    "inertia": Field("inertia", units.INERTIA, r"\binertia\b"),
    "od": Field("outer_diameter", units.DIAMETER, _OUTER + r"|^(diameter|dia|size)\b"),
    "id": Field("inner_diameter", units.DIAMETER, _INNER),
    "count": Field("repeat", None, _COUNT),
    "length": Field("length", units.LENGTH, _LENGTH),
    "name": Field("name", None, _NAME),
}
"""What a head is read as: the first whose pattern it holds."""
NOTHING = ("", "-", "--", "–", "—", "n/a", "na", "none")  # cells that hold nothing


@dataclass(frozen=True)
class Tally:
    """A tally as it was read."""

    text: str  # its lines
    begins: str  # end that its first line is at
    sections: tuple[dict[str, Any], ...]  # from top to bottom, as in a design file
    columns: tuple[tuple[str, str, str], ...]  # head, what it was read as, unit
    notes: tuple[str, ...]  # what was concluded, line by line


class _Cell(NamedTuple):
    text: str
    where: str  # file, line and column


class _Head(NamedTuple):
    text: str
    field: str
    unit: str


def with_tally(tree: dict[str, Any], folder: Path) -> dict[str, Any]:
    """A design's tree with the tally of its string replaced by the sections it holds.

    Sections that the design names as well are laid over those of the tally.
    """
    from drillctl.design.merging import overlay

    string = tree.get("drillstring")
    if not isinstance(string, Mapping) or "tally" not in string:
        if isinstance(string, Mapping) and "tally_from" in string:
            raise InputError("is of a tally, and there is none", "drillstring.tally_from")
        return tree
    made = read(string["tally"], string.get("tally_from"), folder)
    rest = {key: string[key] for key in string if key not in ("tally", "tally_from")}
    base = {"drillstring": {"sections": list(made.sections)}}
    return {**tree, **overlay(base, {"drillstring": rest})}


def read(source: object, begins: object, folder: Path, where: str = "drillstring.tally") -> Tally:
    """Read a tally: a path, or its text; `begins` says which end its first line is at."""
    if not isinstance(source, str):
        raise InputError(
            f"got {shown(source)}; a tally is a file, or its lines in triple quotes", where
        )
    if begins not in ENDS:
        raise InputError(
            f"{'is missing' if begins is None else f'got {shown(begins)}'}: does the first line "
            'of the tally stand at the "top" or at the "bit"?',
            f"{where}_from" if where.endswith("tally") else where,
        )
    if "\n" in source.strip():
        place, text = where, source.lstrip("\n")
    else:
        path = folder / Path(source).expanduser()
        place, text = str(path), _text_of(path, where)
    try:
        rows = [(n, row) for n, row in enumerate(rows_of(text), 1) if any(row)]
    except csv.Error as error:
        raise InputError(str(error), place) from None
    return _read(place, text, rows, str(begins))


def _text_of(path: Path, where: str) -> str:
    """Lines of a file; the first sheet of a workbook as CSV."""
    if path.suffix.lower() in (".xlsx", ".xlsm"):
        stream = io.StringIO()
        content = catalog.read_bytes(path, f"{where}: {path}")
        csv.writer(stream, lineterminator="\n").writerows(_of_workbook(path, content))
        return stream.getvalue()
    return catalog.read(path, f"{where}: {path}").rstrip("\n") + "\n"


def _of_workbook(path: Path, content: bytes) -> list[list[str]]:
    """The first sheet of a workbook."""
    try:
        import openpyxl
    except ImportError:
        raise InputError(
            f"{path}: a workbook needs openpyxl (pip install 'drillctl[xlsx]'), or save it as CSV"
        ) from None
    try:
        book = openpyxl.load_workbook(io.BytesIO(content), read_only=True, data_only=True)
        sheet = book.worksheets[0]
    except Exception as error:  # what is no workbook fails in many ways
        raise InputError(f"{path} is no workbook: {error}") from None
    return [[_written(cell) for cell in row] for row in sheet.iter_rows(values_only=True)]


def _written(value: object) -> str:
    if value is None:
        return ""
    return f"{value:.15g}" if isinstance(value, float) else str(value).strip()


def rows_of(text: str) -> list[list[str]]:
    """Rows of cells; the delimiter is the one that a line has most of, heads or not."""
    lines = text.splitlines()
    delimiter = max(",;\t|", key=lambda one: max(line.count(one) for line in lines[:10]))
    rows = [
        [cell.strip() for cell in row] if row and not row[0].startswith("# ") else []
        for row in csv.reader(lines, delimiter=delimiter)
    ]
    if delimiter == ";":  # where a comma stands in numbers
        rows = [[re.sub(r"(?<=\d),(?=\d)", ".", cell) for cell in row] for row in rows]
    return rows


def _read(place: str, text: str, rows: list[tuple[int, list[str]]], begins: str) -> Tally:
    while len(rows) > 2 and len(_fields(rows[0][1])) < len(_NEEDED) and _heads_below(rows):
        rows = rows[1:]  # a title
    if len(rows) < 2:
        raise InputError("holds no lines below its heads", place)
    (_, heads), *rest = rows
    columns = _columns(heads, [row for _, row in rest], f"{place}: line {rows[0][0]}")
    columns, rest = _with_units_row(columns, rest)
    notes: list[str] = []
    sections: list[dict[str, Any]] = []
    for number, row in rest:
        cells = {
            column.field: _Cell(text.strip(), f"{place}: line {number}, column {column.text!r}")
            for column, text in zip(columns, row, strict=False)
            if column.field and text.strip().lower() not in NOTHING
        }
        line = _Line(f"{place}: line {number}", {c.field: c for c in columns}, cells)
        if line.adds_up:
            notes.append(f"line {number}: {line.name!r} left out, a sum")
        elif cells:
            sections.append(line.section())
            notes += [f"line {number}, {line.name}: {note}" for note in line.notes]
    _refuse_upside_down(sections, begins == "bit", place)
    sections = sections[::-1] if begins == "bit" else sections
    return Tally(
        text,
        begins,
        tuple(_numbered(sections, notes)),
        tuple((c.text, c.field or "not used", c.unit) for c in columns if c.text),
        tuple(notes),
    )


_NEEDED = ({"od"}, {"length", "total length"})  # columns without which there is no string


def _fields(row: list[str]) -> list[set[str]]:
    """Which of the columns that are needed a row of heads has."""
    fields = {_head(text).field for text in row}
    return [one for one in _NEEDED if one & fields]


def _heads_below(rows: list[tuple[int, list[str]]]) -> bool:
    return any(len(_fields(row)) == len(_NEEDED) for _, row in rows[1:10])


def _columns(heads: list[str], rows: list[list[str]], where: str) -> list[_Head]:
    columns = [_head(text) for text in heads]
    for place, column in enumerate(columns):
        values = [row[place].strip() for row in rows if place < len(row) and row[place].strip()]
        numbered = values == [str(n) for n in range(1, len(rows) + 1)]
        if column.field in ("count", "name") and numbered:
            columns[place] = column._replace(field="")  # it counts the lines
        of_pipe = column.field == "joint length" and not re.search("tool|tj", column.text.lower())
        if of_pipe and not {"length", "total length"} & {one.field for one in columns}:
            columns[place] = column._replace(field="length")
    for field in ("od", "length"):
        others = ("total length", "length of a piece") if field == "length" else ()
        if not any(c.field in (field, *others) for c in columns):
            names = ", ".join(repr(c.text) for c in columns if c.text)
            raise InputError(f"no column is the {field} of a component; there are {names}", where)
    found: list[_Head] = []
    for column in columns:
        if column.field and any(one.field == column.field for one in found):
            first = next(one.text for one in found if one.field == column.field)
            if column.field != "name":
                raise InputError(
                    f"columns {first!r} and {column.text!r} both read as {column.field}", where
                )
            column = column._replace(field="")
        found.append(column)
    return found


def _head(text: str) -> _Head:
    """A head: its words, and the unit in brackets, behind a comma or as its last word."""
    words, unit = text.strip(), ""
    bracket = re.search(r"[\[(]([^\])]*)[\])]\s*$", words)
    if bracket:
        words, unit = words[: bracket.start()], bracket[1].strip()
    else:
        last = re.search(r"(?<=[\w.\"])[\s,_/]+([^\s,_]+)$", words)
        if last and _is_unit(last[1]):
            words, unit = words[: last.start()], last[1]
    plain = re.sub(r"[\s._\-/]+", " ", words.lower()).strip()
    for field, about in FIELDS.items():
        if re.search(about.heads, plain):
            if field == "weight" and (not unit) and plain in ("ppf", "lb ft"):
                unit = "lb/ft"
            used = field if field != "not used" and _fits(unit, about.kind) else ""
            return _Head(text.strip(), {"length of a piece": "length"}.get(used, used), unit)
    return _Head(text.strip(), "", unit)


def _is_unit(text: str) -> bool:
    kinds = (units.DIAMETER, units.LINEAR_MASS, units.INERTIA, units.FORCE)
    return text in ("kg", "lb", "lbs") or any(text in units.spellings(kind) for kind in kinds)


def is_unit_of(unit: str, kind: units.Kind) -> bool:
    """Whether a text is a unit of this kind."""
    return bool(unit) and not _problem(f"1 {unit}", kind)


def _fits(unit: str, kind: units.Kind | None) -> bool:
    """Whether a column in this unit can be of this kind: a total mass is no mass per length."""
    return not unit or kind is None or not _problem(f"1 {unit}", kind)


def _problem(text: str, kind: units.Kind) -> str:
    try:
        units.parse(text, kind)
    except InputError as error:
        return error.problem
    return ""


def _with_units_row(
    columns: list[_Head], rows: list[tuple[int, list[str]]]
) -> tuple[list[_Head], list[tuple[int, list[str]]]]:
    """Units that stand in the row under the heads, if that is what this row holds."""
    row = [cell.strip().strip("[]()") for cell in rows[0][1]]
    row += [""] * (len(columns) - len(row))
    pairs = list(zip(columns, row, strict=False))
    measured = [(c, cell) for c, cell in pairs if c.field and FIELDS[c.field].kind is not None]
    given = [(c, cell) for c, cell in measured if cell.lower() not in NOTHING]
    if not given or not all(_fits(cell, FIELDS[c.field].kind) for c, cell in given):
        return columns, rows
    made = [c._replace(unit=cell) if (c, cell) in given else c for c, cell in pairs]
    return made, rows[1:]


class _Line:
    """A line of a tally on its way to a section."""

    def __init__(
        self, where: str, columns: Mapping[str, _Head], cells: Mapping[str, _Cell]
    ) -> None:
        self.where, self.columns, self.cells = where, columns, cells
        self.notes: list[str] = []

    @property
    def name(self) -> str:
        """As written."""
        return self.cells["name"].text if "name" in self.cells else ""

    @property
    def adds_up(self) -> bool:
        """Whether it is the sum under the others."""
        return "od" not in self.cells and bool(re.match(r"(total|sum)\b", self.name.lower()))

    def section(self) -> dict[str, Any]:
        """Keys of a section as in a design file."""
        if not self.name:
            raise InputError("the component has no name", self.where)
        section: dict[str, Any] = {"name": self.name}
        section |= self._lengths()
        section |= self._diameters()
        section |= self._joints(section)
        section |= self._grade(section)
        if "inertia" in self.cells:
            section["inertia"] = self._quantity("inertia")
        self._check(section)
        return section

    def _quantity(self, field: str) -> str:
        """Text with a unit, its own or that of its column."""
        cell, kind = self.cells[field], FIELDS[field].kind
        assert kind is not None
        text = cell.text
        if re.search(r"^\D*\d+,(\d{1,2}|\d{4,})(?!\d|,)", text):
            text = text.replace(",", ".")  # no group of thousands
        elif re.search(r"\d,\d", text):
            groups = re.fullmatch(r"(\d{1,3}(?:,\d{3})+)(\.\d+)?(\D.*)?", text)
            if groups is None or (groups[2] is None and text.count(",") == 1):
                plain, point = text.replace(",", ""), text.replace(",", ".")
                raise InputError(
                    f"{text!r} may be {plain} or {point}; write one of them", cell.where
                )
            text = text.replace(",", "")
        unit = self.columns[field].unit
        if units.bare(text) and unit:
            text = f"{text} {unit}"
        problem = _problem(text, kind)
        if problem:
            hint = "" if unit or not units.bare(text) else "; the column gives no unit either"
            raise InputError(problem + hint, cell.where)
        return text

    def _value(self, field: str) -> float:
        kind = FIELDS[field].kind
        assert kind is not None
        return units.parse(self._quantity(field), kind)

    def _lengths(self) -> dict[str, Any]:
        count = self._count()
        keys: dict[str, Any] = {"repeat": count} if count > 1 else {}
        total = self._value("total length") if "total length" in self.cells else None
        if "length" in self.cells:
            if total is not None and abs(self._value("length") * count / total - 1.0) > 0.01:
                raise InputError(
                    f"{count} x {self._quantity('length')} is not the total length "
                    f"{self._quantity('total length')}",
                    self.cells["total length"].where,
                )
            return {**keys, "length": self._quantity("length")}
        if total is None:
            raise InputError("the component has no length", self.where)
        if count == 1:
            return {"length": self._quantity("total length")}
        return {**keys, "length": f"{total / count!r} m"}

    def _count(self) -> int:
        if "count" not in self.cells:
            return 1
        cell = self.cells["count"]
        found = re.fullmatch(
            r"(\d+)(?:\.0*)?\s*(?:x|jts?|joints?|pcs?|pieces?|stands?)?", cell.text, re.I
        )
        if found is None or int(found[1]) == 0:
            raise InputError(f"{cell.text!r} is not a number of pieces", cell.where)
        return int(found[1])

    def _diameters(self) -> dict[str, Any]:
        if "od" not in self.cells:
            known = find(self.name)
            if known is None:
                raise InputError("the component has no outer diameter", self.where)
            self.notes.append(f"no diameters: {known} of the catalogue")
            return {"pipe": known}
        outer = self._quantity("od")
        if "id" in self.cells:
            return {"outer_diameter": outer, "inner_diameter": self._quantity("id")}
        diameter = self._value("od")
        if "weight" in self.cells:
            weight, heavy = self._value("weight"), kind_in(self.name) == "HWDP"
            known = drill_pipe(diameter, weight, heavy)
            if known is not None:
                self.notes.append(f"no inner diameter: that of {known}")
                bore = PIPES[known].inner_diameter
            else:
                square = diameter**2 - 4.0 * weight / (math.pi * STEEL)
                if square < 0.0:
                    raise InputError(
                        "is more than a solid bar of steel weighs", self.cells["weight"].where
                    )
                bore = math.sqrt(square)
                self.notes.append(f"no inner diameter: {bore * 1e3:.1f} mm by its weight")
            return {"outer_diameter": outer, "inner_diameter": f"{bore * 1e3:.6g} mm"}
        if not _is_bit(self.name):
            raise InputError(
                'the component has no inner diameter ("0 mm" if it is solid)', self.where
            )
        self.notes.append("no inner diameter: taken as solid")
        return {"outer_diameter": outer, "inner_diameter": "0 mm"}

    def _joints(self, section: dict[str, Any]) -> dict[str, Any]:
        fields = ("joint od", "joint id", "joint length")
        given = [field for field in fields if field in self.cells]
        if not given:
            return {}
        if "pipe" in section or "joint length" not in given or "joint od" not in given:
            self.notes.append("tool joint left out: it has no outer diameter and length of its own")
            return {}
        keys = {FIELDS[field].key: self._quantity(field) for field in given}
        if "joint id" not in given:
            keys["joint_inner_diameter"] = section["inner_diameter"]
            self.notes.append("tool joint with the bore of the body")
        if "joint spacing" in self.cells:
            keys["joint_spacing"] = self._quantity("joint spacing")
        elif "repeat" not in section:
            self.notes.append("a tool joint every 31 ft (a typical joint of pipe), or one in all")
        return keys

    def _grade(self, section: dict[str, Any]) -> dict[str, Any]:
        if "grade" not in self.cells:
            return {}
        text = self.cells["grade"].text.upper()
        plain = re.sub(r"[^A-Z0-9]", "", text)
        for grade in GRADES:
            letter, number = grade.split("-")
            if plain in (letter + number, letter, number):
                return {"grade": grade}
        self.notes.append(
            f"grade {self.cells['grade'].text!r} is of no drill pipe: no torsional yield"
        )
        return {}

    def _check(self, section: dict[str, Any]) -> None:
        """Let the table of a section say what is wrong, at the column it is in."""
        try:
            SectionTable.model_validate(section)
        except ValidationError as error:
            problem = error.errors()[0]
            key = str(problem["loc"][-1]) if problem["loc"] else ""
            field = next((f for f, about in FIELDS.items() if about.key == key), "")
            where = self.cells[field].where if field in self.cells else self.where
            text = str(problem.get("ctx", {}).get("error", problem["msg"]))
            raise InputError(text, where) from None


def _is_bit(name: str) -> bool:
    return bool(re.search(r"\bbit$|^bit\b(?!.*\bsub\b)|\bpdc\b|\btricone\b", name.lower()))


def _refuse_upside_down(sections: list[dict[str, Any]], upwards: bool, place: str) -> None:
    """Refuse a tally whose bit is at the other end than it is said to begin at."""
    bits = [n for n, section in enumerate(sections) if _is_bit(section["name"])]
    wrong = len(sections) - 1 if upwards else 0
    if len(sections) > 1 and bits == [wrong]:
        raise InputError(
            f"{sections[wrong]['name']!r} is its {'last' if upwards else 'first'} line, but it is "
            f"said to begin at the {'bit' if upwards else 'top'}",
            place,
        )


def _numbered(sections: Iterable[dict[str, Any]], notes: list[str]) -> Iterable[dict[str, Any]]:
    """Sections with names of their own: the second of a name is called by a number."""
    taken: set[str] = set()
    for section in sections:
        name, number = section["name"], 1
        while name in taken:
            number += 1
            name = f"{section['name']} {number}"
        if number > 1:
            notes.append(f"{section['name']!r} once more: called {name!r}")
        taken.add(name)
        yield {**section, "name": name}
