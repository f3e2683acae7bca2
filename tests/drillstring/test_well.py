"""Path of a well, tension and torque of a soft string in it, and what a design says of both."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import drillctl
from drillctl.errors import InputError
from drillctl.rig.well.soft_string import Motion, Run, drag, lay, sinusoidal_limit
from drillctl.rig.well.survey import path_of, sharp_bends

WELL_A = "well-a-off-bottom"
THREE_DIMENSIONAL = tuple(
    (depth, math.radians(inc), math.radians(azi))
    for depth, inc, azi in ((0, 0, 0), (500, 0, 30), (1100, 40, 30), (2000, 60, 90))
)
RUNS = (
    Run("pipe", 0.0, 1700.0, 40.0, 0.005, 0.08, 0.0, 0.0),
    Run("collars", 1700.0, 2000.0, 150.0, 0.019, 0.1, 0.0, 0.0),
)


def test_a_path_by_minimum_curvature():
    place, tangent, bend = path_of(THREE_DIMENSIONAL).at(2000.0)
    assert place[0] == pytest.approx([440.8160, 669.3922, 1658.9595], abs=6e-5)
    assert tangent[0, 2] == pytest.approx(0.5)
    assert np.linalg.norm(bend) == 0.0  # straight on
    # A circle: any station between two of it is on the path as well.
    path = path_of(((0.0, 0.0, 0.0), (600.0, 1.0, 0.0)))
    place, tangent, bend = path.at([300.0])
    assert place[0] == pytest.approx([600 * (1 - math.cos(0.5)), 0.0, 600 * math.sin(0.5)])
    assert np.linalg.norm(bend) == pytest.approx(1.0 / 600.0)
    assert path_of(((100.0, 0.0, 0.0),)).at(250.0)[0][0, 2] == 250.0  # down to the first station


def test_sharp_bends_are_found():
    assert sharp_bends(path_of(((0.0, 0.0, 0.0), (30.0, math.radians(14.9), 0.0)))) == []
    ((depth, bend),) = sharp_bends(path_of(((0.0, 0.0, 0.0), (30.0, math.radians(15.1), 0.0))))
    assert (depth, math.degrees(bend) * 30.0) == (0.0, pytest.approx(15.1))
    survey = [["0 m", "0 deg", "0 deg"], ["30 m", "16 deg", "0 deg"]]
    warnings = drillctl.load("well-a-off-bottom", **{"well.survey": survey}).warnings
    assert any("16 deg/30 m" in str(one) for one in warnings)


def test_well_a_in_air():
    """Values of an independent computation; to the digits printed, survey and torque and drag."""
    result = drillctl.torque_drag(drillctl.load(WELL_A))
    cases = result.summary()["cases"]
    assert cases["rotating"]["torque"] == pytest.approx(10_736.65, abs=5e-3)
    loads = [cases[case]["hook_load"] for case in ("rotating", "pulling_out", "running_in")]
    assert loads == pytest.approx([935_357, 1_108_549, 816_379], abs=0.6)
    assert result.total_depth == pytest.approx((2196.1960, 632.8891, 0.0), abs=6e-5)
    alone = drillctl.torque_drag(drillctl.load(WELL_A, **{"well.tension": False}))
    assert alone.torque["off_bottom"][0] == pytest.approx(9_639.54, rel=2e-6)
    assert result.design.wall.total == pytest.approx(10_736.65, rel=1e-6)


@pytest.mark.parametrize("motion", [Motion(-1.0, 0.0), Motion(0.4, 5.0), Motion(0.0, 5.0)])
def test_the_soft_string_is_the_solution_of_its_equations(motion):
    """Inclination and azimuth in place of vectors, integrated adaptively."""
    path, mu, density = path_of(THREE_DIMENSIONAL), 0.3, 1200.0
    line = lay(path, RUNS, density)
    found = drag(line, np.full(len(line.run), mu), motion, 2e4, 500.0)

    def angles(s):
        tangent = path.at(s)[1][0]
        return math.acos(min(tangent[2], 1.0)), math.atan2(tangent[1], tangent[0])

    def rates(up, state):
        s, force = 2000.0 - up, state[0]
        run = RUNS[0] if s < 1700.0 else RUNS[1]
        (i, _), (i_up, a_up), (i_down, a_down) = (angles(x) for x in (s, s - 1e-3, s + 1e-3))
        q = 9.81 * (run.mass - density * run.displaced)
        build, turn = (i_down - i_up) / 2e-3, (a_down - a_up) / 2e-3 if i > 1e-6 else 0.0
        n = math.hypot(q * math.sin(i) - force * build, force * math.sin(i) * turn)
        axial, around = motion.shares(run.radius)
        return [q * math.cos(i) - mu * n * axial, mu * n * around * run.radius]

    state, upwards = [-2e4, 500.0], [0.0, 300.0, 900.0, 1500.0, 2000.0]
    for begin, end in pairwise(upwards):
        state = solve_ivp(
            rates, (begin + 0.002, end - 0.002), state, rtol=1e-6, max_step=50.0
        ).y[:, -1]  # fmt: skip
    assert found.tension[0] == pytest.approx(state[0], rel=1e-4)
    assert found.torque[0] == pytest.approx(state[1], rel=1e-4)


def test_mud_presses_on_the_steel():
    """A closed vertical string weighs what its steel does less the mud in its place."""
    line = lay(path_of(((0.0, 0.0, 0.0),)), RUNS, 1000.0)
    load = drag(line, np.zeros(len(line.run)), Motion(0.0, 1.0), 0.0, 0.0).hook_load
    assert load == pytest.approx(9.81 * (1700 * (40.0 - 5.0) + 300 * (150.0 - 19.0)))


def test_a_measured_torque_gives_the_friction_factor():
    design = drillctl.load(WELL_A, **{"torque_drag.off_bottom_torque": "12 kN*m"})
    result = drillctl.torque_drag(design)
    assert result.friction_factor == pytest.approx(0.3 * 12_000 / 10_736.65)
    assert result.torque["off_bottom"][0] == pytest.approx(12_000)
    cased = {"well.holes": [{"to": "2100 m", "diameter": "9 in", "friction_factor": 0.2},
                            {"diameter": "8 1/2 in"}]}  # fmt: skip
    partly = drillctl.torque_drag(design.replace(cased))
    assert partly.torque["off_bottom"][0] == pytest.approx(12_000)
    assert partly.friction_factor > result.friction_factor
    with pytest.raises(InputError, match=r"less than the 2.3\d+ kN\*m of the holes"):
        drillctl.torque_drag(design.replace(cased | {"torque_drag.off_bottom_torque": "1 kN*m"}))
    with pytest.raises(InputError, match=r"need a friction factor of 27\.9; .* at most 10"):
        drillctl.torque_drag(design.replace({"torque_drag.off_bottom_torque": "1000 kN*m"}))
    with pytest.raises(InputError, match="no friction factor follows"):
        drillctl.torque_drag(design.replace({"well.survey": [["0 m", "0 deg", "0 deg"]]}))


def test_what_a_sweep_or_a_trip_cannot_do_is_pointed_out():
    level = {
        "well.survey": [["0 m", "0 deg", "0 deg"], ["700 m", "90 deg", "0 deg"]],
        "well.holes": [{"to": "500 m", "diameter": "9 in", "friction_factor": 0.5},
                       {"diameter": "9 in", "friction_factor": 0.6}],
    }  # fmt: skip
    result = drillctl.torque_drag(drillctl.load(WELL_A, **level))
    assert result.summary()["cases"]["running_in"]["hook_load"] < 0.0
    assert np.ptp(result.torques["off_bottom"]) == 0.0
    said = " ".join(result.notes)
    assert "own: the sweep changes nothing" in said
    assert "does not go down by its own weight" in said
    assert drillctl.torque_drag(drillctl.load(WELL_A)).notes == ()


def test_compression_beyond_the_sinusoidal_limit_is_pointed_out():
    run = RUNS[1]._replace(top=0.0, bottom=1000.0, bending=2e7, clearance=0.03)
    line = lay(path_of(((0.0, 1.0, 0.0),)), (run,), 0.0)
    expected = 2.0 * math.sqrt(2e7 * 9.81 * 150.0 * math.sin(1.0) / 0.03)
    assert sinusoidal_limit(line, (run,)) == pytest.approx(np.full(len(line.run), expected))
    slim = drillctl.load("typical-slim")
    bent = {"well.survey": [["0 m", "0 deg", "0 deg"], ["500 m", "80 deg", "0 deg"]],
            "well.holes": [{"diameter": "17 1/2 in"}],
            "operating_point.weight_on_bit": "300 kN"}  # fmt: skip
    notes = drillctl.torque_drag(slim.replace(bent)).notes
    assert "rotating at the weight on bit of the design: compressed beyond" in notes[0]


def test_a_survey_is_read_from_a_file(tmp_path):
    (tmp_path / "survey.csv").write_text("Inc,Azi,MD\ndeg,deg,ft\n0,0,0\n10,45,1000\n")
    text = 'schema = 1\nmodel = "aarsnes-shor-well-a"\n[well]\nsurvey = "survey.csv"\n'
    (tmp_path / "rig.toml").write_text(text)
    survey = drillctl.load(tmp_path / "rig.toml").tables.well.survey
    assert survey[1] == pytest.approx((304.8, math.radians(10), math.radians(45)))


@pytest.mark.parametrize(
    ("survey", "message"),
    [
        ("MD (m),Azi (deg)\n0,0\n", "no column is the inclination"),
        ("MD,Inc (deg),Azi (deg)\n0,0,0\n", "measured depth in ''.* needs a unit, m or ft"),
        ("MD (m),Inc (deg),Azi (deg)\n0,0,0\n10,5\n", "line 3 has no column 3"),
        ([["0 m", "0 deg", "0 deg"], ["0 m", "1 deg", "0 deg"]], "0 m comes after 0 m"),
        ([["0 m", "-1 deg", "0 deg"]], "inclination -1 deg at 0 m"),
        ([["0 m", "0 deg", "0 deg"], ["9 m", "179.9 deg", "0 deg"]], "turns back on itself"),
    ],
)
def test_what_is_no_survey_is_refused(survey, message):
    with pytest.raises(InputError, match=message):
        drillctl.load("aarsnes-shor-well-a", **{"well.survey": survey})


def test_a_string_without_weight_is_refused_where_the_wall_rubs():
    with pytest.raises(InputError, match="linear_mass: is missing: a polar_moment says nothing"):
        drillctl.load(WELL_A, **{"drillstring.sections.bha.linear_mass": None})


def test_every_string_of_pipe_can_be_laid_into_a_vertical_well():
    result = drillctl.torque_drag(drillctl.load("monteiro-trindade-140kn"))
    weight = 9.81 * 7850 * 3000 * math.pi / 4 * (0.127**2 - 0.1086**2)
    cases = result.summary()["cases"]
    assert cases["off_bottom"] == {"hook_load": pytest.approx(weight), "torque": 0, "bit_torque": 0}
    assert cases["rotating"]["hook_load"] == pytest.approx(weight - 140e3)
    assert cases["rotating"]["torque"] == pytest.approx(6599.9, abs=0.1)
    assert "has no survey" in result.notes[0]
    lumped = drillctl.torque_drag(drillctl.load("navarro-lopez-2dof"))
    assert lumped.summary()["cases"]["off_bottom"]["hook_load"] == 0.0
    assert "of lumped springs" in lumped.notes[0]


def test_sections_with_and_without_tool_joints_have_their_weight():
    bare = {"name": "collar", "outer_diameter": "8 in", "inner_diameter": "3 in", "length": "100 m"}
    jointed = bare | {
        "joint_outer_diameter": "9 in", "joint_inner_diameter": "3 in", "joint_length": "1 m",
        "joint_spacing": "10 m",
    }  # fmt: skip
    body, thick = (math.pi / 4 * ((od * 0.0254) ** 2 - (3 * 0.0254) ** 2) for od in (8.0, 9.0))
    for section, area in ((bare, body), (jointed, 0.9 * body + 0.1 * thick)):
        design = drillctl.load("navarro-lopez-2dof", **{"drillstring.sections": [section]})
        found = drillctl.torque_drag(design).summary()["cases"]["off_bottom"]["hook_load"]
        assert found == pytest.approx(9.81 * 7850 * 100 * area)


def test_springs_without_a_body_do_not_drift():
    values = {"well.friction_factor": 0.3, "well.axial_speed": "1 m/min"}
    wall = drillctl.load("navarro-lopez-2dof", **values).wall
    assert not wall.torque.any()
    assert not wall.drifts
