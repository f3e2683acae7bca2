"""Stability, margins and critical operating points of a loop, without simulation."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from drillctl import units
from drillctl.arrays import Array, ComplexArray, finite, own_errstate
from drillctl.design import Design
from drillctl.errors import InputError
from drillctl.linear.ends import BitSide, Route, bit_side, ends_of, weight_path
from drillctl.linear.loop_margins import Margins, margins, weight_delay_margin, whole_crossings
from drillctl.linear.loop_model import model_poles, poles_of
from drillctl.linear.mesh_limited import Figures, figures_of, mesh_limited
from drillctl.linear.operating_point import OperatingPoint, at_speed, operating_point
from drillctl.linear.regenerative import CuttingLoop, cutting_loop
from drillctl.linear.slope_margin import slope_margin
from drillctl.rig.weight_on_bit import RealWeight
from drillctl.store.codec import label
from drillctl.store.result import Result

ROUNDING = 1e-11  # real part of a pole over the largest pole that is rounding
SPEEDS = np.geomspace(1e-3, 20.0, 401)
"""Speeds between which a critical one is searched, over the set speed."""
WEIGHTS = np.geomspace(1e-3, 20.0, 201)
"""Weights between which a critical one is searched, over that of the design."""


@dataclass(frozen=True, eq=False)
class LoopAnalysis(Result, kind="loop"):
    """Poles, margins and critical operating points of one design.

    Whether the equilibrium is stable is not read from the poles: of an undamped string the
    damping of the highest modes is below their rounding. The slope margin is NaN where the loop
    is not stable even without slope, infinite where it tolerates any. The critical weight lies
    within the friction table unless the design allows more.
    """

    design: Design = label(means="the rig")
    operating_point: OperatingPoint = label(means="steady drilling about which the loop is linear")
    stable: bool = label(means="whether the slope of the rock is under its margin")
    poles: ComplexArray = label("pole", unit="1/s", means="poles of the loop, rock included")
    slope_margin: float = label(unit="N*m*s/rad", means="falling slope that the loop tolerates, D*")
    deciding_frequency_hz: float = label(
        unit="Hz", means="frequency of the poles that decide it, 0 for a real pole"
    )
    continuum_slope_margin: float | None = label(
        unit="N*m*s/rad", means="D* of the exact continuum, of its lowest modes, if it has one"
    )
    margins: Margins | None = label(means="at the top torque; None if the loop is not stable")
    weight_delay_margin: float | None = label(
        unit="s",
        means="further delay of a moving weight on bit that a stable loop bears, infinite if any",
    )
    critical_speed: float | None = label(
        unit="rad/s", means="speed nearest to the set speed at which stability changes"
    )
    critical_weight_on_bit: float | None = label(
        unit="N", means="weight nearest to the operating one at which stability changes"
    )
    mesh_limited: Figures = label(
        means="figures that the mesh decides, each with its value of the exact string (SI) or None"
    )
    cutting: CuttingLoop | None = label(
        means="roots of a bit that cuts its own wake, which decide its stability; else None"
    )

    @property
    def bit_side(self) -> BitSide:
        """What closes the loop at the bit; a weight that moves at once is in the slope."""
        return bit_side(self.design, self.operating_point.slope, self.operating_point.speed)

    @property
    def spectral_abscissa(self) -> float:
        """Largest real part of the poles (1/s)."""
        return float(self.poles.real.max())

    @property
    def oscillations(self) -> list[tuple[float, float]]:
        """Frequency (Hz) and damping ratio of each pair of complex poles, lowest first."""
        upper = self.poles[self.poles.imag > 0.0]
        return [(float(abs(p)) / (2.0 * math.pi), float(-p.real / abs(p))) for p in upper]

    def summary(self) -> dict[str, Any]:
        """Strict JSON values, SI; None where something is undefined."""
        result = self.margins
        more = {} if self.cutting is None else {"cutting": self.cutting.summary()}
        return more | {
            "stable": self.stable,
            "spectral_abscissa": self.spectral_abscissa,
            "slope": self.operating_point.slope,
            "slope_margin": finite(self.slope_margin),
            "deciding_frequency_hz": finite(self.deciding_frequency_hz),
            "disk_margin": None
            if result is None
            else {"gain_db": finite(result.gain_db), "phase_deg": result.phase_deg},
            "peak_sensitivity": None if result is None else result.peak_sensitivity,
            "delay_margin": None if result is None else finite(result.delay),
            "margins": None
            if result is None
            else {name: finite(value) for name, value in asdict(result).items()},
            "continuum_slope_margin": self.continuum_slope_margin,
            "weight_delay_margin": finite(self.weight_delay_margin),
            "mesh_limited": {name: finite(x) for name, x in self.mesh_limited.items()},
            "critical_speed": self.critical_speed,
            "critical_weight_on_bit": self.critical_weight_on_bit,
            "operating_speed": self.operating_point.speed,
            "bit_torque": self.operating_point.bit_torque,
            "modes": [
                {"frequency_hz": frequency, "damping_ratio": ratio}
                for frequency, ratio in self.oscillations[:10]
            ],
        }

    def requested(self) -> tuple[Design, dict[str, Any]]:
        """The design, of which this is all but the map."""
        return self.design, {"no_map": True}


@own_errstate()
def loop(design: Design) -> LoopAnalysis:
    """Analyse the loop of a design about steady drilling.

    Parameters
    ----------
    design : Design
        Rig and control.

    Returns
    -------
    LoopAnalysis
        Of an unstable loop the margins at the top are None.

    Raises
    ------
    InputError
        There is no steady drilling: the drive cannot turn the bit.
    """
    point = operating_point(design)
    ends, bit = ends_of(design.sliding_string), bit_side(design, point.slope, point.speed)
    tolerated, omega = tolerated_slope(design, point.speed)
    at_once = not isinstance(design.weight_on_bit, RealWeight)
    poles = poles_of(design, bit)
    stable = bool(point.slope < tolerated)
    cutting = None if design.axial is None else cutting_loop(design)
    at_top = margins(ends, design.linear_drive, bit, poles) if stable else None
    moving = _moving(design, point) if stable else None
    later, later_at = (
        (None, None) if moving is None else weight_delay_margin(ends, design.linear_drive, moving)
    )
    figures = {"slope_margin": (tolerated, omega / (2.0 * math.pi)), **figures_of(at_top)}
    if later is not None and later_at is not None:
        figures["weight_delay_margin"] = (later, later_at / (2.0 * math.pi))
    return LoopAnalysis(
        design=design,
        operating_point=point,
        stable=stable and (cutting is None or cutting.unstable_roots == 0),
        cutting=cutting,
        poles=poles,
        slope_margin=tolerated,
        deciding_frequency_hz=omega / (2.0 * math.pi),
        continuum_slope_margin=_continuum(design, point.speed),
        margins=at_top,
        weight_delay_margin=later,
        mesh_limited=mesh_limited(design, figures, bit, moving, poles),
        critical_speed=critical_speed(design, tolerated) if at_once else None,
        critical_weight_on_bit=critical_weight_on_bit(design, tolerated) if at_once else None,
    )


def tolerated_slope(
    design: Design, speed: float, model: Route = "finite-elements"
) -> tuple[float, float]:
    """Slope margin of any loop about steady drilling at a speed (rad/s)."""
    ends = ends_of(design.sliding_string, model)
    if design.simple_loop:
        return slope_margin(ends, *design.linear_drive.gains())
    bit = bit_side(design, 0.0, speed)
    poles = model_poles(design, bit)
    if poles.real.max() >= ROUNDING * np.abs(poles).max():
        return math.nan, math.nan
    result = whole_crossings(ends, design.linear_drive, bit)
    over = np.flatnonzero(result.slope > 0.0)
    if len(over) == 0:
        return math.inf, math.nan
    return float(result.slope[over[0]]), float(result.omega[over[0]])


def _moving(design: Design, point: OperatingPoint) -> BitSide | None:
    """The bit with a weight that moves as a part of its own; None without one."""
    path = weight_path(design, point.speed)
    if path is None:
        return None
    held = point.slope
    if design.weight_on_bit.moves:  # its part in the slope is the path's here
        held += path.gain
    return BitSide(held, path)


def _continuum(design: Design, speed: float) -> float | None:
    if design.string.parts.modal_damping > 0.0:
        return None
    return finite(tolerated_slope(design, speed, "wave")[0])


def critical_speed(design: Design, tolerated: float | None = None) -> float | None:
    """Speed at which the slope of the rock equals the slope margin.

    Parameters
    ----------
    design : Design
        Rig and control.
    tolerated : float, optional
        Slope margin (N m s/rad) if it is known already.

    Returns
    -------
    float or None
        The one nearest to the set speed in ratio (rad/s); None if there is none from a
        thousandth to twenty times the set speed.
    """
    limit = tolerated_slope(design, design.speed)[0] if tolerated is None else tolerated
    return _nearest_zero(
        lambda speed: at_speed(design, speed).slope - limit, design.speed * SPEEDS, design.speed
    )


def critical_weight_on_bit(design: Design, tolerated: float | None = None) -> float | None:
    """Weight on bit at which the slope of the rock equals the slope margin.

    Parameters
    ----------
    design : Design
        Rig and control.
    tolerated : float, optional
        Slope margin (N m s/rad) if it is known already.

    Returns
    -------
    float or None
        The one nearest to the design's weight in ratio (N); None if there is none, or only
        outside the friction table where the design refuses that.
    """
    limit = tolerated_slope(design, design.speed)[0] if tolerated is None else tolerated
    nominal = design.tables.operating_point.weight_on_bit
    if nominal == 0.0:
        return None

    def excess(weight: float) -> float:
        try:
            there = design.replace({"operating_point.weight_on_bit": units.SI(weight)})
            return operating_point(there).slope - limit
        except InputError:  # outside the friction table, or more than the drive can turn
            return math.nan

    return _nearest_zero(excess, _weights(design, nominal), nominal)


def _weights(design: Design, nominal: float) -> Array:
    """Weights to look at (N), and the rows of the friction table, where its slope breaks."""
    rows = getattr(design.tables.bit_rock, "table", None) or ()
    return np.unique([*(nominal * WEIGHTS), *(row.weight_on_bit for row in rows)])


def _nearest_zero(function: Callable[[float], float], points: Array, about: float) -> float | None:
    """Zero of a function nearest to a value in ratio; NaN where it is not defined."""
    from scipy.optimize import brentq

    values = np.array([function(float(x)) for x in points])
    changes = np.flatnonzero(values[:-1] * values[1:] < 0.0)
    zeros = [float(brentq(function, points[i], points[i + 1], rtol=1e-13)) for i in changes]
    zeros += [float(x) for x in points[values == 0.0]]
    return min(zeros, key=lambda x: abs(math.log(x / about)), default=None)
