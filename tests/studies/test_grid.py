"""Grids over parameters: axes, groups that share a string, and the numbers of every lane."""

from __future__ import annotations

import numpy as np
import pytest

import drillctl
from drillctl.design.tables import AxisTable
from drillctl.ensemble.grid import axes_of, axis, cell_design, groups, shape_of
from drillctl.errors import InputError
from drillctl.simulation.batch import _turns, prepare
from drillctl.simulation.lanes import lane_numbers
from drillctl.studies import sweep
from drillctl.units import RPM

PAPER = "monteiro-trindade-140kn"
COEFFICIENTS = {
    "bit_rock.law": "navarro-lopez-suarez",
    "bit_rock.a1": 0.03, "bit_rock.a2": 0.06, "bit_rock.beta": 0.1,
}  # fmt: skip


def table(path, low, high, points):
    return AxisTable(path=path, min=low, max=high, points=points)


def grid(design, *axes):
    return axes_of(design, tuple(table(*a) for a in axes))


@pytest.fixture(scope="module")
def paper():
    return drillctl.load(PAPER, **{"simulation.duration": "5 s"})


@pytest.fixture(scope="module")
def plain():
    """A rig with one set of friction coefficients and no table of them."""
    return drillctl.load("navarro-lopez-2dof-bistable", **COEFFICIENTS)


def lane(lanes, index):
    """What one lane holds, by the names of `lane_numbers`."""
    laws = {
        "friction": lanes.friction, "drive": lanes.drive, "weight": lanes.weight,
        "before": lanes.before, "speed_program": lanes.program.speed,
        "weight_program": lanes.program.weight,
    }  # fmt: skip
    held = {
        f"{part}.{name}": values[index]
        for part, law in laws.items()
        for name, values in law._asdict().items()
    }
    held["rock_until"] = lanes.program.rock_until[index]
    for name in (
        "set_speed",
        "turning_speed",
        "bit_speed",
        "nominal_weight",
        "table_low",
        "table_high",
    ):
        held[name] = getattr(lanes, name)[index]
    return held


def check_every_cell(design, axes):
    """Each lane is what its cell gives when resolved as a whole; return the groups."""
    found = list(groups(design, axes))
    for group in found:
        assert len(group.lanes) == len(group.cells)
        for index, cell in enumerate(group.cells):
            alone = cell_design(design, axes, int(cell))
            assert lane(group.lanes, index) == lane_numbers(alone)
            assert group.design.tables.drillstring == alone.tables.drillstring
            assert group.design.tables.top_drive == alone.tables.top_drive
            assert group.design.tables.bha == alone.tables.bha
            assert group.design.tables.simulation == alone.tables.simulation
    cells = np.concatenate([group.cells for group in found])
    np.testing.assert_array_equal(np.sort(cells), np.arange(np.prod(shape_of(axes))))
    return found


# --- axes ------------------------------------------------------------------------------------


def test_axes_are_in_si(paper):
    speed, weight, gain, factor = grid(
        paper,
        ("operating_point.speed", "60 rpm", "120 rpm", 3),
        ("operating_point.weight_on_bit", "100 kN", "20 tf", 2),
        ("controller.kp", 0, 1000, 5),
        ("bit_rock.a1_factor", 0.9, 1.1, 3),
    )
    np.testing.assert_allclose(speed.values, np.array([60, 90, 120]) * RPM, rtol=1e-15)
    np.testing.assert_allclose(weight.values, [100e3, 20 * 9806.65], rtol=1e-15)
    np.testing.assert_array_equal(gain.values, [0.0, 250.0, 500.0, 750.0, 1000.0])
    assert [a.unit for a in (speed, weight, gain, factor)] == ["rad/s", "N", "N*m*s/rad", ""]
    assert len(factor) == 3
    assert shape_of((speed, weight, gain, factor)) == (3, 2, 5, 3)


