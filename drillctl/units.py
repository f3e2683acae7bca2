"""Quantities at the edge: text with a unit in, SI numbers out, and back.

Inside the package every number is SI (m, kg, s, N, rad). Text such as `"140 kN"` or
`"4 1/2 in"` is read here and nowhere else, and written here again, so that what is written
reads back to the same bits.
"""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal
from unicodedata import normalize

from drillctl.errors import InputError, shown
from drillctl.text import clean

RPM = math.pi / 30.0  # one revolution a minute (rad/s)


class SI(float):
    """A number that is already in SI units and needs no reading."""


@dataclass(frozen=True)
class Kind:
    """What a quantity measures.

    Attributes
    ----------
    name : str
        The word used in messages.
    si : str
        SI unit in which values are held.
    examples : tuple of str
        Units in which a value is written for people, the preferred one first.
    usual : tuple of float
        Least and largest value (SI) of a rig; what lies outside is probably a slip of the pen.
    """

    name: str
    si: str
    examples: tuple[str, ...]
    usual: tuple[float, float] = (0.0, math.inf)

    @property
    def one(self) -> str:
        """The word with its article."""
        return f"{'an' if self.name[0] in 'aeiou' else 'a'} {self.name}"


SPEED = Kind("speed", "rad/s", ("rpm", "rev/min", "rad/s", "deg/s"), (0.0, 400 * RPM))
FORCE = Kind("force", "N", ("kN", "N", "klbf", "tf"), (0.0, 1e6))
TORQUE = Kind("torque", "N*m", ("kN*m", "N*m", "klbf*ft"), (0.0, 150e3))
LENGTH = Kind("length", "m", ("m", "ft"), (0.05, 15e3))
DIAMETER = Kind("length", "m", ("mm", "in", "m"), (0.012, 1.0))
SHORT_LENGTH = Kind("length", "m", ("mm", "in", "m"), (1e-4, 0.1))
TIME = Kind("time", "s", ("s", "ms", "min"))
RATE = Kind("rate", "1/s", ("1/s",))
INERTIA = Kind("inertia", "kg*m^2", ("kg*m^2",))
DENSITY = Kind("density", "kg/m^3", ("kg/m^3",), (700.0, 20e3))
MUD = Kind("density", "kg/m^3", ("kg/m^3", "g/cm^3", "lb/gal"), (700.0, 2600.0))
MASS = Kind("mass", "kg", ("kg",), (1.0, 1e6))
AXIAL_DAMPING = Kind("axial damping", "N*s/m", ("N*s/m", "kN*s/m"))
LINEAR_MASS = Kind("mass per length", "kg/m", ("kg/m", "lb/ft"))
VISCOSITY = Kind("viscosity", "Pa*s", ("cP", "Pa*s"), (1e-4, 1.0))
MODULUS = Kind("modulus", "Pa", ("GPa", "Pa", "psi"))
POLAR_MOMENT = Kind("polar moment of area", "m^4", ("m^4", "in^4"))
STIFFNESS = Kind("torsional stiffness", "N*m/rad", ("N*m/rad",))
DAMPING = Kind("torsional damping", "N*m*s/rad", ("N*m*s/rad",))
DRAG = Kind("drag per length", "N*s/rad", ("N*s/rad",))
SLOWNESS = Kind("time per angle", "s/rad", ("s/rad",))
PROPORTIONAL_GAIN = Kind("gain", "N*m*s/rad", ("N*m*s/rad",))
WEIGHT_GAIN = Kind("weight per speed", "N*s/rad", ("kN*s/rad", "N*s/rad"))
POWER = Kind("power", "W", ("kW", "MW", "W", "hp"))
TORQUE_RATE = Kind("torque rate", "N*m/s", ("kN*m/s", "N*m/s"))
FORCE_RATE = Kind("force rate", "N/s", ("kN/s", "N/s"))
INTEGRAL_GAIN = Kind("gain", "N*m/rad", ("N*m/rad",))
ANGLE = Kind("angle", "rad", ("deg", "rad"))
VELOCITY = Kind("axial speed", "m/s", ("m/h", "m/min", "m/s", "ft/h"), (0.0, 5.0))

