"""Plain TOML dictionaries: a design laid over its model, and single values set by path."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from drillctl.errors import InputError, nearest

Tree = dict[str, Any]

# A table of coefficients and single coefficients say the same thing twice: whichever the
# upper layer gives replaces the other.
_ALTERNATIVES = {
    "bit_rock": (("table",), ("a1", "a2", "beta")),
    "drillstring.sections": (
        ("pipe",),
        ("outer_diameter", "inner_diameter"),
        ("polar_moment",),
        ("stiffness",),
    ),
}


def overlay(base: Tree, top: Mapping[str, Any], path: str = "") -> Tree:
    """Return `base` with `top` laid over it.

    Tables merge key by key, sections by name (a new name is added at the bottom). A table
    whose `law` changes, or a start whose `kind` changes, drops what belonged to the old one.

    Parameters
    ----------
    base, top : dict
        Tables as TOML gives them.
    path : str
        Where they stand in the design.

    Returns
    -------
    dict
        A new tree.
    """
    if _changed(base, top, "law") or (path == "start" and _changed(base, top, "kind")):
        return dict(top)
    merged = dict(base)
    for alternative in _ALTERNATIVES.get(path, ()):
        if any(key in top for key in alternative):
            for other in _ALTERNATIVES[path]:
                if other != alternative:
                    merged = {k: v for k, v in merged.items() if k not in other or k in top}
    for key, value in top.items():
        place = f"{path}.{key}" if path else key
        below = merged.get(key)
        if place == "drillstring.sections" and isinstance(value, list):
            merged[key] = _overlay_sections(below or [], value)
        elif isinstance(value, Mapping) and isinstance(below, Mapping):
            merged[key] = overlay(dict(below), value, place)
        else:
            merged[key] = value
    return merged


def _changed(base: Mapping[str, Any], top: Mapping[str, Any], key: str) -> bool:
    return key in top and key in base and top[key] != base[key]


def _overlay_sections(base: list[Tree], top: list[Tree]) -> list[Tree]:
    merged = {section.get("name"): section for section in base}
    for section in top:
        name = section.get("name") if isinstance(section, Mapping) else None
        below = merged.get(name)
        merged[name] = section if below is None else overlay(below, section, "drillstring.sections")
    return list(merged.values())


def branch(path: str, value: object, tree: Tree) -> Tree:
    """The smallest tree that sets `path` to `value`, to be laid over `tree`.

    Parameters
    ----------
    path : str
        Dotted; sections by name: `drillstring.sections.pipe.length`.
    value : object
        As it would stand in the file.
    tree : dict
        The design so far; sections must be in it.

    Raises
    ------
    InputError
        No such section.
    """
    keys = path.split(".")
    if keys[:2] == ["drillstring", "sections"] and len(keys) > 2:
        names = [s.get("name", "") for s in tree.get("drillstring", {}).get("sections", [])]
        # A section's name may itself hold a dot: the longest name that fits is meant.
        rest = ".".join(keys[2:])
        fitting = [n for n in names if rest.startswith(f"{n}.")]
        if not fitting:
            raise InputError(f"no section {keys[2]!r}; {nearest(keys[2], names)}", path)
        name = max(fitting, key=len)
        entry = _nest(rest[len(name) + 1 :].split("."), value) | {"name": name}
        return {"drillstring": {"sections": [entry]}}
    return _nest(keys, value)


def _nest(keys: list[str], value: object) -> Tree:
    for key in reversed(keys):
        value = {key: value}
    assert isinstance(value, dict)
    return value
