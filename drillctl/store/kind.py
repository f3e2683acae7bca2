"""What the store knows of a kind of result."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from drillctl.design import Design
from drillctl.store.differences import Growing
from drillctl.store.writing import write_dataset

if TYPE_CHECKING:
    import xarray


def design_alone(result: Any) -> tuple[Design, dict[str, Any]]:
    """Of a result that follows from its design and nothing else."""
    return result.design, {}


def not_growing(design: Design) -> Growing | None:
    """Of a result that is made in one piece."""
    return None


class Kind(NamedTuple):
    """A kind of result."""

    verb: str  # command that makes it
    of: type  # class of the result
    # the result from its design, dataset and summary
    read: Callable[[Design, xarray.Dataset, dict[str, Any]], Any]
    # from a result the design that gives it again, and what was asked for beside it. Python takes
    # an engine, axes and audited cells that the design does not hold; a command that runs the
    # design itself must not take such a result for its own.
    asked: Callable[[Any], tuple[Design, dict[str, Any]]] = design_alone
    # writes the dataset of a result into a folder
    write: Callable[[Any, Path], None] = write_dataset
    # from a design the count that a finished run may be taken on to, if there is one
    growing: Callable[[Design], Growing | None] = not_growing
