"""Heads of a tally, and the rows of cells that a file of tables holds.

Columns stand in any order under the names in use, with units in the heads or in a row under them.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from drillctl import catalog, units
from drillctl.errors import InputError


class Field(NamedTuple):
    """What a column may hold."""

    key: str  # of a section; empty where it only helps to find others
    kind: units.Kind | None
    heads: str  # pattern of the heads, in lower case, without unit


_JOINT = r"(?=.*\b(tj|tool ?joints?|joint|connection|conn)\b).*"
_OUTER, _INNER = r"\b(od|o d|outer|outside|external)\b", r"\b(id|i d|inner|inside|internal|bore)\b"
_UNUSED = (
    r"\b(cum\w*|accum\w*|running|depth|serial|sn|asset|part|fn|fish\w*|from|to|max|blade|gauge|"
    r"neck|drift|remarks?)\b"
)
_EACH = r"length (per|of (a|each)) |length each|each length|avg length"
_COUNT = r"\b(count|qty|quantity|number|no|nos|nr|joints|jts|pieces|pcs)\b|^#$"
_PIPE_JOINT = r"\b(average|avg|mean|range) (joint|jt)s? (length|len)\b"
_NAME = r"\b(name|component|item|description|tool|element|section|type|bha)\b"
_LENGTH = r"\b(length|len)\b"
_TOTAL = r"\b(total|sum|section) (length|len)\b|\blength total\b"
FIELDS = {
    "not used": Field("", None, _UNUSED),
    "joint od": Field("joint_outer_diameter", units.DIAMETER, _JOINT + _OUTER),
    "joint id": Field("joint_inner_diameter", units.DIAMETER, _JOINT + _INNER),
    "joint spacing": Field(
        "joint_spacing", units.LENGTH, _JOINT + r"\b(spacing|pitch)\b|" + _PIPE_JOINT
    ),
    "length of a piece": Field("length", units.LENGTH, _EACH),
    "joint length": Field("joint_length", units.LENGTH, _JOINT + _LENGTH),
    "total length": Field("", units.LENGTH, _TOTAL),
    "weight": Field("", units.LINEAR_MASS, r"\b(weight|wt|ppf|mass|lb ft|kg m)\b"),
    "grade": Field("grade", None, r"\bgrade\b"),
    "inertia": Field("inertia", units.INERTIA, r"\binertia\b"),
    "stands": Field("repeat", None, r"\bstands?\b"),
    "od": Field("outer_diameter", units.DIAMETER, _OUTER + r"|^(diameter|dia|size)\b"),
    "id": Field("inner_diameter", units.DIAMETER, _INNER),
    "count": Field("repeat", None, _COUNT),
    "length": Field("length", units.LENGTH, _LENGTH),
    "name": Field("name", None, _NAME),
}
"""What a head is read as: the first whose pattern it holds."""
NOTHING = ("", "-", "--", "–", "—", "n/a", "na", "none")  # cells that hold nothing


class Head(NamedTuple):
    """A column: its head, which of `FIELDS` it is (none if empty), and its unit."""

    text: str
    field: str
    unit: str


def text_of(path: Path, where: str) -> str:
    """Lines of a file; of a workbook the first sheet that holds a tally, as CSV."""
    content = catalog.read_bytes(path, f"{where}: {path}")
    if path.suffix.lower() in (".xlsx", ".xlsm"):
        sheets = _of_workbook(path, content)
        rows = next((one for one in sheets if heads_of(list(enumerate(one)))), sheets[0])
        stream = io.StringIO()
        csv.writer(stream, lineterminator="\n").writerows(rows)
        return stream.getvalue()
    return _decoded(content).rstrip("\n") + "\n"


def _decoded(content: bytes) -> str:
    """Text as spreadsheets save it: UTF-8, UTF-16 with its mark, or that of Windows."""
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-16", "replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("cp1252", "replace")


def _of_workbook(path: Path, content: bytes) -> list[list[list[str]]]:
    """The sheets of a workbook."""
    try:
        import openpyxl
    except ImportError:
        raise InputError(
            f"{path}: a workbook needs openpyxl (pip install 'drillctl[xlsx]'), or save it as CSV"
        ) from None
    try:
        book = openpyxl.load_workbook(io.BytesIO(content), read_only=True, data_only=True)
        sheets = [list(sheet.iter_rows(values_only=True)) for sheet in book.worksheets]
    except Exception as error:  # what is no workbook fails in many ways
        raise InputError(f"{path} is no workbook: {error}") from None
    return [[[_written(cell) for cell in row] for row in sheet] for sheet in sheets]


def _written(value: object) -> str:
    if value is None:
        return ""
    return f"{value:.15g}" if isinstance(value, float) else str(value).strip()


def rows_of(text: str) -> list[list[str]]:
    """Rows of cells; the delimiter is what most lines have, a comma where they have no other."""
    lines = text.splitlines(keepends=True)
    some = [line for line in lines[:40] if line.strip()]
    often = (one for one in ";\t|" if 2 * sum(line.count(one) > 1 for line in some) > len(some))
    most = max(",;\t|", key=lambda one: max(line.count(one) for line in lines[:10]))
    delimiter = next(often, most)
    rows: list[list[str]] = []
    reader = csv.reader(lines, delimiter=delimiter)
    for row in reader:
        rows += [[]] * (reader.line_num - len(rows) - 1)  # lines before the last of a row
        cells = [" ".join(cell.split()) for cell in row]
        rows.append(cells if cells and not cells[0].startswith("# ") else [])
    rows = [[] if all(re.fullmatch(r":?-*:?", cell) for cell in row) else row for row in rows]
    cells = [cell for row in rows for cell in row]
    if not any(re.search(r"\d,\d{3}\.\d", cell) for cell in cells) and (
        delimiter == ";" or _with_comma(cells)
    ):
        rows = [[_with_point(cell) for cell in row] for row in rows]
    return rows


def _with_comma(cells: list[str]) -> bool:
    """Whether a comma is the decimal point of all numbers: it is that of some, a point of none."""
    some = any(re.match(r"\d+,(\d{1,2}|\d{4,})(?![\d,])", cell) for cell in cells)
    return some and not any(re.search(r"\d\.\d", cell) for cell in cells)


def _with_point(cell: str) -> str:
    """A number with a decimal comma, and points between thousands, as it is written here."""
    cell = re.sub(r"(?<![\d.])(\d{1,3}(?:\.\d{3})+)(?=,\d)", lambda m: m[1].replace(".", ""), cell)
    return re.sub(r"(?<=\d),(?=\d)", ".", cell)


_NEEDED = ({"od"}, {"length", "total length"})  # columns that heads of a tally have
_OR_BY_NAME = ({"name"}, {"length", "total length"})  # where the catalogue has the diameters
TITLES = 40  # most rows above the heads


def heads_of(rows: list[tuple[int, list[str]]]) -> tuple[int, list[str]] | None:
    """Place of the last row of heads, and the heads: of one row, or of two or three of them.

    Over several columns one head may stand, as the left one of cells that were merged.
    """
    for needed in (_NEEDED, _OR_BY_NAME):
        for last in range(min(len(rows), TITLES)):
            for heads in _ways(rows, last):
                fields = [_head(text).field for text in heads]
                known = [one for one in fields if one not in ("", "name", "count")]
                if all(one & set(fields) for one in needed) and len(known) == len(set(known)):
                    return last, heads
        for last in range(min(len(rows), TITLES)):  # two columns of a kind: said when it is read
            fields = [_head(text).field for text in rows[last][1]]
            if all(one & set(fields) for one in needed):
                return last, rows[last][1]
    return None


def _ways(rows: list[tuple[int, list[str]]], last: int) -> Iterable[list[str]]:
    """What heads that end in a row may say, the likelier first."""
    own = rows[last][1]
    if sum(bool(_head(text).field) for text in own) < 2:
        return  # a line of the tally
    for above in (1, 2):
        upper = [row for _, row in rows[max(0, last - above) : last]]
        if len(upper) < above or sum(map(bool, upper[-above])) < 2:
            break  # a title
        width = max(map(len, [*upper, own]))
        missing = [not cell for cell in own + [""] * (width - len(own))]
        if above == 1 and not any(a and b for a, b in zip(upper[0], missing, strict=False)):
            yield own
        for spread in (True, False):
            wide = [*(_filled(row, spread) for row in upper), own]
            heads = []
            for k, empty in enumerate(missing):  # a head is spread over columns with heads below
                told = [*upper, own] if empty else wide
                heads.append(" ".join(row[k] for row in told if k < len(row) and row[k]))
            yield heads
    yield own


def _filled(row: list[str], spread: bool) -> list[str]:
    """A row of heads, each spread over the empty cells to its right."""
    if not spread:
        return row
    filled: list[str] = []
    for cell in row:
        filled.append(cell or (filled[-1] if filled else ""))
    return filled


def columns_of(heads: list[str], rows: list[list[str]], where: str) -> list[Head]:
    """The columns under some heads; refused where one is missing or there twice."""
    columns = [_head(text) for text in heads]
    for place, column in enumerate(columns):
        values = [row[place] for row in rows if place < len(row) and row[place].isdigit()]
        numbered = values == [str(n) for n in range(1, len(values) + 1)]
        most = len(values) >= 0.5 * len(rows)  # others are of units, or add up
        if column.field in ("count", "name") and numbered and most:
            columns[place] = column._replace(field="")  # it counts the lines
        of_pipe = column.field == "joint length" and not re.search("tool|tj", column.text.lower())
        if of_pipe and not {"length", "total length"} & {one.field for one in columns}:
            columns[place] = column._replace(field="length")
    fields = {one.field for one in columns}
    for field in ("od", "length"):
        instead = {"total length"} if field == "length" else {"name"}
        if field == "od" and "id" in fields:
            instead = set()
        if not {field, *instead} & fields:
            names = ", ".join(repr(c.text) for c in columns if c.text)
            raise InputError(f"no column is the {field} of a component; there are {names}", where)
    found: list[Head] = []
    for place, column in enumerate(columns):
        twice = [one.field for one in columns].count(column.field) > 1
        if twice and rows and not any(row[place] for row in rows if place < len(row)):
            column = column._replace(field="")
        first = next((one for one in found if one.field and one.field == column.field), None)
        if first is not None:
            if column.field != "name" and (first.unit == column.unit or not column.unit):
                raise InputError(
                    f"columns {first.text!r} and {column.text!r} both read as {column.field}", where
                )
            column = column._replace(field="")  # the same in another unit
        found.append(column)
    return found


def _head(text: str) -> Head:
    """A head: its words, and the unit in brackets, behind a comma or as its last word."""
    words, unit = text.strip(), ""
    bracket = re.search(r"[\[(]([^\])]*)[\])]\s*$", words)
    if bracket:
        words, unit = words[: bracket.start()], bracket[1].strip()
    else:
        last = re.search(r"(?<=[\w.\"])[\s,_/]+([^\s,_]+)$", words)
        if last and (_is_unit(last[1]) or _is_unit(last[1].lower())):
            words, unit = words[: last.start()], last[1]
    plain = re.sub(r"[\s._\-/]+", " ", words.lower()).strip()
    for field, about in FIELDS.items():
        if re.search(about.heads, plain):
            if field == "weight" and (not unit) and plain in ("ppf", "lb ft"):
                unit = "lb/ft"
            used = field if field != "not used" and _fits(unit, about.kind) else ""
            return Head(text.strip(), {"length of a piece": "length"}.get(used, used), unit)
    return Head(text.strip(), "", unit)


def _is_unit(text: str) -> bool:
    kinds = (units.DIAMETER, units.LINEAR_MASS, units.INERTIA, units.FORCE)
    return text in ("kg", "lb", "lbs") or any(text in units.spellings(kind) for kind in kinds)


def is_unit_of(unit: str, kind: units.Kind) -> bool:
    """Whether a text is a unit of this kind."""
    return bool(unit) and not problem_of(f"1 {unit}", kind)


def _fits(unit: str, kind: units.Kind | None) -> bool:
    """Whether a column in this unit can be of this kind: a total mass is no mass per length."""
    return not unit or kind is None or not problem_of(f"1 {unit}", kind)


def problem_of(text: str, kind: units.Kind) -> str:
    """What is wrong with a quantity; empty for nothing."""
    try:
        units.parse(text, kind)
    except InputError as error:
        return error.problem
    return ""


def with_units_row(
    columns: list[Head], rows: list[tuple[int, list[str]]]
) -> tuple[list[Head], list[tuple[int, list[str]]]]:
    """Units that stand in the row under the heads, if that is what this row holds."""
    row = [cell.strip().strip("[]()") for cell in rows[0][1]]
    row += [""] * (len(columns) - len(row))
    pairs = list(zip(columns, row, strict=False))
    measured = [(c, cell) for c, cell in pairs if c.field and FIELDS[c.field].kind is not None]
    given = [(c, cell) for c, cell in measured if cell.lower() not in NOTHING]
    units_of = dict(given)
    if not given or not all(_fits(unit, FIELDS[c.field].kind) for c, unit in given):
        return columns, rows
    return [c._replace(unit=units_of.get(c, c.unit)) for c in columns], rows[1:]
