"""Steady drilling, and the friction that decides whether it stays so."""

from __future__ import annotations

from drillctl.reporting.blocks import Block, Figure, Table, Text
from drillctl.reporting.gather import Gathered
from drillctl.reporting.words import NOTHING


def build(gathered: Gathered) -> tuple[Block, ...]:
    """Speeds, weight, torque, slope; friction curves."""
    design, words = gathered.design, gathered.words
    point = design.tables.operating_point
    found = gathered.need("loop").summary
    rows = [
        ("set speed", words.quantity(point.speed, "rad/s")),
        ("weight on bit", words.quantity(point.weight_on_bit, "N")),
        ("speed of steady drilling", words.quantity(found["operating_speed"], "rad/s")),
        ("bit torque at that speed", words.quantity(found["bit_torque"], "N*m")),
        ("falling slope of the rock, −dT/dω", words.quantity(found["slope"], "N*m*s/rad")),
        ("slope that the loop tolerates", _margin(gathered)),
    ]
    for name, key, unit in (
        ("nearest speed at which stability changes", "critical_speed", "rad/s"),
        ("nearest weight at which stability changes", "critical_weight_on_bit", "N"),
    ):
        value = found[key]
        rows.append((name, NOTHING if value is None else words.quantity(value, unit)))
    return (
        Table("operating-point", "Steady drilling", ("quantity", "value"), tuple(rows)),
        Figure(
            "friction", "Bit torque against bit speed, at each weight of the friction table.",
            "Curves of bit torque over bit speed: the torque is largest at rest and falls as the "
            "bit turns faster, which is what drives stick-slip.",
            lambda: _curves(gathered),
        ),
        Text(
            "Friction is set-valued here: a bit at rest bears any torque up to the static one. A "
            "falling slope feeds torsional oscillation; the loop bears a slope up to its margin."
        ),
    )  # fmt: skip


def _margin(gathered: Gathered) -> str:
    found = gathered.need("loop").summary
    if found["slope_margin"] is None:
        return "any" if found["stable"] else NOTHING
    return gathered.words.quantity(found["slope_margin"], "N*m*s/rad")


def _curves(gathered: Gathered):  # type: ignore[no-untyped-def]
    from drillctl import plots

    return plots.friction_curves(gathered.design, system=gathered.words.system)
