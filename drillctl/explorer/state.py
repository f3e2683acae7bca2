"""What a page shows, as one frozen value: undo, files and commands follow from it.

A page turns requests into states (`changed`) and pictures into work; nothing else is kept. What a
state sets is written as in a design file, so that the commands that a page offers give the same
numbers to the bit.
"""

from __future__ import annotations

import json
import math
import shlex
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from drillctl import units
from drillctl.design import Design
from drillctl.design.paths import axis_tables, parameter
from drillctl.design.tables import AxisTable
from drillctl.ensemble.grid import Axis, axis
from drillctl.errors import InputError, nearest
from drillctl.explorer import controls
from drillctl.simulation.measures import BATCH_MEASURES

VERSION = 1  # of the file that a state is saved to
POINTS = 41  # of an axis that was chosen on the page
MOST_DRAWS = 10_000
GAINS = ("controller.kp", "controller.ki")


class End(NamedTuple):
    """An axis as a design file has it."""

    path: str
    min: str | float
    max: str | float
    points: int

    @property
    def table(self) -> AxisTable:
        """The axis as a table of a design."""
        return AxisTable(**self._asdict())

    @property
    def option(self) -> str:
        """The same on the command line."""
        low, high = (f"{v:.12g}" if isinstance(v, float) else v for v in (self.min, self.max))
        return f"{self.path}={low}:{high}:{self.points}"


class Kept(NamedTuple):
    """Case A: what was set, and where the cross was."""

    settings: dict[str, Any]
    cross: dict[str, str | float]  # by path


@dataclass(frozen=True)
class State:
    """What a page shows."""

    settings: dict[str, Any]  # laid over the design, by path, as in a file
    axes: tuple[End, End]
    cross: tuple[float, float]  # SI, along both axes
    measure: str = "j1"
    level: float = 30.0  # of J1 (s)
    draws: int = 0  # of the rock; 0 for the rock of the design
    units: units.System = "si"
    kept: Kept | None = None

    def design(self, base: Design) -> Design:
        """The design with what is set, and the map."""
        values = dict(self.settings)
        values["map.axes"] = [one._asdict() for one in self.axes]
        return base.replace(values)

    def grid(self, design: Design) -> tuple[Axis, Axis]:
        """Both axes."""
        first, second = (axis(design, one.table) for one in self.axes)
        return first, second

    def point(self, design: Design) -> dict[str, str | float]:
        """What the cross sets, by path."""
        return {
            one.path: _exact(design, one.path, value)
            for one, value in zip(self.axes, self.cross, strict=True)
        }

    def at_cross(self, base: Design) -> Design:
        """The design at the cross."""
        design = base.replace(self.settings)
        return design.replace(self.point(design))

    def case_a(self, base: Design) -> Design | None:
        """The design that is kept, at its cross; None if there is none."""
        if self.kept is None:
            return None
        return base.replace(self.kept.settings).replace(self.kept.cross)


def _exact(design: Design, path: str, value: float) -> str | float:
    kind = parameter(design, path).kind
    return float(value) if kind is None else units.write(float(value), kind)


def first_state(
    base: Design, system: units.System, settings: Mapping[str, Any] | None = None
) -> State:
    """The state that a page opens with: the design as it is, with some values set."""
    settings = dict(settings or {})
    design = base.replace(settings)
    ends = [End(one.path, one.min, one.max, one.points) for one in axis_tables(design)[:2]]
    if len(ends) < 2:
        known = controls.axis_ranges(design)
        ends.append(_chosen(design, next(known[p] for p in known if p != ends[0].path)))
    levels = design.tables.map.levels
    level = levels[min(1, len(levels) - 1)]
    state = State(settings, (ends[0], ends[1]), (0.0, 0.0), level=level, units=system)
    return replace(state, cross=_at_design(design, state))


def _chosen(design: Design, one: controls.Range) -> End:
    kind = parameter(design, one.path).kind
    low, high = (
        float(f"{v:.6g}") if kind is None else units.write(float(f"{v:.6g}"), kind)
        for v in (one.low, one.high)
    )
    return End(one.path, low, high, POINTS)


def _at_design(design: Design, state: State) -> tuple[float, float]:
    """Where the design itself is on the map, or the middle where it says nothing."""
    known = controls.axis_ranges(design)
    results = []
    for one in state.grid(design):
        value = parameter(design, one.path).value
        if value is None:
            value = known[one.path].value if one.path in known else float(np.median(one.values))
        results.append(float(np.clip(value, one.values[0], one.values[-1])))
    return results[0], results[1]


