"""Tallies: the list of components that a rig keeps of its string, read into sections.

One line a component, columns in any order under the names in use, units in the heads, in a second
row or in each cell. Nothing is guessed that changes a number: which end a tally begins at is told,
and what was read how is reported.
"""

from __future__ import annotations

import csv
import itertools
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import ValidationError

from drillctl import units
from drillctl.design.tables import RANGE_2, SectionTable
from drillctl.design.tally_heads import (
    FIELDS,
    NOTHING,
    Head,
    columns_of,
    heads_of,
    likeliest,
    parted,
    problem_of,
    rows_of,
    text_of,
    with_units_row,
)
from drillctl.errors import InputError, shown
from drillctl.rig.drillstring import GRADES, PIPES
from drillctl.rig.drillstring.catalogue import (
    STEEL,
    drill_pipe,
    find,
    kind_in,
    sizes_in,
    typical_bore,
)

ENDS = ("top", "bit")
LONGEST_PIECE = 50.0  # length (m) that no piece has: a stand of four joints has some 40
SHORTEST_STAND = 15.0  # length (m) of a stand: two short joints
SAME_BORE = 1e-3  # by how much (m) a bore may differ from that of the catalogue's pipe


_SUM = re.compile(r"\b(sub-?)?(total|sum|summe|somme|suma|totaal|totalt)s?\b")
_INCHES = re.compile(r"""(\d[\d /.-]*)(?:"|\u2033|\u201d|''|in\b|inch)""")
_WHOLE = re.compile(r"\b(length|footage|bha|assembly|string|drillstring)\b")
_WIDE = re.compile(r"stab|reamer|opener|hole|casing|liner|centrali")
_REMARK = re.compile(
    r":|\b(bha|assembly|string|drillstring|remarks?|notes?|date|page|end of|\w+ed by)\b"
)
_PIPE = re.compile(
    r"\bd\.?p\b|pipe|\bhw|hwdp|heavy|hevi|gestänge|borerør|tungvekt|tuber|boorbuis|"
    r"(?<!masse)(?<!masse[ -])tige"
)
_TYPES = {"hybrid": "hybrid|kymera", "roller-cone": r"conic|cone|\btci\b|mill|rolle", "pdc": "pdc"}
_BIT = re.compile(
    r"\bbits?$|^bits?\b(?!.*\bsub\b)|\bbit\b *\(|\bpdc\b|tri-?con|"
    r"mei(ß|ss)el|krone$|^outil\b|tr[ée]pan|beitel|^barrena|^broca"
)


@dataclass(frozen=True)
class Tally:
    """A tally as it was read."""

    place: str  # file, and sheet of a workbook
    text: str  # its lines
    begins: str  # end that its first line is at
    sections: tuple[dict[str, Any], ...]  # from top to bottom, as in a design file
    columns: tuple[tuple[str, str, str], ...]  # head, what it was read as, unit
    notes: tuple[str, ...]  # what was concluded, line by line
    in_feet: bool  # whether most of its lengths are

    @property
    def bit(self) -> tuple[float | None, str | None]:
        """Diameter (m) and type of the bit, as far as its lines say."""
        bits = [one for one in self.sections if _is_bit(one["name"])]
        if not bits:
            return None, None
        size, name = bits[-1].get("outer_diameter"), bits[-1]["name"].lower()
        across = 0.0 if size is None else units.parse(size, units.DIAMETER)
        called = _INCHES.search(name)  # its diameter may be that of its shank
        named = [one * 0.0254 for one in sizes_in(called[1]) if 2.0 < one < 40.0] if called else []
        types = (kind for kind, words in _TYPES.items() if re.search(words, name))
        return max([across, *named[:1]]) or None, next(types, None)


class _Cell(NamedTuple):
    text: str
    where: str  # file, line and column


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
            "--from" if where.startswith("--") else f"{where}_from",
        )
    if "\n" in source.strip():
        place, text = where, source.lstrip("\n")
    else:
        path = folder / Path(source).expanduser()
        place, text = text_of(path, where)
    try:
        rows = [(n, row) for n, row in enumerate(rows_of(text), 1) if any(row)]
    except csv.Error as error:
        raise InputError(str(error), place) from None
    return _read(place, text, rows, str(begins))


