"""Steady drilling: published equilibria, slopes against differences, refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import drillctl
from drillctl.errors import InputError
from drillctl.linear.ends import ends_of
from drillctl.linear.loop_model import loop_poles
from drillctl.linear.operating_point import at_speed, equilibria, operating_point
from drillctl.linear.slope_margin import slope_margin

DESIGN = "monteiro-trindade-140kn"
LUMPED = "navarro-lopez-2dof"
RADIUS, STATIC, SLIDING, DECAY, DRAG = 0.155575, 0.8, 0.5, 0.9, 475.0


def lumped(torque, weight, **values):
    given = {
        "controller.torque": f"{torque!r} N*m",
        "operating_point.weight_on_bit": f"{weight!r} N",
    }
    return drillctl.load(LUMPED, **given, **values)


def torque_by_hand(weight, speed):
    return weight * RADIUS * (SLIDING + (STATIC - SLIDING) * math.exp(-DECAY * speed))


def growth(design, slope):
    """Largest real part of the poles with the falling slope at the bit."""
    return loop_poles(design.string, *design.top_drive.gains(), slope).real.max()


def test_published_equilibria_of_two_inertias():
    design = lumped(6000.0, 50e3)
    slow, fast = equilibria(design)
    assert slow.speed == pytest.approx(0.14967, abs=5.1e-6)
    assert fast.speed == pytest.approx(4.34501, abs=5.1e-6)
    for found in (slow, fast):
        assert found.bit_torque == pytest.approx(torque_by_hand(50e3, found.speed), rel=1e-12)
        assert found.bit_torque + DRAG * found.speed == pytest.approx(6000.0, rel=1e-12)
    margin, _ = slope_margin(ends_of(design.string), 0.0, 0.0)
    assert fast.slope < margin < slow.slope
    assert growth(design, slow.slope) > 0.0 > growth(design, fast.slope)


def test_at_constant_torque_the_fastest_steady_state_is_drilled_at():
    for frame in ("5.005 rad/s", "0.2 rad/s"):
        rig = lumped(6000.0, 50e3, **{"operating_point.speed": frame})
        assert operating_point(rig).speed == pytest.approx(4.34501, abs=5.1e-6)
        assert len(equilibria(rig)) == 2


def test_without_integral_action_the_steady_state_nearest_to_the_set_speed():
    gains = {"law": "pi", "kp": 5000.0, "ki": 0.0}
    rig = lumped(6000.0, 50e3, controller=gains)
    found = operating_point(rig).speed
    assert found == min((x.speed for x in equilibria(rig)), key=lambda x: abs(x - rig.speed))
    assert 3.0 < found < rig.speed  # the droop of proportional control


def test_speed_that_ten_thousand_sustain():
    found = operating_point(drillctl.load(LUMPED))
    assert found.speed == pytest.approx(5.005, abs=5e-4)


@pytest.mark.parametrize("weight", [20e3, 50e3, 97347.0])
@pytest.mark.parametrize("torque", [4e3, 6e3, 1e4, 5e4])
def test_all_equilibria_of_two_inertias(torque, weight):
    def surplus(speed):
        return torque - DRAG * speed - torque_by_hand(weight, speed)

    grid = np.linspace(1e-5, 150.0, 200_001)
    signs = np.array([surplus(speed) > 0.0 for speed in grid])
    expected = [
        brentq(surplus, grid[i], grid[i + 1], xtol=1e-14)
        for i in np.flatnonzero(signs[1:] != signs[:-1])
    ]
    found = equilibria(lumped(torque, weight))
    assert [x.speed for x in found] == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("speed", [0.01, 0.7, 5.0, 10.471975511965976, 40.0])
@pytest.mark.parametrize("name", [DESIGN, "monteiro-trindade-120kn", LUMPED])
def test_slope_against_differences(name, speed):
    design = drillctl.load(name)
    step = 1e-5 * max(speed, 0.1)
    low, high = (at_speed(design, speed + d).bit_torque for d in (-step, step))
    found = at_speed(design, speed)
    assert found.speed == speed
    assert found.slope == pytest.approx(-(high - low) / (2 * step), rel=1e-6)
    assert found.slope > 0.0


@pytest.mark.parametrize(
    ("weight", "torque", "slope"),
    [
        (80, 3637.9, 55.6),
        (100, 4634.9, 133.4),
        (120, 5652.7, 210.8),
        (140, 6599.9, 290.1),
        (160, 7631.2, 359.5),
    ],
)
def test_integral_action_holds_the_set_speed(weight, torque, slope):
    design = drillctl.load(f"monteiro-trindade-{weight}kn")
    found = operating_point(design)
    assert equilibria(design) == (found,)
    assert found.speed == design.speed == pytest.approx(100 * math.pi / 30)
    assert found.bit_torque == pytest.approx(torque, abs=0.051)
    assert found.slope == pytest.approx(slope, abs=0.051)


def test_without_integral_action_speed_falls_below_the_set_speed():
    drag = {"drillstring.sections.pipe.drag": "0.02 N*s/rad"}
    design = drillctl.load(DESIGN, **{"controller.kp": 2000.0, "controller.ki": 0.0}, **drag)
    assert len(equilibria(design)) == 1
    found = operating_point(design)
    drive = 2000.0 * (design.speed - found.speed)
    assert drive == pytest.approx(found.bit_torque + 0.02 * 3000.0 * found.speed, rel=1e-12)
    expected = 140e3 * (0.026 + 0.059 * math.exp(-0.098 * found.speed))
    assert found.bit_torque == pytest.approx(expected, rel=1e-12)
    assert found.slope == pytest.approx(0.098 * (expected - 140e3 * 0.026), rel=1e-12)


def test_damping_between_nodes_takes_no_torque_from_steady_drilling():
    inner = {
        "drillstring.sections.pipe.damping": "900 N*m*s/rad",
        "drillstring.modal_damping": 0.05,
    }
    found = equilibria(lumped(6000.0, 50e3, **inner))
    plain = equilibria(lumped(6000.0, 50e3))
    assert [x.speed for x in found] == pytest.approx([x.speed for x in plain], rel=1e-9)


def test_a_drive_too_weak_has_no_operating_point():
    weak = lumped(3000.0, 50e3)
    assert equilibria(weak) == ()
    with pytest.raises(InputError, match="controller"):
        operating_point(weak)
    with pytest.raises(InputError, match="controller"):
        operating_point(drillctl.load(DESIGN, **{"controller.kp": 100.0, "controller.ki": 0.0}))


def test_nothing_limits_the_speed_of_a_strong_drive_without_drag():
    free = {"top_drive.damping": "0 N*m*s/rad", "bha.damping": "0 N*m*s/rad"}
    strong = lumped(1e4, 50e3, **free)
    assert equilibria(strong) == ()
    with pytest.raises(InputError, match="controller"):
        operating_point(strong)
    (only,) = equilibria(lumped(5000.0, 50e3, **free))
    assert torque_by_hand(50e3, only.speed) == pytest.approx(5000.0, rel=1e-12)
