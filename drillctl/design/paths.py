"""Values of a design by dotted path, with the unit they are held and written in."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, get_args, get_origin

from pydantic import BeforeValidator

from drillctl import units
from drillctl.design.tables import AxisTable, Table, settings_of_studies
from drillctl.errors import InputError, nearest, shown
from drillctl.rig.table import Range, Reader, number
from drillctl.rig.top_drive.law import drive_laws
from drillctl.units import Kind

if TYPE_CHECKING:
    from drillctl.design.design import Design

USUAL_NAMES = {
    "controller.kp": "Kp", "controller.ki": "Ki", "controller.absorption": "absorption",
    "controller.high_pass": "high-pass", "controller.stiffness": "stiffness",
    "controller.rate": "rate", "controller.spring": "spring", "controller.damper": "damper",
    "controller.torque": "torque", "operating_point.speed": "set speed",
    "operating_point.weight_on_bit": "weight on bit",
}  # fmt: skip
"""What the usual parameters are called in pictures and sentences; others keep their path."""
SI_OF = {
    "kp": "N*m*s/rad", "ki": "N*m/rad", "spring": "N*m/rad", "damper": "N*m*s/rad",
    "mobility": "rad/(N*m*s)", "sensed_inertia": "kg*m^2", "corner": "1/s", "high_pass": "s",
}  # fmt: skip
"""Units of the numbers that a drive has, whichever law that of a design is."""
_HIDDEN = (
    "title", "author", "source", "status", "notes", "schema_version", "map", "uncertain",
    "uncertainty",
    *settings_of_studies(),
)  # fmt: skip


@dataclass(frozen=True)
class Parameter:
    """A numeric value of a design.

    Attributes
    ----------
    path : str
        Dotted path.
    kind : Kind or None
        What it measures; None for factors and counts.
    value : float or None
        In SI; None where the design leaves it out.
    whole : bool
        Whether it is a count and takes whole numbers only.
    check : BeforeValidator or None
        What its table checks a value with.
    """

    path: str
    kind: Kind | None
    value: float | None
    whole: bool = False
    check: BeforeValidator | None = None

    @property
    def si_unit(self) -> str:
        """Unit of SI values, empty for factors and counts."""
        return self.kind.si if self.kind else ""

    def refusal(self, value: float) -> str | None:
        """Why its table allows no such value (SI), or None if it does.

        Rules that tie it to other keys are not checked.
        """
        if self.check is None:
            return None
        try:
            self.check.func(units.SI(value) if self.kind else value)  # type: ignore[call-arg]
        except InputError as error:
            return error.problem
        return None

    def parse(self, value: object) -> float:
        """Read a value as it would stand in the file, into SI.

        Raises
        ------
        InputError
            Not a finite number, or not of this kind.
        """
        if self.kind is not None:
            si = units.parse(value, self.kind)
            if not math.isfinite(si):
                raise InputError(f"{shown(value)} is not a finite {self.kind.name}")
            return si
        value = units.plain(value)
        if isinstance(value, str):
            try:
                value = float(value)
            except ValueError:
                raise InputError(f"{shown(value)} is not a number") from None
        return number(value)


def parameter(design: Design, path: str) -> Parameter:
    """Look a numeric parameter up.

    Raises
    ------
    InputError
        There is no such path, or what stands there is not a number.
    """
    known = {p.path: p for p in parameters(design)}
    if path not in known:
        raise InputError(f"no numeric parameter {path!r}; {_near_paths(path, known)}", path)
    return known[path]


def _near_paths(path: str, known: dict[str, Parameter]) -> str:
    """Suggest among the paths of the same table, if there is one, else among all."""
    table = path.rpartition(".")[0]
    same = [p for p in known if p.startswith(f"{table}.")] if table else []
    return nearest(path, same or known)


def parameters(design: Design) -> list[Parameter]:
    """Every numeric parameter that `--set` and sweep axes take, in file order."""
    return values_of(design.tables)


def values_of(table: Table) -> list[Parameter]:
    """The same of validated tables."""
    result: list[Parameter] = []
    _collect(table, "", result)
    return result


def _collect(table: Table, prefix: str, result: list[Parameter]) -> None:
    for key, number_of in _keys(type(table)).items():
        value = getattr(table, key)
        path = f"{prefix}{key}"
        if isinstance(value, Table):
            _collect(value, f"{path}.", result)
        elif path == "drillstring.sections":
            for section in value:
                _collect(section, f"{path}.{section.name}.", result)
        elif path == "bit_rock.points":
            for number, point in enumerate(value, start=1):
                _collect(point, f"{path}.{number}.", result)
        elif number_of is not None and not isinstance(value, tuple):
            whole, kind, check = number_of
            kind = kind or table.kind_by_key(key)
            result.append(Parameter(path, kind, value, whole, check))


@cache
def _keys(table: type[Table]) -> dict[str, tuple[bool, Kind | None, BeforeValidator | None] | None]:
    """Keys of a table, and of those that take numbers whether whole ones, their kind and check."""
    return {
        key: _number_of(info) if _is_number(info.annotation) else None
        for key, info in table.model_fields.items()
        if key not in _HIDDEN
    }


def _number_of(info: Any) -> tuple[bool, Kind | None, BeforeValidator | None]:
    whole = _is_number(info.annotation, int) and not _is_number(info.annotation, float)
    return whole, kind_of(info), _check_of(info)


def _is_number(annotation: Any, *types: type) -> bool:
    """Whether an annotation is, or holds, one of `types`; of int and float if none is given."""
    if annotation in (types or (int, float)):
        return True
    return any(_is_number(a, *types) for a in get_args(annotation) if a is not annotation)


def _check_of(info: Any) -> BeforeValidator | None:
    """The check in a field's annotation, wherever in it that stands."""
    return next(_notes(info, BeforeValidator), None)