# What the common units are in SI, as pint has it to the bit: pint takes half a second to start, and
# reads the others alone.
_KNOWN: dict[str, dict[str, float]] = {
    "rad/s": {
        "rpm": 0.10471975511965977, "rev/min": 0.10471975511965977, "rad/s": 1.0,
        "deg/s": 0.017453292519943295,
    },
    "N": {
        "N": 1.0, "kN": 1e3, "MN": 1e6, "lbf": 4.4482216152605005, "klbf": 4448.221615260501,
        "tf": 9806.65,
    },
    "N*m": {
        "N*m": 1.0, "kN*m": 1e3, "lbf*ft": 1.3558179483314006, "klbf*ft": 1355.8179483314004,
    },
    "m": {
        "m": 1.0, "mm": 0.001, "cm": 0.01, "km": 1e3, "in": 0.0254, "ft": 0.30479999999999996,
    },
    "s": {"s": 1.0, "ms": 0.001, "min": 60.0, "h": 3600.0},
    "1/s": {"1/s": 1.0},
    "kg*m^2": {"kg*m^2": 1.0, "lb*ft^2": 0.0421401100938048},
    "kg/m^3": {"kg/m^3": 1.0, "g/cm^3": 1e3, "lb/gal": 119.82642731689667},
    "kg": {"kg": 1.0},
    "N*s/m": {"N*s/m": 1.0, "kN*s/m": 1e3},
    "kg/m": {"kg/m": 1.0, "lb/ft": 1.488163943569554},
    "Pa*s": {"Pa*s": 1.0, "mPa*s": 1e-3, "cP": 1e-3},
    "Pa": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "psi": 6894.7572931683635},
    "m^4": {"m^4": 1.0, "in^4": 4.1623142559999997e-07},
    "N*m/rad": {"N*m/rad": 1.0, "klbf*ft/rev": 215.78512840965433},
    "N*m*s/rad": {"N*m*s/rad": 1.0, "klbf*ft/rpm": 12947.107704579259},
    "N*s/rad": {"N*s/rad": 1.0, "kN*s/rad": 1e3, "klbf/rpm": 42477.38748221543},
    "s/rad": {"s/rad": 1.0, "1/rpm": 9.549296585513721},
    "W": {"W": 1.0, "kW": 1e3, "MW": 1e6, "hp": 745.6998715822701},
    "N*m/s": {"N*m/s": 1.0, "kN*m/s": 1e3, "klbf*ft/s": 1355.8179483314004},
    "N/s": {"N/s": 1.0, "kN/s": 1e3, "klbf/s": 4448.221615260501},
    "rad": {"rad": 1.0, "deg": 0.017453292519943295, "rev": 6.283185307179586},
    "m/s": {"m/s": 1.0, "m/min": 1.0 / 60.0, "m/h": 1.0 / 3600.0, "ft/h": 0.3048 / 3600.0},
    # shown alone
    "N/m": {"lbf/ft": 14.593902937206364},
    "J": {"kJ": 1e3, "klbf*ft": 1355.8179483314004},
    "rad/(N*m*s)": {"rpm/(kN*m)": 0.00010471975511965977, "rpm/(klbf*ft)": 7.723732765784518e-05},
    "rad/s/(N*m)": {"rpm/(klbf*ft)": 7.723732765784518e-05},
    "rad/(N*m)": {"rev/(klbf*ft)": 0.004634239659470709},
    "N*m/(rad/s)": {"klbf*ft/rpm": 12947.107704579259},
}  # fmt: skip

# How drillers spell them, by what each is in SI; a thousand pounds are never a mass here.
_POUNDS, _KIPS = ("lbf", "lb", "lbs"), ("klbf", "klb", "klbs", "kip", "kips", "k lbf", "k lbs")
_SIGNS = re.compile(r"(?<=[^\W\d_])[-.\u00b7\u22c5\u2022\u00d7\s]+(?=[^\W\d_])")  # for a `*`
_SPELLED: dict[str, dict[str, str]] = {
    "rad/s": {
        **dict.fromkeys(("r/min", "revs/min", "r.p.m.", "U/min", "tr/min", "o/min"), "rev/min"),
        "rad/sec": "rad/s",
    },
    "N": {
        **dict.fromkeys(_KIPS, "klbf"),
        **dict.fromkeys(
            ("t", "te", "mt", "tonf", "tonnef", "tonne", "tonnes", "metric tons", "metric tonnes"),
            "tf",
        ),
    },
    "N*m": {  # with `*` for the other signs between force and arm
        **{one: "lbf*ft" for lb in _POUNDS for one in (f"{lb}*ft", f"ft*{lb}", f"ft{lb}")},
        **{f"{lb}*ft": "klbf*ft" for lb in _KIPS},
        **{f"{ft}*{lb}": "klbf*ft" for ft in ("kft", "k*ft") for lb in _POUNDS},
        "Nm": "N*m", "kNm": "kN*m", "daNm": "daN*m",
    },
    "m": {
        **dict.fromkeys(('"', "\u2033", "\u201d", "''", "inch", "inches", "in."), "in"),
        **dict.fromkeys(("'", "\u2032", "\u2019", "feet", "ft."), "ft"),
    },
    "kg/m^3": {
        "ppg": "lb/gal", "lbm/gal": "lb/gal", "sg": "g/cm^3", "s.g.": "g/cm^3", "pcf": "lb/ft^3",
    },
    "kg*m^2": {
        **dict.fromkeys(("lbm*ft^2", "lb-ft^2", "lb*ft2", "lb-ft2"), "lb*ft^2"),
        **dict.fromkeys(("kgm2", "kgm^2", "kg-m2", "kg-m^2"), "kg*m^2"),
    },
    "kg/m": dict.fromkeys(("#", "#/ft", "ppf", "lbs/ft", "lbm/ft", "lbf/ft"), "lb/ft"),
    "Pa*s": {"cps": "cP", "mPa.s": "mPa*s", "mPas": "mPa*s"},
    "m/s": {"fph": "ft/h"},
}  # fmt: skip

