"""Motors behind a gear: inertia and limits at the pipe, in both engines."""

from __future__ import annotations

import math

import numpy as np
import pytest

import drillctl
from drillctl import units
from drillctl.errors import InputError
from drillctl.rig.top_drive import PI, RealDrive
from drillctl.rig.top_drive.law import curve_limits
from drillctl.rig.top_drive.real_drive import curve_torque, limits

RPM = units.RPM
GEAR = {
    "top_drive.motor_inertia": "23 kg*m^2",
    "top_drive.gear_ratio": 7.2,
    "top_drive.gearbox_inertia": "930 kg*m^2",
}
CURVE = [["0 rpm", "9 kN*m"], ["90 rpm", "9 kN*m"], ["150 rpm", "5.4 kN*m"]]


def rig(**values):
    return drillctl.load("monteiro-trindade-120kn", **values)


def of_limits(**keys):
    return rig(**{f"top_drive.{key}": value for key, value in keys.items()})


def test_a_motor_counts_with_the_ratio_squared():
    assert rig(**GEAR).string.top_inertia == pytest.approx(2122.32, abs=1e-9)
    plate = rig(**GEAR | {"top_drive.gear_ratio": "7.2 : 1"})  # as it stands on a plate
    assert plate.string.top_inertia == pytest.approx(2122.32, abs=1e-9)
    two = rig(**GEAR, **{"top_drive.motors": 2})
    assert two.string.top_inertia == pytest.approx(2 * 23 * 7.2**2 + 930)


def test_limits_of_a_motor_are_those_at_the_pipe():
    motor = [["0 rpm", "1 kN*m"], ["900 rpm", "1 kN*m"], ["1500 rpm", "0.6 kN*m"]]
    more = {"limits_at": "motor", "torque_speed": motor, "efficiency": 0.9, "motors": 2,
            "continuous_torque": "0.7 kN*m"}  # fmt: skip
    drive = rig(**GEAR, **{f"top_drive.{key}": value for key, value in more.items()}).top_drive
    gain = 7.2 * 2 * 0.9
    assert isinstance(drive, RealDrive)
    assert drive.most == pytest.approx(gain * 1e3)
    assert drive.power == pytest.approx(2 * 0.9 * 600 * 1500 * RPM)  # a gear takes or gives none
    assert 1.0 / drive.slowness == pytest.approx(1500 * RPM / 7.2)
    assert drive.continuous == pytest.approx(gain * 700)
    assert drive.least == 0.0


def test_the_curve_is_constant_torque_then_power_then_nothing():
    drive = of_limits(limits_at="pipe", torque_speed=CURVE).top_drive
    for rpm, torque in ((0, 9e3), (60, 9e3), (90, 9e3), (120, 6.75e3), (150, 5.4e3)):
        assert limits(drive, rpm * RPM)[1] == pytest.approx(torque, rel=1e-9)
    assert limits(drive, 157.5 * RPM)[1] == pytest.approx(0.5 * 5.4e3 * 150 / 157.5, rel=1e-6)
    assert limits(drive, 166 * RPM)[1] == 0.0
    assert curve_limits(((5.0, 3.0), (10.0, 3.0), (10.5, 0.0))).speed == 10.0


def test_other_points_limit_the_torque_as_they_are_given():
    drive = of_limits(limits_at="pipe", torque_speed=KINKED).top_drive
    assert (drive.most, drive.power, 1.0 / drive.slowness) == (9e3, math.inf, 200 * RPM)
    given = {0: 9e3, 60: 9e3, 90: 9e3, 120: 8.5e3, 150: 8e3, 175: 6e3, 200: 4e3, 210: 2e3, 220: 0}
    for rpm, torque in given.items():
        for sign in (1, -1):
            assert limits(drive, sign * rpm * RPM)[1] == pytest.approx(torque, abs=1e-8)
    assert curve_torque(drive, np.array([120.0, 175.0]) * RPM) == pytest.approx([8.5e3, 6e3])
    rounded = of_limits(limits_at="pipe", torque_speed=[*CURVE[:2], ["150 rpm", "5.5 kN*m"]])
    assert rounded.top_drive.curve == math.inf
    closed = curve_limits(((0.0, 9.0), (10.0, 5.0), (20.0, 0.0)))
    assert (closed.speed, closed.curve[-1]) == (20.0, (20.0, 0.0))


def test_of_many_points_those_count_that_give_its_shape():
    speeds = np.linspace(0.0, 20.0, 60)
    torques = 9e3 - 20.0 * speeds**2
    limited = curve_limits(tuple(zip(speeds.tolist(), torques.tolist(), strict=True)))
    assert len(limited.curve) == 12
    assert limited.off[0] < 5e-3
    assert limited.curve[0] == (0.0, 9e3)
    stairs = [[f"{5 * k} rpm", f"{45 - 3 * (k // 2)} kN*m"] for k in range(30)]
    (said,) = (one for one in of_limits(limits_at="pipe", torque_speed=stairs).warnings
               if one.key == "top_drive.torque_speed")  # fmt: skip
    assert "straight between 12 of its points, which is off by 3%" in said.said("si")