def _read(place: str, text: str, rows: list[tuple[int, list[str]]], begins: str) -> Tally:
    if len(rows) < 2:
        raise InputError("holds no lines below its heads", place)
    last, heads = heads_of(rows) or likeliest(rows)
    heads, rest = parted(heads, rows[last + 1 :])
    columns = columns_of(heads, [row for _, row in rest], f"{place}: line {rows[last][0]}")
    if not rest:
        raise InputError("holds no lines below its heads", place)
    columns, rest = with_units_row(columns, rest)
    lines = [_Line(place, number, columns, row) for number, row in rest]
    notes: list[str] = []
    if "name" not in {column.field for column in columns}:
        notes.append("no column is the name of a component, which says what it is: call one 'Name'")
    if "total length" not in {column.field for column in columns} and any(
        line.longer_than_a_piece for line in lines
    ):
        notes.append("the length of a line counts as that of all its pieces: no piece is so long")
        for line in lines:
            line.of_all_pieces()
    if _adds_up(lines):
        notes.append("the total length adds up from line to line: not used")
    sections: list[dict[str, Any]] = []
    said: tuple[str, list[str]] = ("", [])
    for line in lines:
        if line.adds_up or line.is_sum_of(sections):
            notes.append(
                f"line {line.number}: {line.name or 'a line without name'!r} left out, a sum"
            )
        elif line.is_remark:
            notes.append(f"line {line.number}: {line.name!r} left out, a title or remark")
        elif line.cells:
            sections.append(line.section())
            if line.notes and (line.name, line.notes) != said:  # once for a list of joints
                notes += [f"line {line.number}, {line.name}: {note}" for note in line.notes]
            said = (line.name, line.notes)
    if not sections:
        raise InputError("holds no lines below its heads", place)
    _refuse_upside_down(sections, begins == "bit", place)
    sections = list(_joined(sections[::-1] if begins == "bit" else sections, notes))
    return Tally(
        place,
        text,
        begins,
        tuple(_numbered(sections, notes)),
        tuple((c.text, c.field or "not used", c.unit) for c in columns if c.text),
        tuple(notes),
        2 * sum(line.in_feet for line in lines) > len(sections),
    )


