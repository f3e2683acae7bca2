"""What `identify` writes for other commands: a design with the rock of the log, and joint draws."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from drillctl import units
from drillctl.design import Design, to_toml
from drillctl.design.validation import validated
from drillctl.store.json_files import write_text

if TYPE_CHECKING:
    from drillctl.studies.identify.compute import Identification

DESIGN, DRAWS = "identified.toml", "draws.csv"


def paths_of(result: Identification) -> tuple[str, ...]:
    """Where the coefficients are in a design."""
    if result.law == "tabulated":
        count = len(result.fitted.values) - 1
        return ("bit_rock.static", *(f"bit_rock.points.{k}.a" for k in range(1, count + 1)))
    return tuple(f"bit_rock.{name}" for name in result.fitted.names)


def identified(result: Identification) -> Design:
    """The design with the rock, and the numbers of the rig, that the log says."""
    one = result.fitted
    rock: dict[str, Any] = {"law": result.law}
    if result.law == "tabulated":
        static, *arms = map(float, one.values)
        speeds = [float(name.split()[2]) for name in one.names[1:]]
        rock |= {
            "static": static,
            "points": [
                {"speed": f"{w!r} rad/s", "a": a} for w, a in zip(speeds, arms, strict=True)
            ],
        }
    else:
        rock |= dict(zip(one.names, map(float, one.values), strict=True))
    tree = {**result.design.tree, "bit_rock": rock}
    tree.pop("uncertain", None)
    tree.get("uncertainty", {}).pop("correlations", None)
    values: dict[str, Any] = {"operating_point.weight_on_bit": units.SI(result.weight)}
    fitted = {n.name: n.log / n.design for n in result.numbers if n.fitted}
    for name, key in (("bit_inertia", "bha.inertia"), ("drive_inertia", "top_drive.inertia")):
        if name in fitted:
            number = next(n for n in result.numbers if n.name == name)
            values[key] = units.SI(number.log)
    if "drive_inertia" in fitted:
        tree["top_drive"] = {
            key: value for key, value in tree["top_drive"].items()
            if key not in ("motor_inertia", "gear_ratio", "gearbox_inertia")
        }  # fmt: skip
    slow, stiff = fitted.get("travel_time", 1.0), fitted.get("impedance", 1.0)
    if slow != 1.0 or stiff != 1.0:
        values |= _scaled(result.design, stiff / slow, stiff * slow)
    name, origin = result.design.name, result.design.origin
    return Design(name, validated(tree, origin), tree, origin).replace(values)


def _scaled(design: Design, stiffer: float, heavier: float) -> dict[str, Any]:
    """Sections whose stiffness and inertia are multiplied: by their modulus and density."""
    from drillctl.design.parts import STEEL_DENSITY, shear_modulus

    values: dict[str, Any] = {}
    for one in design.tables.drillstring.sections:
        path = f"drillstring.sections.{one.name}"
        if one.stiffness is not None:
            values[f"{path}.stiffness"] = units.SI(one.stiffness * stiffer)
        else:
            density = STEEL_DENSITY if one.density is None else one.density
            values[f"{path}.shear_modulus"] = units.SI(shear_modulus(one) * stiffer)
            values[f"{path}.density"] = units.SI(density * heavier)
    return values


def write(result: Identification, folder: Path) -> None:
    """Write the design and the draws beside each other."""
    paths = paths_of(result)
    lines = [",".join(paths), *(",".join(f"{x!r}" for x in row) for row in result.draws.tolist())]
    title = (
        f"{result.design.tables.title or result.design.name}: rock from {', '.join(result.files)}"
    )
    text = to_toml(identified(result).replace({"title": title}))
    blocks = [
        f'[uncertain."{path}"]\ndistribution = "samples"\nfile = "{DRAWS}"\ncolumn = "{path}"\n'
        "joint = true\n"
        for path in paths
    ]
    write_text(folder / DRAWS, "\n".join(lines) + "\n")
    write_text(folder / DESIGN, f"{text}\n" + "\n".join(blocks))
