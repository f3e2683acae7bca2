"""The command line: one generic command for studies, functions for the rest; no numerics.

`app.py` holds the program and its exit codes, `options.py` the shared options, `verb.py` the
command of a study. Every command takes a design by path or shipped name. Exit codes: 0 done,
2 invalid input, 130 interrupted, 1 anything else.
"""

from collections.abc import Callable

from drillctl.cli import files
from drillctl.cli.app import app, run
from drillctl.cli.verb import command, log
from drillctl.studies.base import Group, studies

VERBS: dict[str, tuple[Callable[..., None], Group]] = {
    "models": (files.models, "Describe a rig"),
    "designs": (files.designs, "Describe a rig"),
    "catalog": (files.catalog, "Describe a rig"),
    "new": (files.new, "Describe a rig"),
    "show": (files.show, "Describe a rig"),
    "validate": (files.validate, "Describe a rig"),
    "log": (log, "Describe a rig"),
    "explore": (files.explore, "Decide"),
    "report": (files.report, "Hand over"),
}
"""Commands that are not studies, with their groups in the help."""

for name, (function, group) in VERBS.items():
    app.command(name=name, rich_help_panel=group)(function)
for name, study in studies().items():
    if study.command:
        app.command(name=name, rich_help_panel=study.group)(command(study))

__all__ = ["VERBS", "app", "run"]
