r"""A string seen from its two ends: all that loops, margins and boundaries need of it.

What a moving weight on bit does to the linear loop.

Near steady drilling the torque of the rock changes by :math:`-D\,w_b + g\,W'`, with D the falling
slope at constant weight, g = dT/dW, and W' the change of the weight. A weight that follows the bit
speed through filter, delay and hoist is

.. math:: W' = K_w \frac{e^{-s \tau}}{(1 + s \tau_s)(1 + s \tau_h)}\, w_b,

one that follows an observer has the observer's response to top speed and top torque in place of
w_b / (1 + s tau_s). A signal that is sampled counts as half a period late.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from drillctl.arrays import Array, ComplexArray
from drillctl.design import Design
from drillctl.errors import InputError, nearest
from drillctl.linear.modal import Expansion
from drillctl.linear.observer import Observer, observer_of
from drillctl.linear.transmission import Banded, FromMobility, Lines
from drillctl.rig.bit_rock.law import by_weight
from drillctl.rig.drillstring import Drillstring, Parts
from drillctl.rig.drillstring.frequencies import Model, natural_frequencies
from drillctl.rig.weight_on_bit import PATHS, FollowingSpeed, RealWeight

WAVE_MODES = 40  # modes of a continuum that are computed; there are infinitely many
BETWEEN = 24  # frequencies between two neighbouring natural frequencies


Ends = Lines | FromMobility
"""A string that gives the speeds of its ends per torque on them."""
Route = Literal["finite-elements", "wave", "matrices"]
"""How a string is computed: as its elements, as the continuum, or by solving M, C and K."""
ROUTES = ("finite-elements", "wave", "matrices")


def ends_of(string: Drillstring, model: Route = "finite-elements") -> Ends:
    """A string seen from its ends.

    Parameters
    ----------
    string : Drillstring
        The assembled string.
    model : {'finite-elements', 'wave', 'matrices'}
        Its elements, the continuum that they stand for, or the elements again by solving
        their matrices at each frequency, slowly.

    Raises
    ------
    InputError
        Unknown model, or the continuum of a string whose damping is given mode
        by mode.
    """
    if model not in ROUTES:
        raise InputError(f"no model {model!r}; {nearest(model, ROUTES)}", "model")
    if model == "matrices":
        return Banded(string)
    if string.parts.modal_damping == 0.0:
        return Lines(string.parts, model)
    if model == "wave":
        raise InputError(
            "damping given mode by mode has no continuum; use stiffness_damping or mass_damping",
            "drillstring.modal_damping",
        )
    return Expansion(string)


def model_of(ends: Ends) -> Model:
    """Whether elements or the continuum."""
    return ends.model if isinstance(ends, Lines) else "finite-elements"


def count_of(ends: Ends) -> int:
    """Modes that are computed: all of the elements', `WAVE_MODES` of the continuum."""
    if model_of(ends) == "wave":
        return WAVE_MODES
    return 1 + sum(section.elements for section in ends.parts.sections)


def telling_grid(ends: Ends) -> Array:
    """Angular frequencies (rad/s) that resolve every resonance of a string.

    They cluster at the natural frequencies with either end free or held: whatever is put at the
    ends, resonances lie between these, and where two of them are close a response turns fast.
    Below the first they go down by decades, for slow integral action.
    """
    return _grid_of(ends.parts, model_of(ends), count_of(ends))


@functools.lru_cache(maxsize=64)
def _grid_of(parts: Parts, model: Model, count: int) -> Array:
    """The same for maps of loops on one string, made once; not to be written to."""
    marks = marks_of(parts, model, count)
    apart = np.concatenate([[True], np.diff(marks) > 1e-13 * marks[1:]])
    marks = np.append(marks[apart], 3.0 * marks[-1])
    share = 0.5 * (1.0 - np.cos(np.pi * (np.arange(BETWEEN) + 0.5) / BETWEEN))
    inner = (marks[:-1, None] + np.diff(marks)[:, None] * share).ravel()
    slow = np.geomspace(1e-10 * marks[0], marks[0], 300, endpoint=False)
    grid = np.unique(np.concatenate([slow, inner]))
    grid.flags.writeable = False
    return grid