_AMBIGUOUS = {
    **dict.fromkeys(
        ("lb", "lbs"), 'pound-force ("lbf") or a mass of 0.4536 kg; thousands are "klbf"'
    ),
    **dict.fromkeys(
        ("ton", "tons"), 'metric ton-force ("tf", 9.807 kN) or short ton-force, 2 klbf (8.896 kN)'
    ),
    **dict.fromkeys(
        ("mlb", "mlbs", "mlbf"), 'thousands of pounds-force, "klbf", or millions, "1000 klbf"'
    ),
    "mph": 'metres per hour ("m/h") or miles per hour ("mi/h")',
}
"""Units of two meanings."""

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_TEXT = re.compile(
    r"^\s*(?:(?:(?P<whole>[-+]?\d+)[\s-]+)?(?P<over>\d+)\s*/\s*(?P<under>\d+)"
    rf"|(?P<number>{_NUMBER}))\s*(?P<unit>.*?)\s*$"
)
_RAISED = str.maketrans({"\u00b2": "^2", "\u00b3": "^3", "\u2074": "^4"})
_VULGAR = re.compile("[\u00bc-\u00be\u2150-\u215e]")  # fractions in one character
_FEET_AND_INCHES = re.compile(
    r"""^\s*(\d+)\s*(?:ft|'|\u2032|\u2019)[\s-]*(\d[\d\s./-]*?)\s*(?:in|"|\u2033|\u201d|'')\s*$"""
)
_SPACED = re.compile(r"^\s*[-+]?\d{1,3}(?:[ \u00a0\u202f'\u2019]\d{3})+(?![\d/])")
_POINTS = re.compile(r"^\s*[-+]?\d{1,3}(?:\.\d{3})+,\d+")
_COMMAS = re.compile(r"^\s*[-+]?\d{1,3}((?:,\d{3})+)(\.\d+)?(?![\d,])")
_SUPERSCRIPTS = re.compile("[\u207b\u00b9\u00b2\u00b3\u2070\u2074-\u2079]+")
_EXPONENT = re.compile(r"(?:\^|\*\*)\s*[-+]?\d(?![\d.])")
_NUMBER_BUT_ONE = re.compile(r"(?!1\b)\b\d")
_POWER = re.compile(r"\b((?:[kcmd]?m)|in|ft|s)([234])\b")


@functools.cache
def registry() -> Any:
    """The pint registry, made on first use since importing pint is slow."""
    import pint

    try:
        units = pint.UnitRegistry(cache_folder=":auto:")
    except Exception:  # whatever an unwritable folder, or a damaged entry in it, may raise
        units = pint.UnitRegistry()
    units.define("rev = revolution")
    units.define("klbf = 1000 * force_pound")
    units.define("kdaN = 10 * kilonewton")
    units.define("tf = 1000 * kilogram * standard_gravity")
    return units


