"""What can be chosen by name: laws and studies. One line adds one.

Modules stand here as text, so that nothing is imported before it is needed, and so that what lies
low in the house can reach what it does not know.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable, Iterable
from importlib import import_module
from pathlib import Path
from typing import Any

FRICTION_LAWS = (
    "drillctl.rig.bit_rock.navarro_lopez_suarez",
    "drillctl.rig.bit_rock.printed_three_branch",
    "drillctl.rig.bit_rock.jansen_van_den_steen",
    "drillctl.rig.bit_rock.tabulated",
    "drillctl.rig.bit_rock.tucker_wang",
    "drillctl.rig.bit_rock.stribeck",
    "drillctl.rig.bit_rock.aggressiveness",
    "drillctl.rig.bit_rock.richard_detournay",
)
"""Each module holds `LAWS`, a tuple of `drillctl.rig.bit_rock.law.FrictionLaw`."""

DRIVE_LAWS = (
    "drillctl.rig.top_drive.ideal",
    "drillctl.rig.top_drive.tuned",
)
"""Each module holds `LAWS`, a tuple of `drillctl.rig.top_drive.law.DriveLaw`."""

WEIGHT_LAWS = (
    "drillctl.rig.weight_on_bit.law",
    "drillctl.rig.weight_on_bit.following_speed",
    "drillctl.rig.weight_on_bit.stick_slip_alarm",
)
"""Each module holds `LAWS`, a tuple of `drillctl.rig.weight_on_bit.law.WeightOnBitLaw`."""

STUDIES: tuple[str, ...] = (
    "drillctl.studies.log",
    "drillctl.studies.identify",
    "drillctl.studies.torque_drag",
    "drillctl.studies.modes",
    "drillctl.studies.loop",
    "drillctl.studies.loop_mapping",
    "drillctl.studies.simulate",
    "drillctl.studies.cycle",
    "drillctl.studies.map",
    "drillctl.studies.uncertainty",
    "drillctl.studies.three_regions",
    "drillctl.studies.regularisation",
    "drillctl.studies.doctor",
    "drillctl.studies.compare",
    "drillctl.studies.delay",
    "drillctl.studies.advantage",
    "drillctl.studies.tune",
    "drillctl.studies.recommend",
    "drillctl.studies.export",
    "drillctl.studies.schedule",
)
"""Each package holds `STUDY`; its keys in a design file, if any, are in its `settings.py`."""


def resolve(place: str) -> Any:
    """What stands at `module:name`."""
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)


def at_first_use(
    package: str,
) -> tuple[list[str], Callable[[str], Any], Callable[[], list[str]]]:
    """`__all__`, `__getattr__` and `__dir__` of a package whose names are imported at first use.

    They are those that its source imports for the type checker alone, `from there import x as x`.
    """
    tree = ast.parse(Path(str(sys.modules[package].__file__)).read_text(encoding="utf-8"))
    imports = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    home = {one.asname: node.module for node in imports for one in node.names if one.asname}

    def look_up(name: str) -> Any:
        if name not in home:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return resolve(f"{home[name]}:{name}")

    return list(home), look_up, lambda: sorted({*vars(sys.modules[package]), *home})


def gathered(modules: Iterable[str], name: str) -> tuple[Any, ...]:
    """The tuples of that name in all modules, one after the other."""
    return tuple(one for module in modules for one in resolve(f"{module}:{name}"))
