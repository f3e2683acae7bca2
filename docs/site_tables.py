"""Cells that hold a number, with its unit: browsers would break 1e-05 after its sign."""

import re

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.typing import ExtensionMetadata

NUMBER = re.compile(r"[-+]?\d[\d.,]*(e[-+]?\d+)?( ?\S{1,6})?")


def mark(app: Sphinx, doctree: nodes.document) -> None:
    """Give such cells the class `number`, which the style sheet keeps in one line."""
    for cell in doctree.findall(nodes.entry):
        if NUMBER.fullmatch(cell.astext().strip()):
            cell["classes"].append("number")


def setup(app: Sphinx) -> ExtensionMetadata:
    """Listen to every page as it is read."""
    app.connect("doctree-read", mark)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