@pytest.mark.parametrize(
    ("drive", "within"),
    [
        ({}, 1e-4),
        # 2 % with limits at the speed that an unlimited torque leads to
        ({"controller.law": "z-torque"}, 2e-3),
        pytest.param({"controller.drive.sampling_period": "10 ms"}, 1e-4, marks=pytest.mark.slow),
    ],
    ids=["continuous", "fed back", "sampled"],
)
def test_both_engines_agree_along_the_points_of_a_curve(drive, within):
    design = of_limits(limits_at="pipe", torque_speed=KINKED).replace(
        {"simulation.duration": "20 s", **drive}
    )
    exact = drillctl.simulate(design, "reference").measures
    batch = drillctl.simulate(design, "batch").measures
    assert 2.0 < exact.time_at_torque_limit < 15.0
    assert batch.time_at_torque_limit == pytest.approx(exact.time_at_torque_limit, abs=0.15)
    assert batch.j1 == pytest.approx(exact.j1, rel=within)


def test_the_narrower_limit_holds():
    design = of_limits(limits_at="pipe", intermittent_torque="30 kN*m")
    assert design.top_drive.most == 30e3
    assert design.replace({"controller.drive.torque_limit": "20 kN*m"}).top_drive.most == 20e3
    assert design.replace({"controller.drive.torque_limit": "40 kN*m"}).top_drive.most == 30e3
    assert isinstance(design.linear_drive, PI)  # inside its limits it is as before


AT_PIPE = {"top_drive.limits_at": "pipe"}
KINKED = [*CURVE[:2], ["150 rpm", "8 kN*m"], ["200 rpm", "4 kN*m"]]
SLOW = [["0 rpm", "20 kN*m"], ["90 rpm", "20 kN*m"]]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"top_drive.gear_ratio": 7.2}, r"motor_inertia is missing beside gear_ratio"),
        ({"controller.drive.gear_ratio": 7.2}, r"it stands in \[top_drive\]"),
        ({"top_drive.intermittent_torque": "30 kN*m"}, r'at the "motor" or at the "pipe"'),
        ({"top_drive.limits_at": "motor"}, "needs motor_inertia and gear_ratio"),
        (AT_PIPE | {"top_drive.torque_speed": CURVE[::-1]}, "must rise"),
        (AT_PIPE | {"top_drive.torque_speed": SLOW}, "beyond the 90 rpm"),
        (AT_PIPE | {"top_drive.intermittent_torque": "3 kN*m"}, "top_drive: gives 3 kN"),
        ({"controller.drive.maximum_speed": "200 rpm"}, "needs a torque_limit"),
    ],
)
def test_what_is_misplaced_is_explained(values, message):
    with pytest.raises(InputError, match=message):
        rig(**values)


def test_a_gear_beside_an_inertia_at_the_pipe_is_explained(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(
        'schema = 1\nmodel = "monteiro-trindade-2012"\n[top_drive]\ninertia = "2000 kg*m^2"\n'
        "gear_ratio = 7.2\n",
        encoding="utf-8",
    )
    with pytest.raises(InputError, match="counts at the pipe already"):
        drillctl.load(path)


def test_both_engines_agree_on_time_at_the_limits():
    design = rig(
        **{
            "top_drive.limits_at": "pipe", "top_drive.torque_speed": CURVE,
            "top_drive.continuous_torque": "7 kN*m", "simulation.duration": "15 s",
        }
    )  # fmt: skip
    exact = drillctl.simulate(design, "reference")
    batch = drillctl.simulate(design, "batch").measures
    assert exact.energy.relative_residual < 1e-8
    times = ("time_at_torque_limit", "time_at_power_limit", "time_over_continuous")
    for name in times:
        one, other = getattr(exact.measures, name), getattr(batch, name)
        assert 0.1 < one < 15.0
        assert other == pytest.approx(one, abs=0.15), name
    assert batch.peak_drive_power == pytest.approx(exact.measures.peak_drive_power, rel=0.02)
    assert exact.measures.peak_drive_power <= 1.001 * 9e3 * 90 * RPM
    assert batch.peak_top_torque == pytest.approx(9e3)


def test_an_ideal_drive_is_at_no_limit():
    run = drillctl.simulate(rig(**{"simulation.duration": "2 s"})).measures
    assert (run.time_at_torque_limit, run.time_over_continuous) == (0.0, 0.0)
    assert run.peak_drive_power is None
    assert math.isfinite(run.peak_top_torque)


def test_show_prints_a_drive_behind_a_gear_at_the_pipe(capsys):
    from drillctl.cli.app import run

    sets = [f"top_drive.{key.partition('.')[2]}={value}" for key, value in GEAR.items()]
    sets += ["top_drive.limits_at=motor", "top_drive.continuous_torque=5 kNm"]
    words = [word for one in sets for word in ("--set", one)]
    assert run(["show", "monteiro-trindade-120kn", *words]) == 0
    said = capsys.readouterr().out
    assert "# Drive at the pipe: inertia 2122.32 kg m², continuous torque 36 kN m" in said


@pytest.mark.parametrize("key", ["power", "rated_speed", "max_rpm"])
def test_a_name_plate_is_told_where_it_goes(key):
    with pytest.raises(InputError, match=f"{key}: unknown key.*points of torque_speed.*3.32 kN"):
        rig(**{f"top_drive.{key}": "400 kW"})
