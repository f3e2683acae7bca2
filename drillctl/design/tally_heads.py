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


_WORDS = {
    "outer": "ext utv außen aussen ytre utvendig extérieur exterieur exterior uitwendige",
    "inner": "int innv innen indre innvendig intérieur interieur interior inwendige",
    "od": "außendurchmesser aussendurchmesser buitendiameter ad",
    "id": "innendurchmesser binnendiameter",
    "diameter": "dia diam durchmesser diamètre diametre diámetro diametro ø",
    "length": "längd længde länge laenge lengde lengte longueur longitud",
    "each length": "einzellänge",
    "total length": "gesamtlänge",
    "each": "unitaire unitaria",
    "per": "pr je",
    "total": "totale gesamt",
    "count": "qté antal jnts anzahl antall aantal nombre cantidad stück stk",
    "component": "comp beschreibung beskrivelse beskrivning bezeichnung benennung "
    "komponente komponent komponenten désignation designation omschrijving onderdeel "
    "descripción descripcion élément elemento",
    "weight": "gewicht vekt poids peso masse masa",
    "cumulative": "akkumuliert akkumulert kumuliert kumulativ cumulée cumulé acumulada acumulado",
    "grade": "stahlgüte stålkvalitet kvalitet güte nuance grado",
    "inertia": "trägheitsmoment treghetsmoment inertie inercia",
}
_ENGLISH = {word: english for english, words in _WORDS.items() for word in words.split()}
_JOINT = r"(?=.*\b(tj|tool ?(joint|jt)s?|joint|connection|conn|box|pin)\b).*"
_OUTER = r"\b(od|o d|do|d o|outer|outside|external|diameter (out|ext))\b"
_INNER = r"\b(id|i d|di|d i|inner|inside|internal|bore|diameter in[tn]?)\b"
_UNUSED = (
    r"\b(a?cum\w*|acc|akk|kum|accum\w*|running|depth|serial|sn|asset|part|fn|fish\w*|from|to|max|blade|"
    r"gauge|neck|drift|remarks?)\b|\b(stand|joint|jt) ?(#|no|nr|number)$|\bpos$|"
    r"\b(joints|jts|pieces) per stand\b|\b(total|cum) (weight|wt|mass)\b|"
    r"\b(conn|connection|thread) type$"
)
_EACH = (
    r"(length|len) (per|of (a|each)) |(length|len) each|each (length|len)|"
    r"(avg|single|unit) (length|len)"
)
_COUNT = r"\b(count|qty|quantity|number|no|nos|nr|joints|jts|pieces|pcs)\b|^#$"
_PIECES = r"\b(count|qty|quantity|joints|jts|pieces|pcs)\b"  # what no number of a line is called
_PIPE_JOINT = r"\b(average|avg|mean|range) (joint|jt)s? (length|len)\b"
_NAME = r"\b(name|component|item|description|tool|element|section|type|bha)\b"
_LENGTH = r"(?:\b(length|len|footage)\b|^l(ong)?$)"
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
    "weight": Field("", units.LINEAR_MASS, r"\b(weight|wt|ppf|mass|lb per ft|kg per m)\b|^[mwq]$"),
    "grade": Field("grade", None, r"\bgrade\b"),
    "inertia": Field("inertia", units.INERTIA, r"\binertia\b"),
    "stands": Field("repeat", None, r"\bstands?\b"),
    "od": Field("outer_diameter", units.DIAMETER, _OUTER + r"|^(diameter|dia|size)\b(?! in)"),
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

    @property
    def is_of_a_piece(self) -> bool:
        """Whether a length says that it is of a piece."""
        return bool(re.search(_EACH, _plain(self.text)))


def text_of(path: Path, where: str) -> tuple[str, str]:
    """Where a tally stands, and its lines: a file, or the likeliest sheet of a workbook."""
    content = catalog.read_bytes(path, f"{where}: {path}")
    if path.suffix.lower() in (".xlsx", ".xlsm"):
        sheets = _of_workbook(path, content)
        name = max(sheets, key=lambda one: _known_heads(sheets[one]))
        stream = io.StringIO()
        csv.writer(stream, lineterminator="\n").writerows(sheets[name])
        return f"{path}, sheet {name!r}" if len(sheets) > 1 else str(path), stream.getvalue()
    if path.suffix.lower() in (".xls", ".ods") or content[:4] == b"%PDF":
        raise InputError(f"{path}: save the sheet as .xlsx or CSV, which are read")
    return str(path), _decoded(content).rstrip("\n") + "\n"


