"""Friction of the wall at nodes of the string: published case, both engines, special cases."""

from __future__ import annotations

import numpy as np
import pytest

import drillctl
from benchmarks.wall_campaign import design_of
from drillctl.design import Design
from drillctl.design.validation import validated
from drillctl.errors import InputError
from drillctl.linear.ends import ends_of
from drillctl.linear.operating_point import operating_point
from drillctl.linear.slope_margin import slope_margin
from drillctl.rig.well.wall import edges_of
from drillctl.simulation import simulate
from drillctl.simulation.kernels import advance, wall_step
from drillctl.simulation.reference import solve
from drillctl.simulation.run import sample

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
    assert time[turns] == pytest.approx(3.43, abs=0.03)
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
    assert j1[0] == pytest.approx(j1[1], rel=1e-2)
    assert runs["batch"].status == runs["reference"].status == "sticking"
    works = [runs[engine].measures.work_at_wall for engine in ENGINES]
    assert works[0] == pytest.approx(works[1], rel=2e-2)


@pytest.mark.parametrize(
    ("number", "until"),
    # Falling rock: a light drive, a jump of the friction, a stiff drive that sends waves back.
    [(1, "5.5 s"), (5, "3.17 s"), (40, "5.418 s")],
)
def test_engines_agree_over_random_wells(number, until):
    """Up to where the bit sticks again; all sixty are in `benchmarks/wall_campaign.py`."""
    values = {"simulation.duration": until, "simulation.accuracy": "fine"}
    design = design_of(number).replace(values)
    exact, found = sample(solve(design, 1e-10)), simulate(design, "batch")
    assert found.measures.j1 == pytest.approx(exact.measures.j1, rel=1e-2)
    assert found.status == exact.status


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


@pytest.mark.parametrize(
    "axial",
    ["0 m/s", pytest.param("30 m/h", marks=pytest.mark.slow)],  # a kernel each
)
def test_more_sweeps_change_little(axial, monkeypatch):
    """The fixed number of the kernel against the inclusion of each step solved to rounding."""
    values = {"simulation.duration": "6.8 s", "well.axial_speed": axial}
    design = drillctl.load(WELL_A, **SHORT).replace(values)
    found = simulate(design, "batch").measures
    monkeypatch.setattr(wall_step, "SWEEPS", 40)
    many = advance._compile(on_disk=False)
    monkeypatch.setattr(advance, "kernel", lambda *laws: many)
    exact = simulate(design, "batch").measures
    assert found.j1 != exact.j1
    for name in ("j1", "peak_pipe_torque", "work_at_wall"):  # three sweeps leave six times that
        assert getattr(found, name) == pytest.approx(getattr(exact, name), rel=1e-6), name
    assert found.peak_bit_speed == pytest.approx(exact.peak_bit_speed, rel=3e-6)


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


@pytest.mark.parametrize("axial", ["30 m/h", "0.2 m/s"])  # drilling ahead, running in
def test_a_string_that_drifts_never_sticks(axial):
    values = {"well.axial_speed": axial, "simulation.duration": "6.8 s"}
    design = drillctl.load(WELL_A, **SHORT).replace(values)
    runs = {engine: simulate(design, engine) for engine in ENGINES}
    energy = runs["reference"].energy
    assert energy.relative_residual < 1e-8
    assert energy.damping > 0.0
    work = runs["batch"].measures.work_at_wall
    assert energy.wall == pytest.approx(work, rel=1e-2)
    j1, peak = (
        [getattr(runs[engine].measures, name) for engine in ENGINES]
        for name in ("j1", "peak_bit_speed")
    )
    assert j1[0] == pytest.approx(j1[1], rel=1e-2)
    assert peak[0] == pytest.approx(peak[1], rel=3e-2)
    for run in runs.values():
        assert run.wall_stuck[:, :-1].sum() == 0.0
        assert run.measures.work_at_bit == 0.0  # what rubs at the bit is of the wall


