"""Exceptions. Each derives from the builtin that a caller would expect.

- `InputError`: invalid input; exit code 2.
- `SimulationError`: a computation failed; exit code 1.
- `StoreError`: results could not be written or read; exit code 1.
"""

from __future__ import annotations

import datetime
import difflib
from collections.abc import Iterable, Mapping, Sequence

from drillctl.text import LONGEST_ERROR, LONGEST_PLACE, one_line, shortened

MOST_ERRORS = 10  # of a design that are told at once


class DrillctlError(Exception):
    """Base of all errors that this package raises."""


class InputError(DrillctlError, ValueError):
    """An invalid design, path or option: one line of 500 characters at most.

    Parameters
    ----------
    problem : str
        The given value, and what is allowed.
    where : str, optional
        File, key or option with the problem, e.g. `rig.toml: bha.inertia`.
    """

    def __init__(self, problem: str, where: str = "") -> None:
        self.where = shortened(one_line(where), LONGEST_PLACE)
        self.problem = shortened(one_line(problem), LONGEST_ERROR - len(self.where) - 2)
        super().__init__(f"{self.where}: {self.problem}" if where else self.problem)

    def within(self, place: str) -> InputError:
        """The same error with the file or key that contains it."""
        return InputError(self.problem, f"{place}: {self.where}" if self.where else place)


class MultipleInputError(InputError):
    """Several at once, a line each, up to ten; `problem` and `where` are those of the first.

    Parameters
    ----------
    errors : sequence of InputError
        Two or more.
    """

    def __init__(self, errors: Sequence[InputError]) -> None:
        super().__init__(errors[0].problem, errors[0].where)
        self.errors = tuple(errors)
        more = len(errors) - MOST_ERRORS
        lines = [str(error) for error in errors[:MOST_ERRORS]]
        self.args = ("\n".join([*lines, *([f"and {more} more"] if more > 0 else [])]),)

    def within(self, place: str) -> InputError:
        """The same errors with the file or key that contains them."""
        return MultipleInputError([error.within(place) for error in self.errors])


class SimulationError(DrillctlError, RuntimeError):
    """A solver failed."""


class StoreError(DrillctlError, OSError):
    """A full disk, or a folder that cannot be read or written."""


def shown(value: object) -> str:
    """Return a value from the user as short text on one line, as TOML writes it, for a message.

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
    if isinstance(value, (datetime.date, datetime.time)):
        return value.isoformat()
    if isinstance(value, int) and abs(value) >= 10**18:
        return "a number of more than 18 digits"
    text = f"{float(value)!r}" if isinstance(value, float) else repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def nearest(name: str, valid: Iterable[str]) -> str:
    """Return a hint with the valid word closest to `name`, then all valid words.

    Parameters
    ----------
    name : str
        The invalid word.
    valid : iterable of str
        The valid words.

    Returns
    -------
    str
        For example `did you mean 'inertia'? allowed: damping, inertia`.
    """
    words = sorted(valid)
    # A typing error; else a valid word with an extra ending; else a word of similar letters.
    close = difflib.get_close_matches(name, words, n=1, cutoff=0.85)
    close = close or [w for w in words if w and name.startswith(w)]
    close = close or difflib.get_close_matches(name, words, n=1, cutoff=0.5)
    hint = f"did you mean '{close[0]}'? " if close else ""
    return f"{hint}allowed: {', '.join(words) or 'none'}"
