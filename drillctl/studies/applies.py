"""Why a study does not apply to a design; empty where it does."""

from __future__ import annotations

from drillctl.studies.base import Requested


def fitting_map(request: Requested) -> str:
    """Why the default map does not fit a design that names no axes of its own."""
    from drillctl.ensemble.grid import axes_of
    from drillctl.errors import InputError

    try:
        axes_of(request.design, request.design.tables.map.axes)
    except InputError as error:
        return f"its map does not fit this design ({error.problem}); name other axes in [map]"
    return ""


def over_two_axes(request: Requested) -> str:
    """Why no map over two parameters applies."""
    reason = fitting_map(request)
    count = len(request.design.tables.map.axes)
    if not reason and count != 2:
        return f"it is shown over two parameters, the map of this design has {count}"
    return reason


def in_batch(request: Requested) -> str:
    """Why the batch engine does not apply."""
    if request.design.tables.bit_rock.law == "printed-three-branch":
        return "the batch engine does not take the friction law printed-three-branch"
    return ""
