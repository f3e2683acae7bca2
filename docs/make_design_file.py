"""Write `design-file.md` from the tables that validate design files.

python docs/make_design_file.py
"""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any, get_args

from drillctl.design import (
    advantage_tables,
    bit_rock_tables,
    compare_tables,
    controller_tables,
    delay_tables,
    scenario_tables,
    tables,
    tune_tables,
    uncertain_tables,
    weight_tables,
)
from drillctl.design.paths import kind_of

HEAD = """# Keys of a design file

Made from the code by `docs/make_design_file.py`; a test keeps it true. TOML, `schema = 1`. At
the top level: `schema`, `model` (a shipped name or a path; the design is laid over it), `title`,
`source`, `status`, `notes`. Everything below is optional in a design that names a model.

A key with a unit takes text such as the example; the unit may be any of its kind. Gains may be
bare numbers. Sections of a design and of its model are merged by name. A table whose `law`
changes drops the numbers of the old law; `controller.drive` and `weight_on_bit.path` stay.
"""

TABLES = (
    ("[operating_point]", tables.OperatingPoint),
    ("[drillstring]", tables.DrillstringTable),
    ("[[drillstring.sections]]", tables.SectionTable),
    ("[top_drive]", tables.TopDriveTable),
    ("[bha]", tables.BhaTable),
    ('[bit_rock] law = "navarro-lopez-suarez"', bit_rock_tables.NavarroLopezSuarezTable),
    ('[bit_rock] law = "printed-three-branch"', bit_rock_tables.PrintedThreeBranchTable),
    ("rows of bit_rock.table", bit_rock_tables.FrictionRow),
    ('[bit_rock] law = "bit-radius-friction"', bit_rock_tables.BitRadiusFrictionTable),
    ('[bit_rock] law = "jansen-van-den-steen"', bit_rock_tables.JansenVanDenSteenTable),
    ('[bit_rock] law = "coulomb"', bit_rock_tables.CoulombTable),
    ('[bit_rock] law = "tabulated"', bit_rock_tables.TabulatedFrictionTable),
    ("entries of bit_rock.points", bit_rock_tables.FrictionPoint),
    ('[bit_rock] law = "tucker-wang"', bit_rock_tables.TuckerWangTable),
    ('[bit_rock] law = "stribeck"', bit_rock_tables.StribeckTable),
    ('[controller] law = "pi"', controller_tables.PITable),
    ('[controller] law = "constant-torque"', controller_tables.ConstantTorqueTable),
    ('[controller] law = "stiff-speed"', controller_tables.StiffSpeedTable),
    ('[controller] law = "soft-torque"', controller_tables.SoftTorqueTable),
    ('[controller] law = "z-torque"', controller_tables.ZTorqueTable),
    (
        '[controller] law = "torsional-rectification"',
        controller_tables.TorsionalRectificationTable,
    ),
    ('[controller] law = "active-damping"', controller_tables.ActiveDampingTable),
    ("[controller.drive]", controller_tables.DriveTable),
    ('[weight_on_bit] law = "constant"', weight_tables.ConstantWeightTable),
    ('[weight_on_bit] law = "navarro-lopez-suarez"', weight_tables.FollowingSpeedTable),
    ('[weight_on_bit] law = "surface-observer"', weight_tables.SurfaceObserverTable),
    ('[weight_on_bit] law = "stick-slip-alarm"', weight_tables.StickSlipAlarmTable),
    ("[weight_on_bit.path]", weight_tables.PathTable),
    ("[scenario.speed]", scenario_tables.SpeedProgramTable),
    ("[scenario.weight_on_bit]", scenario_tables.WeightProgramTable),
    ("[scenario.bit_rock]", scenario_tables.RockProgramTable),
    ("[start]", tables.StartTable),
    ("[simulation]", tables.SimulationTable),
    ("[map]", tables.MapTable),
    ("entries of map.axes", tables.AxisTable),
    ('[uncertain."dotted.path"]', uncertain_tables.DistributionTable),
    ("[uncertainty]", uncertain_tables.UncertaintyTable),
    ("entries of uncertainty.correlations", uncertain_tables.CorrelationTable),
    ("[uncertainty.until]", uncertain_tables.UntilTable),
    ("[uncertainty.sensitivity]", uncertain_tables.SensitivityTable),
    ("[compare]", compare_tables.CompareTable),
    ("entries of compare.cases", compare_tables.CaseTable),
    ("[weight_delay]", delay_tables.WeightDelayTable),
    ("[tune]", tune_tables.TuneTable),
    ('[tune.parameters."dotted.path"]', tune_tables.RangeTable),
    ("[tune.weights]", tune_tables.TuneWeightsTable),
    ("[tune.constraints]", tune_tables.TuneConstraintsTable),
    ("[advantage]", advantage_tables.AdvantageTable),
    ("[tune.certificate]", tune_tables.TuneCertificateTable),
)


def main() -> None:
    """Write the page beside this file."""
    Path(__file__).with_name("design-file.md").write_text(page(), encoding="utf-8")


def page() -> str:
    """The whole page."""
    return "\n".join([HEAD, *(_section(name, table) for name, table in TABLES)])


def _section(name: str, table: type[tables.Table]) -> str:
    lines = [f"## `{name}`", "", inspect.getdoc(table) or "", ""]
    lines += ["| key | unit | default |", "|---|---|---|"]
    for key, info in table.model_fields.items():
        kind = kind_of(info)
        unit = ", ".join(kind.examples) if kind else _values(info.annotation)
        lines.append(f"| `{info.alias or key}` | {unit} | {_default(info, kind)} |")
    return "\n".join([*lines, ""])


def _values(annotation: Any) -> str:
    """Words that a key may take, if it takes words."""
    words = [w for part in (annotation, *get_args(annotation)) for w in get_args(part)]
    return " or ".join(f"`{w}`" for w in dict.fromkeys(words) if isinstance(w, str))


def _default(info: Any, kind: Any) -> str:
    from drillctl import units

    if info.is_required():
        return "required"
    value = info.default
    if value is None or info.default_factory is not None:
        return ""
    if kind is not None:
        values = value if isinstance(value, tuple) else (value,)
        return ", ".join(units.write(one, kind) for one in values)
    if isinstance(value, tuple):
        return ", ".join(str(getattr(item, "path", item)) for item in value)
    return str(value)


if __name__ == "__main__":
    main()