@pytest.mark.parametrize(
    ("path", "shared"),
    [
        ("drillstring.sections.pipe.length", True), ("top_drive.inertia", True),
        ("bha.damping", True), ("simulation.duration", True), ("controller.kp", False),
        ("operating_point.weight_on_bit", False), ("start.speed", False),
    ],
)  # fmt: skip
def test_what_lanes_share(paper, path, shared):
    from drillctl.studies import Axis

    assert Axis(path, "", np.zeros(2)).shared is shared


def test_axes_of_other_units_or_none_at_all_are_refused(paper):
    from drillctl.studies import Axis

    with pytest.raises(
        InputError, match=r"operating_point\.speed: values are SI, in rad/s and not"
    ):
        sweep(paper, (Axis("operating_point.speed", "rpm", np.array([60.0, 120.0])),))
    with pytest.raises(
        InputError, match=r"'controller\.kp' is no axis; write drillctl\.studies\.Axis"
    ):
        sweep(paper, {"controller.kp": [200.0, 300.0]})
    listed = sweep(paper, (Axis("controller.kp", "N m s", [500.0, 600.0]),), audit_cells=0)
    assert listed.regions


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (("controller.kq", 0, 1, 3), "map.axes controller.kq: no numeric parameter"),
        (("operating_point.speed", 60, 120, 3), 'did you mean "60 rpm"'),
        (("operating_point.speed", "60 kN", "120 rpm", 3), "60 kN"),
        (("controller.kp", 3, 3, 2), "must be less"),
        (("controller.kp", 4, 3, 2), "must be less"),
        (("drillstring.sections.pipe.elements", 1, 4, 3), "2.5 is not a whole number"),
    ],
)
def test_axes_that_do_not_fit(paper, asked, words):
    with pytest.raises(InputError, match=words) as told:
        axis(paper, table(*asked))
    assert f"map.axes {asked[0]}" in str(told.value)


def test_grids_too_large_are_refused_before_they_are_made(paper, monkeypatch):
    monkeypatch.setattr("drillctl.ensemble.grid._free_memory", lambda: 1e6)
    assert shape_of(grid(paper, ("controller.kp", 0, 1, 1000))) == (1000,)
    with pytest.raises(InputError, match=r"10,000 cells need about 0\.0 GiB"):
        grid(paper, ("controller.kp", 0, 1, 100), ("controller.ki", 0, 1, 100))
    monkeypatch.setattr("drillctl.ensemble.grid._free_memory", lambda: float("inf"))
    assert shape_of(grid(paper, ("controller.kp", 0, 1, 100), ("controller.ki", 0, 1, 100)))


def test_axes_given_by_hand_are_refused_too(paper, monkeypatch):
    axes = grid(paper, ("controller.kp", 0, 1, 100))
    monkeypatch.setattr("drillctl.ensemble.grid._free_memory", lambda: 1e4)
    with pytest.raises(InputError, match="fewer points"):
        sweep(paper, axes)


# --- lanes -----------------------------------------------------------------------------------

OWN = {
    "gains": [("controller.kp", 0, 1000, 3), ("controller.ki", 0, 500, 2)],
    "one axis": [("controller.kp", 10, 900, 4)],
    "one number twice": [
        ("operating_point.weight_on_bit", "90 kN", "150 kN", 3),
        ("bit_rock.a1_factor", 0.9, 1.1, 2),
    ],
    "two factors": [("bit_rock.a1_factor", 0.5, 1.1, 3), ("bit_rock.a2_factor", 1.0, 1.5, 3)],
    "speed and start": [
        ("operating_point.speed", "60 rpm", "120 rpm", 3), ("start.speed", "20 rpm", "90 rpm", 2),
    ],
    "three": [
        ("controller.ki", 0, 500, 2), ("operating_point.speed", "60 rpm", "120 rpm", 2),
        ("bit_rock.beta_factor", 0.5, 2.0, 3),
    ],
}  # fmt: skip