def test_the_share_of_the_friction_is_that_of_torque_and_drag():
    values = {"well.axial_speed": "0.1 m/s", "well.friction_ratio": 1.0}
    design = drillctl.load(WELL_A, **values)
    along_well = drillctl.torque_drag(design).torque["rotating"][0]
    assert along_well == pytest.approx(design.wall.at_speed(design.speed), rel=1e-4)
    assert along_well < 0.999 * drillctl.load(WELL_A).wall.total


def test_sliding_along_the_well_damps_the_linear_loop():
    design = drillctl.load(WELL_A, **{"well.axial_speed": "0.1 m/s"})
    still = design.replace({"well.axial_speed": "0 m/s"})
    assert still.sliding_string is still.string
    step = 1e-4
    faster, slower = (design.wall.at_speed(design.speed + k * step) for k in (1, -1))
    slopes = design.wall.slopes(design.speed)
    assert slopes.sum() == pytest.approx((faster - slower) / (2.0 * step), rel=1e-6)
    # The dampers stand at the nodes, in the matrices and in the sections alike.
    added = (design.sliding_string.damping - design.string.damping).diagonal()
    assert added[list(design.wall.nodes[:-2])] == pytest.approx(slopes[:-2])
    assert added[-1] == pytest.approx(slopes[-2])
    s = 1j * np.linspace(0.5, 20.0, 9)
    by_sections, by_matrices = (
        ends_of(design.sliding_string, model).mobility(s)
        for model in ("finite-elements", "matrices")
    )
    for one, other in zip(by_sections, by_matrices, strict=True):
        assert one == pytest.approx(other, rel=1e-9)
    margins = [
        slope_margin(ends_of(one.sliding_string), *one.top_drive.gains())[0]
        for one in (still, design)
    ]
    assert margins[1] > 2.0 * margins[0]


def test_a_drive_without_integral_action_carries_the_wall():
    """Steady speed of a proportional drive: what is missing to the set speed holds the wall."""
    values = {"controller.ki": 0.0, "controller.kp": 6e3}
    design = drillctl.load(WELL_A, **values)
    point = operating_point(design)
    drag = design.string.ground_damping.sum() * point.speed
    held = design.wall.ratio * design.wall.total + drag
    assert 6e3 * (design.speed - point.speed) == pytest.approx(held, rel=1e-9)


def test_a_design_without_a_friction_factor_has_the_bits_of_one_without_a_well():
    """Survey, mud density and friction nodes are no part of the motion by themselves."""
    with_well = drillctl.load(WELL_A, **SHORT, **{"well.friction_factor": None})
    tree = {key: value for key, value in with_well.tree.items() if key != "well"}
    bare = Design(with_well.name, validated(tree, ""), tree)
    assert with_well.wall is bare.wall is None
    for engine in ENGINES:
        found, expected = (simulate(one, engine) for one in (with_well, bare))
        assert found.measures == expected.measures
        for name, signal in expected.signals.items():
            assert np.array_equal(found.signals[name], signal), name


@pytest.mark.parametrize("axial", ["0 m/s", "0.1 m/s"])
def test_the_scheme_is_of_second_order(axial):
    """From rest through the first slip, where no friction jumps at a critical speed."""
    design = drillctl.load(WELL_A, **SHORT).replace({
        "well.friction_ratio": 1.0, "well.axial_speed": axial, "simulation.duration": "6 s",
        "drillstring.sections.pipe.elements": 32, "drillstring.sections.bha.elements": 8,
        "simulation.modes": 41,
    })  # fmt: skip
    exact = simulate(design, "reference").measures.j1
    coarse, fine = (
        abs(simulate(design.replace({"simulation.step": step}), "batch").measures.j1 - exact)
        for step in ("4 ms", "1 ms")
    )
    assert coarse < 3e-5 * exact
    assert 0.5 * np.log2(coarse / fine) == pytest.approx(2.0, abs=0.3)
