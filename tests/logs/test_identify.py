"""What a log says of the rock, and what it does not; logs are made by characteristics."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

import drillctl
from drillctl import units
from drillctl.cli import run
from drillctl.ensemble.parameters import draw
from drillctl.errors import InputError
from drillctl.logs.laws import EXPONENTIAL_LAW
from drillctl.studies.identify.compute import _findings, identify
from drillctl.studies.identify.written import write as write_design
from drillctl.studies.log.compute import log_overview
from tests.logs.synthetic import WEIGHT, Rig, laboratory, sampled, write

NOISE = (200.0, 0.02)
PI = {"controller.kp": 200, "controller.ki": 100}


def design(**values):
    return drillctl.load(
        "monteiro-trindade-140kn", **{k.replace("__", "."): v for k, v in values.items()}
    )


@pytest.fixture(scope="module")
def motion():
    return Rig().run(300.0)


@pytest.fixture(scope="module")
def clean(motion, tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "clean.csv"
    return write(path, sampled(motion, 100.0, 60.0, 240.0), weight=WEIGHT)


@pytest.fixture(scope="module")
def noisy(motion, tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "noisy.csv"
    return write(path, sampled(motion, 20.0, 30.0, 290.0, NOISE, seed=4), columns=4)


def test_a_log_without_noise_gives_the_curve_and_the_string(clean):
    result = identify(design(identify__free=["travel_time", "impedance", "bit_inertia"]), [clean])
    one = result.fitted
    assert one.name == "navarro-lopez-suarez"
    assert one.torque == pytest.approx(Rig().curve(one.speed), rel=1e-4)
    for number in result.numbers[:3]:
        assert number.log == pytest.approx(number.design, rel=1e-4)
    assert result.weight == pytest.approx(WEIGHT)
    assert result.weight_known
    assert not result.findings


def test_windows_off_bottom_or_of_a_moving_weight_are_not_fitted(motion, tmp_path):
    time, torque, speed, bit = sampled(motion, 20.0, 60.0, 240.0)
    off, less = (time > 60.0) & (time < 80.0), (time > 150.0) & (time < 158.0)
    weight = WEIGHT * np.select([off, less], [0.0, 0.5], 1.0)
    log = (time, np.select([off, less], [500.0, 0.7 * torque], torque), speed, bit)
    result = identify(design(), [write(tmp_path / "a.csv", log, weight=weight)])
    assert result.fitted.torque == pytest.approx(Rig().curve(result.fitted.speed), rel=5e-3)
    assert result.weight == pytest.approx(WEIGHT)


@pytest.fixture(scope="module")
def identified(noisy):
    return identify(design(), [noisy])


def test_a_noisy_log_gives_a_band_that_holds_the_curve(identified):
    one = identified.fitted
    truth = Rig().curve(one.speed)
    assert np.mean((one.low <= truth) & (truth <= one.high)) > 0.8
    assert 0.005 < np.mean((one.high - one.low) / (2.0 * truth)) < 0.03
    assert identified.identifiable["static_friction"]
    assert identified.downhole_difference < 0.01
    assert not any(number.off for number in identified.numbers)
    said = " ".join(identified.findings)
    assert "the weight on bit is not in the log" in said


def test_joint_draws_keep_their_correlations(identified, tmp_path):
    write_design(identified, tmp_path)
    made = drillctl.load(tmp_path / "identified.toml")
    assert made.tables.bit_rock.a2 == pytest.approx(0.085, rel=0.01)
    values = np.array(list(draw(made, 2000, seed=1).values.values()))
    assert np.corrcoef(values) == pytest.approx(np.corrcoef(identified.draws.T), abs=0.08)
    assert np.corrcoef(values)[0, 1] > 0.5
    rows = {tuple(row) for row in identified.draws.tolist()}
    assert all(tuple(row) in rows for row in values.T.tolist())
    table = tmp_path / "draws.csv"
    text = table.read_text().splitlines()
    table.write_text("\n".join([*text[:3], "0.02,none,0.1", *text[3:]]))
    with pytest.raises(
        InputError, match=r"a2\.file.*draws.csv: 'none' in row 3 of column 'bit_rock.a2'"
    ):
        drillctl.load(tmp_path / "identified.toml")
    held = {"distribution": "samples", "joint": True}
    uneven = {
        "bit_rock.a1_factor": {**held, "samples": [1.0] * 9},
        "bit_rock.a2_factor": {**held, "samples": [1.0] * 12},
    }
    with pytest.raises(InputError, match=r"12 samples, but 9 of bit_rock.a1_factor: joint samples"):
        draw(design().replace({"uncertain": uneven}), 3, 1)


def test_a_wrong_drive_inertia_is_named(noisy):
    result = identify(design(top_drive__inertia="650 kg*m^2"), [noisy])
    (off,) = [number for number in result.numbers if number.off]
    assert off.name == "drive_inertia"
    assert off.log == pytest.approx(500.0, rel=0.08)
    assert any("drive inertia at the pipe: the design has 650" in text for text in result.findings)
    truth = Rig().curve(result.fitted.speed)
    assert np.mean((result.fits[0].low <= truth) & (truth <= result.fits[0].high)) > 0.6


def test_a_torque_in_the_wrong_unit_is_named(noisy, tmp_path):
    text = noisy.read_text().replace("top_torque_Nm", "top_torque_ftlb")
    path = tmp_path / "wrong.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=r"0\.\d% if the torque is in N m, read as ft lbf"):
        identify(design(), [path])


def test_a_speed_in_the_wrong_unit_is_named(noisy, tmp_path):
    path = tmp_path / "wrong.csv"
    rows = [line.split(",") for line in noisy.read_text().splitlines()[1:]]
    path.write_text(
        "time_s,top_torque_Nm,top_speed_rpm\n"
        + "\n".join(f"{a},{b},{float(c) * np.pi / 30.0}" for a, b, c, *_ in rows)
    )
    with pytest.raises(InputError, match="the speed is in rad/s, read as rpm"):
        identify(design(), [path])


def test_wrong_columns_are_named(noisy, tmp_path):
    path = tmp_path / "wrong.csv"
    path.write_text(
        noisy.read_text().replace("_torque_Nm", "_x_rpm").replace("_speed_rpm", "_torque_Nm")
    )
    rows = {"log.top_speed.column": "top_x_rpm", "log.top_torque.column": "top_torque_Nm"}
    with pytest.raises(InputError, match="which no rig drills with"):
        identify(drillctl.load("monteiro-trindade-140kn", **rows), [path])


@pytest.mark.parametrize("times", [1e-3, 1e3])
def test_a_weight_in_another_unit_is_refused(times, motion, tmp_path):
    samples = sampled(motion, 100.0, 60.0, 150.0)
    path = write(tmp_path / "unit.csv", samples, weight=times * WEIGHT)
    with pytest.raises(InputError, match=r"the weight on bit of this log is 1[^ ]* N at a top"):
        identify(design(), [path])


def test_a_weight_that_is_logged_and_left_out_is_not_called_absent(motion, tmp_path):
    path = write(tmp_path / "none.csv", sampled(motion, 100.0, 60.0, 150.0), weight=-WEIGHT)
    said = " ".join(identify(design(), [path]).findings)
    assert "the weight on bit is missing or next to nothing somewhere: the curve" in said


def test_one_sample_a_second_is_refused(motion, tmp_path):
    path = write(tmp_path / "slow.csv", sampled(motion, 1.0, 30.0, 290.0))
    with pytest.raises(InputError, match=r"1 Hz is too slow for a period of 7\.84 s"):
        identify(design(), [path])


def test_without_sticks_static_friction_is_not_seen(tmp_path):
    rig = Rig(kp=450.0, ki=150.0, a1=0.034 * WEIGHT, a2=0.07 * WEIGHT, beta=0.1)
    path = write(tmp_path / "a.csv", sampled(rig.run(200.0), 100.0, 15.0, 100.0, (20.0, 0.002)))
    result = identify(design(), [path])
    assert not result.sticks.any()
    assert not result.identifiable["static_friction"]
    assert not result.identifiable["a2"]
    assert any("no break-away in this log" in text for text in result.findings)
    one = result.fitted
    truth = rig.curve(one.speed)
    assert np.mean((one.low <= truth) & (truth <= one.high)) > 0.5
    assert result.draws.std(axis=0)[1] > 0.05 * result.draws.mean(axis=0)[1]


def test_a_constant_torque_is_flat(tmp_path):
    rig = Rig(a1=5000.0, a2=5000.0, peak=14000.0, beta=0.0, ki=50.0)
    path = write(tmp_path / "a.csv", sampled(rig.run(260.0), 100.0, 15.0, 250.0, NOISE))
    result = identify(design(), [path])
    assert result.law == "jansen-van-den-steen"
    assert result.fitted.values * WEIGHT == pytest.approx([5000.0, 14000.0], rel=0.03)


def test_a_straight_fall_leaves_beta_open():
    x = np.array([2000.0, 6000.0, np.log(0.01)])
    main = SimpleNamespace(
        sticks=(True, True), quiet=False, slowest=0.0, fastest=12.0, x=x, family=EXPONENTIAL_LAW,
        curve=EXPONENTIAL_LAW.curve(x),
    )  # fmt: skip
    law = SimpleNamespace(
        names=("a1", "a2", "beta"), values=np.ones(3), half=np.zeros(3), explained=1.0
    )
    (said,), known = _findings(main, law, [], True, WEIGHT)
    assert said.startswith("the torque falls along a straight line over the speeds seen: beta is")
    assert known == {"a1": False, "a2": True, "beta": False, "static_friction": True}


def test_what_is_said_is_said_of_the_law_that_is_written(motion, tmp_path):
    time, torque, speed, bit = sampled(motion, 100.0, 40.0, 150.0)
    speed = np.where(time < 50.0, speed[0], speed)  # so that another law explains more of it
    path = write(tmp_path / "a.csv", (time, torque, speed, bit), weight=WEIGHT)
    result = drillctl.identify(design(**PI), [path])
    leading = max(result.fits, key=lambda one: one.explained)
    assert leading.name != result.law == "navarro-lopez-suarez"
    assert not any("flat" in one for one in result.findings)
    assert any("explain 79% of what returns to the top" in one for one in result.findings)
    assert not any(result.identifiable[name] for name in ("a1", "a2", "beta", "static_friction"))


def test_several_damped_sections(tmp_path):
    """The log is made by the reference solver: two sections, damping, another bit."""
    pipe = {"pipe": "5 in 19.5 lb/ft", "length": "2500 m", "stiffness_damping": "0.001 s"}
    collar = {"outer_diameter": "165 mm", "inner_diameter": "71 mm", "length": "200 m"}
    sections = [{"name": "pipe", **pipe}, {"name": "collar", **collar}]
    values = {**PI, "simulation.duration": "110 s", "drillstring.sections": sections}
    rig = drillctl.load("monteiro-trindade-140kn", **values)
    run_ = drillctl.simulate(rig, "reference", interval=0.02)
    keep = run_.time > 20.0
    signals = (run_.signals[name][keep] for name in ("top_torque", "top_speed", "bit_speed"))
    samples = run_.time[keep] - 20.0, *signals
    path = write(tmp_path / "a.csv", samples)
    one = identify(rig, [path]).fits[0]
    law = rig.bit_rock
    truth = WEIGHT * (law.a1 + (law.a2 - law.a1) * np.exp(-law.beta * one.speed))
    assert one.torque == pytest.approx(truth, rel=0.005)


def test_a_laboratory_rig_of_two_bodies_in_millinewton_metres(tmp_path):
    top, bit, stiffness = 2e-3, 4e-4, 8e-3
    law = (0.006, 0.012, 0.5)
    motion = laboratory(70.0, top, bit, stiffness, 0.01, 5.0, *law)
    time, torque, speed, _ = sampled(motion, 100.0, 10.0, 70.0, (5e-5, 0.005))
    path = tmp_path / "rig.csv"
    np.savetxt(
        path, np.array([time, 1e3 * torque, speed]).T, delimiter=",", comments="",
        header="time (s),motor torque (mN*m),motor speed (rad/s)",
    )  # fmt: skip
    numbers = {
        "drillstring.sections.pipe.stiffness": stiffness, "drillstring.sections.pipe.damping": 0.0,
        "top_drive.inertia": top, "top_drive.damping": 0.0, "bha.inertia": bit, "bha.damping": 0.0,
    }  # fmt: skip
    rig = drillctl.load("navarro-lopez-2dof-bistable").replace(
        {path: units.SI(value) for path, value in numbers.items()}
    )
    result = identify(rig, [path])
    one = result.fitted
    truth = law[0] + (law[1] - law[0]) * np.exp(-law[2] * one.speed)
    assert result.sticks.all()
    assert one.torque == pytest.approx(truth, rel=0.03)
    assert np.mean((one.low <= truth) & (truth <= one.high)) > 0.9
    assert not any(number.off for number in result.numbers), result.numbers


@pytest.mark.parametrize("known", [True, False])
def test_the_bit_stands_still_where_it_did(motion, tmp_path, known):
    samples = sampled(motion, 20.0, 60.0, 240.0, NOISE)
    path = write(tmp_path / "a.csv", samples, columns=3 if known else 4)
    result = log_overview(design() if known else None, [path])
    assert result.sticking_from == ("waves" if known else "downhole speed")
    time, bit = samples[0], samples[3]
    seen = (time > 12.0) & (time < 168.0)  # what the waves tell
    marked = np.zeros(len(time), bool)
    for begin, end in result.sticking:
        marked |= (time >= begin) & (time <= end)
    assert np.mean((marked == (bit < 0.05 * samples[2].mean()))[seen]) > 0.97
    assert 0.3 < np.nanmean(result.windows.stuck) < 0.6


def test_the_command_writes_what_others_run(noisy, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    command = ["identify", "monteiro-trindade-140kn", "--log", str(noisy), "--out", "o", "--json"]
    assert run(command) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["law"] == "navarro-lopez-suarez"
    assert set(found["string"]) == {"travel_time", "impedance", "bit_inertia", "drive_inertia"}
    assert len(found["curve"]["low"]) == len(found["curve"]["speed"])
    for name in ("curve", "window", "profile"):
        assert (tmp_path / "o" / f"identified-{name}.png").stat().st_size > 5000
    assert run(["validate", "o/identified.toml"]) == 0
    assert run(command) == 0  # shown again
    assert "already done" in capsys.readouterr().err
    assert drillctl.open("o").summary() == {k: v for k, v in found.items() if k != "warnings"}


def test_a_report_of_a_design_that_names_its_log(noisy, tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(
        f'schema = 1\nmodel = "monteiro-trindade-140kn"\n[log]\nfiles = ["{noisy}"]\n'
        "[identify]\ndraws = 20\n"
    )
    made = drillctl.report(drillctl.load(path), tmp_path / "r", sections=["log"])
    assert made.content["sections"] == ["log"]
    text = made.files["html"].read_text(encoding="utf-8")
    assert "Friction from the log" in text
    assert "computed from the waves alone" in text