@pytest.mark.parametrize("case", OWN)
def test_lanes_are_their_cells(paper, case):
    found = check_every_cell(paper, grid(paper, *OWN[case]))
    assert len(found) == 1
    assert found[0].design is not None


def test_an_axis_that_another_switches_off_at_its_end(plain):
    """At a1 = 0 its factor changes nothing; elsewhere it does."""
    check_every_cell(
        plain, grid(plain, ("bit_rock.a1", 0, 0.03, 3), ("bit_rock.a1_factor", 1, 2, 3))
    )
    check_every_cell(
        plain, grid(plain, ("bit_rock.a1_factor", 1, 2, 3), ("bit_rock.a1", 0, 0.03, 3))
    )


@pytest.mark.parametrize(("a1", "a2"), [((0.05, 0.1), (0.2, 0.3)), ((0.005, 0.015), (0.02, 0.028))])
def test_values_possible_only_together(plain, a1, a2):
    """Every cell is, though a1 = 0.1 is not with the design's own a2 = 0.06, nor a2 with its a1."""
    check_every_cell(plain, grid(plain, ("bit_rock.a1", *a1, 3), ("bit_rock.a2", *a2, 3)))


@pytest.mark.parametrize("swapped", [False, True])
def test_an_impossible_corner_is_told(plain, swapped):
    """Either axis is possible with the design's other value; not a1 = 0.055 with a2 = 0.04."""
    asked = [("bit_rock.a1", 0.03, 0.055, 3), ("bit_rock.a2", 0.04, 0.3, 3)]
    with pytest.raises(InputError, match=r"a2 = 0\.04 must not be less than a1") as told:
        list(groups(plain, grid(plain, *(reversed(asked) if swapped else asked))))
    assert "map.axes: at " in str(told.value)
    assert "bit_rock.a1 = " in str(told.value)


def test_large_grids_are_not_resolved_cell_by_cell(paper, monkeypatch):
    resolved = []
    real = drillctl.Design.replace
    monkeypatch.setattr(drillctl.Design, "replace", lambda *a: resolved.append(1) or real(*a))
    axes = grid(paper, ("controller.kp", 0, 1000, 60), ("controller.ki", 0, 500, 50))
    (group,) = groups(paper, axes)
    assert len(group.lanes) == 3000
    assert len(resolved) < 130


LIMITED = {"controller.drive.torque_limit": "20 kN*m", "controller.drive.lag": "10 ms"}


@pytest.mark.parametrize("windup", ["back-calculation", "none", "1 s"])
def test_gains_of_a_limited_drive_are_not_resolved_cell_by_cell(paper, windup, monkeypatch):
    """The rate of the anti-windup is ki / kp, but for gains of zero; 1/s at opposite corners."""
    key = "tracking_time" if windup == "1 s" else "anti_windup"
    design = paper.replace(LIMITED | {f"controller.drive.{key}": windup})
    axes = grid(design, ("controller.kp", 0, 1000, 7), ("controller.ki", 0, 1000, 6))
    check_every_cell(design, axes)
    resolved = []
    real = drillctl.Design.replace
    monkeypatch.setattr(drillctl.Design, "replace", lambda *a: resolved.append(1) or real(*a))
    list(groups(design, axes))
    assert len(resolved) < 25


def test_a_limited_drive_with_its_tracking_on_an_axis(paper):
    """Then the rate follows from three axes: cell by cell."""
    design = paper.replace(LIMITED | {"controller.drive.tracking_time": "1 s"})
    check_every_cell(
        design,
        grid(
            design, ("controller.kp", 0, 1000, 2), ("controller.ki", 0, 500, 2),
            ("controller.drive.tracking_time", "1 s", "3 s", 3),
        ),
    )  # fmt: skip


