"""Links from a page to Markdown outside `docs/` lead somewhere on a forge, and not on the site."""

import re

from sphinx.application import Sphinx
from sphinx.util.typing import ExtensionMetadata

OUTSIDE = re.compile(r"(?<!!)\[([^\]]+)\]\(\.\./[^)#]+\.md(?:#[^)]*)?\)")


def as_text(app: Sphinx, page: str, source: list[str]) -> None:
    """Leave the words of such a link."""
    source[0] = OUTSIDE.sub(r"\1", source[0])


def setup(app: Sphinx) -> ExtensionMetadata:
    """Read every page so."""
    app.connect("source-read", as_text)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
