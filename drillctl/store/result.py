"""Base class of results: labelled data, saved to a folder; see `codec`."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, ParamSpec, TypeVar

from drillctl import units
from drillctl.arrays import own_errstate
from drillctl.design import Design
from drillctl.provenance import provenance
from drillctl.store import showing
from drillctl.store.codec import dataset, documented, label, read, write
from drillctl.store.folder import Growing, claim, finished_run, resolved

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.figure import Figure


class Result:
    """Base class of results: frozen dataclasses with a design and labelled arrays."""

    kind: ClassVar[str]  # name of the study that computes it, which is its command

    def __init_subclass__(cls, kind: str = "", **options: Any) -> None:
        """Document its fields; `kind` names its study."""
        super().__init_subclass__(**options)
        if kind:
            cls.kind = kind
        documented(cls)
        cls.__repr__ = Result.__repr__  # type: ignore[method-assign]  # in place of a dataclass's

    def __repr__(self) -> str:
        """The first table of its study, in at most ten lines."""
        return showing.in_lines(self)

    def _repr_html_(self) -> str:
        """The same with a small picture, for a notebook."""
        return showing.in_html(self)

    def plot(self, name: str | None = None, system: units.System | None = None) -> Figure:
        """A figure of its study, as the command writes it.

        Parameters
        ----------
        name : str, optional
            Of the file that the command writes, without `.png`; the first by default.
        system : {'si', 'field'}, optional
            Units, by default those of the design.

        Returns
        -------
        matplotlib.figure.Figure
            Made without pyplot; a notebook shows it at the end of a cell.

        Raises
        ------
        InputError
            No picture of that name, or none at all.
        """
        return showing.figure_of(self, name, system)

    def to_dataframe(self, *dims: str) -> pandas.DataFrame:
        """Arrays that share their dimensions, as the columns of a table.

        Parameters
        ----------
        *dims : str
            Dimensions in their order; by default those that most arrays have.

        Returns
        -------
        pandas.DataFrame
            With the coordinates as index, SI; `attrs["units"]` has the units by column.

        Raises
        ------
        InputError
            No array over these dimensions, or none at all.
        """
        return showing.frame_of(self, dims)

    if TYPE_CHECKING:

        @property
        def design(self) -> Design:
            """What was studied."""
            ...

        def summary(self) -> dict[str, Any]:
            """Strict JSON values, SI."""
            ...

    @property
    def data(self) -> xarray.Dataset:
        """Labelled arrays with units; provenance as attributes."""
        return dataset(self)

    def derived(self) -> dict[str, Any]:
        """Further variables of `data`, computed from the fields and not read back."""
        return {}

    def requested(self) -> tuple[Design, dict[str, Any]]:
        """The design and the further settings that reproduce this result."""
        return self.design, {}

    def growing(self) -> Growing | None:
        """The count of draws to which a run may be extended; None for a fixed run."""
        return None

    def write(self, folder: Path) -> None:
        """Write arrays and numbers into the folder of a run."""
        design, _ = self.requested()
        # As it is read back it gives the same numbers again.
        write(self if design is self.design else replace(self, design=design), folder)  # type: ignore[type-var]

    def save(self, folder: str | Path) -> Path:
        """Write design, data and summary into a folder.

        Parameters
        ----------
        folder : str or Path
            New, empty, or holding the same run.

        Returns
        -------
        Path
            The folder.

        Raises
        ------
        InputError
            The folder holds other files, or cannot be written.
        """
        design, settings = self.requested()
        with claim(self.kind, design, folder, self.growing(), **settings) as run:
            run.conclude(self, self.summary())
            return run.path


@dataclass(frozen=True, eq=False, kw_only=True)
class Timed(Result):
    """Base class of results that record how long they took, made by functions that are `timed`."""

    total_seconds: float = label(unit="s", means="from call to return", default=math.nan)
    provenance: dict[str, str] = label(
        means="versions and processor it came from", default_factory=provenance
    )


Asked = ParamSpec("Asked")
Made = TypeVar("Made", bound=Timed)


def timed(study: Callable[Asked, Made]) -> Callable[Asked, Made]:
    """A function of a study whose result records how long it took; numpy warns our way."""

    @wraps(study)
    def computed(*given: Asked.args, **named: Asked.kwargs) -> Made:
        begin = time.perf_counter()
        with own_errstate():
            result = study(*given, **named)
        return replace(result, total_seconds=time.perf_counter() - begin)

    return computed


def open(folder: str | Path) -> Any:
    """Read a saved result back.

    Parameters
    ----------
    folder : str or Path
        As written by `save` or by a command.

    Returns
    -------
    Result
        Equal to what was saved, to the bit.

    Raises
    ------
    InputError
        Not a run, an unfinished one, or one in the format of another version.
    StoreError
        A file is missing or damaged.
    """
    return read(finished_run(resolved(folder, "")))