@functools.lru_cache(maxsize=512)
def factor(unit: str, kind: Kind) -> float:
    """SI value of one `unit`, refused (`InputError`) if it does not measure `kind`."""
    if unit.lower() in _AMBIGUOUS and not (kind.si == "kg" and unit.lower() in _POUNDS):
        raise InputError(f"{unit!r} has two meanings: {_AMBIGUOUS[unit.lower()]}")
    known, spelled = _KNOWN[kind.si], _SPELLED.get(kind.si, {})
    ways = (unit, _joined(unit, kind))
    names = [spelled.get(one, one) for one in ways]
    found = next((one for one in names if one in known), None)
    if found is not None:
        return known[found]
    low = {one.lower() for one in ways}
    alike = [one for one in (*known, *spelled) if one not in ways and one.lower() in low]
    if alike and (kind is SPEED or unit == unit.upper()):  # in capitals
        return factor(alike[0], kind)
    if kind is SPEED:
        raise InputError(f"a speed is given in {_join(SPEED.examples)}, not in {unit!r}")
    try:
        return _by_pint(unit, names[1], kind)
    except InputError:
        if alike:
            return factor(alike[0], kind)
        raise


def _joined(unit: str, kind: Kind) -> str:
    """A unit of several, with `*` between them however it is written: `ft-lbs/rpm`, `Nms`."""
    unit = re.sub(r"\s+per\s+", "/", unit.translate(_RAISED))
    unit = re.sub(r"\b[kK]\*(?=(?i:lb|ft))", "k", _SIGNS.sub("*", unit))
    if kind.si == "kg*m^2":
        return re.sub(r"^kg\*?m", "kg*m", unit)
    if "N" not in kind.si:
        return re.sub(r"\b(lbs|lbm)\b", "lb", unit)
    unit = re.sub(r"\b(k|M|da|kda)?Nm(s?)\b", lambda m: f"{m[1] or ''}N*m{'*s' * len(m[2])}", unit)
    unit = re.sub(r"\b(k?)(ft|in)\*?lb[sf]?\b", r"\1lbf*\2", unit)
    unit = re.sub(r"\b(k?)lb[sf]?\*?(ft|in)\b", r"\1lbf*\2", unit)
    return re.sub(r"\bt\b", "tf", re.sub(r"\b(k?)lbs?\b", r"\1lbf", unit))


def _computable(name: str) -> str:
    """A unit with its powers as `^`; refused (`ValueError`) if a number or a power is raised.

    pint computes in whole numbers as long as they may become: `9^9^9` would take hours.
    """
    text = _SUPERSCRIPTS.sub(lambda m: "^" + normalize("NFKC", m[0]).replace("\u2212", "-"), name)
    plain, powers = _EXPONENT.subn("", text)
    if "^" in plain or "**" in plain or (powers and _NUMBER_BUT_ONE.search(plain)):
        raise ValueError(name)
    return text


def _by_pint(unit: str, name: str, kind: Kind) -> float:
    import pint

    units = registry()
    try:
        measure = units.Quantity(1.0, _POWER.sub(r"\1^\2", _computable(name)))
        return float(measure.to(kind.si).magnitude)
    except pint.DimensionalityError as error:
        raise InputError(
            f"{unit!r} is not a unit of {kind.name}; use {_join(kind.examples)}"
        ) from error
    except Exception as error:  # pint raises many types on text that is no unit
        raise InputError(f"{unit!r} is not a known unit; use {_join(kind.examples)}") from error


def _join(words: tuple[str, ...]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} or {words[-1]}"


def plain(value: Any) -> Any:
    """A value as a design holds it.

    Parameters
    ----------
    value : object
        A number of NumPy or xarray becomes one of Python, with a unit (of pint, or as xarray keeps
        it) text; arrays become lists; text is cleaned; tables and lists are gone through, anything
        else is kept.

    Returns
    -------
    object
        The same in types of Python.
    """
    if isinstance(value, str):
        return clean(str(value))
    if isinstance(value, Mapping):
        return {plain(key): plain(inside) for key, inside in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(inside) for inside in value]
    if hasattr(value, "magnitude"):  # pint
        number, unit = plain(value.magnitude), f"{value.units:~C}"
    elif hasattr(value, "dtype"):
        unit = getattr(value, "attrs", {}).get("units", "")  # xarray
        number = getattr(value, "values", value).tolist()
    else:
        return value
    return f"{number!r} {unit}" if unit and isinstance(number, (int, float)) else number