SHARED = {
    "length": [("drillstring.sections.pipe.length", "1000 m", "3000 m", 3)],
    "elements": [("drillstring.sections.pipe.elements", 10, 30, 3)],
    "top drive": [("top_drive.inertia", "1000 kg*m^2", "3000 kg*m^2", 2)],
    "duration": [("simulation.duration", "5 s", "10 s", 2)],
    "own last": [("bha.inertia", "300 kg*m^2", "400 kg*m^2", 2), ("controller.kp", 0, 500, 3)],
    "own first": [("controller.kp", 0, 500, 3), ("bha.inertia", "300 kg*m^2", "400 kg*m^2", 2)],
    "shared between": [
        ("controller.kp", 0, 500, 2), ("simulation.duration", "5 s", "9 s", 3),
        ("bit_rock.a1_factor", 0.9, 1.1, 2), ("top_drive.damping", "0 N*m*s/rad", "9 N*m*s/rad", 2),
    ],
}  # fmt: skip


@pytest.mark.parametrize("case", SHARED)
def test_shared_axes_make_groups(paper, case):
    axes = grid(paper, *SHARED[case])
    found = check_every_cell(paper, axes)
    assert len(found) == np.prod([len(a) for a in axes if a.shared])
    for group in found:  # each with a string of its own
        np.testing.assert_array_equal(
            group.lanes.string.undamped_modes[0],
            cell_design(paper, axes, int(group.cells[0])).string.undamped_modes[0],
        )


def test_elements_reach_the_string(paper):
    axes = grid(paper, ("drillstring.sections.pipe.elements", 10, 30, 3))
    nodes = [group.lanes.string.nodes for group in groups(paper, axes)]
    assert np.diff(nodes).tolist() == [10, 10]


def test_cells_are_in_c_order(paper):
    axes = grid(paper, ("controller.kp", 0, 2, 3), ("controller.ki", 0, 30, 4))
    for cell, (kp, ki) in {0: (0, 0), 1: (0, 10), 4: (1, 0), 11: (2, 30)}.items():
        law = cell_design(paper, axes, cell).top_drive
        assert (law.kp, law.ki) == (kp, ki)


# --- sweeps over what lanes share ------------------------------------------------------------


@pytest.mark.parametrize("case", ["length", "top drive", "duration", "own first"])
def test_sweep_equals_its_cells_alone(paper, case):
    """A cell simulated by itself gives the same bits as in the sweep, in its own place."""
    axes = grid(paper, *SHARED[case])
    found = sweep(paper, axes, audit_cells=0)
    assert found.j1.shape == shape_of(axes)
    for cell in range(found.j1.size):
        alone = drillctl.simulate(cell_design(paper, axes, cell), engine="batch")
        assert found.j1.ravel()[cell] == alone.measures.j1
        assert found.measures["peak_pipe_torque"].ravel()[cell] == alone.measures.peak_pipe_torque


# --- lanes block by block ----------------------------------------------------------------------

SCHEMED = {
    **OWN,
    **SHARED,
    "steep at the end": [
        ("bit_rock.beta_factor", 0.5, 60.0, 5), ("bit_rock.a2_factor", 1.0, 1.5, 3),
        ("controller.kp", 0, 500, 3),
    ],
    "programs": [
        ("controller.kp", 0, 500, 3), ("scenario.speed.end", "1.5 s", "3.7 s", 4),
        ("scenario.weight_on_bit.end", "2 s", "3 s", 3),
    ],
}  # fmt: skip
RAMPED = {"scenario.speed.start": "0 rpm", "scenario.weight_on_bit.start": "0 kN",
          "scenario.speed.end": "1 s", "scenario.weight_on_bit.end": "1 s"}  # fmt: skip


