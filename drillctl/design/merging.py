"""Plain TOML dictionaries: a design laid over its model, and single values set by path."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from drillctl import units
from drillctl.design.tables import DesignTables, refuse_same_names
from drillctl.design.uncertain_tables import flattened
from drillctl.errors import InputError, nearest, shown

Tree = dict[str, Any]

# Keys that say the same thing in different ways: whichever way the upper layer takes
# replaces the others.
_ALTERNATIVES: dict[str, tuple[tuple[tuple[str, ...], ...], ...]] = {
    "bit_rock": ((("table",), ("a1", "a2", "beta")),),
    "top_drive": (
        (("inertia",), ("motor_inertia", "gear_ratio", "motors", "gearbox_inertia", "efficiency")),
    ),
    "drillstring.sections": (
        (("pipe",), ("outer_diameter", "inner_diameter"), ("polar_moment",), ("stiffness",)),
        (("shear_modulus",), ("youngs_modulus", "poisson_ratio")),
        (("tool_joints",), ("joint_outer_diameter", "joint_inner_diameter", "joint_length")),
    ),
}

_BESIDE = ("motors", "gearbox_inertia", "efficiency")  # alone they take no way

WHOLE = ("tune.parameters",)
"""Tables that say what there is to do: the upper layer's stands in place of the lower one's."""


def overlay(
    base: Tree, top: Mapping[str, Any], path: str = "", whole: tuple[str, ...] = WHOLE
) -> Tree:
    """Return `base` with `top` laid over it.

    Tables merge key by key, sections by name (a new name is added at the bottom). A table
    whose `law` changes, a start whose `kind` or an uncertain parameter whose `distribution`
    changes, drops what belonged to the old one; the drive around a controller and the path of a
    weight law stay. What is tuned is that of the upper layer alone.
    """
    if not path and _changed(base.get("controller", DEFAULT), top.get("controller", {}), "law"):
        base = _without_gains(base)
    if path == "start" and _changed(base, top, "kind", "turning"):
        return dict(top)
    if _changed(base, top, "law"):
        # The old law's numbers go; the drive it acts through, or the hoist, stays what it is.
        return overlay({k: base[k] for k in ("drive", "path") if k in base}, top, path)
    if path.startswith("uncertain.") and _changed(base, top, "distribution"):
        return dict(top)
    if path == "uncertain":
        base, top = flattened(base), flattened(top)
    merged = dict(base)
    for ways in _ALTERNATIVES.get(path, ()):
        taken = [way for way in ways if any(key in top for key in way if key not in _BESIDE)]
        if taken:
            left = {key for way in ways if way not in taken for key in way}
            merged = {key: value for key, value in merged.items() if key not in left}
    for key, value in top.items():
        place = f"{path}.{key}" if path else key
        below = merged.get(key)
        if place == "drillstring.sections" and isinstance(value, list):
            merged[key] = _overlay_sections(below, value)
        elif place in whole:
            merged[key] = value
        elif isinstance(value, Mapping) and isinstance(below, Mapping):
            merged[key] = overlay(dict(below), value, place, whole)
        else:
            merged[key] = value
    return merged


DEFAULT = {"law": "pi"}  # of a design that names no controller


def _without_gains(base: Tree) -> Tree:
    """Without axes and bounds of search over gains, which another drive law does not have."""
    result = dict(base)
    chart, search = _table(base.get("map")), _table(base.get("tune"))
    axes, bounds = chart.get("axes"), _table(search.get("parameters"))
    if isinstance(axes, list) and any(_is_gain(_table(axis).get("path")) for axis in axes):
        result["map"] = {key: value for key, value in chart.items() if key != "axes"}
    if any(map(_is_gain, bounds)):
        left = {path: value for path, value in bounds.items() if not _is_gain(path)}
        result["tune"] = {**search, "parameters": left}
    return result


def _table(value: object) -> Mapping[str, Any]:
    """A table; of anything else, which validation reports, an empty one."""
    return value if isinstance(value, Mapping) else {}


def _is_gain(path: object) -> bool:
    """Whether a path is that of a number of the law, not of the drive that it acts through."""
    text = str(path)
    return text.startswith("controller.") and not text.startswith("controller.drive.")


def _changed(
    base: Mapping[str, Any], top: Mapping[str, Any], key: str, default: str | None = None
) -> bool:
    if not (isinstance(base, Mapping) and isinstance(top, Mapping)):  # reported when validated
        return False
    below = base.get(key, default)
    return key in top and below is not None and top[key] != below


def _overlay_sections(base: object, top: list[Any]) -> list[Any]:
    if not isinstance(base, list) or not (_named(base) and _named(top)):
        return top  # not sections at all: left for the validation to report
    for layer in (base, top):
        refuse_same_names([section["name"] for section in layer], "drillstring.sections")
    merged = {section["name"]: section for section in base}
    for section in top:
        name = section["name"]
        below = merged.get(name)
        merged[name] = section if below is None else overlay(below, section, "drillstring.sections")
    return list(merged.values())


def _named(sections: list[Any]) -> bool:
    return all(isinstance(s, Mapping) and isinstance(s.get("name"), str) for s in sections)


def with_values(tree: Tree, values: Mapping[str, Any]) -> Tree:
    """A new tree with single values set by dotted path, in whatever order they are given."""
    values = units.plain(values)
    # A law or a kind drops the numbers of the old one, so it goes before the new one's.
    first = (".law", ".kind", ".distribution")
    for path in sorted(values, key=lambda path: not path.endswith(first)):
        if "controller" not in tree and path.startswith("controller."):
            # The default controller is what a gain alone is a change of.
            controller = DesignTables.model_fields["controller"].default
            tree = {**tree, "controller": controller.model_dump(exclude={"drive"})}
        if "weight_on_bit" not in tree and path.startswith("weight_on_bit."):
            tree = {**tree, "weight_on_bit": {"law": "constant"}}
        # A value within such a table is set in what stands there.
        whole = tuple(place for place in WHOLE if not path.startswith(f"{place}."))
        tree = overlay(tree, branch(path, values[path], tree), whole=whole)
    return tree


def branch(path: str, value: object, tree: Tree) -> Tree:
    """The smallest tree that sets `path` to `value`, to be laid over `tree`."""
    keys = path.split(".")
    if keys[:2] == ["drillstring", "sections"] and len(keys) > 2:
        names = _section_names(tree)
        # A section's name may itself hold a dot: the longest name that fits is meant.
        rest = ".".join(keys[2:])
        fitting = [n for n in names if f"{rest}.".startswith(f"{n}.")]
        if not fitting:
            raise InputError(f"no section {keys[2]!r}; {nearest(keys[2], names)}", path)
        name = max(fitting, key=len)
        inside = rest[len(name) + 1 :]
        entry = _nest(inside.split("."), value) if inside else value
        if not isinstance(entry, Mapping):
            raise InputError(f"got {shown(value)}; a section is a table", path)
        if entry.get("name", name) != name:
            raise InputError("a section cannot be renamed: its name is its address", path)
        return {"drillstring": {"sections": [{**entry, "name": name}]}}
    if keys[:2] == ["bit_rock", "points"] and len(keys) == 4:
        return {"bit_rock": {"points": _with_point(keys[2], keys[3], value, tree, path)}}
    return _nest(keys, value)


def _with_point(number: str, key: str, value: object, tree: Tree, path: str) -> list[Any]:
    """Tabulated points, a number of one of them changed; they count from 1."""
    rock = tree.get("bit_rock")
    points = rock.get("points") if isinstance(rock, Mapping) else None
    if not (isinstance(points, list) and all(isinstance(one, Mapping) for one in points)):
        raise InputError("this rock has no points", path)
    if not (number.isdecimal() and 1 <= int(number) <= len(points)):
        raise InputError(f"there is no point {number}; there are {len(points)}", path)
    changed = {**points[int(number) - 1], key: value}
    return [changed if k == int(number) else one for k, one in enumerate(points, start=1)]


def _section_names(tree: Tree) -> list[str]:
    string = tree.get("drillstring")
    sections = string.get("sections") if isinstance(string, Mapping) else None
    return [s["name"] for s in sections] if isinstance(sections, list) and _named(sections) else []


def _nest(keys: list[str], value: object) -> Tree:
    *parents, last = keys
    tree: Tree = {last: value}
    for key in reversed(parents):
        tree = {key: tree}
    return tree
