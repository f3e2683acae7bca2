"""A string seen from its two ends: all that loops, margins and boundaries need of it."""

from __future__ import annotations

import functools
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from drillctl.drillstring import Drillstring, Parts
from drillctl.errors import InputError, nearest
from drillctl.linear.banded import Banded
from drillctl.linear.counting import natural_frequencies
from drillctl.linear.expansion import Expansion
from drillctl.linear.transmission import EndMobility, Lines, Model

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complexfloating[Any, Any]]

WAVE_MODES = 40
"""Modes of a continuum that are looked at; it has no end of them."""
BETWEEN = 24
"""Frequencies between two neighbouring natural frequencies."""


class Ends(Protocol):
    """A string that tells the speeds of its ends per torque on them."""

    @property
    def parts(self) -> Parts:
        """Sections and ends."""
        ...

    def mobility(
        self, s: ComplexArray, top: ComplexArray | complex = 0.0, bit: ComplexArray | complex = 0.0
    ) -> EndMobility:
        """Response at complex frequencies `s` (1/s) with impedances added at the ends."""
        ...

    def bit_impedance(self, s: ComplexArray, top: ComplexArray | complex = 0.0) -> ComplexArray:
        """Torque per speed at the bit (N m s/rad), with `top` added at the drive."""
        ...

    def top_impedance(self, s: ComplexArray, bit: ComplexArray | complex = 0.0) -> ComplexArray:
        """Torque per speed at the top (N m s/rad), with `bit` added at the rock."""
        ...


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
        Unknown model, or the continuum was asked for of a string whose damping is given mode
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
    """Modes that are looked at: all of the elements', `WAVE_MODES` of the continuum."""
    if model_of(ends) == "wave":
        return WAVE_MODES
    return 1 + sum(section.elements for section in ends.parts.sections)


def telling_grid(ends: Ends) -> Array:
    """Angular frequencies (rad/s) at which nothing that a string does goes unseen.

    They cluster at the natural frequencies with either end free or held: whatever is put at the
    ends, resonances lie between these, and where two of them are close a response turns fast.
    Below the first they go down by decades, for slow integral action.
    """
    return _grid_of(ends.parts, model_of(ends), count_of(ends))


@functools.lru_cache(maxsize=64)
def _grid_of(parts: Parts, model: Model, count: int) -> Array:
    """The same for maps of loops on one string, made once; not to be written to."""
    marks = np.unique(
        np.concatenate(
            [
                natural_frequencies(parts, model, count, top, bit)
                for top in (False, True)
                for bit in (False, True)
            ]
        )
    )
    marks = marks[marks > 0.0]
    apart = np.concatenate([[True], np.diff(marks) > 1e-13 * marks[1:]])
    marks = np.append(marks[apart], 3.0 * marks[-1])
    share = 0.5 * (1.0 - np.cos(np.pi * (np.arange(BETWEEN) + 0.5) / BETWEEN))
    inner = (marks[:-1, None] + np.diff(marks)[:, None] * share).ravel()
    slow = np.geomspace(1e-10 * marks[0], marks[0], 300, endpoint=False)
    grid = np.unique(np.concatenate([slow, inner]))
    grid.flags.writeable = False
    return grid
