"""What columns of a log mean: quantities by the names that people give them, units by spelling."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from drillctl import units
from drillctl.errors import InputError, nearest

FOOT_POUND = 1.3558179483314004  # (N m)
POUND = 4.4482216152605005  # (N)


class Quantity(NamedTuple):
    """A quantity that a log may hold."""

    name: str  # as in `[log]` and in results
    label: str  # for people
    si: str  # SI unit
    # what a name must match, its letters in lower case and its words parted by blanks
    pattern: str
    units: Mapping[str, float]  # SI value of a unit, spelt without blanks and signs


_TIME = {
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), 1.0),
    **dict.fromkeys(("ms", "msec"), 1e-3), **dict.fromkeys(("min", "mins", "minutes"), 60.0),
    **dict.fromkeys(("h", "hr", "hrs", "hour", "hours"), 3600.0),
    **dict.fromkeys(("d", "day", "days"), 86400.0),
}  # fmt: skip
_SPEED = {
    **dict.fromkeys(("rpm", "1min", "revmin", "cmin", "rmin", "revpermin"), units.RPM),
    **dict.fromkeys(("rads", "radsec", "radpers"), 1.0), "degs": units.RPM / 6.0,
    "revs": 60.0 * units.RPM, "cs": 60.0 * units.RPM,
}  # fmt: skip
_TORQUE = {
    "nm": 1.0, "mnm": 1e-3, "ncm": 0.01,
    **dict.fromkeys(("knm", "kilonewtonmeter"), 1e3), "dnm": 10.0, "kgfm": 9.80665,
    **dict.fromkeys(("ftlb", "ftlbs", "ftlbf", "lbft", "lbfft", "lbsft"), FOOT_POUND),
    **dict.fromkeys(
        ("kftlb", "kftlbs", "kftlbf", "klbfft", "klbft", "klbsft", "kipft", "kflb", "1000ftlbf"),
        1e3 * FOOT_POUND,
    ),
}  # fmt: skip
_FORCE = {
    "n": 1.0, "millinewton": 1e-3, "kn": 1e3, "dan": 10.0, "kdan": 1e4, "mn": 1e6, "lbf": POUND,
    "kgf": 9.80665,
    **dict.fromkeys(("klbf", "klb", "klbs", "kip", "kips", "1000lbf"), 1e3 * POUND),
    **dict.fromkeys(("tf", "tonne", "tonnes", "t"), 9806.65),
}  # fmt: skip

_DOWN = r"(bit|downhole|dh|dhl|mwd|collar|bha|sub)"
_TOP = r"(top ?drive|td|tds|rotary|surface|surf|string|table|drive|top|motor)"
_MEAN = r"( (avg|average|mean|actual|act|value))?"

QUANTITIES = {
    one.name: one
    for one in (
        Quantity("time", "time", "s",
                 rf"(elapsed )?(time|t|etim|date ?time|time ?stamp|hh ?mm ?ss){_MEAN}", _TIME),
        Quantity("bit_speed", "downhole speed", "rad/s",
                 rf"{_DOWN} (rot(ary|ation(al)?)? )?(speed|rpm|velocity){_MEAN}|(speed|rpm) {_DOWN}"
                 r"|dhrpm|drpm|w b", _SPEED),
        Quantity("top_speed", "top speed", "rad/s",
                 rf"({_TOP} )*(rot(ary|ation(al)?)? )?(speed|rpm|rpma|velocity){_MEAN}"
                 rf"|(speed|rpm) {_TOP}|tdrpm|srpm|rpms|rotrpm|w s|omega", _SPEED),
        Quantity("top_torque", "top torque", "N*m",
                 rf"({_TOP} )*(torque|trq|tq|tor|tqa|tqm|stor|tdtq|tdtor){_MEAN}"
                 rf"|torque {_TOP}|t m", _TORQUE),
        Quantity("weight_on_bit", "weight on bit", "N",
                 rf"(surface |downhole )?(wob|weight on bit|bit weight|swob|woba|wobx){_MEAN}",
                 _FORCE),
        Quantity("hook_load", "hook load", "N",
                 rf"(hook ?load|hkld|hkla|hkl|hklda|hl){_MEAN}", _FORCE),
    )
}  # fmt: skip
"""By name."""
NEEDED = ("time", "top_speed", "top_torque")


class Head(NamedTuple):
    """A column of a file."""

    name: str  # as it stands there
    unit: str = ""  # as the file names it, if it does


class Chosen(NamedTuple):
    """The column of a quantity."""

    quantity: str
    column: str
    unit: str  # as it was read; `date` for text that holds dates or times of day
    factor: float  # SI value of one unit
    number: int = 0  # of the column, from 0


def spelt(unit: str) -> str:
    """A unit without blanks, brackets and signs, in lower case; m is milli, M mega."""
    if unit.strip("()[]{} ") == "mN":
        return "millinewton"
    return re.sub(r"[^a-z0-9]", "", unit.lower().replace("³", "3"))


def words(name: str) -> str:
    """A name in lower case with its words parted by blanks, `topDrive_RPM` as `top drive rpm`."""
    parted = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", re.sub(r"[(\[{].*?[)\]}]", " ", name))
    return " ".join(re.findall(r"[a-z]+|\d+", parted.lower()))


def split(head: Head, known: Mapping[str, float]) -> tuple[str, str]:
    """The words of a name, and its unit: beside it, in brackets, or its last words."""
    name = words(head.name)
    if spelt(head.unit) in known:
        return name, head.unit
    inside = re.search(r"[(\[{](.*?)[)\]}]", head.name)
    if inside and spelt(inside[1]) in known:
        return name, inside[1]
    parts = name.split()
    for count in (3, 2, 1):
        ending = "".join(parts[-count:])
        if ending in known and len(parts) > count:
            tail = head.name.rstrip("_ ")
            at = next(k for k in range(len(tail), -1, -1) if spelt(tail[k:]) == ending)
            return " ".join(parts[:-count]), tail[at:]
    # `rpm` alone is a name and a unit.
    return name, parts[-1] if parts and parts[-1] in known and len(parts[-1]) > 2 else ""


def choose(
    heads: Iterable[Head],
    given: Mapping[str, tuple[str, str]],
    file: str,
    dated: frozenset[int] = frozenset(),
) -> dict[str, Chosen]:
    """The columns of each quantity.

    `given`: column and unit by quantity, either may be empty. `dated`: columns that hold text, by
    number. Refused (`InputError`): a needed one that is missing, two that fit, a unit that is
    missing or of something else.
    """
    columns = list(heads)
    found: dict[str, Chosen] = {}
    for name, one in QUANTITIES.items():
        column, unit = given.get(name, ("", ""))
        matches = (
            [k for k, head in enumerate(columns) if head.name.strip() == column]
            if column
            else _matching(one, columns)
        )
        where = f"log.{name}"
        if column and not matches:
            heard = [head.name.strip() for head in columns]
            raise InputError(f"{file} has no column {column!r}; {nearest(column, heard)}", where)
        if not matches:
            continue
        if len(matches) > 1:
            names = ", ".join(repr(columns[k].name) for k in matches)
            raise InputError(
                f"{file}: {names} all look like {one.label}; name one in [log.{name}] column", where
            )
        head = columns[matches[0]]
        text = name == "time" and matches[0] in dated and not unit
        read = "date" if text else unit or split(head, one.units)[1]
        factor = 1.0 if text else _factor(one, head, read, file)
        found[name] = Chosen(name, head.name, read, factor, matches[0])
    for name in NEEDED:
        if name not in found:
            names = ", ".join(head.name for head in columns)
            raise InputError(
                f"{file}: no column looks like {QUANTITIES[name].label}; it has {names}. Name it "
                f"in [log.{name}] column, or with --set log.{name}.column=NAME",
                f"log.{name}",
            )
    return found


def _matching(one: Quantity, columns: list[Head]) -> list[int]:
    """Columns that a quantity matches, those that match by the shortest pattern first."""
    results = []
    for number, head in enumerate(columns):
        name = split(head, one.units)[0]
        if re.fullmatch(one.pattern, name) or re.fullmatch(one.pattern, words(head.name)):
            results.append(number)
    return results


def _factor(one: Quantity, head: Head, unit: str, file: str) -> float:
    known = one.units.get(spelt(unit))
    if known is not None:
        return known
    named = unit or head.unit
    problem = (
        f"{file}: column {head.name!r} names no unit of {one.label}"
        if not named
        else f"{file}: {named!r} of column {head.name!r} is no unit of {one.label}"
    )
    usual = ", ".join(list(dict.fromkeys(one.units))[:12])
    raise InputError(
        f"{problem}; name it in [log.{one.name}] unit, or with --set log.{one.name}.unit=UNIT; "
        f"known are {usual}",
        f"log.{one.name}.unit",
    )
