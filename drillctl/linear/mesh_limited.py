"""Figures of a loop that the mesh decides, and what the exact string has in their place.

Elements follow a wave up to about a radian from node to node; the modes above are the mesh's own.
A figure that one of them decides is mesh-limited, unless the exact string has it too. What that
string has is taken from its lowest `ends.WAVE_MODES` modes, and again from half of them: where
the two differ, more modes keep changing it, and no number of them gives a value.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from drillctl.arrays import ComplexArray
from drillctl.design import Design
from drillctl.linear.ends import WAVE_MODES, BitSide, Ends, ends_of, marks_of
from drillctl.linear.loop_margins import Margins, margins, weight_delay_margin, whole_crossings
from drillctl.linear.slope_margin import crossings
from drillctl.rig.drillstring.frequencies import followed, natural_frequencies
from drillctl.rig.top_drive import TopDriveLaw

CONVERGED = 0.02  # relative difference of half and all modes up to which a value exists
SAME = 0.05  # relative difference to the exact string up to which a figure is not the mesh's
NEWTON = 12  # steps towards a pole of the exact string
Figures = dict[str, float | None]


def figures_of(result: Margins | None) -> dict[str, tuple[float, float | None]]:
    """Figures of the margins by name, with the frequency (Hz) that decides each."""
    if result is None:
        return {}
    return {
        "disk_gain_db": (result.gain_db, result.disk_hz),
        "disk_phase_deg": (result.phase_deg, result.disk_hz),
        "peak_sensitivity": (result.peak_sensitivity, result.peak_sensitivity_hz),
        "delay_margin": (result.delay, result.delay_hz),
    }


def mesh_limited(
    design: Design,
    figures: dict[str, tuple[float, float | None]],
    bit: BitSide,
    moving: BitSide | None,
    poles: ComplexArray,
) -> Figures:
    """Figures that the mesh decides, each with its value of the exact string or None.

    `moving`: of a weight that moves, as its own delay margin takes it.
    """
    limit = followed(design.string.parts) / (2.0 * math.pi)
    asked = {name: value for name, (value, hertz) in figures.items() if (hertz or 0.0) > limit}
    if not asked:
        return {}
    exact: Figures = {}
    if design.string.parts.modal_damping == 0.0:
        exact = _of_the_line(design, asked, bit, moving, poles)
    return {
        name: exact.get(name)
        for name, value in asked.items()
        if not _near(value, exact.get(name), SAME)
    }


def _of_the_line(
    design: Design,
    asked: Iterable[str],
    bit: BitSide,
    moving: BitSide | None,
    poles: ComplexArray,
) -> Figures:
    """The same figures of the exact string; None where they do not converge."""
    ends, drive = ends_of(design.sliding_string, "wave"), design.linear_drive
    last = float(natural_frequencies(ends.parts, "wave", WAVE_MODES)[-1])
    wanted = set(asked)
    found: list[dict[str, float]] = []
    near = np.concatenate([poles, line_poles(ends, drive, bit, poles)])
    for below in (last, 0.5 * last):
        slope = _slope(design, ends, BitSide(0.0, bit.path), below)
        values = {"slope_margin": slope}
        if slope <= bit.slope:  # a loop that is not stable has no margins
            wanted = {"slope_margin"}
        if wanted - {"slope_margin", "weight_delay_margin"}:
            made = margins(ends, drive, bit, near, below)
            values |= {name: value for name, (value, _) in figures_of(made).items()}
        if "weight_delay_margin" in wanted and moving is not None:
            values["weight_delay_margin"] = weight_delay_margin(ends, drive, moving, below)[0]
        found.append(values)
    whole, half = found
    return {
        name: value if _near(value, half.get(name), CONVERGED) else None
        for name, value in whole.items()
    }


def _slope(design: Design, ends: Ends, bit: BitSide, below: float) -> float:
    """Slope margin (N m s/rad) by the crossings below a frequency (rad/s)."""
    drive = design.linear_drive
    result = (
        crossings(ends, *drive.gains()) if design.simple_loop else whole_crossings(ends, drive, bit)
    )
    kept = result.slope[(result.omega <= below) & (result.slope >= 0.0)]
    return float(kept.min(initial=math.inf))


def line_poles(ends: Ends, drive: TopDriveLaw, bit: BitSide, poles: ComplexArray) -> ComplexArray:
    """Poles of the exact string in its loop (1/s), by Newton's method.

    It starts at the natural frequencies, at two distances from the axis, and at the poles of the
    elements.
    """
    omega = marks_of(ends.parts, "wave", WAVE_MODES)
    starts = [shift * omega for shift in (1j - 1e-5, 1j - 1e-2)]
    s: ComplexArray = np.concatenate([*starts, poles[poles.imag > 0.0]])

    def impedance(s: ComplexArray) -> ComplexArray:
        return bit.top_impedance(ends, s) + drive.impedance(s)

    with np.errstate(all="ignore"):  # a start may run away
        for _ in range(NEWTON):
            here, step = impedance(s), 1e-7 * s
            s = s - here * step / (impedance(s + step) - here)
    return np.asarray(s[np.isfinite(s) & (s.imag > 0.0) & (s.imag < 2.0 * omega[-1])])


def _near(value: float, exact: float | None, share: float) -> bool:
    return exact is not None and (
        value == exact or abs(value - exact) <= share * max(abs(value), abs(exact))
    )