def changed(state: State, asked: dict[str, Any], base: Design) -> State:
    """The state after a request of the page; an impossible one is refused (`InputError`)."""
    action = asked.get("do")
    if action not in ACTIONS:
        raise InputError(f"no such request: {nearest(str(action), ACTIONS)}")
    try:
        result: State = ACTIONS[action](state, asked, base)
    except InputError:
        raise
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"a request {action!r} that cannot be read ({error})") from None
    if replace(result, cross=state.cross) == state:  # what follows holds as before
        return result
    at = result.design(base)
    result.grid(at)
    for name in ("top_drive", "bit_rock", "weight_on_bit", "string"):
        getattr(at, name)  # impossible laws are refused here, beside what made them
    return result


def _set(state: State, asked: dict[str, Any], base: Design) -> State:
    path, value = str(asked["path"]), float(asked["value"])
    design = base.replace(state.settings)
    for place, one in enumerate(state.axes):
        if one.path == path:
            factor, _ = controls.shown_unit(parameter(design, path).si_unit, state.units)
            cross = list(state.cross)
            cross[place] = value * factor
            return replace(state, cross=(cross[0], cross[1]))
    made = controls.settings_of(design, path, value, state.units)
    return replace(state, settings=state.settings | made)


def _law(state: State, asked: dict[str, Any], base: Design) -> State:
    path = str(asked["path"])
    table = path.partition(".")[0]
    before = base.replace(state.settings)
    if table == "controller":  # at the cross, which may hold both gains
        before = before.replace({p: v for p, v in state.point(before).items() if p in GAINS})
    made = controls.law_settings(before, path, str(asked["value"]))
    settings = {
        key: value
        for key, value in state.settings.items()
        if not key.startswith(f"{table}.") or key.startswith(f"{table}.drive.")
    } | made  # fmt: skip
    after = base.replace(settings)
    axes = list(state.axes)
    known = controls.axis_ranges(after)
    gone = [k for k, one in enumerate(axes) if one.path.startswith(f"{table}.")
            and one.path not in known]  # fmt: skip
    others = [p for p in known if p.startswith(f"{table}.")]
    others += [p for p in known if p not in others]
    for place in gone:
        taken = {one.path for k, one in enumerate(axes) if k != place}
        path = next(p for p in others if p not in taken)
        axes[place] = _chosen(after, known[path])
    result = replace(state, settings=settings, axes=(axes[0], axes[1]))
    return replace(result, cross=_at_design(after, result)) if gone else result


def _cross(state: State, asked: dict[str, Any], base: Design) -> State:
    """The cross, in the units that are shown, or by so many cells."""
    axes = state.grid(base.replace(state.settings))
    results = []
    for one, at, to in zip(axes, state.cross, (asked["x"], asked["y"]), strict=True):
        if asked.get("cells"):
            value = at + float(to) * (one.values[1] - one.values[0])
        else:
            factor, _ = controls.shown_unit(one.unit, state.units)
            value = _rounded(float(to), (one.values[-1] - one.values[0]) / factor) * factor
        results.append(float(np.clip(value, one.values[0], one.values[-1])))
    return replace(state, cross=(results[0], results[1]))


def _rounded(value: float, span: float) -> float:
    """A value that a person would write, to 1/200 of a span or better."""
    ten = 10.0 ** math.floor(math.log10(span / 200.0))
    step = max(k * ten for k in (1.0, 2.0, 5.0) if k * ten <= span / 200.0)
    return float(f"{step * round(value / step):.10g}")


def _axis(state: State, asked: dict[str, Any], base: Design) -> State:
    """Another parameter along an axis, or other ends (in the units that are shown)."""
    place = int(asked["place"])
    design = base.replace(state.settings)
    path = str(asked["path"])
    axes = list(state.axes)
    if path == axes[1 - place].path:
        raise InputError("is the other axis already", f"axis {'xy'[place]}")
    if path == axes[place].path and "low" in asked:
        unit = parameter(design, path).si_unit
        low, high = (
            controls.written(unit, float(asked[end]), state.units) for end in ("low", "high")
        )
        axes[place] = End(path, low, high, axes[place].points)
    else:
        known = controls.axis_ranges(design)
        if path not in known:
            raise InputError(f"cannot be an axis: {nearest(path, known)}", path)
        axes[place] = _chosen(design, known[path])
    # What the axis that goes had at the cross stays set; what comes is no longer set.
    left = {p: v for p, v in state.point(design).items() if p not in {a.path for a in axes}}
    settings = {p: v for p, v in (state.settings | left).items() if p != path}
    result = replace(state, settings=settings, axes=(axes[0], axes[1]))
    own = _at_design(design.replace(state.point(design)), result)
    return replace(result, cross=own)