def parse(value: object, kind: Kind) -> float:
    """Read a quantity.

    Parameters
    ----------
    value : str or SI or float
        Text with a unit (`"140 kN"`, `"4 1/2 in"`), or an `SI` number; as an array of one or a
        quantity of pint, too. A bare number is taken for gains alone.
    kind : Kind
        What it must measure.

    Returns
    -------
    float
        The value in `kind.si`.

    Raises
    ------
    InputError
        No unit, a wrong or unknown unit, or not a number; the message suggests a form.
    """
    if isinstance(value, SI):
        return float(value)
    value = plain(value)
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise _no_quantity(value, kind)
    if not isinstance(value, str):
        return _bare(value, kind)
    feet = _FEET_AND_INCHES.match(_parted(value)) if kind.si == "m" else None
    if feet is not None:
        inches = parse(f"{feet[2]} in", kind)
        return float(feet[1]) * factor("ft", kind) + inches
    match = _TEXT.match(_parted(pointed(value)))
    if match is None:
        raise _no_quantity(value, kind)
    number = _magnitude(match, value)
    if not match["unit"]:
        return _bare(number, kind)
    try:
        return number * factor(match["unit"], kind)
    except InputError as error:
        raise InputError(f"{shown(value)}: {error.problem}") from None


def bare(text: str) -> bool:
    """Whether a text is a number without a unit."""
    match = _TEXT.match(_parted(pointed(text)))
    return match is not None and not match["unit"]


def pointed(text: str) -> str:
    """A number without marks between its thousands, and a comma for a point as a point."""
    text = _SPACED.sub(lambda one: re.sub(r"(?<=\d)[\s'\u2019]", "", one[0]), text)
    text = _POINTS.sub(lambda one: one[0].replace(".", "").replace(",", "."), text)
    if re.match(r"\s*[-+]?\d+,(\d{1,2}|\d{4,})(?![\d,])", text):
        return text.replace(",", ".", 1)
    grouped = _COMMAS.match(text)
    if grouped is None:
        return text
    if grouped[1].count(",") == 1 and grouped[2] is None:
        number = grouped[0].strip()
        raise InputError(
            f"{text.strip()!r} may be {number.replace(',', '')} or {number.replace(',', '.')}; "
            "write one of them"
        )
    return grouped[0].replace(",", "") + text[grouped.end() :]


def _parted(text: str) -> str:
    """A text with `½` and the like as `1/2`, apart from the number before."""
    text = text.replace("\u2044", "/")
    return _VULGAR.sub(lambda one: f" {normalize('NFKC', one[0]).replace(chr(0x2044), '/')}", text)


def _no_quantity(value: object, kind: Kind) -> InputError:
    return InputError(f'{shown(value)} is not {kind.one}; write it like "100 {kind.examples[0]}"')


def _magnitude(match: re.Match[str], value: str) -> float:
    """The number in front of the unit; `4 1/2` is four and a half."""
    if match["number"] is not None:
        return float(match["number"])
    # Not int(): Python refuses whole numbers of thousands of digits with an error of its own.
    under = float(match["under"])
    if under == 0.0:
        raise InputError(f"{shown(value)} divides by zero")
    part = float(match["over"]) / under
    whole = match["whole"]
    if whole is None:
        return part
    return math.copysign(abs(float(whole)) + part, -1.0 if whole.startswith("-") else 1.0)


def _bare(number: float, kind: Kind) -> float:
    """A number without unit: a gain, or refused with the suggestion."""
    try:
        value = float(number)
    except OverflowError:
        raise _no_quantity(number, kind) from None
    if kind.name == "gain":
        return value
    if not math.isfinite(value):
        raise _no_quantity(value, kind)
    short = f"{value:.15g}"
    likely = (
        unit
        for unit in kind.examples
        if kind.usual[0] <= abs(value) * factor(unit, kind) <= kind.usual[1]
    )
    unit = next(likely, kind.examples[0])
    raise InputError(f'{short} has no unit; did you mean "{short} {unit}"?')


def write(value: float, kind: Kind) -> str:
    """Write a quantity so that `parse` gives back the same bits.

    Parameters
    ----------
    value : float
        In `kind.si`, finite.
    kind : Kind
        What it measures.

    Returns
    -------
    str
        In the first of the kind's units that is short and exact, else in SI, in full.
    """
    value = float(value)
    for unit in kind.examples:
        magnitude = value / factor(unit, kind)
        if not math.isfinite(magnitude):  # overflow: this unit is too small for it
            continue
        for digits in (6, 10, 15):
            text = f"{magnitude:.{digits}g} {unit}"
            if parse(text, kind) == value:
                return text
    return f"{value!r} {kind.si}"


def spellings(kind: Kind) -> list[str]:
    """Every unit that a kind is read in without a search, the usual ones first."""
    return list(dict.fromkeys([*kind.examples, *_KNOWN[kind.si], *_SPELLED.get(kind.si, {})]))


