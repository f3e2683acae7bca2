"""Frequency responses by name, of the string alone and of its loops."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from drillctl.arrays import Array, ComplexArray
from drillctl.errors import InputError, nearest
from drillctl.linear.ends import Route, WeightPath, ends_of
from drillctl.linear.state_space import INPUTS, OUTPUTS, SIGNALS
from drillctl.linear.transmission import EndMobility
from drillctl.rig.drillstring import Drillstring
from drillctl.rig.drillstring.frequencies import natural_frequencies
from drillctl.store.codec import documented, label

if TYPE_CHECKING:
    import control
    import xarray

    from drillctl.design import Design

Loop = Literal["plant", "open_loop", "closed_loop"]

FREQUENCIES = tuple(np.geomspace(0.02, 5.0, 1200).tolist())
"""Frequencies (Hz) where none are given: from under the first mode to well above stick-slip."""

_PER_TORQUE = {
    "top_speed": "rad/s/(N*m)",
    "bit_speed": "rad/s/(N*m)",
    "pipe_torque": "1",
    "twist": "rad/(N*m)",
    "top_torque": "1",
}
_PER_SPEED = {
    "top_speed": "1",
    "bit_speed": "1",
    "pipe_torque": "N*m/(rad/s)",
    "twist": "s",
    "top_torque": "N*m/(rad/s)",
}


@dataclass(frozen=True, eq=False)
@documented
class FrequencyResponse:
    """Response of a string or a loop to each of its inputs."""

    frequency_hz: Array = label("frequencies", unit="Hz", means="frequencies")
    response: ComplexArray = label(
        "frequencies",
        "outputs",
        "inputs",
        unit="of the output per unit of the input",
        means="positive bit torque brakes",
    )
    # names of the signals: torques in N m, speeds in rad/s, twist in rad
    inputs: tuple[str, ...] = label(default=INPUTS, means="names of the signals")
    outputs: tuple[str, ...] = label(default=OUTPUTS, means="names of the signals")
    title: str = label(default="String without control", means="what it is a response of")

    def between(self, source: str, target: str) -> ComplexArray:
        """Response of one output to one input.

        Parameters
        ----------
        source : str
            Input: one of `inputs`.
        target : str
            Output: one of `outputs`.

        Returns
        -------
        ndarray of complex, shape (frequencies,)
            In the unit of the output per unit of the input.

        Raises
        ------
        InputError
            There is no such signal.
        """
        return self.response[:, _index(target, self.outputs), _index(source, self.inputs)]

    def unit(self, source: str, target: str) -> str:
        """Unit of one response; `1` where it has none."""
        per = _PER_TORQUE if source.endswith("torque") else _PER_SPEED
        return per.get(target, "")

    @property
    def data(self) -> xarray.Dataset:
        """Every response by name, `bit_speed_per_top_torque` and so on, with units."""
        import xarray

        variables = {
            f"{target}_per_{source}": (
                "frequency",
                self.between(source, target),
                {"units": self.unit(source, target)},
            )
            for source in self.inputs
            for target in self.outputs
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
    marks = np.concatenate(
        [natural_frequencies(string.parts, "finite-elements", 200, held) for held in (False, True)]
    ) / (2.0 * np.pi)
    low, high = FREQUENCIES[0], FREQUENCIES[-1]
    marks = marks[(marks > low) & (marks < high)]
    sides = np.outer(marks, 1.0 + np.array([-3e-3, -1e-3, -3e-4, 3e-4, 1e-3, 3e-3])).ravel()
    return np.unique(np.concatenate([FREQUENCIES, sides]))


def frequency_response(
    subject: Design | Drillstring,
    frequency_hz: ArrayLike = FREQUENCIES,
    loop: Loop = "plant",
    model: Route = "finite-elements",
    slope: float = 0.0,
    path: WeightPath | None = None,
) -> FrequencyResponse:
    """Response of the string, alone or with its drive, at given frequencies.

    Parameters
    ----------
    subject : Design or Drillstring
        The rig; a bare string has no loop but `plant`.
    frequency_hz : array_like, shape (frequencies,)
        Frequencies (Hz), each more than zero: the rigid body has no response at rest. On an
        undamped string the height of a peak shows only how near a frequency is to resonance.
    loop : {'plant', 'open_loop', 'closed_loop'}
        The string alone; drive and string in series, from the speed error; or closed, from the
        set speed. Signals and signs are those of `drillctl.linear.plant`, `open_loop` and
        `closed_loop`.
    model : {'finite-elements', 'wave', 'matrices'}
        Elements; the exact continuum; or the elements by solving their matrices.
    slope : float
        Falling slope of the rock (N m s/rad) closed around the bit; `bit_torque` is then what
        acts beside it.
    path : WeightPath, optional
        Of a weight on bit that follows a measured bit speed, closed with it.

    Returns
    -------
    FrequencyResponse
        No transfer function is formed.

    Raises
    ------
    InputError
        No frequency, or one that is not finite and more than zero; unknown loop or model; a path
        through an observer, which acts on the top too: see `linear.loop_model`.
    """
    frequency = frequencies_of(frequency_hz)
    if loop not in SIGNALS:
        raise InputError(f"no loop {loop!r}; {nearest(loop, SIGNALS)}", "loop")
    if not math.isfinite(slope):
        raise InputError(f"must be a number, got {slope:g}", "slope")
    string = subject if isinstance(subject, Drillstring) else subject.sliding_string
    s = 2j * math.pi * frequency
    drive = np.zeros_like(s)
    if loop != "plant":
        if isinstance(subject, Drillstring):
            raise InputError(f"a bare string has no {loop}; give a design", "loop")
        drive = drive + subject.linear_drive.impedance(s)
    closed = drive if loop == "closed_loop" else 0.0
    at_bit = -slope + 0.0 * s
    if path is not None:
        if path.observer is not None:
            raise InputError("takes a measured bit speed; see drillctl.linear.loop_model", "path")
        at_bit = at_bit + path.feedback(s).bit
    seen = ends_of(string, model).mobility(s, closed, at_bit)
    columns = _columns(seen, s)
    response = columns if loop == "plant" else _driven(columns, drive, loop)
    title = _TITLES[loop] + (" (continuum)" if model == "wave" else "")
    return FrequencyResponse(frequency, response, *SIGNALS[loop], title)


_TITLES = {
    "plant": "String without control",
    "open_loop": "Drive and string, loop open",
    "closed_loop": "String with its drive",
}


def _columns(seen: EndMobility, s: ComplexArray) -> ComplexArray:
    """Plant outputs per top torque and per braking bit torque, shape (frequencies, 4, 2)."""
    from_top = [seen.top, seen.transfer, seen.pipe_from_top, (seen.top - seen.transfer) / s]
    from_bit = [seen.transfer, seen.bit, seen.pipe_from_bit, (seen.transfer - seen.bit) / s]
    return np.stack([np.stack(from_top, -1), -np.stack(from_bit, -1)], -1)


def _driven(columns: ComplexArray, drive: ComplexArray, loop: Loop) -> ComplexArray:
    """The same per speed into the drive and per bit torque, with the torque of the drive."""
    into = columns.copy()
    into[:, :, 0] *= drive[:, None]
    torque = np.zeros((len(drive), 1, 2), dtype=complex)
    torque[:, 0, 0] = drive
    if loop == "closed_loop":
        torque[:, 0, :] -= drive[:, None] * into[:, 0, :]
    return np.concatenate([into, torque], axis=1)


def response_of(system: control.StateSpace, frequency_hz: ArrayLike) -> FrequencyResponse:
    """Response of any state-space system with named signals.

    Parameters
    ----------
    system : control.StateSpace
        Continuous; of `Design.plant()`, `Design.loop()` or made by the user.
    frequency_hz : array_like, shape (frequencies,)
        Frequencies (Hz), each more than zero.

    Raises
    ------
    InputError
        No frequency, or one that is not finite and more than zero.
    """
    frequency = frequencies_of(frequency_hz)
    response = np.asarray(system(2j * math.pi * frequency, squeeze=False)).transpose(2, 0, 1)
    inputs, outputs = tuple(system.input_labels), tuple(system.output_labels)
    return FrequencyResponse(frequency, response, inputs, outputs, str(system.name))


def frequencies_of(frequency_hz: ArrayLike) -> Array:
    """Frequencies (Hz) as an array; none, or one not finite and more than zero, is refused."""
    frequency = np.atleast_1d(np.asarray(frequency_hz, dtype=float))
    if frequency.ndim != 1 or frequency.size == 0:
        raise InputError("needs a list of one frequency or more (Hz)", "frequency_hz")
    wrong = frequency[~(np.isfinite(frequency) & (frequency > 0.0))]
    if wrong.size:
        raise InputError(
            f"frequencies must be finite and more than 0 Hz, got {wrong[0]:g}", "frequency_hz"
        )
    return frequency


def _index(name: str, names: tuple[str, ...]) -> int:
    if name not in names:
        raise InputError(f"no signal {name!r}; {nearest(name, names)}")
    return names.index(name)
