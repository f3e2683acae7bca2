"""Frequency response of a string, solved frequency by frequency."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy.linalg
from numpy.typing import ArrayLike, NDArray

from drillctl.drillstring import Drillstring
from drillctl.errors import InputError, nearest
from drillctl.linear.state_space import INPUTS, OUTPUTS

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

FREQUENCIES = tuple(np.geomspace(0.02, 5.0, 1200).tolist())
"""Frequencies (Hz) where none are given: from under the first mode to well above stick-slip."""

UNITS = {
    "top_speed": "rad/s/(N*m)",
    "bit_speed": "rad/s/(N*m)",
    "pipe_torque": "1",
    "twist": "rad/(N*m)",
}
"""Unit of the response of each output to a torque."""


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """Response of the string to torques at its two ends.

    Attributes
    ----------
    frequency_hz : ndarray, shape (frequencies,)
        Frequencies (Hz).
    response : ndarray of complex, shape (frequencies, outputs, inputs)
        Outputs `top_speed`, `bit_speed` (rad/s per N m), `pipe_torque` (1) and `twist` (rad
        per N m); inputs `top_torque` and `bit_torque`, of which the latter brakes.
    """

    frequency_hz: Array
    response: ComplexArray

    def between(self, source: str, target: str) -> ComplexArray:
        """Response of one output to one input.

        Parameters
        ----------
        source : {'top_torque', 'bit_torque'}
            Input.
        target : {'top_speed', 'bit_speed', 'pipe_torque', 'twist'}
            Output.

        Returns
        -------
        ndarray of complex, shape (frequencies,)
            In the unit of the output per N m.

        Raises
        ------
        InputError
            There is no such signal.
        """
        return self.response[:, _index(target, OUTPUTS), _index(source, INPUTS)]

    @property
    def data(self) -> xarray.Dataset:
        """Every response by name, `bit_speed_per_top_torque` and so on, with units."""
        import xarray

        variables = {
            f"{target}_per_{source}": (
                "frequency",
                self.between(source, target),
                {"units": UNITS[target]},
            )
            for source in INPUTS
            for target in OUTPUTS
        }
        coords = {"frequency": ("frequency", self.frequency_hz, {"units": "Hz"})}
        return xarray.Dataset(variables, coords)


def telling_frequencies(string: Drillstring) -> Array:
    """`FREQUENCIES`, and more of them at both sides of each peak and each gap between peaks.

    On a grid alone the height of a narrow peak is chance and a narrow gap is stepped over.

    Parameters
    ----------
    string : Drillstring
        Its undamped modes, with the top free (peaks) and held (gaps at the top), are marked.

    Returns
    -------
    ndarray
        Frequencies (Hz), increasing.
    """
    free, _ = string.undamped_modes
    inner = slice(1, None)
    stiffness, mass = (m.toarray()[inner, inner] for m in (string.stiffness, string.mass))
    held = np.sqrt(np.maximum(scipy.linalg.eigvalsh(stiffness, mass), 0.0))
    marks = np.concatenate([free[1:], held]) / (2.0 * np.pi)
    low, high = FREQUENCIES[0], FREQUENCIES[-1]
    marks = marks[(marks > low) & (marks < high)]
    sides = np.outer(marks, 1.0 + np.array([-3e-3, -1e-3, -3e-4, 3e-4, 1e-3, 3e-3])).ravel()
    return np.unique(np.concatenate([FREQUENCIES, sides]))


def frequency_response(
    string: Drillstring, frequency_hz: ArrayLike = FREQUENCIES
) -> FrequencyResponse:
    """Solve (-w^2 M + i w C + K) u = F for a unit torque at each end.

    Parameters
    ----------
    string : Drillstring
        The assembled string, without control.
    frequency_hz : array_like, shape (frequencies,)
        Frequencies (Hz), each more than zero: the rigid body has no response at rest. On an
        undamped string the height of a peak tells only how near a frequency is to resonance.

    Returns
    -------
    FrequencyResponse
        Same signals and signs as `drillctl.linear.plant`.

    Raises
    ------
    InputError
        No frequency, or one that is not finite and more than zero.
    """
    frequency = np.atleast_1d(np.asarray(frequency_hz, dtype=float))
    _refuse_frequencies(frequency)
    omega = 2.0 * math.pi * frequency
    angle = _angles(string, omega)
    speed = 1j * omega[:, None, None] * angle
    first = string.element_stiffness[0] + 1j * omega[:, None] * string.element_damping[0]
    response = np.stack(
        [
            speed[:, 0],
            speed[:, -1],
            first * (angle[:, 0] - angle[:, 1]),
            angle[:, 0] - angle[:, -1],
        ],
        axis=1,
    )
    return FrequencyResponse(frequency, response)


def _refuse_frequencies(frequency: Array) -> None:
    if frequency.ndim != 1 or frequency.size == 0:
        raise InputError("needs a list of one frequency or more (Hz)", "frequency_hz")
    wrong = frequency[~(np.isfinite(frequency) & (frequency > 0.0))]
    if wrong.size:
        raise InputError(
            f"frequencies must be finite and more than 0 Hz, got {wrong[0]:g}", "frequency_hz"
        )


def _angles(string: Drillstring, omega: Array) -> ComplexArray:
    """Angles (rad per N m) of all nodes, shape (frequencies, nodes, inputs)."""
    forces = np.zeros((string.nodes, len(INPUTS)))
    forces[0, 0] = 1.0
    forces[-1, 1] = -1.0
    if _tridiagonal(string.damping.toarray()):
        m, c, k = (_bands(x.toarray()) for x in (string.mass, string.damping, string.stiffness))
        return np.array(
            [scipy.linalg.solve_banded((1, 1), k + w * (1j * c - w * m), forces) for w in omega]
        )
    m, c, k = (x.toarray() for x in (string.mass, string.damping, string.stiffness))
    return np.array([np.linalg.solve(k + w * (1j * c - w * m), forces) for w in omega])


def _tridiagonal(matrix: Array) -> bool:
    """Whether only neighbours are coupled; damping given mode by mode couples all nodes."""
    return not np.triu(matrix, 2).any()


def _bands(matrix: Array) -> Array:
    """A tridiagonal matrix in the storage of `scipy.linalg.solve_banded`."""
    bands = np.zeros((3, len(matrix)))
    bands[0, 1:] = np.diagonal(matrix, 1)
    bands[1] = np.diagonal(matrix)
    bands[2, :-1] = np.diagonal(matrix, -1)
    return bands


def _index(name: str, names: tuple[str, ...]) -> int:
    if name not in names:
        raise InputError(f"no signal {name!r}; {nearest(name, names)}")
    return names.index(name)
