"""Links to pages outside `docs/`: for the forge; plain words in the site, which has them not."""

from pathlib import Path

from docutils import nodes
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx
from sphinx.util.typing import ExtensionMetadata


def unlink(app: Sphinx, doctree: nodes.document) -> None:
    """Leave the words of such links. A file that does not exist never comes here: it is told."""
    for link in list(doctree.findall(pending_xref)):
        if link.get("refdomain") == "doc" and Path(link["reftarget"]).is_absolute():
            link.replace_self(link.children)


def setup(app: Sphinx) -> ExtensionMetadata:
    """Listen to every page as it is read."""
    app.connect("doctree-read", unlink)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
