"""The Python surface on one page: each object once, where a user would import it from."""

from typing import Any, NamedTuple

from sphinx.application import Sphinx
from sphinx.util.typing import ExtensionMetadata

import drillctl


class _Law(NamedTuple):
    number: float


FIELD = type(_Law.__dict__["number"])


def leave_out(
    app: Sphinx, what: str, name: str, thing: Any, skip: bool, options: Any
) -> bool | None:
    """Skip in a package what the front door shows; numbers of a law, which its class explains."""
    if what != "module":
        return True if isinstance(thing, FIELD) else None
    here = app.env.current_document.autodoc_module
    at_the_door = here != "drillctl" and name in drillctl.__all__
    return True if at_the_door and getattr(drillctl, name) is thing else None


def without_map(
    app: Sphinx, what: str, name: str, thing: Any, options: Any, lines: list[str]
) -> None:
    """Leave out the map of files that a package begins with: it is for those who work in it."""
    if what == "module":
        lines.clear()


def setup(app: Sphinx) -> ExtensionMetadata:
    """Listen to what autodoc finds."""
    app.connect("autodoc-skip-member", leave_out)
    app.connect("autodoc-process-docstring", without_map)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
