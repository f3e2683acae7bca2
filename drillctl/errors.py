"""Exceptions. Each derives from the builtin that a caller would expect.

- `InputError`: something the user wrote cannot be used; exit code 2.
- `SimulationError`: a computation could not be carried out; exit code 1.
- `StoreError`: results could not be written or read; exit code 1.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping


class DrillctlError(Exception):
    """Base of every error this package raises on purpose."""


class InputError(DrillctlError, ValueError):
    """A design, a path or an option that cannot be used.

    Parameters
    ----------
    problem : str
        What came, and what is allowed.
    where : str, optional
        File, key or option the problem stands in, e.g. `rig.toml: bha.inertia`.
    """

    def __init__(self, problem: str, where: str = "") -> None:
        self.problem = problem
        self.where = where
        super().__init__(f"{where}: {problem}" if where else problem)

    def within(self, place: str) -> InputError:
        """The same error, told with the file or key around it."""
        return InputError(self.problem, f"{place}: {self.where}" if self.where else place)


class SimulationError(DrillctlError, RuntimeError):
    """A solver could not finish what was asked of it."""


class StoreError(DrillctlError, OSError):
    """A disk that takes no more, or a folder that cannot be read or written."""


def shown(value: object) -> str:
    """Return what the user wrote, as short text on one line for a message.

    Parameters
    ----------
    value : object
        Anything a TOML file can hold.
    """
    if isinstance(value, Mapping):
        return "a table"
    if isinstance(value, (list, tuple)):
        return "a list"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int) and abs(value) >= 10**18:
        return "an enormous number"
    text = f"{float(value)!r}" if isinstance(value, float) else repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def nearest(name: str, valid: Iterable[str]) -> str:
    """Return a hint that names the valid word closest to `name`, then all of them.

    Parameters
    ----------
    name : str
        The word that was not understood.
    valid : iterable of str
        The words that would have been.

    Returns
    -------
    str
        For instance `did you mean 'inertia'? allowed: damping, inertia`.
    """
    words = sorted(valid)
    # A slip of the pen; else a word with an ending too many; else one of like letters.
    close = difflib.get_close_matches(name, words, n=1, cutoff=0.85)
    close = close or [w for w in words if w and name.startswith(w)]
    close = close or difflib.get_close_matches(name, words, n=1, cutoff=0.5)
    hint = f"did you mean '{close[0]}'? " if close else ""
    return f"{hint}allowed: {', '.join(words) or 'none'}"