def marks_of(parts: Parts, model: Model, count: int) -> Array:
    """Natural frequencies (rad/s) but zero, each end free or held."""
    every = [
        natural_frequencies(parts, model, count, top, bit)
        for top in (False, True)
        for bit in (False, True)
    ]
    marks = np.unique(np.concatenate(every))
    return marks[marks > 0.0]


class Feedback(NamedTuple):
    """Torque on the bit per motion: T_b' = bit w_b + top w_top + torque T_top."""

    # per bit speed and top speed (N m s/rad)
    bit: Any
    top: Any
    torque: Any  # per torque of the drive


@dataclass(frozen=True, eq=False)
class WeightPath:
    """From the bit speed, or what stands for it, to the torque of the rock."""

    gain: float  # g K_w, torque per bit speed at rest of all lags (N m s/rad)
    # total delay and the time constants of sensor and hoist (s)
    delay: float
    sensor: float
    hoist: float
    observer: Observer | None  # in place of a sensor

    def feedback(self, s: ComplexArray) -> Feedback:
        """Torque per motion at complex frequencies `s` (1/s)."""
        way = self.gain * np.exp(-s * self.delay) / (1.0 + s * self.hoist)
        if self.observer is None:
            return Feedback(way / (1.0 + s * self.sensor), 0.0, 0.0)
        by_torque, by_speed = self.observer.transfer(s)
        return Feedback(0.0, way * by_speed, way * by_torque)


def weight_path(design: Design, speed: float) -> WeightPath | None:
    """The path of a design's weight law about steady drilling at a speed (rad/s).

    None for a weight that is constant, at its limit, or changed by an alarm alone, which drilling
    steadily never sets off.
    """
    law = design.weight_on_bit
    if not isinstance(law, (FollowingSpeed, RealWeight)):
        return None
    slope = float(FollowingSpeed(*law[:5]).slope(speed))
    if slope == 0.0:
        return None
    weight = float(FollowingSpeed(*law[:5]).weight(speed))
    gain = slope * float(by_weight(design.bit_rock, weight, speed, np.exp))
    if isinstance(law, FollowingSpeed):
        return WeightPath(gain, 0.0, 0.0, 0.0, None)
    delay = law.delay + 0.5 * law.period
    return WeightPath(gain, delay, law.sensor, law.hoist, observer_of(design))


@dataclass(frozen=True, eq=False)
class BitSide:
    """What closes the loop at the bit: the slope of the rock, and the weight that moves."""

    slope: float  # falling slope D of the rock at constant weight (N m s/rad)
    path: WeightPath | None = None  # of a weight that moves

    def top_impedance(self, ends: Ends, s: ComplexArray) -> ComplexArray:
        """Torque per speed at the top (N m s/rad), drive inertia included, the bit closed."""
        if self.path is None:
            return ends.top_impedance(s, -self.slope)
        felt = self.path.feedback(s)
        if self.path.observer is None:
            return ends.top_impedance(s, felt.bit - self.slope)
        seen = ends.mobility(s, bit=-self.slope + 0.0 * s)
        # w_top = top T - transfer T_b', T_b' = felt.top w_top + felt.torque T.
        return np.asarray(
            (1.0 + seen.transfer * felt.top) / (seen.top - seen.transfer * felt.torque)
        )

    def bit_impedance(self, ends: Ends, s: ComplexArray, drive: ComplexArray) -> ComplexArray:
        """Torque per speed at the bit (N m s/rad), drive and weight closed, the slope apart.

        Poles lie where it equals the slope.
        """
        return ends.bit_impedance(s, drive) + self.by_weight(ends, s, drive)

    def by_weight(self, ends: Ends, s: ComplexArray, drive: ComplexArray) -> ComplexArray:
        """The part of the moving weight in it (N m s/rad)."""
        if self.path is None:
            return np.zeros_like(s)
        felt = self.path.feedback(s)
        if self.path.observer is None:
            return np.asarray(felt.bit + 0.0 * s)
        seen = ends.mobility(s, top=drive)
        return np.asarray((felt.top - felt.torque * drive) * seen.transfer / seen.bit)


def bit_side(design: Design, slope: float, speed: float) -> BitSide:
    """What closes the loop at the bit; a weight that moves at once is in the slope."""
    moves_late = isinstance(design.weight_on_bit, PATHS)
    return BitSide(slope, weight_path(design, speed) if moves_late else None)
