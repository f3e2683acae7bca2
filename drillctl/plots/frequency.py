"""Frequency response between any two signals, of one system or of several."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FormatStrFormatter, LogLocator, MultipleLocator, NullFormatter
from numpy.typing import NDArray

from drillctl.errors import InputError
from drillctl.linear.response import FrequencyResponse
from drillctl.plots import style

TARGETS = ("top_speed", "bit_speed")
"""Outputs that are drawn unless others are named."""
WIDTHS = (2.8, 1.6, 1.1, 0.8)
"""Widths (points) of one response after another, so that equal ones show through."""


def bode(
    result: FrequencyResponse | Sequence[FrequencyResponse],
    ax: Sequence[Axes] | None = None,
    source: str | None = None,
    targets: Sequence[str] | None = None,
) -> Figure:
    """Draw magnitude and phase of the response of some signals to one other.

    Parameters
    ----------
    result : FrequencyResponse or sequence of FrequencyResponse
        From `drillctl.linear.frequency_response`: one, or several to be compared, such as
        finite elements and continuum. Those compared are told apart by their `title`.
    ax : sequence of Axes, optional
        Two panels: magnitude and phase.
    source : str, optional
        Input; by default the first input of each result.
    targets : sequence of str, optional
        Outputs; by default top and bit speed.

    Returns
    -------
    Figure
        Magnitude in dB of the unit named; phase between -180 and 180 degrees. The peaks of
        an undamped string are infinite: as drawn they end where the nearest frequency lies.

    Raises
    ------
    InputError
        No such signal, nothing to draw, or responses of different units.
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
    title = results[0].title if len(results) == 1 else ""
    style.dress(magnitude, "", _level(unit), title)
    style.dress(phase, "frequency (Hz)", "phase (deg)")
    phase.yaxis.set_major_locator(MultipleLocator(90.0))
    phase.set_ylim(-190.0, 190.0)
    hertz(phase)
    if len(results) == 1:
        magnitude.legend(
            handles=phase.get_lines(), fontsize=style.SMALL, frameon=False, loc="upper right"
        )
    else:  # long names, above the curves instead of on them
        magnitude.legend(
            handles=phase.get_lines(), fontsize=style.SMALL, frameon=False, loc="lower left",
            bbox_to_anchor=(0.0, 1.0), handlelength=3.5,
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
