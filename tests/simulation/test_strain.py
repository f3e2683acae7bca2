"""Torque in every section: against a direct integration of the string between its two ends."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import drillctl
from drillctl.simulation.strain import section_peaks

STRING = """schema = 1
model = "monteiro-trindade-120kn"
[drillstring]
tally_from = "top"
stiffness_damping = "2e-3 s"
tally = '''
name,  length [m], OD [mm], ID [mm], grade
pipe,  1500,       127,     108.6,   S-135
light, 600,        89,      70,      E-75
heavy, 100,        165,     71,      -
'''
[start]
kind = "turning"
speed = "60 rpm"
[simulation]
duration = "12 s"
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    path = tmp_path_factory.mktemp("strain") / "rig.toml"
    path.write_text(STRING, encoding="utf-8")
    return drillctl.simulate(drillctl.load(path))


def test_the_peak_in_each_section_is_that_of_a_direct_integration(run):
    string, speed = run.design.string, run.design.speed
    mass, damping, stiffness = (
        x.toarray() for x in (string.mass, string.damping, string.stiffness)
    )
    n, time, solver = string.nodes, run.time, np.linalg.inv(mass)
    ends = np.zeros((n, 2))
    ends[0, 0], ends[-1, 1] = 1.0, -1.0

    def rates(t, state):
        torque = [np.interp(t, time, run.signals[name]) for name in ("top_torque", "bit_torque")]
        force = ends @ torque - damping @ state[n:] - stiffness @ state[:n]
        return np.concatenate([state[n:], solver @ force])

    begin = np.concatenate([np.zeros(n), np.full(n, 2 * np.pi - speed)])
    states = solve_ivp(rates, (0.0, 12.0), begin, t_eval=time, max_step=0.01, rtol=1e-5).y
    twist, turn = -np.diff(states[:n], axis=0), -np.diff(states[n:], axis=0)
    torque = string.element_stiffness[:, None] * twist + string.element_damping[:, None] * turn
    peaks = np.abs(torque).max(axis=1)
    of = {name: peaks[[x == name for x in string.node_section[1:]]].max() for name in run.yields}
    assert list(of) == ["pipe", "light"]  # the grade of the third is not known
    assert run.section_torque == pytest.approx(of, rel=5e-3)
    assert run.section_torque["pipe"] == pytest.approx(run.measures.peak_pipe_torque, rel=0.02)


def test_shares_are_of_each_section_s_own_yield(run):
    shares = {name: one["share"] for name, one in run.yields.items()}
    assert shares["light"] > 2.0 * shares["pipe"] > 0.0
    assert run.summary()["yield"]["light"]["torsional_yield"] == pytest.approx(25.5e3, rel=0.01)


def test_a_map_compares_each_section_with_its_own_yield(run):
    axis = [{"path": "controller.kp", "min": 200.0, "max": 600.0, "points": 2}]
    design = run.design.replace({"map.axes": axis, "simulation.duration": "6 s"})
    made = drillctl.sweep(design, audit_cells=0)
    peaks = {
        name: max(
            drillctl.simulate(design.replace({"controller.kp": kp}), "batch").section_torque[name]
            for kp in (200.0, 600.0)
        )
        for name in ("pipe", "light")
    }
    assert made.section_torque == pytest.approx(peaks, rel=1e-9)
    light = made.over_yield["light"]
    assert light["largest_share"] == pytest.approx(peaks["light"] / light["torsional_yield"])
    assert list(made.over_yield) == ["pipe", "light"]
    assert light["cells"] == 0
    twice = made.section_torque | {"light": 10.0 * light["torsional_yield"]}
    over = dataclasses.replace(made, section_torque=twice).over_yield
    assert (over["light"]["cells"], over["pipe"]["cells"]) == (2, 0)


def test_nothing_is_computed_where_no_yield_is_known():
    design = drillctl.load("monteiro-trindade-120kn")
    assert section_peaks(design, np.zeros(2), {}) == {}
