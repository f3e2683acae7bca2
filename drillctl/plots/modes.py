"""Shapes of the modes along the string.

Mobility at the ends of the string: how fast an end turns per torque on it.

Frequency response between any two signals, of one system or of several.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import (
    FormatStrFormatter,
    LogLocator,
    MaxNLocator,
    MultipleLocator,
    NullFormatter,
)
from numpy.typing import NDArray

from drillctl import units
from drillctl.errors import InputError
from drillctl.linear.modal import Mode, Modes
from drillctl.linear.response import FrequencyResponse
from drillctl.plots import style
from drillctl.plots.style import picture

SHOWN = 4  # modes drawn of each boundary condition: more cannot be told apart


@picture(
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
    for (support, found), (left, right) in zip(rows, (panels[:2], panels[2:]), strict=True):
        for number, mode in enumerate(found[:SHOWN]):
            _draw(left, right, mode, place, number)
        style.dress(left, "angle, largest = 1", label, f"{support}: angle")
        style.dress(right, "torque, largest = 1", "", f"{support}: torque")
        right.legend(
            fontsize=style.SMALL, frameon=False, loc="upper left", bbox_to_anchor=(1.02, 1.0)
        )
    for panel in panels:
        panel.axvline(0.0, color="#888888", linewidth=0.8, zorder=1)
        panel.set_xlim(-1.1, 1.1)
        panel.set_ylim(place[-1], place[0])
        panel.yaxis.set_major_locator(MaxNLocator(integer=True))
    return figure


def _places(result: Modes, system: units.System) -> tuple[NDArray[np.float64], str]:
    """Where the nodes are drawn, and the label of that axis."""
    if result.node_depth[-1] > 0.0:
        depth, unit = units.displayed(result.node_depth, "m", system)
        return depth, f"depth ({unit})"
    return np.arange(len(result.node_depth), dtype=float), "node, 0 = top drive"


def _draw(left: Axes, right: Axes, mode: Mode, place: NDArray[np.float64], number: int) -> None:
    colour = style.COLOURS[number]
    dashes = style.DASHES[number]
    left.plot(mode.shape, place, color=colour, linestyle=dashes, linewidth=style.LINE)
    # Torque is constant along an element: steps, and no more smoothness than there is.
    right.stairs(
        mode.torque_shape,
        place,
        orientation="horizontal",
        baseline=None,
        color=colour,
        linestyle=dashes,
        linewidth=style.LINE,
        zorder=2,
        label=_name(mode),
    )


def _name(mode: Mode) -> str:
    if mode.frequency_hz == 0.0:
        return "rigid body"
    if mode.damping_ratio is None:
        return f"{mode.frequency_hz:.4g} Hz, overdamped"
    damping = f"\ndamping {100.0 * mode.damping_ratio:.3g} %" if mode.damping_ratio else ""
    return f"{mode.frequency_hz:.4g} Hz{damping}"


PER_TORQUE = 1e3 / units.RPM  # revolutions a minute per kN m in one rad/s per N m
UNIT = "rpm/(kN m)"
ENDS = (("bit", "bit_torque", "bit_speed"), ("top", "top_torque", "top_speed"))
"""Name, input and output of each end."""


@picture(
    results="From `drillctl.linear.frequency_response`; told apart by their `title`.",
    ax="A panel for the bit, and one for the top if a result has the top torque as an input.",
    raises="Nothing to draw, a result without mobility at the bit, not as many axes as panels.",
)
def mobility(
    results: FrequencyResponse | Sequence[FrequencyResponse], ax: Sequence[Axes] | None = None
) -> Figure:
    """Draw the magnitude of the mobility at bit and top.

    In rpm per kN m, of the string alone (`plant`) or with its drive (`closed_loop`, which has no
    top torque among its inputs). High peaks at the bit are where the rock's falling slope feeds
    the string; those of an undamped string end where the nearest frequency lies.
    """
    given = listed(results)
    for one in given:
        one.between("bit_torque", "bit_speed")
    shown = [end for end in ENDS if any(_has(one, end) for one in given)]
    figure, panels = style.grid_or_new(ax, len(shown), 1, 7.5, 2.6 * len(shown) + 1.2, share_x=True)
    for panel, end in zip(panels, shown, strict=True):
        for number, one in enumerate(given):
            if _has(one, end):
                _draw_mobility(panel, one, end, number, len(given))
        title = "Mobility of the string" if panel is panels[0] else ""
        style.dress(panel, "", f"mobility at the {end[0]} ({UNIT})", title)
    panels[-1].set_xlabel("frequency (Hz)", fontsize=style.LABEL)
    for panel in panels:
        hertz(panel)
    panels[0].legend(
        fontsize=style.SMALL, frameon=False, loc="lower right", bbox_to_anchor=(1.0, 1.0),
        handlelength=3.5,
    )  # fmt: skip
    return figure


def _has(one: FrequencyResponse, end: tuple[str, str, str]) -> bool:
    return end[1] in one.inputs and end[2] in one.outputs


def _draw_mobility(
    panel: Axes, one: FrequencyResponse, end: tuple[str, str, str], number: int, count: int
) -> None:
    panel.loglog(
        one.frequency_hz,
        np.abs(one.between(*end[1:])) * PER_TORQUE,
        color=style.COLOURS[number % len(style.COLOURS)],
        linestyle=style.DASHES[number % len(style.DASHES)],
        linewidth=style.LINE if count == 1 else WIDTHS[min(number, len(WIDTHS) - 1)],
        label=one.title,
    )


TARGETS = ("top_speed", "bit_speed")  # outputs that are drawn unless others are named
WIDTHS = (2.8, 1.6, 1.1, 0.8)
"""Widths (points) of one response after another, so that equal ones show through."""


@picture(
    result="From `drillctl.linear.frequency_response`; several are told apart by their `title`.",
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
) -> Figure:
    """Draw magnitude and phase of the response of some signals to one other.

    Magnitude in dB of the unit named; phase between -180 and 180 degrees. The peaks of an undamped
    string are infinite: as drawn they end where the nearest frequency lies.
    """
    results = listed(result)
    names = TARGETS if targets is None else tuple(targets)
    if not names:
        raise InputError("needs one output or more", "targets")
    sources = [source or one.inputs[0] for one in results]
    unit = _common_unit(results, sources, names)
    figure, (magnitude, phase) = style.grid_or_new(ax, 2, 1, 7.5, 6.0, share_x=True)
    for order, (one, come_from) in enumerate(zip(results, sources, strict=True)):
        for number, target in enumerate(names):
            response = one.between(come_from, target)
            look = _look(order, number, len(results), len(names))
            label = f"{spoken(come_from)} to {spoken(target)}"
            if len(results) > 1:
                label = f"{one.title}: {label}"
            with np.errstate(divide="ignore"):  # a response that is zero has no level
                level = 20.0 * np.log10(np.abs(response))
            magnitude.semilogx(one.frequency_hz, level, **look)
            phase.semilogx(one.frequency_hz, unbroken(response), label=label, **look)
    title = f"Bode plot: {results[0].title.lower()}" if len(results) == 1 else ""
    style.dress(magnitude, "", _level(unit), title)
    style.dress(phase, "frequency (Hz)", "phase (deg)")
    phase.yaxis.set_major_locator(MultipleLocator(90.0))
    phase.set_ylim(-190.0, 190.0)
    hertz(phase)
    # Above the curves instead of on them, beside the title if there is one.
    side = 0.0 if len(results) > 1 else 1.0
    magnitude.legend(
        handles=phase.get_lines(), fontsize=style.SMALL, frameon=False,
        loc="lower right" if side else "lower left", bbox_to_anchor=(side, 1.0), handlelength=3.5,
    )  # fmt: skip
    return figure


def listed(result: Any) -> list[Any]:
    """Results as a list, whether one was given or a sequence of them."""
    results = list(result) if isinstance(result, Sequence) else [result]
    if not results:
        raise InputError("nothing to draw: give one result or more")
    return results


def hertz(ax: Axes) -> None:
    """Frequency axis with plain numbers and no empty margin."""
    ax.margins(x=0.0)
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.xaxis.set_major_formatter(FormatStrFormatter("%g"))
    ax.xaxis.set_minor_formatter(NullFormatter())


def spoken(name: str) -> str:
    """A signal as words."""
    return name.replace("_", " ")


def unbroken(response: NDArray[np.complexfloating[Any, Any]]) -> NDArray[np.float64]:
    """Phase (deg) with a gap where it leaves at one edge and comes back at the other."""
    phase = np.degrees(np.angle(response))
    wraps = np.flatnonzero(np.abs(np.diff(phase)) > 270.0) + 1
    phase[wraps] = np.nan
    return phase


def _common_unit(
    results: Sequence[FrequencyResponse], sources: Sequence[str], targets: Sequence[str]
) -> str:
    """The unit of all that is drawn on one axis; refuses several."""
    found: dict[str, str] = {}
    for one, source in zip(results, sources, strict=True):
        for target in targets:
            one.between(source, target)  # refuses an unknown signal by name
            found.setdefault(one.unit(source, target), f"{spoken(source)} to {spoken(target)}")
    if len(found) > 1:
        pairs = "; ".join(f"{pair} in {unit or 'no known unit'}" for unit, pair in found.items())
        raise InputError(f"one axis cannot show several units: {pairs}", "targets")
    return next(iter(found))


def _level(unit: str) -> str:
    return "magnitude (dB)" if unit in ("", "1") else f"magnitude (dB re 1 {_plain(unit)})"


def _plain(unit: str) -> str:
    return unit.replace("*", " ")


def _look(order: int, number: int, results: int, targets: int) -> dict[str, Any]:
    """Colour by target; dash and width by result as well, so that grey print can be read."""
    dash = style.DASHES[(order * targets + number) % len(style.DASHES)]
    width = style.LINE if results == 1 else WIDTHS[min(order, len(WIDTHS) - 1)]
    colour = style.COLOURS[(order * targets + number) % len(style.COLOURS)]
    return {"color": colour, "linestyle": dash, "linewidth": width}