@pytest.mark.parametrize("case", SCHEMED)
def test_a_few_lanes_ask_for_the_scheme_of_all(paper, case, monkeypatch):
    monkeypatch.setattr("drillctl.ensemble.grid.SEARCHED", 2)
    design = paper.replace(RAMPED) if case == "programs" else paper
    for group in groups(design, grid(design, *SCHEMED[case])):
        table = group.design.tables.simulation
        assert prepare(group.telling, table).scheme == prepare(group.lanes, table).scheme
        assert group.telling.steepest_fall == group.lanes.steepest_fall
        np.testing.assert_array_equal(_turns(group.telling), _turns(group.lanes))


def test_a_grid_of_ten_million_cells_is_two_columns(paper):
    axes = grid(paper, ("controller.kp", 0, 1000, 3163), ("controller.ki", 0, 500, 3163))
    (group,) = groups(paper, axes)
    assert len(group) == 3163**2
    assert sum(values.size for values in group.numbers.numbers.values()) < 7000
    assert len(group.telling) == 1
    chosen = np.array([5, 9_000_000])
    assert group.some(chosen).drive.kp.tolist() == axes[0].values[chosen // 3163].tolist()
    assert group.some(chosen).drive.ki.tolist() == axes[1].values[chosen % 3163].tolist()
    assert group.cells_of(chosen).tolist() == chosen.tolist()


def test_a_sweep_makes_the_lanes_of_one_block_at_a_time(paper, monkeypatch):
    from drillctl.ensemble import running, sweeps

    axes = grid(paper, ("controller.kp", 0, 1000, 6), ("controller.ki", 0, 500, 5))
    whole = sweep(paper, axes, audit_cells=0)
    most = []
    real = running.run_batch
    monkeypatch.setattr(sweeps, "CHUNK", 7)
    monkeypatch.setattr(running, "run_batch", lambda *a: most.append(len(a[0])) or real(*a))
    parts = sweep(paper, axes, audit_cells=0)
    assert most == [7, 7, 7, 7, 2]
    for name, values in whole.measures.items():
        np.testing.assert_array_equal(parts.measures[name], values)
    np.testing.assert_array_equal(parts.status, whole.status)


def test_measures_that_are_kept(paper, tmp_path):
    axes = grid(paper, ("controller.kp", 0, 1000, 3), ("controller.ki", 0, 500, 2))
    whole = sweep(paper, axes, audit_cells=0)
    some = sweep(paper, axes, audit_cells=0, measures=["sticks"])
    assert list(some.measures) == ["j1", "sticks"]
    np.testing.assert_array_equal(some.measures["sticks"], whole.measures["sticks"])
    again = drillctl.open(some.save(tmp_path / "some"))
    assert list(again.measures) == ["j1", "sticks"]
    np.testing.assert_array_equal(again.j1, whole.j1)
    with pytest.raises(InputError, match="did you mean 'sticks'"):
        sweep(paper, axes, measures=["stick"])


def test_fewer_measures_are_less_memory(paper, monkeypatch):
    monkeypatch.setattr("drillctl.ensemble.grid._free_memory", lambda: 2.5e4)
    axes = grid(paper, ("controller.kp", 0, 1000, 2))
    large = (axes[0], type(axes[0])("controller.ki", "N*m/rad", np.linspace(0, 1, 50)))
    assert sweep(paper, large, audit_cells=0, measures=["j1"]).j1.shape == (2, 50)
    with pytest.raises(InputError, match="fewer points"):
        sweep(paper, large)


def test_a_drive_that_absorbs_nothing_is_a_law_of_its_own(paper):
    """At an absorption of zero a Z-torque drive is a plain PI, with fewer numbers."""
    design = paper.replace({"controller.law": "z-torque"})
    axes = grid(design, ("controller.absorption", 0, 1, 3))
    found = sweep(design, axes, audit_cells=0)
    for cell, value in enumerate(axes[0].values):
        alone = design.replace({"controller.absorption": float(value)})
        expected = drillctl.simulate(alone, engine="batch").measures.j1
        assert found.j1[cell] == pytest.approx(expected, rel=1e-12)
