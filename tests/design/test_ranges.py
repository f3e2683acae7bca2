"""What a design is mapped and searched over where it does not say: the law on this rig."""

from __future__ import annotations

import numpy as np
import pytest

import drillctl
from drillctl.catalog import find
from drillctl.design import axis_tables, tuned_ranges
from drillctl.rig.top_drive.law import drive_laws
from drillctl.units import RPM

PAPER = "monteiro-trindade-2012"
TORQUE = {"constant-torque": {"controller.torque": "8 kN*m"}}


def bare(folder, **values):
    """The paper's rig as a file of its own that names neither axes nor bounds."""
    text = find(PAPER).read_text(encoding="utf-8")
    (folder / "bare.toml").write_text(text[: text.index("[map]")], encoding="utf-8")
    return drillctl.load(folder / "bare.toml", **values)


def with_law(design, law):
    return design.replace({"controller.law": law, **TORQUE.get(law, {})})


def test_gains_follow_from_pipe_and_drive(tmp_path):
    design = bare(tmp_path)
    zeta, spring = design.string.pipe_impedance, design.string.drive_spring
    assert tuned_ranges(design) == {
        "controller.kp": (0.0, pytest.approx(6.0 * zeta, rel=0.06)),
        "controller.ki": (0.0, pytest.approx(1.5 * spring, rel=0.06)),
    }
    assert tuned_ranges(design)["controller.kp"][1] == 1800.0
    heavier = design.replace({"top_drive.inertia": "5000 kg*m^2"})
    assert tuned_ranges(heavier)["controller.ki"][1] == 4900.0


def test_a_lumped_spring_has_ranges_too():
    found = tuned_ranges(drillctl.load("navarro-lopez-4dof"))
    assert all(0.0 < high < 1e5 for _, high in found.values())


@pytest.mark.parametrize("law", sorted(drive_laws()))
def test_every_law_has_a_map_of_two_axes(law):
    tables = axis_tables(with_law(drillctl.load(PAPER), law))
    assert len(tables) == 2
    assert all(table.points == 41 for table in tables)
    if law == "soft-torque":
        assert [(one.path, one.min, one.max) for one in tables] == [
            ("controller.share", 0.05, 1.0), ("operating_point.speed", "50 rpm", "150 rpm"),
        ]  # fmt: skip


def test_another_law_takes_the_axes_of_the_old_gains_away():
    design = drillctl.load(PAPER)
    assert [one.path for one in axis_tables(design)] == ["controller.kp", "controller.ki"]
    assert set(design.tables.tune.parameters) == {"controller.kp", "controller.ki"}
    soft = with_law(design, "soft-torque")
    assert soft.tables.map.axes == ()
    assert soft.tables.tune.parameters == {}
    kept = {"path": "controller.drive.torque_limit", "min": "5 kN*m", "max": "9 kN*m", "points": 3}
    limited = design.replace({"map.axes": [kept]}).replace({"controller.law": "soft-torque"})
    assert [one.path for one in axis_tables(limited)] == ["controller.drive.torque_limit"]


def test_the_ranges_of_the_paper_s_rig_hold_good_gains(tmp_path):
    found = drillctl.stability_map(
        bare(tmp_path, **{"operating_point.weight_on_bit": "140 kN"}), audit_cells=0
    )
    assert found.j1.shape == (41, 41)
    assert np.count_nonzero(found.j1 < 30.0) >= 25


def test_the_speed_axis_of_a_slow_rig(tmp_path):
    slow = bare(tmp_path, **{"operating_point.speed": "57 rpm", "controller.law": "z-torque"})
    speed = axis_tables(slow)[1]
    assert (speed.min, speed.max) == ("28 rpm", "86 rpm")
    assert slow.speed == pytest.approx(57.0 * RPM)