class _Line:
    """A line of a tally on its way to a section."""

    def __init__(self, place: str, number: int, columns: list[Head], row: list[str]) -> None:
        self.number, self.where = number, f"{place}: line {number}"
        self.columns = {column.field: column for column in columns}
        self.cells = {
            column.field: _Cell(text.strip(), f"{self.where}, column {column.text!r}")
            for column, text in zip(columns, row, strict=False)
            if column.field and text.strip().lower() not in NOTHING
        }
        self.notes: list[str] = []

    @property
    def name(self) -> str:
        """As written."""
        return self.cells["name"].text if "name" in self.cells else ""

    @property
    def adds_up(self) -> bool:
        """Whether it is called the sum of others."""
        return "od" not in self.cells and bool(_SUM.search(self.name.lower()))

    @property
    def is_remark(self) -> bool:
        """Whether it is words between or below the components."""
        return list(self.cells) == ["name"] and bool(_REMARK.search(self.name.lower()))

    def is_sum_of(self, sections: list[dict[str, Any]]) -> bool:
        """Whether it has no diameter, and the length of those before, of all or of the last."""
        own = {"length", "total length"} & set(self.cells)
        if "od" in self.cells or not own or (self.name and not _WHOLE.search(self.name.lower())):
            return False
        length, whole = self.value(own.pop()), 0.0
        for section in reversed(sections):
            whole += _span(section)
            if abs(length / whole - 1.0) < 0.01 and (self.name or section is sections[0]):
                return True
        return False

    @property
    def longer_than_a_piece(self) -> bool:
        """Whether its length must be that of all its pieces."""
        if "length" not in self.cells or self.adds_up or self.count() == 1:
            return False
        return self.value("length") > LONGEST_PIECE

    def of_all_pieces(self) -> None:
        """Let its length be that of all its pieces."""
        self.columns["total length"] = self.columns["length"]
        if "length" in self.cells:
            self.cells["total length"] = self.cells.pop("length")

    @property
    def in_feet(self) -> bool:
        """Whether its length is in feet."""
        own = ({"length", "total length"} & set(self.cells)) and not self.adds_up
        field = "length" if "length" in self.cells else "total length"
        return bool(own) and bool(
            re.search(r"f(ee|oo)?t|['\u2032\u2019]", self._quantity(field).lower())
        )

    def section(self) -> dict[str, Any]:
        """Keys of a section as in a design file."""
        section: dict[str, Any] = {"name": self.name or f"component of line {self.number}"}
        section |= self._lengths()
        section |= self._grade()
        section |= self._diameters(section.get("grade"))
        section |= self._joints(section)
        if "pipe" in section:
            section = {k: v for k, v in section.items() if not k.endswith("er_diameter")}
        if kind_in(self.name) == "motor":
            self.notes.append("the speed that a mud motor adds to the bit is not in the model")
        if "inertia" in self.cells:
            section["inertia"] = self._quantity("inertia")
        self._check(section)
        return section

    def _quantity(self, field: str) -> str:
        """Text with a unit, its own or that of its column."""
        cell, kind = self.cells[field], FIELDS[field].kind
        assert kind is not None
        unit = self.columns[field].unit
        try:
            text = units.pointed(cell.text)
        except InputError as error:
            raise InputError(error.problem, cell.where) from None
        if units.bare(text) and unit:
            text = f"{text} {unit}"
        problem = problem_of(text, kind)
        if problem:
            hint = "" if unit or not units.bare(text) else "; the column gives no unit either"
            raise InputError(problem + hint, cell.where)
        return text

    def value(self, field: str) -> float:
        """A quantity of the line (SI)."""
        kind = FIELDS[field].kind
        assert kind is not None
        return units.parse(self._quantity(field), kind)

    def _lengths(self) -> dict[str, Any]:
        count = self.count()
        keys: dict[str, Any] = {"repeat": count} if count > 1 else {}
        total = self.value("total length") if "total length" in self.cells else None
        if "length" in self.cells:
            if total is not None and abs(self.value("length") * count / total - 1.0) > 0.01:
                raise InputError(
                    f"{count} x {self._quantity('length')} is not the total length "
                    f"{self._quantity('total length')}",
                    self.cells["total length"].where,
                )
            return {**keys, "length": self._quantity("length")}
        if total is None:
            raise InputError("the component has no length", self._at("length", "total length"))
        if count == 1:
            return {"length": self._quantity("total length")}
        return {**keys, "length": f"{total / count!r} m"}

    def count(self) -> int:
        """Number of its pieces."""
        cell = self.cells.get("count") or self.cells.get("stands")
        if cell is None:
            return 1
        found = re.fullmatch(
            r"(\d+)(?:\.0*)?\s*(?:x|jts?\.?|joints?|pcs?\.?|pieces?|(stands?))?", cell.text, re.I
        )
        count = int(found[1]) if found is not None and len(found[1]) < 9 else 0
        if found is None or count == 0:
            raise InputError(f"{cell.text!r} is not a number of pieces", cell.where)
        stands = bool(found[2]) or "count" not in self.cells
        short = "length" in self.cells and self.value("length") < SHORTEST_STAND
        if stands and short and count > 1:
            raise InputError(
                f"{self._quantity('length')} is the length of a joint, not of a stand: give that "
                "of a stand, or the number of joints",
                self.cells["length"].where,
            )
        return count

    def _diameters(self, grade: str | None) -> dict[str, Any]:
        if "od" not in self.cells:
            return self._by_name(grade)
        outer = self._quantity("od")
        wide = _is_bit(self.name) or _WIDE.search(self.name.lower())
        if not 0.02 <= self.value("od") <= (1.0 if wide else 0.36):
            raise InputError(
                f"{outer} is no outer diameter of a component: is it of another column, "
                "or in another unit?",
                self.cells["od"].where,
            )
        if "id" in self.cells:
            if self.value("id") >= self.value("od"):
                raise InputError(
                    f"inner diameter {self._quantity('id')} is not less than the outer, {outer}",
                    self.cells["id"].where,
                )
            self._compare_weight()
            return {"outer_diameter": outer, "inner_diameter": self._quantity("id")}
        bore, how = self._bore()
        self.notes.append(f"no inner diameter: {how}")
        return {"outer_diameter": outer, "inner_diameter": f"{bore * 1e3:.6g} mm"}

    def _by_name(self, grade: str | None) -> dict[str, Any]:
        """What the catalogue has under the name of the line; the size of a bit."""
        known, sizes = find(self.name), sizes_in(self.name)
        if known is not None:
            thick = bool(PIPES[known].thick(grade))
            joints = " with its tool joints" if thick else ""
            self.notes.append(f"no diameters: {known} of the catalogue{joints}")
            return {"pipe": known, **({"tool_joints": True} if thick else {})}
        if _is_bit(self.name) and sizes:
            self.notes.append("no diameters: the size in its name, taken as solid")
            return {"outer_diameter": f"{sizes[0]:g} in", "inner_diameter": "0 mm"}
        raise InputError("the component has no outer diameter", self._at("od"))

    def _compare_weight(self) -> None:
        """Say where a weight is not that of the diameters, which count."""
        if "weight" in self.cells:
            body = 0.25 * math.pi * STEEL * (self.value("od") ** 2 - self.value("id") ** 2)
            share = self.value("weight") / body
            if not 0.6 < share < 1.8:
                self.notes.append(
                    f"{self._quantity('weight')} is {share:.2g} times what steel of its diameters "
                    "weighs; the diameters count"
                )

    def _bore(self) -> tuple[float, str]:
        """An inner diameter (m) that no cell gives, and where it is from."""
        outer = self.value("od")
        if "weight" in self.cells:
            weight, heavy = self.value("weight"), kind_in(self.name) == "HWDP"
            known = drill_pipe(outer, weight, heavy)
            if known is not None:
                return PIPES[known].inner_diameter, f"that of {known}"
            square = outer**2 - 4.0 * weight / (math.pi * STEEL)
            if square < 0.0:
                raise InputError(
                    f"{self._quantity('weight')} is more than a solid bar of steel weighs",
                    self.cells["weight"].where,
                )
            return math.sqrt(square), f"{math.sqrt(square) * 1e3:.1f} mm by its weight"
        if _is_bit(self.name):
            return 0.0, "taken as solid"
        typical = typical_bore(self.name, outer)
        if typical is None:
            raise InputError(
                'the component has no inner diameter ("0 mm" if it is solid)', self._at("id")
            )
        return typical, f"{typical * 1e3:.1f} mm, typical of its kind and size"

    def _joints(self, section: dict[str, Any]) -> dict[str, Any]:
        fields = ("joint od", "joint id", "joint length")
        given = [field for field in fields if field in self.cells]
        if "pipe" in section or "joint od" not in given:
            return self._joints_of_catalogue(section)
        keys = {FIELDS[field].key: self._quantity(field) for field in given}
        if "joint length" not in given:
            known = self._like()
            if known is None:
                return {}  # a tool with the size of its connection
            length = next(iter(PIPES[known].joints.values())).length
            keys["joint_length"] = f"{length!r} m"
            self.notes.append(f"tool joint as long as that of {known}, {length / 0.0254:g} in")
        if "joint id" not in given:
            keys["joint_inner_diameter"] = section["inner_diameter"]
            self.notes.append("tool joint with the bore of the body")
        if "joint spacing" not in self.cells and "repeat" not in section:
            self.notes.append("a tool joint every 31 ft (a typical joint of pipe), or one in all")
        return keys | self._spacing(section, RANGE_2)

    def _spacing(self, section: dict[str, Any], usual: float) -> dict[str, Any]:
        """How far tool joints are apart where the pieces are not joints of pipe: in stands."""
        if "joint spacing" in self.cells:
            return {"joint_spacing": self._quantity("joint spacing")}
        length = units.parse(section["length"], units.LENGTH)
        if length < SHORTEST_STAND or "repeat" not in section:
            return {}
        return {"joint_spacing": f"{length / round(length / usual):.6g} m"}

    def _like(self) -> str | None:
        """The pipe of the catalogue that is next in size."""
        if not _PIPE.search(self.name.lower()):
            return None
        kind, outer = kind_in(self.name), self.value("od")
        known = [name for name, pipe in PIPES.items() if pipe.kind == kind]
        return min(known, key=lambda name: abs(PIPES[name].outer_diameter - outer), default=None)

    def _joints_of_catalogue(self, section: dict[str, Any]) -> dict[str, Any]:
        """Tool joints of a pipe that gives none: of its size, weight or bore, and grade."""
        if "pipe" in section or not _PIPE.search(self.name.lower()):
            return {}
        outer, bore = self.value("od"), units.parse(section["inner_diameter"], units.DIAMETER)
        weight = self.value("weight") if "weight" in self.cells else None
        known = drill_pipe(outer, weight, kind_in(self.name) == "HWDP", bore)
        if known is None or abs(PIPES[known].inner_diameter - bore) > SAME_BORE:
            self.notes.append(
                "no tool joints: no pipe of the catalogue has its size and bore; give TJ OD, TJ ID"
            )
            return {}
        grade, pipe = section.get("grade", ""), PIPES[known]
        lowest = (
            "" if kind_in(known) == "HWDP" else f" of the lowest grade, {next(iter(pipe.joints))},"
        )
        said = f" of {grade}" if grade in pipe.joints else lowest
        self.notes.append(f"tool joints: those of {known}{said} in the catalogue")
        return {"pipe": known, "tool_joints": True, **self._spacing(section, pipe.joint_spacing)}

    def _grade(self) -> dict[str, Any]:
        named = re.search(r"\b(E-?75|X-?95|G-?105|S-?135)\b", self.name.upper())
        if "grade" not in self.cells and named is None:
            return {}
        text = self.cells["grade"].text if "grade" in self.cells else named[1] if named else ""
        plain = re.sub(r"[^A-Z0-9]", "", text.upper())
        for grade in GRADES:
            letter, number = grade.split("-")
            if plain in (letter + number, letter, number):
                return {"grade": grade}
        self.notes.append(f"grade {text!r} is none of {', '.join(GRADES)}: no torsional yield")
        return {}

    def _check(self, section: dict[str, Any]) -> None:
        """Let the table of a section say what is wrong, at the column it is in."""
        try:
            SectionTable.model_validate(section)
        except ValidationError as error:
            problem = error.errors()[0]
            text = str(problem.get("ctx", {}).get("error", problem["msg"]))
            key = str(problem["loc"][-1]) if problem["loc"] else text.partition(" ")[0]
            fields = [field for field, about in FIELDS.items() if about.key == key]
            raise InputError(text, self._at(*fields, "total length")) from None

    def _at(self, *fields: str) -> str:
        """The line, and its column of one of some fields if there is one."""
        heads = [self.columns[one].text for one in fields if one in self.columns]
        return f"{self.where}, column {heads[0]!r}" if heads else self.where


