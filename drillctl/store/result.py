"""Base class of results: labelled data, saved to a folder; see `codec`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from drillctl.design import Design
from drillctl.store.codec import dataset, documented, read, write
from drillctl.store.folder import Growing, claim, finished_run, resolved

if TYPE_CHECKING:
    import xarray


class Result:
    """Base class of results: frozen dataclasses with a design and labelled arrays."""

    kind: ClassVar[str]  # name of the study that computes it, which is its command

    def __init_subclass__(cls, kind: str = "", **options: Any) -> None:
        """Document its fields; `kind` names its study."""
        super().__init_subclass__(**options)
        if kind:
            cls.kind = kind
        documented(cls)

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
