"""Base class of results: labelled data, saved to a folder.

A result is a frozen dataclass. Its arrays are labelled where they are declared:

    axes: tuple[Axis, ...]
    j1: Array = label("axes", unit="s", means="J1; NaN where the run failed")

From the labels follow the dataset (`data`) and the files of the result; see `codec`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from drillctl.design import Design

if TYPE_CHECKING:
    import xarray

    from drillctl.store.folder import Growing


@dataclass(frozen=True)
class Label:
    """Dimensions, unit and meaning of an array or of a dictionary of arrays."""

    # "axes" means the paths of the axes of the object; {name} an attribute of the object
    dims: tuple[str, ...] = ()
    unit: str | Callable[[str], str] = "1"  # SI; for a dictionary a function of the key
    means: str | Callable[[str], str] = ""
    name: str = ""  # of the variable; default: that of the field
    flat: bool = False  # whether names inside omit the name of this field
    over: str = ""  # dimension along which arrays of a tuple of objects are stacked
    flags: tuple[str, ...] = ()  # meanings of the integers 0, 1, ...


def label(
    *dims: str,
    unit: str | Callable[[str], str] = "1",
    means: str | Callable[[str], str] = "",
    name: str = "",
    flat: bool = False,
    over: str = "",
    flags: tuple[str, ...] = (),
    **options: Any,
) -> Any:
    """Declare a field of a result with its label; other options are those of a dataclass field."""
    return field(metadata={"label": Label(dims, unit, means, name, flat, over, flags)}, **options)


class Result:
    """Base class of results: frozen dataclasses with a design and labelled arrays."""

    kind: ClassVar[str]
    """Name of the study that computes it, which is its command."""

    def __init_subclass__(cls) -> None:
        """Document the fields of a result from their labels, for `help` and the reference."""
        super().__init_subclass__()
        if cls.__doc__ and "Attributes\n" not in cls.__doc__:
            cls.__doc__ = f"{cls.__doc__.rstrip()}\n\n{_attributes(cls)}"

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
        from drillctl.store.codec import dataset

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
        from drillctl.store.codec import write

        write(self, folder)

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
        from drillctl.store.saving import save

        return save(self, folder)


def _attributes(cls: type) -> str:
    """The numpydoc section of a class whose fields are labelled."""
    lines = ["    Attributes", "    ----------"]
    for name, kind in cls.__annotations__.items():
        if kind.startswith("ClassVar"):
            continue
        one = getattr(vars(cls).get(name), "metadata", {}).get("label")
        lines.append(f"    {name} : {kind}")
        if one is not None:
            lines.append(f"        {_described(one)}")
    return "\n".join(lines) + "\n    "


def _described(one: Label) -> str:
    parts = [one.means if isinstance(one.means, str) else ""]
    parts += [f"shape ({', '.join(one.dims)})"] if one.dims else []
    parts += [f"in {one.unit}"] if isinstance(one.unit, str) and one.unit != "1" else []
    return "; ".join(part for part in parts if part) or "See the class."
