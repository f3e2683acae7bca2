"""The command line: one function a verb, no numerics.

`app.py` holds the program and its exit codes, `options.py` what verbs have in common, `running.py`
a run in its folder; the verbs are in files by subject. Every verb takes a design by path or
shipped name. Exit codes: 0 done, 2 the input is wrong, 130 interrupted, 1 anything else.
"""

from collections.abc import Callable

from drillctl.cli import (
    advantage,
    comparisons,
    files,
    linear,
    maps,
    reports,
    tuning,
    uncertain,
)
from drillctl.cli.app import app, run
from drillctl.cli.verb import command
from drillctl.studies.base import studies

VERBS: dict[str, Callable[..., None]] = {
    "models": files.models,
    "designs": files.designs,
    "new": files.new,
    "show": files.show,
    "validate": files.validate,
    "modes": linear.modes,
    "loop": linear.loop,
    "cycle": linear.cycle,
    "map": maps.stability_map,
    "compare": comparisons.compare,
    "delay": comparisons.delay,
    "advantage": advantage.advantage,
    "uncertainty": uncertain.uncertainty,
    "tune": tuning.tune,
    "report": reports.report,
}
"""Every verb, in the order of the help."""

for name, verb in VERBS.items():
    app.command(name=name)(verb)
for name, study in studies().items():
    if study.command:
        app.command(name=name)(command(study))

__all__ = ["VERBS", "app", "run"]