def _known_heads(rows: list[list[str]]) -> int:
    """How many columns of a tally a sheet has."""
    found = heads_of(list(enumerate(rows)))
    return 0 if found is None else len({_head(text).field for text in found[1]} - {""})


def _decoded(content: bytes) -> str:
    """Text as spreadsheets save it: UTF-8, UTF-16 with its mark, or that of Windows."""
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-16", "replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("cp1252", "replace")


def _of_workbook(path: Path, content: bytes) -> dict[str, list[list[str]]]:
    """The sheets of a workbook by name."""
    try:
        import openpyxl
    except ImportError:
        raise InputError(
            f"{path}: a workbook needs openpyxl (pip install 'drillctl[xlsx]'), or save it as CSV"
        ) from None
    try:
        book = openpyxl.load_workbook(io.BytesIO(content), read_only=True, data_only=True)
        sheets = {one.title: list(one.iter_rows(values_only=True)) for one in book.worksheets}
    except Exception as error:  # what is no workbook fails in many ways
        raise InputError(f"{path} is no workbook: {error}") from None
    return {
        name: [[_written(cell) for cell in row] for row in rows] for name, rows in sheets.items()
    }


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
    told = re.match(r"sep=(.)$", some[0].strip()) if some else None  # as Excel writes it
    delimiter = told[1] if told else next(often, most)
    lines = ["\n", *lines[1:]] if told else lines
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
        commas = any(re.fullmatch(r"\d+,\d+", cell) for cell in cells)
        rows = [[_with_point(cell, commas) for cell in row] for row in rows]
    elif any(re.match(r"\d*\.\d", cell) for cell in cells):  # then a comma parts thousands
        rows = [[_THOUSANDS.sub("", cell) for cell in row] for row in rows]
    return rows


_THOUSANDS = re.compile(r"(?:(?<=^\d)|(?<=^\d\d)|(?<=^\d{3})),(?=\d{3}(?![\d,.]))")


def _with_comma(cells: list[str]) -> bool:
    """Whether a comma is the decimal point of all numbers: it is that of some, a point of none."""
    some = any(re.match(r"\d+,(\d{1,2}|\d{4,})(?![\d,])", cell) for cell in cells)
    return some and not any(re.search(r"\d\.\d", cell) for cell in cells)


def _with_point(cell: str, commas: bool) -> str:
    """A number with a decimal comma, and points between thousands, as it is written here."""
    if commas and re.fullmatch(r"\d{1,3}\.\d{3}", cell):
        return cell.replace(".", ",")  # beside decimal commas it may be either, and is refused so
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


def likeliest(rows: list[tuple[int, list[str]]]) -> tuple[int, list[str]]:
    """The row that looks most like heads where none has all: by known ones, then by words."""

    def like(place: int) -> tuple[int, int]:
        row = rows[place][1]
        words = [cell for cell in row if cell and not re.search(r"^\W*\d", cell)]
        return sum(bool(_head(cell).field) for cell in words), len(words)

    best = max(range(min(len(rows), TITLES)), key=like)
    return best, rows[best][1]


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


