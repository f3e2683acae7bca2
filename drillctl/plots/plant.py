"""The plant: mode shapes, mobility of the ends, frequency responses, friction of the bit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, MultipleLocator

from drillctl import units
from drillctl.arrays import Array, ComplexArray
from drillctl.design import Design
from drillctl.errors import InputError
from drillctl.linear.modal import Mode, Modes
from drillctl.linear.response import FrequencyResponse
from drillctl.plots import style
from drillctl.rig.bit_rock import BitRockLaw

SHOWN = 4  # modes drawn of each boundary condition: more cannot be distinguished


@style.picture(
    result="From `drillctl.modes`.",
    ax="Four panels: angle and torque with the top free, then with the top held.",
)
def mode_shapes(
    result: Modes, ax: Sequence[Axes] | None = None, system: units.System = "si"
) -> Figure:
    """Draw angle and torque of the lowest modes along the string, depth downward.

    A lumped string, which has no length, is drawn over its node numbers.
    """
    figure, panels = style.grid_or_new(ax, 2, 2, 8.5, 8.0, share_y=True)
    place, label = _places(result, system)
    rows = (("Top free", result.free_free), ("Top held", result.fixed_top))
    for (support, lowest), (left, right) in zip(rows, (panels[:2], panels[2:]), strict=True):
        for number, mode in enumerate(lowest[:SHOWN]):
            _draw(left, right, mode, place, number)
        style.dress(left, "angle, largest = 1", label, f"{support}: angle")
        style.dress(right, "torque, largest = 1", "", f"{support}: torque")
        style.legend(right, loc="upper left", bbox_to_anchor=(1.02, 1.0))
    for panel in panels:
        panel.axvline(0.0, color=style.GREY, linewidth=0.8, zorder=1)
        panel.set_xlim(-1.1, 1.1)
        panel.set_ylim(place[-1], place[0])
        panel.yaxis.set_major_locator(MaxNLocator(integer=True))
    return figure


def _places(result: Modes, system: units.System) -> tuple[Array, str]:
    """Where the nodes are drawn, and the label of that axis."""
    if result.node_depth[-1] > 0.0:
        depth, unit = units.displayed(result.node_depth, "m", system)
        return depth, f"depth ({unit})"
    return np.arange(len(result.node_depth), dtype=float), "node, 0 = top drive"


def _draw(left: Axes, right: Axes, mode: Mode, place: Array, number: int) -> None:
    left.plot(mode.shape, place, **style.look(number))
    # Torque is constant along an element: steps, and no more smoothness than there is.
    right.stairs(
        mode.torque_shape, place, orientation="horizontal", baseline=None, zorder=2,
        label=_name(mode), **style.look(number),
    )  # fmt: skip


def _name(mode: Mode) -> str:
    if mode.frequency_hz == 0.0:
        return "rigid body"
    if mode.damping_ratio is None:
        return f"{mode.frequency_hz:.4g} Hz, overdamped"
    damping = f"\ndamping {100.0 * mode.damping_ratio:.3g} %" if mode.damping_ratio else ""
    return f"{mode.frequency_hz:.4g} Hz{damping}"


ENDS = (("bit", "bit_torque", "bit_speed"), ("top", "top_torque", "top_speed"))
"""Name, input and output of each end."""


@style.picture(
    results="From `drillctl.linear.frequency_response`; distinguished by their `title`.",
    ax="A panel for the bit, and one for the top if a result has the top torque as an input.",
    raises="Nothing to draw, a result without mobility at the bit, not as many axes as panels.",
)
def mobility(
    results: FrequencyResponse | Sequence[FrequencyResponse],
    ax: Sequence[Axes] | None = None,
    system: units.System = "si",
) -> Figure:
    """Draw the magnitude of the mobility at bit and top.

    Speed per torque, of the string alone (`plant`) or with its drive (`closed_loop`, which has no
    top torque among its inputs). High peaks at the bit are where the rock's falling slope feeds
    the string; those of an undamped string end where the nearest frequency lies.
    """
    given = style.listed(results)
    for one in given:
        one.between("bit_torque", "bit_speed")
    shown = [end for end in ENDS if any(_has(one, end) for one in given)]
    figure, panels = style.grid_or_new(ax, len(shown), 1, 7.5, 2.6 * len(shown) + 1.2, share_x=True)
    scale, unit = units.displayed(1.0, "rad/(N*m*s)", system)
    for panel, end in zip(panels, shown, strict=True):
        for number, one in enumerate(given):
            if _has(one, end):
                _draw_mobility(panel, one, end, scale, number, len(given))
        title = "Mobility of the string" if panel is panels[0] else ""
        style.dress(panel, "", f"mobility at the {end[0]} ({unit})", title)
    panels[-1].set_xlabel("frequency (Hz)", fontsize=style.LABEL)
    for panel in panels:
        hertz(panel)
    style.legend_above(panels[0])
    return figure


def _has(one: FrequencyResponse, end: tuple[str, str, str]) -> bool:
    return end[1] in one.inputs and end[2] in one.outputs


def _draw_mobility(
    panel: Axes, one: FrequencyResponse, end: tuple[str, str, str], scale: float, number: int,
    count: int,
) -> None:  # fmt: skip
    width = style.LINE if count == 1 else WIDTHS[min(number, len(WIDTHS) - 1)]
    speed = np.abs(one.between(*end[1:])) * scale
    panel.loglog(one.frequency_hz, speed, label=one.title, **style.look(number, width))


TARGETS = ("top_speed", "bit_speed")  # outputs that are drawn unless others are named
WIDTHS = (2.8, 1.6, 1.1, 0.8)
"""Widths (points) of one response after another, so that equal ones show through."""


@style.picture(
    result="From `drillctl.linear.frequency_response`; several are distinguished by their `title`.",
    ax="Two panels: magnitude and phase.",
    source="Input; by default the first input of each result.",
    targets="Outputs; by default top and bit speed.",
    raises="No such signal, nothing to draw, or responses of different units.",
)
def bode(
    result: FrequencyResponse | Sequence[FrequencyResponse],
    ax: Sequence[Axes] | None = None,
    source: str | None = None,
    targets: Sequence[str] | None = None,
    system: units.System = "si",
) -> Figure:
    """Draw magnitude and phase of the response of some signals to one other.

    Magnitude in dB of the unit named; phase between -180 and 180 degrees. The peaks of an undamped
    string are infinite: as drawn they end where the nearest frequency lies.
    """
    results = style.listed(result)
    names = TARGETS if targets is None else tuple(targets)
    if not names:
        raise InputError("needs one output or more", "targets")
    sources = [source or one.inputs[0] for one in results]
    scale, unit = units.displayed(1.0, _common_unit(results, sources, names), system)
    figure, (magnitude, phase) = style.grid_or_new(ax, 2, 1, 7.5, 6.0, share_x=True)
    for order, (one, come_from) in enumerate(zip(results, sources, strict=True)):
        for number, target in enumerate(names):
            response = one.between(come_from, target)
            look = _look(order, number, len(results), len(names))
            label = f"{spoken(come_from)} to {spoken(target)}"
            if len(results) > 1:
                label = f"{one.title}: {label}"
            with np.errstate(divide="ignore"):  # a response that is zero has no level
                level = 20.0 * np.log10(scale * np.abs(response))
            magnitude.semilogx(one.frequency_hz, level, **look)
            phase.semilogx(one.frequency_hz, unbroken(response), label=label, **look)
    title = f"Bode plot: {results[0].title.lower()}" if len(results) == 1 else ""
    style.dress(magnitude, "", _level(unit), title)
    style.dress(phase, "frequency (Hz)", "phase (deg)")
    phase.yaxis.set_major_locator(MultipleLocator(90.0))
    phase.set_ylim(-190.0, 190.0)
    hertz(phase)
    # Above the curves instead of on them, beside the title if there is one.
    side: Literal["left", "right"] = "left" if len(results) > 1 else "right"
    style.legend_above(magnitude, phase.get_lines(), side)
    return figure


def hertz(ax: Axes) -> None:
    """Frequency axis with plain numbers and no empty margin."""
    ax.margins(x=0.0)
    style.written_out(ax.xaxis)


def spoken(name: str) -> str:
    """A signal as words."""
    return name.replace("_", " ")


def unbroken(response: ComplexArray) -> Array:
    """Phase (deg) with a gap where it leaves at one edge and comes back at the other."""
    phase = np.degrees(np.angle(response))
    wraps = np.flatnonzero(np.abs(np.diff(phase)) > 270.0) + 1
    phase[wraps] = np.nan
    return phase


def _common_unit(
    results: Sequence[FrequencyResponse], sources: Sequence[str], targets: Sequence[str]
) -> str:
    """The unit of all that is drawn on one axis; refuses several."""
    by_unit: dict[str, str] = {}
    for one, source in zip(results, sources, strict=True):
        for target in targets:
            one.between(source, target)  # refuses an unknown signal by name
            by_unit.setdefault(one.unit(source, target), f"{spoken(source)} to {spoken(target)}")
    if len(by_unit) > 1:
        pairs = "; ".join(f"{pair} in {unit or 'no known unit'}" for unit, pair in by_unit.items())
        raise InputError(f"one axis cannot show several units: {pairs}", "targets")
    return next(iter(by_unit))


def _level(unit: str) -> str:
    return f"magnitude (dB re 1 {unit})" if unit else "magnitude (dB)"


def _look(order: int, number: int, results: int, targets: int) -> dict[str, Any]:
    """Colour by target; dash and width by result as well, so that grey print can be read."""
    width = style.LINE if results == 1 else WIDTHS[min(order, len(WIDTHS) - 1)]
    return style.look(order * targets + number, width)


BACKWARD = -20.0  # slowest speed drawn (rpm): enough to show that the torque changes sign
FORWARD = 250.0  # highest speed drawn (rpm), unless the rig is set to turn faster
WEIGHT = "operating_point.weight_on_bit"


@style.picture(design="The rig.")
def friction_curves(design: Design, ax: Axes | None = None, system: units.System = "si") -> Figure:
    """Draw the torque on the bit against its speed, for each weight on bit of the table.

    One curve for each row of the friction table, and for the operating weight on bit if it is not
    a row. At rest the torque takes any value on the vertical segment. A dot marks the operating
    point.
    """
    figure, ax = style.axes_or_new(ax)
    weight = design.tables.operating_point.weight_on_bit
    last = max(FORWARD, 1.2 * design.speed / units.RPM)
    scale, torque_unit = units.displayed(1.0, "N*m", system)
    for number, each in enumerate(_weights(design)):
        law = design.replace({WEIGHT: units.SI(each)}).bit_rock
        speeds, torques = _curve(law, each, last)
        look = style.look(number) | {"linestyle": "-" if each == weight else "--"}
        ax.plot(speeds, scale * torques, label=_weight(each, system), **look)
    torque, _ = design.bit_rock.torque_and_slope(weight, design.speed, math.exp)
    label = f"operating point: {_weight(weight, system)}, {design.speed / units.RPM:.4g} rpm"
    ax.plot(design.speed / units.RPM, scale * torque, "o", color=style.BLACK, zorder=5, label=label)
    style.dress(
        ax, "bit speed (rpm)", f"bit torque ({torque_unit})", "Bit torque against bit speed"
    )
    for line in (ax.axhline, ax.axvline):
        line(0.0, color=style.GREY, linewidth=0.8, zorder=1)
    ax.set_xlim(BACKWARD, last)
    style.legend(ax, loc="lower right")
    return figure


def _weight(weight: float, system: units.System) -> str:
    shown, unit = units.displayed(weight, "N", system)
    return f"{shown:.4g} {unit}"


def _weights(design: Design) -> list[float]:
    """Weights on bit (N) to draw, heaviest first, as the curves lie in the picture."""
    rows = getattr(design.tables.bit_rock, "table", None) or ()
    weights = {row.weight_on_bit for row in rows}
    return sorted(weights | {design.tables.operating_point.weight_on_bit}, reverse=True)


def _curve(law: BitRockLaw, weight: float, last: float) -> tuple[Array, Array]:
    """Speed (rpm) and torque (N m) from `BACKWARD` to `last` (rpm), through rest."""
    forward = np.linspace(0.0, last, 400)
    backward = np.linspace(-BACKWARD, 0.0, 100)
    ahead = _torques(law, weight, forward * units.RPM)
    behind = _torques(law, weight, backward * units.RPM)
    static = law.static_torque(weight)
    speed = np.concatenate([-backward, [0.0, 0.0], forward])
    torque = np.concatenate([-behind, [-static, static], ahead])
    return speed, torque


def _torques(law: BitRockLaw, weight: float, speeds: Array) -> Array:
    return np.array([law.torque_and_slope(weight, speed, math.exp)[0] for speed in speeds])