def _adds_up(lines: list[_Line]) -> bool:
    """Whether total lengths are those from one end to each line; then they are left out."""
    both = [one for one in lines if {"length", "total length"} <= set(one.cells)]
    for way in (both, both[::-1]):
        so_far, adds = 0.0, len(both) > 2
        for one in way:
            so_far += one.value("length") * one.count()
            adds = adds and abs(one.value("total length") / so_far - 1.0) < 0.01
        if adds:
            for one in both:
                del one.cells["total length"]
            return True
    return False


def _joined(sections: Iterable[dict[str, Any]], notes: list[str]) -> Iterable[dict[str, Any]]:
    """A list of joints, a line each, as a section of so many pieces of their mean length."""
    alike = itertools.groupby(sections, lambda one: {k: v for k, v in one.items() if k != "length"})
    for keys, group in alike:
        pieces = list(group)
        if len(pieces) < 3 or "repeat" in keys or "inertia" in keys:
            yield from pieces
            continue
        mean = sum(map(_span, pieces)) / len(pieces)
        notes.append(f"{keys['name']!r}: {len(pieces)} lines are pieces of {mean:.4g} m on average")
        yield {**pieces[0], "repeat": len(pieces), "length": f"{mean:.10g} m"}


def _span(section: Mapping[str, Any]) -> float:
    """Length of a section (m)."""
    return units.parse(section["length"], units.LENGTH) * int(section.get("repeat", 1))


def _is_bit(name: str) -> bool:
    return bool(_BIT.search(name.lower()))


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