def parted(
    heads: list[str], rows: list[tuple[int, list[str]]]
) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Columns that hold two diameters, `OD x ID`, as two columns."""
    for place in reversed(range(len(heads))):
        words, unit = _unit_of(heads[place])
        both = re.search(r"(?i)\b(o\.?d\.?)\s*[x×/]\s*(i\.?d\.?)(?=\W|$)", words)
        if both is None:
            continue
        rest = f"{words[: both.start()]}{{}}{words[both.end() :]}{f' ({unit})' if unit else ''}"
        heads = [*heads[:place], rest.format("OD"), rest.format("ID"), *heads[place + 1 :]]
        rows = [
            (n, [*row[:place], *_two(row[place : place + 1]), *row[place + 1 :]]) for n, row in rows
        ]
    return heads, rows


def _two(cell: list[str]) -> list[str]:
    """A cell of two diameters as two cells; what has one is the outer."""
    first, _, second = (cell or [""])[0].replace("×", "x").replace("X", "x").partition("x")
    if not second:
        first, _, second = first.partition(" / ")
    return [first.strip(), second.strip()]


def columns_of(heads: list[str], rows: list[list[str]], where: str) -> list[Head]:
    """The columns under some heads; refused where one is missing or there twice."""
    columns = [_head(text) for text in heads]
    for place, column in enumerate(columns):
        values = [row[place] for row in rows if place < len(row) and row[place].isdigit()]
        numbered = [str(n) for n in range(1, len(values) + 1)]
        most = len(values) >= 0.5 * len(rows)  # others are of units, or add up
        may = column.field == "name" or (
            column.field == "count" and not re.search(_PIECES, _plain(column.text))
        )
        if may and values in (numbered, numbered[::-1]) and most:
            columns[place] = column._replace(field="")  # it counts the lines
    columns = _lengths_of(columns)
    fields = {one.field for one in columns}
    for field in ("od", "length"):
        instead = {"total length"} if field == "length" else {"name"}
        if field == "od" and "id" in fields:
            instead = set()
        if not {field, *instead} & fields:
            names = ", ".join(repr(c.text) for c in columns if c.text)
            raise InputError(
                f"no column is the {_CALLED[field]} of a component: call one {_HEADS[field]!r}; "
                f"there are {names}",
                where,
            )
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


_CALLED = {"od": "outer diameter", "length": "length"}
_HEADS = {"od": "OD", "length": "Length"}


def _lengths_of(columns: list[Head]) -> list[Head]:
    """Columns of lengths: of a piece, of a line or of a tool joint, as the others tell."""
    fields = [one.field for one in columns]
    each = [one for one in columns if one.field == "length" and one.is_of_a_piece]
    made = []
    for one in columns:
        field = one.field
        of_pipe = field == "joint length" and not re.search("tool|tj", one.text.lower())
        if of_pipe and "joint od" not in fields:
            field = "joint spacing" if "length" in fields else "length"
        elif of_pipe and not {"length", "total length"} & set(fields):
            field = "length"
        elif field == "length" and each and one not in each and "total length" not in fields:
            field = "total length"
        made.append(one._replace(field=field))
    return made


def _head(text: str) -> Head:
    """A head: its words, and the unit in brackets, behind a comma or as its last word."""
    words, unit = _unit_of(text)
    plain = _plain(words)
    for field, about in FIELDS.items():
        if re.search(about.heads, plain):
            if field == "weight" and (not unit) and plain in ("ppf", "lb per ft"):
                unit = "lb/ft"
            used = field if field != "not used" and _fits(unit, about.kind) else ""
            return Head(text.strip(), {"length of a piece": "length"}.get(used, used), unit)
    return Head(text.strip(), "", unit)


def _unit_of(text: str) -> tuple[str, str]:
    """Words of a head, and the unit in brackets, behind a comma or as its last word."""
    words, unit = text.strip(), ""
    if per := re.fullmatch(r"(?i)(weight|wt\.?|lbs?|#|kg)\s*(?:/|per)\s*(ft|m)", words):
        return "weight", "lb/ft" if per[2].lower() == "ft" else "kg/m"
    bracket = re.search(r"[\[(]([^\])]*)[\])]\s*$", words)
    if bracket:
        words, unit = words[: bracket.start()], bracket[1].strip()
    else:
        last = re.search(r"(?<=[\w.\"])[\s,_/]+([^\s,_]+)$", words)
        alone = last and last[1] == "#" and not re.search(r"^w", words.lower())  # of a number
        if last and not alone and (_is_unit(last[1]) or _is_unit(last[1].lower())):
            words, unit = words[: last.start()], last[1]
    return words, unit


def _plain(words: str) -> str:
    """A head in small letters, in English, without signs."""
    plain = re.sub(r"[\s._\-]+", " ", words.lower().replace("/", " per ")).strip()
    return " ".join(_ENGLISH.get(word, word) for word in plain.split())


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
    if any(unit[0].isdigit() for _, unit in given):  # seen at once, without pint
        return columns, rows
    if not given or not all(_fits(unit, FIELDS[c.field].kind) for c, unit in given):
        return columns, rows
    return [c._replace(unit=units_of.get(c, c.unit)) for c in columns], rows[1:]