System = Literal["si", "field"]
"""Units people read: rpm, kN, kN m, m, mm; or rpm, klbf, klbf ft, ft, in."""

DIAMETERS = "m across"  # for `displayed`: a length that is read in mm or in

# What people read in place of an SI unit; any other is read as it is.
_SHOWN: dict[str, dict[str, str]] = {
    "si": {
        "rad/s": "rpm", "N": "kN", "N*m": "kN*m", "N*s/rad": "kN*s/rad", "J": "kJ",
        "rad/(N*m*s)": "rpm/(kN*m)", "m/s": "m/h", "W": "kW", "Pa": "MPa", DIAMETERS: "mm",
    },
    "field": {
        "rad/s": "rpm", "rad": "rev", "s/rad": "1/rpm", "N": "klbf", "N/s": "klbf/s",
        "N/m": "lbf/ft",
        "N*s/rad": "klbf/rpm", "N*m": "klbf*ft", "N*m/s": "klbf*ft/s", "J": "klbf*ft",
        "N*m/rad": "klbf*ft/rev", "N*m*s/rad": "klbf*ft/rpm", "N*m/(rad/s)": "klbf*ft/rpm",
        "rad/(N*m*s)": "rpm/(klbf*ft)", "rad/s/(N*m)": "rpm/(klbf*ft)",
        "rad/(N*m)": "rev/(klbf*ft)",
        "kg*m^2": "lb*ft^2", "kg/m": "lb/ft", "kg/m^3": "lb/gal", "Pa": "psi", "Pa*s": "cP",
        "W": "hp", "m^4": "in^4", "m": "ft", "m/s": "ft/h", DIAMETERS: "in",
    },
}  # fmt: skip
_SPOKEN = {"N*m*s/rad": "N m s", "N*m/rad": "N m", "1": ""}  # else as `_plain` has it


def displayed(value: Any, si_unit: str, system: System = "si") -> tuple[Any, str]:
    """A value in the unit that people read, and that unit's name.

    Parameters
    ----------
    value : float or ndarray
        In `si_unit`.
    si_unit : str
        SI unit, or `DIAMETERS` (m); one that has no usual other form is kept.
    system : {'si', 'field'}
        Whose units.

    Returns
    -------
    value, name : float or ndarray, and str
        Converted, and the unit as it is printed; empty for a number without.
    """
    unit = _SHOWN[system].get(si_unit)
    if unit is None:
        return value, _SPOKEN.get(si_unit, _plain(si_unit))
    return value / _KNOWN["m" if si_unit == DIAMETERS else si_unit][unit], _plain(unit)


def file_unit(si_unit: str, system: System) -> str:
    """The unit that people read in place of an SI unit, as a design file takes it."""
    return _SHOWN[system].get(si_unit, si_unit)


def unit_name(si_unit: str, system: System) -> str:
    """The unit that people read in place of an SI unit; empty for a number without."""
    return str(displayed(1.0, si_unit, system)[1])


def filed(value: Any, si_unit: str, system: System) -> tuple[Any, str]:
    """A value as a CSV file has it, and its unit there: plain SI, or the reader's field units."""
    plain = "" if si_unit == "1" else si_unit
    return (value, plain) if system == "si" else displayed(value, si_unit, system)


def filed_text(text: str, system: System) -> str:
    """A text with quantities in full as a CSV file has it."""
    return str(text) if system == "si" else told(text, system)


def full(value: float, si_unit: str, digits: int = 6) -> str:
    """A quantity in a text, for `told`."""
    return f"{value + 0.0:.{digits}g} {'' if si_unit == '1' else si_unit}".rstrip()


def told(text: str, system: System) -> str:
    """A text whose quantities are written in full, `200 N*m*s/rad`, in units that people read."""
    return _QUANTITY.sub(lambda match: _told(match[1], match[2], system), text)


def _told(number: str, si_unit: str, system: System) -> str:
    value, unit = displayed(float(number), si_unit, system)
    return f"{number if value == float(number) else f'{value:.5g}'} {unit}"


def _plain(unit: str) -> str:
    """A unit in plain print."""
    for power, raised in (("^2", "²"), ("^3", "³"), ("^4", "⁴")):
        unit = unit.replace(power, raised)
    return unit.replace("*", " ")


_IN_FULL = sorted((*_KNOWN, DIAMETERS), key=len, reverse=True)
_QUANTITY = re.compile(
    rf"(?<![\w.-])({_NUMBER}) ({'|'.join(map(re.escape, _IN_FULL))})"
    r"(?![\w*/^])"
)
