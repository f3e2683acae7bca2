"""The directive `verbs`: every command with its help, read from the program itself."""

from typing import Any

import typer
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective
from sphinx.util.typing import ExtensionMetadata

from drillctl.cli import app


class Verbs(SphinxDirective):
    """A section a command: what it says to `--help`."""

    def run(self) -> list[nodes.Node]:
        """Sections in the order of the program's own help."""
        program = typer.main.get_command(app)
        return [self._section(verb, program.commands[verb]) for verb in program.commands]

    def _section(self, verb: str, command: Any) -> nodes.section:
        section = nodes.section(ids=[nodes.make_id(verb)], names=[verb])
        section += nodes.title(verb, f"drillctl {verb}")
        context = command.context_class(
            command, info_name=f"drillctl {verb}", terminal_width=88, max_content_width=88
        )
        section += nodes.literal_block("", command.get_help(context), language="text")
        return section


def setup(app: Sphinx) -> ExtensionMetadata:
    """Make the directive known."""
    app.add_directive("verbs", Verbs)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