def kind_of(info: Any) -> Kind | None:
    """The `Kind` kept in a field's annotation, if it has one."""
    return next(_notes(info, Kind), None)


def kind_in(annotation: Any) -> Kind | None:
    """The first `Kind` in a type."""
    return next((note for note in _notes_inside(annotation) if isinstance(note, Kind)), None)


def entries_of(annotation: Any, count: int) -> tuple[Any, ...]:
    """Type of each of so many entries of a list."""
    lists = [one for one in (annotation, *get_args(annotation)) if get_origin(one) is tuple]
    if not lists:
        return (None,) * count
    first, *rest = get_args(lists[0])
    return (first,) * count if rest == [Ellipsis] else (first, *rest)


def range_of(info: Any) -> Range | None:
    """The range that numbers of a field must lie in, if it takes numbers."""
    check = _check_of(info)
    return check.func.range if check and isinstance(check.func, Reader) else None


def _notes(info: Any, kind: type) -> Iterator[Any]:
    """What is noted of a kind in a field's annotation, wherever in it that stands."""
    inside = [*info.metadata, *_notes_inside(info.annotation)]
    return (note for note in inside if isinstance(note, kind))


def _notes_inside(annotation: Any) -> list[Any]:
    result: list[Any] = list(getattr(annotation, "__metadata__", ()))
    for argument in get_args(annotation):
        result += _notes_inside(argument)
    return result


# What a drive law is tuned by, for this rig.

MAP_POINTS = 41  # of each axis of a map that a design does not describe
AROUND_THE_SPEED = (0.5, 1.5)  # share of the set speed over which a map runs by default


def tuned_ranges(design: Design) -> dict[str, tuple[float, float]]:
    """Least and largest value (SI) by path of what the drive's law is tuned by on this rig."""
    table = design.tables.controller
    ranges = drive_laws()[table.law].ranges(table, design.string)
    return {
        f"controller.{key}": (_rounded(low, math.floor), _rounded(high, math.ceil))
        for key, (low, high) in ranges.items()
    }


def _rounded(value: float, to_whole: Callable[[float], int]) -> float:
    """To two digits, outwards: an axis ends where a person would end it."""
    if value == 0.0:
        return 0.0
    digit = 10.0 ** (math.floor(math.log10(abs(value))) - 1)
    # Rounded as a decimal first: 0.05 is not to become 0.049 or 0.051.
    return float(f"{to_whole(round(value / digit, 9)) * digit:.12g}")


def axis_tables(design: Design) -> tuple[AxisTable, ...]:
    """Axes of a map: those of the design, else two that fit its drive law and its rig."""
    if design.tables.map.axes:
        return design.tables.map.axes
    ranges = itertools.islice(tuned_ranges(design).items(), 2)
    ends = {path: tuple(_written(design, path, end) for end in pair) for path, pair in ranges}
    if len(ends) < 2:
        least, most = AROUND_THE_SPEED
        speed = design.speed / units.RPM
        ends["operating_point.speed"] = (
            f"{_rounded(least * speed, math.floor):g} rpm",
            f"{_rounded(most * speed, math.ceil):g} rpm",
        )
    return tuple(
        AxisTable(path=path, min=low, max=high, points=MAP_POINTS)
        for path, (low, high) in ends.items()
    )


def _written(design: Design, path: str, value: float) -> float | str:
    kind = parameter(design, path).kind
    return value if kind is None else units.write(value, kind)