def _choose(state: State, asked: dict[str, Any], base: Design) -> State:
    """Measure, level, draws or units."""
    name, value = str(asked["name"]), asked["value"]
    if name == "measure":
        if value not in BATCH_MEASURES:
            raise InputError(f"no measure {value!r}; {nearest(str(value), BATCH_MEASURES)}", name)
        return replace(state, measure=str(value))
    if name == "level":
        level = float(value)
        if not 0.0 < level < 1e6:
            raise InputError(f"must be more than 0 s, got {level:g}", "level")
        return replace(state, level=level)
    if name == "draws":
        draws = int(value)
        if not 0 <= draws <= MOST_DRAWS:
            raise InputError(f"0 to {MOST_DRAWS} rocks, got {draws}", "rocks")
        return replace(state, draws=draws)
    if name == "units" and value in ("si", "field"):
        return replace(state, units=value)
    raise InputError(f"no choice {name!r} of {value!r}")


def _keep(state: State, asked: dict[str, Any], base: Design) -> State:
    """Keep what is shown as case A, or forget it."""
    if not asked.get("on", True):
        return replace(state, kept=None)
    point = state.point(base.replace(state.settings))
    return replace(state, kept=Kept(dict(state.settings), point))


ACTIONS = {
    "set": _set, "law": _law, "cross": _cross, "axis": _axis, "choose": _choose, "keep": _keep,
    "open": lambda state, asked, base: read(str(asked["text"]), base),
}  # fmt: skip
"""What a page may ask for."""


# Files and commands.


def saved(state: State, base: Design) -> str:
    """The state as the text of a file."""
    return json.dumps({"explorer": VERSION, "design": base.name, **asdict(state)}, indent=1)


def read(text: str, base: Design) -> State:
    """A state from the text of a file; refused (`InputError`) if it is none, or of another rig."""
    try:
        held = json.loads(text)
        version, name = held.pop("explorer"), held.pop("design")
        first, second = (End(*one) for one in held["axes"])
        x, y = (float(one) for one in held["cross"])
        if not math.isfinite(x * y):
            raise ValueError
        kept = None if held["kept"] is None else Kept(*held["kept"])
        held |= {"axes": (first, second), "cross": (x, y), "kept": kept}
        state = State(**held)
    except (ValueError, KeyError, TypeError, AttributeError):
        raise InputError("not a file that a page of the explorer saved", "open") from None
    if version != VERSION:
        raise InputError(f"written by another version of the explorer ({version})", "open")
    if name != base.name:
        raise InputError(f"a page of the design {name!r}, not of {base.name!r}", "open")
    for one in ("measure", "level", "draws", "units"):
        state = _choose(state, {"name": one, "value": getattr(state, one)}, base)
    state.case_a(base)
    return state


def command(state: State, base: Design) -> str:
    """The command that makes the map."""
    verb = "uncertainty" if state.draws else "map"
    words = ["drillctl", verb, _called(base), *_sets(state.settings)]
    for one in state.axes:
        words += ["--axis", one.option]
    if state.draws:
        words += ["--realizations", str(state.draws), "--set", f"map.levels=[{state.level:g}]"]
    elif state.measure != "j1":
        words += ["--measure", state.measure]
    return shlex.join(words)


def run_command(state: State, base: Design) -> str:
    """The command that makes the run at the cross."""
    point = state.point(base.replace(state.settings))
    words = ["drillctl", "simulate", _called(base), *_sets(state.settings | point)]
    return shlex.join([*words, "--engine", "batch"])


def _called(base: Design) -> str:
    from drillctl import catalog

    shipped = {one.name: str(one.path) for kind in ("designs", "models")
               for one in catalog.entries(kind)}  # fmt: skip
    return base.name if shipped.get(base.name) == base.origin else base.origin or base.name


def _sets(settings: dict[str, Any]) -> list[str]:
    return [word for path, value in settings.items() for word in ("--set", f"{path}={value}")]
