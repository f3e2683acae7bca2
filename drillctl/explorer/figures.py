"""Pictures of a page: each a value that `draw.js` draws, of its two axes and marks between them.

A mark is a line, an area, points or texts, in the units that are shown; NaN breaks a line. Colours
are names, for which `page.css` has the same eight as the figures of reports.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import islice
from typing import TYPE_CHECKING, Any

import contourpy
import numpy as np

from drillctl import units
from drillctl.arrays import Array, ComplexArray
from drillctl.design.paths import USUAL_NAMES
from drillctl.ensemble.grid import Axis
from drillctl.explorer.computed import Share
from drillctl.explorer.controls import shown_unit
from drillctl.simulation.measures import MEASURES

if TYPE_CHECKING:
    from drillctl.ensemble.audit import Audit
    from drillctl.explorer.computed import Boundary, Loop, Picture
    from drillctl.simulation import Simulation

Drawn = dict[str, Any]
Place = tuple[float, float]

REQUIRED = 1.10  # slope margin over slope that a recommendation requires by default
SHARES = (0.05, 0.5, 0.95)  # levels of a map of shares
NEAR = 3.0  # half-width of the Nyquist picture
FAR = 20.0  # beyond it nothing is drawn of the curve
SEEN = 0.01  # distance along it that can be seen
ANGLE = np.linspace(0.0, 2.0 * np.pi, 121)


def _axis(label: str, low: float, high: float, log: bool = False) -> Drawn:
    return {"label": label, "low": float(low), "high": float(high), "log": log}


def _about(label: str, *values: Array) -> Drawn:
    """An axis that holds values, and a little more."""
    finite = np.concatenate([one[np.isfinite(one)] for one in values])
    low, high = (finite.min(), finite.max()) if finite.size else (0.0, 1.0)
    more = 0.06 * (high - low) or 1.0
    return _axis(label, low - more, high + more)


def _line(x: Any, y: Any, colour: str, **how: Any) -> Drawn:
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    return {"kind": "line", "x": x, "y": y, "colour": colour, **how}


def _points(place: tuple[Any, Any], colour: str, shape: str, size: float) -> Drawn:
    x, y = (np.atleast_1d(np.asarray(one, dtype=float)) for one in place)
    return {"kind": "points", "x": x, "y": y, "colour": colour, "shape": shape, "size": size}


def _joined(lines: Iterable[Array], colour: str, **how: Any) -> Drawn:
    """Lines of shape (points, 2) as one."""
    gap = np.full((1, 2), np.nan)
    rows = [part for line in lines for part in (line, gap)]
    x, y = np.concatenate([gap, *rows]).T
    return _line(x, y, colour, **how)


def contours(
    x: Array, y: Array, values: Array, levels: tuple[float, ...], colour: str, **how: Any
) -> Iterator[Drawn]:
    """Lines at levels, and what each is."""
    if min(values.shape) < 2:
        return
    made = contourpy.contour_generator(x, y, np.ma.masked_invalid(values.T))
    found = [(number, line) for number, level in enumerate(levels) for line in made.lines(level)]
    yield _joined((line for _, line in found), colour, **how)
    # Not beside the label of the line before.
    at = [line[int((k + 0.5) / len(levels) * (len(line) - 1))] for k, line in found]
    across, up = np.array(at).reshape(-1, 2).T
    yield {"kind": "texts", "x": across, "y": up, "texts": [f"{levels[k]:g}" for k, _ in found]}


# The map.


def shown(one: Axis, system: units.System) -> Array:
    """Values of an axis as they are shown."""
    return np.asarray(one.values / shown_unit(one.unit, system)[0])


def _named(name: str, unit: str) -> str:
    return f"{name} ({unit})" if unit else name


def stability(
    axes: tuple[Axis, Axis], system: units.System, one: Picture | Share | None,
    levels: tuple[float, ...], marks: Iterable[Drawn],
) -> Drawn:  # fmt: skip
    """The map of a measure or of a share, with its levels under other marks."""
    result: Drawn = {}
    for key, side in zip("xy", axes, strict=True):
        low, high = _ends(shown(side, system))
        unit = shown_unit(side.unit, system)[1]
        result[key] = _axis(_named(USUAL_NAMES.get(side.path, side.path), unit), low, high)
    if one is None:
        return result | {"marks": list(marks)}
    x, y = (shown(side, system) for side in one.axes)
    factor, scale, drawn = _colouring(one, levels, system)
    values = one.values * factor
    image = {
        "kind": "image", "values": values.T.ravel(), "columns": len(x), "x": _ends(x),
        "y": _ends(y), "scale": scale, "rising": isinstance(one, Share),
    }  # fmt: skip
    lines = contours(x, y, values, drawn, "black", width=1.6)
    return result | {"image": image, "marks": [*lines, *marks]}


def _ends(values: Array) -> Place:
    """Outer sides of the cells at the ends of an axis."""
    half = 0.5 * float(values[1] - values[0])
    return float(values[0]) - half, float(values[-1]) + half


def _colouring(
    one: Picture | Share, levels: tuple[float, ...], system: units.System
) -> tuple[float, Drawn, tuple[float, ...]]:
    """Factor to what is shown, the scale of the colours, and levels that are drawn."""
    if isinstance(one, Share):
        return 1.0, _axis("share of rocks", 0.0, 1.0), SHARES
    measure = MEASURES[one.measure]
    factor, unit = units.displayed(1.0, measure.unit, system)
    label = _named(measure.label, unit)
    if one.measure == "j1":
        return float(factor), _axis(label, 0.0, 2.0 * max(levels)), levels
    finite = one.values[np.isfinite(one.values)] * factor
    low, high = (finite.min(), finite.max()) if finite.size else (0.0, 1.0)
    return float(factor), _axis(label, low, high if high > low else low + 1.0), ()


def bounded(boundary: Boundary, system: units.System) -> Iterator[Drawn]:
    """Boundary and margin of the linear loop."""
    x, y = (shown(one, system) for one in boundary.axes)
    ratio = np.clip(boundary.ratio, 0.0, 10.0)
    if boundary.lines is None:
        yield from islice(contours(x, y, ratio, (1.0,), "red", width=2), 1)
    else:
        one = [shown_unit(side.unit, system)[0] for side in boundary.axes]
        yield _joined((line / one for line in boundary.lines), "red", width=2)
    yield from islice(contours(x, y, ratio, (REQUIRED,), "red", width=1.4, dash=[2, 3]), 1)


def checked(audit: Audit, axes: tuple[Axis, Axis], system: units.System) -> Drawn:
    """Audited cells."""
    x, y = (shown(one, system) for one in axes)
    i, j = np.unravel_index(audit.cells, (len(x), len(y)))
    return _points((x[i], y[j]), "blue", "circle", 3.5)


def starred(place: Place) -> Drawn:
    """The recommended setting."""
    return _points(place, "red", "star", 9)


def kept_levels(
    one: Picture, levels: tuple[float, ...], place: Place | None, system: units.System
) -> Iterator[Drawn]:
    """Levels of case A, and its cross."""
    x, y = (shown(side, system) for side in one.axes)
    yield from islice(contours(x, y, one.values, levels, "purple", width=2, dash=[6, 4]), 1)
    if place is not None:
        yield _points(place, "purple", "square", 5)


# At the cross.


def of_run(run: Simulation, of_a: Simulation | None, system: units.System) -> dict[str, Drawn]:
    """Speeds, torques and phase portrait of a run, over those of case A."""
    kept = None if of_a is None else _signals(of_a, system)
    here, level = _signals(run, system), run.design.speed / units.RPM
    end = here["time"][-1]
    time = _axis("time (s)", 0.0, end)
    twist = _about("twist (rev)", here["twist"], *([kept["twist"]] if kept else []))
    torque = f"torque ({units.unit_name('N*m', system)})"

    def drawn(x: str, side: Drawn, label: str, of_a: str, colours: dict[str, str]) -> Drawn:
        lines = [_line(kept[x], kept[of_a], "purple", alpha=0.7)] if kept else []
        lines += [_line(here[x], here[y], colour, width=1.4) for y, colour in colours.items()]
        return {"x": side, "y": _about(label, *(one["y"] for one in lines)), "marks": lines}

    speed = drawn("time", time | {"bare": True}, "speed (rpm)", "bit_speed",
                  {"top_speed": "orange", "bit_speed": "blue"})  # fmt: skip
    speed["marks"].append(_line([0.0, end], [level, level], "grey", dash=[2, 3]))
    torques = {"pipe_torque": "sky", "top_torque": "red"}
    return {
        "speed": speed,
        "torque": drawn("time", time, torque, "top_torque", torques),
        "phase": drawn("twist", twist, "bit speed (rpm)", "bit_speed", {"bit_speed": "blue"}),
    }


def _signals(run: Simulation, system: units.System) -> dict[str, Array]:
    torque = shown_unit("N*m", system)[0]
    scales = {
        "bit_speed": units.RPM, "top_speed": units.RPM, "twist": 2.0 * math.pi,
        "top_torque": torque, "pipe_torque": torque,
    }  # fmt: skip
    return {"time": run.time} | {name: run.signals[name] / one for name, one in scales.items()}


def of_loop(loop: Loop | None, of_a: Loop | None) -> dict[str, Drawn]:
    """Nyquist curve with the disk of its margin, impedance and reflection, over those of case A."""
    curves, impedances, reflections = list[Drawn](), list[Drawn](), list[Drawn]()
    for one, of_curve, of_drive in ((of_a, "purple", "purple"), (loop, "blue", "green")):
        if one is None:
            continue
        near = _seen(one.loop)
        curves.append(_line(near.real, near.imag, of_curve, width=1.4))
        hertz = one.drive["frequency"]
        impedances.append(_line(hertz, one.drive["impedance"], of_drive, width=1.4))
        reflections.append(_line(hertz, one.drive["reflection"], of_drive, width=1.4))
    if loop is not None:
        mirror = curves[-1] | {"y": -curves[-1]["y"], "colour": "sky", "dash": [5, 4]}
        curves = [*_disk(loop), mirror, *curves]
    low, high = (hertz[0], hertz[-1]) if impedances else (0.1, 10.0)
    frequency = _axis("frequency (Hz)", low, high, log=True)
    one_line = _line([low, high], [1.0, 1.0], "grey", dash=[2, 3])
    circle = _line(np.cos(ANGLE), np.sin(ANGLE), "grey", dash=[2, 3])
    return {
        "nyquist": {
            "x": _axis("real part of L", -NEAR, NEAR - 1.0), "equal": True,
            "y": _axis("imaginary part of L", -NEAR, NEAR),
            "marks": [circle, *curves, _points((-1.0, 0.0), "red", "cross", 4)],
        },
        "impedance": {"x": frequency, "y": _axis("|Z| / pipe", 0.03, 300.0, log=True),
                      "marks": [one_line, *impedances]},
        "reflection": {"x": frequency, "y": _axis("reflection |r|", 0.0, 1.25),
                       "marks": reflections},
    }  # fmt: skip


def _seen(curve: ComplexArray) -> ComplexArray:
    """Points of a curve as far apart as can be seen; NaN where it is far away."""
    near = np.where(np.abs(curve) < FAR, curve, np.nan)
    along = np.nancumsum(np.abs(np.diff(near, prepend=near[:1])))
    further = np.diff(np.floor(along / SEEN), prepend=-1.0) > 0.0
    return near[further | np.isnan(near)]


def _disk(loop: Loop) -> Iterator[Drawn]:
    if loop.margins is None or loop.margins.disk_ends is None:
        return
    far, near = loop.margins.disk_ends
    middle, radius = 0.5 * (near + far), 0.5 * (near - far)
    yield _line(middle + radius * np.cos(ANGLE), radius * np.sin(ANGLE), "orange", fill=0.35)
