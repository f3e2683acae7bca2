"""What studies have in common: why one does not apply, empty where it does; the check of audits."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from drillctl.studies.base import Check, Requested


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


def audited(audit: Any, what: str, cells: str) -> Iterator[Check]:
    """Whether the reference solver agrees, if anything was audited."""
    from drillctl.store.tables import number

    if len(audit.cells):
        detail = f"{len(audit.cells)} {cells}, worst relative difference in J1 "
        question = f"Does the reference solver agree with {what}?"
        yield Check(question, audit.verdict == "ok", detail + number(audit.worst, 2))
