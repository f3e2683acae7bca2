"""Gains over depth against exact lines, rules and the search; where they must be changed."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

import drillctl
from drillctl import units
from drillctl.errors import InputError
from drillctl.studies.recommend.candidates import gains_of
from drillctl.studies.schedule.compute import reflection, schedule, searched
from drillctl.studies.schedule.strings import Along
from drillctl.studies.tune.search import search_problem
from drillctl.studies.tune.tuned import tuned_parameters

HOLDS = {
    "gains over depth": "periods, integral gain and reflection of gains from 0.8 of each depth "
    "against the characteristic equation of a uniform pipe, to 0.1 %",
}
LINE = {
    "operating_point.weight_on_bit": "140 kN",
    "schedule.law": "soft-torque",
    "schedule.values": "500 m:5000 m:10",
}
ZETA, SPEED, BIT = 297.061, 3184.357, 394.0  # of the pipe (N m s, m/s) and the bit (kg m2)


def line(**values):
    return drillctl.load("monteiro-trindade-2012", **LINE | values)


def lowest(depth):
    """Lowest root of w J_b tan(w L/c) = zeta (rad/s)."""
    end = 0.5 * math.pi * SPEED / depth
    return brentq(
        lambda w: w * BIT * math.sin(w * depth / SPEED) - ZETA * math.cos(w * depth / SPEED),
        1e-9, end,
    )  # fmt: skip


STALE = {
    2900: {500: 0.841, 1000: 0.777, 3000: 0.691, 5000: 0.663},
    500: {500: 0.618, 1000: 0.609, 3000: 0.604, 5000: 0.602},
}
PERIOD = {500: 2.9238, 1000: 4.2143, 3000: 7.8409, 5000: 10.7992}


@pytest.mark.parametrize("inertia", STALE)
def test_a_uniform_pipe_has_gains_and_reflections_of_the_exact_line(inertia):
    along = Along(line(**{"top_drive.inertia": f"{inertia} kg*m^2"}))
    for depth, period in PERIOD.items():
        omega, earlier = lowest(depth), lowest(0.8 * depth)
        there = along.by_rule(float(depth))
        assert 2.0 * math.pi / there.string.stick_slip_frequency == pytest.approx(period, rel=1e-3)
        gains = gains_of(there)
        assert gains["controller.kp"] == pytest.approx(4.0 * ZETA, rel=1e-3)
        assert gains["controller.ki"] == pytest.approx(omega**2 * inertia, rel=1e-3)
        assert reflection(there) == pytest.approx(0.6, rel=1e-3)
        kept = along.by_rule(0.8 * depth)
        stale = reflection(there.replace(gains_of(kept)))
        z = 4.0 * ZETA + 1j * (omega * inertia - earlier**2 * inertia / omega)
        assert stale == pytest.approx(abs((ZETA - z) / (ZETA + z)), rel=1e-3)
        assert stale == pytest.approx(STALE[inertia][depth], abs=6e-4)


SMALL = {
    "schedule.values": "2000 m:3000 m:3",
    "schedule.realizations": 20,
    "simulation.accuracy": "fast",
    "simulation.duration": "40 s",
    "recommend.speed_step": "25 rpm",
    "recommend.weight_step": "35 kN",
}


@pytest.fixture(scope="module")
def heavy():
    return schedule(line(**SMALL | {"top_drive.inertia": "2900 kg*m^2"}))


def test_a_heavy_drive_needs_a_schedule_and_changes_where_it_reflects_too_much(heavy):
    assert not heavy.hardly_needed
    assert heavy.sentence.startswith("A schedule is needed from 2000 m to 3000 m")
    along = Along(heavy.design)
    assert heavy.changes
    for one in heavy.changes:
        there, before = along.by_rule(one.depth), along.by_rule(one.before)
        kept = reflection(there.replace(gains_of(before)))
        assert kept - reflection(there) == pytest.approx(0.1, abs=1e-3)
    told = ", ".join(units.full(one.depth, "m", 5) for one in heavy.changes)
    assert f"set new gains at {told} (there the old ones reflect 0.1 more" in heavy.sentence
    assert [one.before for one in heavy.changes] == [2000.0, *(x.depth for x in heavy.changes[:-1])]


def test_a_light_drive_needs_almost_none():
    light = schedule(line(**SMALL | {"schedule.values": "2500 m:3000 m:2"}))
    assert light.hardly_needed
    assert light.costs < 0.01
    assert light.changes == ()
    assert light.sentence.startswith("Almost no schedule is needed from 2500 m to 3000 m")
    assert light.sentence.endswith("the gains of 2500 m do to the end.")
    assert light.summary()["change_at"] == []
    row = replace(light.rows[-1], hits=20, stale_hits=2)
    lost = replace(light, rows=(light.rows[0], row)).sentence
    assert lost.startswith("A schedule is needed")
    assert "and lose the required probability at 3000 m" in lost


def test_the_table_of_stands_holds_the_rule_at_each(heavy):
    assert np.diff(heavy.stands).max() <= heavy.design.tables.schedule.stand + 1e-9
    assert (heavy.stands[0], heavy.stands[-1]) == (2000.0, 3000.0)
    at = len(heavy.stands) // 2
    gains = gains_of(Along(heavy.design).by_rule(float(heavy.stands[at])))
    assert {path: one[at] for path, one in heavy.stand_gains.items()} == gains


def test_the_picture_gives_the_unit_of_each_number(heavy):
    gains = {"controller.absorption": 1.0, "controller.high_pass": 20.0}
    rows = tuple(replace(one, gains=gains, stale_gains=gains) for one in heavy.rows)
    panels = drillctl.plots.schedule(replace(heavy, rows=rows)).axes
    assert [panel.get_ylabel() for panel in panels[:2]] == ["absorption", "high-pass (s)"]


def test_searched_gains_begin_with_those_of_the_depth_before():
    values = {"schedule.law": "tuned", "schedule.realizations": 12, "schedule.kept_from": 0.9}
    result = schedule(line(**SMALL | values | {"schedule.values": "2800 m:3000 m:2"}))
    first, last = result.rows
    along = Along(result.design)
    assert last.gains == searched(along.by_rule(3000.0), first.gains)
    assert last.gains != searched(along.by_rule(3000.0), None)
    tuned = tuned_parameters(along.by_rule(3000.0).replace({"tune.realizations": 12}))
    problem = search_problem(along.by_rule(3000.0).replace({"tune.realizations": 12}), tuned)
    both = np.array([list(one.gains.values()) for one in (first, last)])
    before, found = problem.points(both, 12)
    assert found.merit <= before.merit
    # Between two depths gains go with powers of the depth.
    assert last.stale_gains["controller.kp"] == pytest.approx(first.gains["controller.kp"])
    middle = float(np.interp(2900.0, result.stands, result.stand_gains["controller.kp"]))
    ends = sorted(one.gains["controller.kp"] for one in result.rows)
    assert ends[0] - 1e-6 <= middle <= ends[1] + 1e-6


def test_pipe_is_added_at_the_top_joint_by_joint():
    land = drillctl.load("typical-land")
    along = Along(land)
    depths = along.values()
    sections = land.tables.drillstring.sections
    whole = sum(one.span for one in sections)
    assert depths[-1] == pytest.approx(whole)
    assert depths[0] == pytest.approx(whole - 0.5 * sections[0].span)
    same, half = along.at(float(depths[-1])), along.at(float(depths[0]))
    assert same.string.stick_slip_frequency == pytest.approx(
        land.string.stick_slip_frequency, rel=1e-4
    )
    spans = [one.span for one in half.tables.drillstring.sections]
    assert sum(spans) == pytest.approx(depths[0])
    assert half.string.pipe_impedance == pytest.approx(land.string.pipe_impedance)


@pytest.mark.parametrize(
    ("values", "problem"),
    [
        ({"schedule.values": "500 m:5000 m"}, "first:last:points"),
        ({"schedule.values": "500 m:5000 m:1"}, "2 values or more"),
        ({"schedule.values": "500 m:500 m:3"}, "begins where it ends"),
        ({"schedule.values": "500 kg:5000 m:3"}, "schedule.values"),
        ({"schedule.kept_from": 1.0}, "less than 1"),
        ({"schedule.along": "bha.inertia"}, "is not a unit of inertia"),
    ],
)
def test_impossible_schedules_are_refused(values, problem):
    with pytest.raises(InputError, match=problem):
        Along(line(**values)).values()


def test_any_axis_that_changes_the_string_has_a_schedule():
    along = Along(line(**{"schedule.along": "bha.inertia", "schedule.values": "300:500:3"}))
    with pytest.raises(InputError):
        along.values()
    asked = {"schedule.along": "bha.inertia", "schedule.values": "300 kg*m^2:500 kg*m^2:3"}
    along = Along(line(**asked))
    assert along.values().tolist() == [300.0, 400.0, 500.0]
    assert along.at(400.0).tables.bha.inertia == 400.0
