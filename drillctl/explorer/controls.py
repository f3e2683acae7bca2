"""What can be turned on a page, for this rig: its parameters with their ranges, and its laws."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from drillctl import units
from drillctl.design import Design
from drillctl.design.paths import USUAL_NAMES, parameter, parameters, tuned_ranges
from drillctl.errors import InputError
from drillctl.linear.operating_point import cancelling_weight_gain, operating_point
from drillctl.rig.top_drive.law import drive_laws
from drillctl.rig.weight_on_bit.law import HEAVIEST, weight_laws
from drillctl.studies.recommend.candidates import gains_of
from drillctl.studies.recommend.deeper import depth_changes, depth_of, under_top

LIGHT = 50e3  # least end of the range of the weight (N), where nothing else bounds it
DEPTH = "depth"
"""Length of the whole string, which the topmost section makes up; no path of a design."""
SPEED, WEIGHT = "operating_point.speed", "operating_point.weight_on_bit"


class Range(NamedTuple):
    """A parameter that can be turned."""

    path: str
    label: str
    unit: str  # SI
    low: float  # SI
    high: float
    value: float
    means: str  # what it is, in plain words


def shown_unit(unit: str, system: units.System) -> tuple[float, str]:
    """SI value of one unit that people read, and its name."""
    one, name = units.displayed(1.0, unit, system)
    return 1.0 / float(one), name


def ranges(design: Design) -> dict[str, Range]:
    """Everything that can be turned or be an axis of the map, by path."""
    found = [*_drilling(design), *_rock(design), *_drive(design), *_weight_law(design)]
    return {one.path: one for one in found}


def axis_ranges(design: Design) -> dict[str, Range]:
    """What can be an axis of the map: the same, with the length of the top pipe for the depth."""
    found = ranges(design)
    depth = found.pop(DEPTH, None)
    first = design.tables.drillstring.sections[0]
    if depth is not None and first.repeat == 1:
        path, rest = f"drillstring.sections.{first.name}.length", under_top(design)
        found[path] = Range(path, f"length of {first.name}", "m", depth.low - rest,
                            depth.high - rest, depth.value - rest, depth.means)  # fmt: skip
    return found


def _drilling(design: Design) -> Iterator[Range]:
    point, (low, high) = design.tables.operating_point, design.table_range
    weight = point.weight_on_bit
    most = high if high < HEAVIEST else max(2.0 * weight, LIGHT)
    yield Range(WEIGHT, "weight on bit", "N", low if low > 0.0 else 0.0, most, weight,
                "Force on the bit. More of it means more friction and stick-slip.")  # fmt: skip
    speed = design.speed
    slowest = min(speed, _round(0.3 * speed))
    yield Range(SPEED, "set speed", "rad/s", slowest, _round(2.5 * speed), speed,
                "Speed that the top drive is set to. A faster bit sticks less.")  # fmt: skip
    try:
        depth, least = depth_of(design), under_top(design)
    except InputError:
        return
    low = max(0.2 * depth, 1.05 * least)
    yield Range(DEPTH, "depth", "m", low, 2.5 * depth, depth,
                "Length of the whole string; pipe is added at the top.")  # fmt: skip


def _rock(design: Design) -> Iterator[Range]:
    """Factors of the friction law where it has them, else its numbers, and the wall's factor."""
    known = {
        one.path: one
        for one in parameters(design)
        if one.path.startswith("bit_rock.") and one.path.count(".") == 1 and one.value
        and not one.whole
    }  # fmt: skip
    for path, one in known.items():
        factor = path.endswith("_factor")
        if not factor and f"{path}_factor" in known:
            continue
        value = float(one.value or 0.0)
        low, high = (0.5, 1.5) if factor else (0.5 * value, 1.5 * value)
        name = path.partition(".")[2].replace("_", " ")
        means = f"{name} of the friction law of the rock, see docs/laws.md"
        yield Range(path, name, one.si_unit, low, high, value, means)
    wall = design.tables.well.friction_factor
    if wall is not None:
        yield Range("well.friction_factor", "wall friction", "", 0.0, 0.6, wall,
                    "Coulomb friction factor between string and wall.")  # fmt: skip


def _drive(design: Design) -> Iterator[Range]:
    law, values = drive_laws()[design.tables.controller.law], gains_of(design)
    given = {f"controller.{key}": getattr(design.tables.controller, key) for key in law.tuned}
    for path, (low, high) in tuned_ranges(design).items():
        value = values[path] if given.get(path) is None else float(given[path])
        name = USUAL_NAMES.get(path, path.partition(".")[2].replace("_", " "))
        yield Range(path, name, parameter(design, path).si_unit, min(low, value),
                    max(high, value), value, f"{name} of the drive law {law.name}.")  # fmt: skip


def _weight_law(design: Design) -> Iterator[Range]:
    for one in parameters(design):
        if not one.path.startswith("weight_on_bit.") or one.path.count(".") > 1:
            continue
        if one.value is None or one.whole:
            continue
        high = 3.0 * one.value if one.value else 1.0
        if one.path == "weight_on_bit.gain":
            high = max(high, 4.0 * _weight_gain(design))
        name = one.path.partition(".")[2].replace("_", " ")
        yield Range(one.path, name, one.si_unit, 0.0, high, one.value,
                    f"{name} of the weight law {design.tables.weight_on_bit.law}.")  # fmt: skip


def _round(value: float) -> float:
    """A speed (rad/s) to 5 rpm."""
    return max(5.0, 5.0 * round(value / units.RPM / 5.0)) * units.RPM


def settings_of(design: Design, path: str, value: float, system: units.System) -> dict[str, Any]:
    """What a slider at a value (in the unit that it shows) sets, as it would stand in a file."""
    if path == DEPTH:
        factor, _ = shown_unit("m", system)
        return {
            key: f"{float(si):.8g} m" if key.endswith(("length", "spacing")) else int(si)
            for key, si in depth_changes(design, value * factor).items()
        }
    return {path: written(parameter(design, path).si_unit, value, system)}


def written(unit: str, value: float, system: units.System) -> str | float:
    """A value in the unit that people read, as a design file takes it."""
    return f"{value:.10g} {units.file_unit(unit, system)}" if unit else float(f"{value:.10g}")


def law_settings(design: Design, path: str, law: str) -> dict[str, Any]:
    """What sets another law, with numbers to begin with where it has no defaults."""
    if path == "controller.law":
        if law not in drive_laws():
            raise InputError(f"no drive law {law!r}", path)
        values: dict[str, Any] = {path: law}
        if law == "pi":
            kp, ki = design.linear_drive.gains()
            values |= {"controller.kp": f"{float(kp):.6g}", "controller.ki": f"{float(ki):.6g}"}
        if law == "constant-torque":
            values["controller.torque"] = f"{operating_point(design).bit_torque:.6g} N*m"
        return values
    if law not in weight_laws():
        raise InputError(f"no weight law {law!r}", path)
    values = {path: law}
    if "gain" in weight_laws()[law].table.model_fields:
        values["weight_on_bit.gain"] = f"{_weight_gain(design):.6g} N*s/rad"
    return values


def _weight_gain(design: Design) -> float:
    """Half of the gain (N s/rad) that cancels the falling slope of the rock."""
    try:
        return 0.5 * cancelling_weight_gain(design)
    except (InputError, ZeroDivisionError):  # no steady drilling, or a torque without weight
        return 1000.0


def laws() -> dict[str, list[str]]:
    """Laws that can be chosen, by their path."""
    return {"controller.law": sorted(drive_laws()), "weight_on_bit.law": sorted(weight_laws())}
