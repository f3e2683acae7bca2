"""Friction of the wall at nodes of the string: published case, both engines, special cases."""

from __future__ import annotations

import numpy as np
import pytest

import drillctl
from drillctl.errors import InputError
from drillctl.rig.well.wall import edges_of
from drillctl.simulation import simulate
from drillctl.simulation.batch import prepare
from drillctl.simulation.kernels import wall_step
from drillctl.simulation.lanes import single_lane

WELL_A = "well-a-off-bottom"
# The front of slip has passed, and the bit sticks again, within eight seconds.
SHORT = {"well.tension": False, "simulation.duration": "8 s", "simulation.j1_from": "0 s"}
ENGINES = ("reference", "batch")


@pytest.fixture(scope="module")
def runs():
    """Well A without tension in the side force, by both engines."""
    design = drillctl.load(WELL_A, **SHORT)
    return {engine: simulate(design, engine, interval=0.005) for engine in ENGINES}


@pytest.mark.parametrize("engine", ENGINES)
def test_first_cycle_of_well_a(runs, engine):
    """Against characteristics on 12 000 cells, each with its share of the friction."""
    run = runs[engine]
    time, bit, pipe = run.time, run.signals["bit_speed"], run.signals["pipe_torque"]
    turns = int(np.argmax(np.abs(bit) > 0.01))
    assert time[turns] == pytest.approx(3.43, abs=0.035)
    before = time < 5.0
    assert pipe[before].max() == pytest.approx(12_840, rel=0.01)
    assert time[before][pipe[before].argmax()] == pytest.approx(4.32, abs=0.06)
    later = time > time[turns] + 0.5
    sticks = int(np.argmax(later & (np.abs(bit) < 0.01)))
    assert time[sticks] == pytest.approx(6.895, abs=0.03)
    assert bit[:sticks].max() == pytest.approx(17.64, rel=0.01)


def test_engines_agree_until_the_bit_sticks_again(runs):
    values = {"simulation.duration": "6.8 s"}
    j1 = [simulate(runs[e].design, e, **values).measures.j1 for e in ENGINES]
    assert j1[0] == pytest.approx(j1[1], rel=5e-3)
    assert runs["batch"].status == runs["reference"].status == "sticking"
    works = [runs[engine].measures.work_at_wall for engine in ENGINES]
    assert works[0] == pytest.approx(works[1], rel=2e-2)


def test_energy_balances_with_the_dissipation_along_the_wall(runs):
    energy = runs["reference"].energy
    assert energy.wall > 10.0 * abs(energy.bit)
    assert energy.relative_residual < 1e-7
    assert energy.summary()["wall"] == energy.wall


@pytest.mark.parametrize("engine", ENGINES)
def test_parts_that_stick_are_shown(runs, engine):
    run = runs[engine]
    edges = edges_of(run.design.wall, run.design.string.depth)
    assert run.wall_depth == pytest.approx(edges)
    assert run.wall_stuck.shape == (len(run.time), 12)
    length = run.signals["stuck_length"]
    assert length[0] == pytest.approx(edges[-1] - edges[0])  # all of it at the start
    assert length[int(np.argmax(run.signals["bit_speed"]))] < 0.2 * length[0]
    # The front of slip runs down the string: upper nodes break loose first.
    first = [int(np.argmax(run.wall_stuck[:, node] == 0.0)) for node in range(12)]
    assert first == sorted(first)
    assert first[0] > 0  # all of them do
    assert len(drillctl.plots.sticking(run).axes) == 2


def test_a_run_without_a_wall_has_no_picture_of_it():
    run = simulate(drillctl.load(WELL_A, **SHORT, **{"well.friction_factor": None}), "batch")
    assert run.wall_stuck is None
    assert run.measures.work_at_wall == 0.0
    with pytest.raises(InputError, match="the wall does not rub"):
        drillctl.plots.sticking(run)


@pytest.mark.parametrize("engine", ENGINES)
def test_one_node_at_the_bit_is_coulombs_law(engine):
    plain = {"controller.kp": 900.0, "controller.ki": 300.0, "simulation.duration": "20 s",
             "drillstring.sections.pipe.elements": 20, "drillstring.sections.bha.elements": 5,
             "simulation.step": "10 ms"}  # fmt: skip
    one = {"well.friction_nodes": 1, "well.friction_ratio": 1.0}
    walled = drillctl.load(WELL_A, **SHORT).replace(plain | one)
    assert walled.wall.nodes == (walled.string.nodes - 1,)
    rock = walled.replace({
        "well.friction_factor": None, "bit_rock.a": walled.wall.total / 1e3,
        "operating_point.weight_on_bit": "1 kN",
    })  # fmt: skip
    assert rock.wall is None
    found, expected = (simulate(design, engine) for design in (walled, rock))
    assert found.measures.sticks == expected.measures.sticks > 0
    for name in ("j1", "stuck_time", "peak_bit_speed", "peak_pipe_torque", "work_at_bit"):
        value = getattr(expected.measures, name)
        assert getattr(found.measures, name) == pytest.approx(value, rel=1e-9), name


def test_more_sweeps_change_little(runs):
    """The six of the kernel against the inclusion of a step solved to rounding, on its matrix."""
    design = runs["batch"].design
    prepared = prepare(single_lane(design), design.tables.simulation)
    matrix = prepared.stepper.string.by_wall
    assert np.linalg.cond(matrix) < 60.0
    friction, random = design.wall.torque[:-1], np.random.default_rng(5)

    def solve(free, torque, sweeps):
        torque = torque.copy()
        for _ in range(sweeps):
            for k in range(len(torque)):
                rest = free[k] - matrix[k] @ torque + matrix[k, k] * torque[k]
                torque[k] = np.clip(rest / matrix[k, k], -friction[k], friction[k])
        return torque

    for _ in range(20):  # from the torques of the last step, a step's change of speed away
        free = matrix @ (friction * random.uniform(-1.5, 1.5, len(friction)))
        before = solve(free, 0.0 * friction, 400)
        free = free + 0.1 * random.standard_normal(len(friction))
        exact, found = (solve(free, before, n) for n in (400, wall_step.SWEEPS))
        slid = np.abs(matrix @ (found - exact))
        assert slid.max() < 1e-5  # rad/s; five sweeps leave twice that


def test_nodes_are_many_where_the_wall_rubs():
    design = drillctl.load(WELL_A)
    nodes = design.wall.nodes
    assert len(nodes) == 12
    assert nodes[-1] == design.string.nodes - 1
    assert design.string.depth[nodes[0]] > 1500.0
    assert design.wall.torque.sum() == pytest.approx(10_736.65, rel=1e-6)
    lighter = design.replace(
        {"operating_point.weight_on_bit": "50 kN", "well.mud_density": "1.2 sg"}
    )
    assert lighter.wall.nodes == nodes  # lanes of one string share them
    assert lighter.wall.total < design.wall.total


def test_cycles_are_not_looked_for_where_the_wall_rubs():
    with pytest.raises(InputError, match="cycles are not found where the wall rubs"):
        drillctl.limit_cycle(drillctl.load(WELL_A))
