"""Local stability, J1 and attraction over one grid, each against what is known of it."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

import drillctl
from drillctl.design.tables import AxisTable
from drillctl.ensemble.grid import axes_of
from drillctl.errors import InputError
from drillctl.linear.ends import ends_of
from drillctl.linear.operating_point import operating_point
from drillctl.linear.slope_margin import slope_margin
from drillctl.linear.state_space import closed_loop_matrices
from drillctl.simulation.measures import STATUSES
from drillctl.store import claim
from drillctl.studies import sweep
from drillctl.studies.three_regions import compute as attraction
from drillctl.studies.three_regions.compute import FIELDS, MASKS, three_regions
from tests.alike import same

HOLDS = {
    "three regions": "eigenvalues, reference solver, published bistability",
}

LONG = {"simulation.duration": "200 s"}


def grid(design, *tables):
    keys = ("path", "min", "max", "points")
    return axes_of(design, tuple(AxisTable(**dict(zip(keys, t, strict=True))) for t in tables))


def at(result, *values):
    """Index of the cell at these values."""
    return tuple(
        int(np.flatnonzero(np.isclose(a.values, v))[0])
        for a, v in zip(result.axes, values, strict=True)
    )


@pytest.fixture(scope="module")
def paper():
    return drillctl.load("monteiro-trindade-140kn")


@pytest.fixture(scope="module")
def coarse(paper):
    """The paper's gains in steps of 25."""
    axes = grid(paper, ("controller.kp", 0, 1000, 41), ("controller.ki", 0, 500, 21))
    return three_regions(paper, axes)


@pytest.fixture(scope="module")
def lumped():
    return drillctl.load("navarro-lopez-2dof-bistable")


@pytest.fixture(scope="module")
def around(lumped):
    """Torque and weight around the values at which the rig is known to be bistable."""
    axes = grid(
        lumped,
        ("controller.torque", "8 kN*m", "12 kN*m", 3),
        ("operating_point.weight_on_bit", "77.347 kN", "117.347 kN", 3),
    )
    return three_regions(lumped, axes)


# --- the paper's map -------------------------------------------------------------------------


def test_locally_stable_gains_of_the_paper(coarse):
    assert coarse.locally_stable.sum() == 56
    kp, ki = (
        a.values[w] for a, w in zip(coarse.axes, np.nonzero(coarse.locally_stable), strict=True)
    )
    assert (kp.min(), kp.max()) == (475.0, 700.0)
    assert (ki.min(), ki.max()) == (50.0, 200.0)


@pytest.mark.parametrize(
    ("kp", "ki"),
    [(475, 100), (450, 100), (700, 150), (725, 150), (600, 200), (600, 225), (600, 50), (600, 25)],
)
def test_local_stability_is_that_of_the_eigenvalues(paper, coarse, kp, ki):
    """On both sides of each edge."""
    cell = paper.replace({"controller.kp": kp, "controller.ki": ki})
    a, b, c, _ = closed_loop_matrices(cell.string, kp, ki)
    slope = operating_point(cell).slope
    growth = np.linalg.eigvals(a - slope * b[:, 1:] @ c[1:2]).real.max()
    where = at(coarse, kp, ki)
    assert coarse.locally_stable[where] == (growth < 0.0)
    assert coarse.slope[where] == pytest.approx(slope, rel=1e-12)


def test_j1_is_that_of_a_sweep(paper, coarse):
    swept = sweep(paper, coarse.axes, audit_cells=0)
    assert swept.j1.tobytes() == coarse.j1.tobytes()
    np.testing.assert_array_equal(coarse.inside_level, swept.j1 <= 33.0)
    assert coarse.level == 33.0
    exactly = float(coarse.j1[at(coarse, 600, 125)])  # at the level is inside
    tighter = three_regions(paper, grid(paper, ("controller.kp", 575, 625, 3)), level=exactly)
    assert tighter.inside_level.tolist() == [False, True, True]


def test_the_margin_and_what_decides_it(paper, coarse):
    """Where a low mode decides, and where many high ones are nearly alike."""
    margin, omega = slope_margin(ends_of(paper.string), 700.0, 175.0)
    where = at(coarse, 700, 175)
    assert coarse.slope_margin[where] == pytest.approx(margin, rel=1e-9)
    assert coarse.deciding_frequency[where] == pytest.approx(omega / (2.0 * np.pi), rel=1e-6)
    assert coarse.deciding_frequency[where] == pytest.approx(0.1076, abs=1e-3)
    margin, _ = slope_margin(ends_of(paper.string), 500.0, 100.0)
    where = at(coarse, 500, 100)
    assert coarse.slope_margin[where] == pytest.approx(margin, rel=1e-4)
    assert coarse.deciding_frequency[where] > 5.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kp", "ki", "kind"),
    [
        (625, 150, "rest"), (625, 150, "wound_up"), (525, 100, "rest"), (525, 100, "wound_up"),
        (550, 150, "rest"), (300, 100, "rest"),
    ],
)  # fmt: skip
def test_attraction_is_that_of_the_reference_solver(paper, coarse, kp, ki, kind):
    gains = {"controller.kp": kp, "controller.ki": ki, "start.kind": kind}
    run = drillctl.simulate(paper, engine="reference", **LONG, **gains)
    settled = run.measures.settling_time
    where = at(coarse, kp, ki)
    assert getattr(coarse, f"from_{kind}")[where] == (settled is not None and settled <= 180.0)
    assert getattr(coarse, f"sticking_from_{kind}")[where] == (run.status == "sticking")


def test_a_slow_way_home_is_not_a_second_answer(coarse):
    """Settles from rest; wound up, it only needs longer than 200 s, and never sticks so late."""
    where = at(coarse, 525, 100)
    assert coarse.locally_stable[where]
    assert coarse.from_rest[where]
    assert not coarse.from_wound_up[where]
    assert coarse.undecided[where]
    assert not coarse.bistable[where]
    where = at(coarse, 600, 150)  # leaves the band for the last time at 190 s
    assert not coarse.from_wound_up[where]
    where = at(coarse, 550, 150)
    assert coarse.bistable[where]
    assert not coarse.undecided[where]
    assert not (coarse.bistable & coarse.undecided).any()


def test_without_integral_action_the_paper_drills_nowhere(coarse):
    """A proportional drive up to 1000 N m s cannot turn this bit steadily."""
    np.testing.assert_array_equal(np.isnan(coarse.reference_speed[:, 0]), True)
    np.testing.assert_array_equal(coarse.reference_speed[:, 1:], coarse.design.speed)
    assert not coarse.locally_stable[:, 0].any()
    assert not coarse.attracted[:, 0].any()


def test_counts_add_up(coarse):
    assert sum(coarse.combinations.values()) == coarse.j1.size
    assert len(coarse.combinations) == 17
    assert coarse.counts["locally_stable"] == 56
    assert coarse.counts["attracted"] == (coarse.from_rest & coarse.from_wound_up).sum()
    both = [
        n for name, n in coarse.combinations.items()
        if {"locally_stable", "inside_level"} <= set(name.split(" + "))
    ]  # fmt: skip
    assert sum(both) == (coarse.locally_stable & coarse.inside_level).sum()


# --- a drive without speed control -----------------------------------------------------------


def test_the_lumped_rig_is_found_bistable(lumped, around):
    assert around.bistable[1, 1]
    assert around.sticking_from_rest[1, 1]
    assert around.reference_speed[1, 1] == pytest.approx(5.005, abs=1e-3)
    settles = drillctl.simulate(lumped, engine="batch", **LONG)
    assert settles.measures.settling_time <= 180.0
    sticks = drillctl.simulate(lumped, engine="reference", **LONG, **{"start.kind": "rest"})
    assert sticks.status == "sticking"


def test_too_little_torque_has_no_operating_point(around):
    assert np.isnan(around.reference_speed[0, 2])
    assert np.isnan(around.slope[0, 2])
    assert around.no_operating_point[0, 2]
    assert not around.locally_stable[0, 2]
    assert not around.attracted[0, 2]
    assert not around.bistable[0, 2]


def test_plenty_of_torque_settles_at_the_cells_own_speed(lumped, around):
    """Twice the set speed of the design, which is only a frame here."""
    assert around.locally_stable[2, 0]
    assert around.attracted[2, 0]
    speed = around.reference_speed[2, 0]
    assert speed > 1.5 * lumped.speed
    cell = {"controller.torque": "12 kN*m", "operating_point.weight_on_bit": "77.347 kN"}
    run = drillctl.simulate(lumped, engine="reference", **LONG, **cell, **{"start.kind": "rest"})
    assert run.signals["bit_speed"][-1] == pytest.approx(speed, rel=1e-6)


def test_proportional_control_keeps_its_set_speed(lumped):
    """It settles below the set speed; a frame at that lower speed would change its torque."""
    law = {"controller.law": "pi", "controller.kp": 900.0, "controller.ki": 0.0}
    design = lumped.replace(law | {"operating_point.speed": "20 rad/s"})
    found = three_regions(design, grid(design, ("controller.kp", 300, 900, 3)))
    assert np.isnan(found.reference_speed[0])
    assert not found.attracted[0]
    assert found.attracted[2]
    run = drillctl.simulate(design, engine="reference", **LONG, **{"start.kind": "rest"})
    assert found.reference_speed[2] < 0.6 * design.speed
    assert run.signals["bit_speed"][-1] == pytest.approx(found.reference_speed[2], rel=1e-6)


# --- failures, files, input ------------------------------------------------------------------


def test_a_failed_lane_is_told(lumped, around, monkeypatch):
    """Told as failed, and neither bistable nor undecided for want of an answer."""
    measured = attraction.measured

    def failing(lanes, prepared):
        batch = measured(lanes, prepared)
        for values in batch.measures.values():
            values[4] = np.nan
        batch.status[4] = STATUSES.index("failed")
        return batch

    monkeypatch.setattr(attraction, "measured", failing)
    found = three_regions(around.design, around.axes)
    assert found.failed.sum() == 1
    assert found.failed[1, 1]
    assert found.locally_stable[1, 1]
    assert not (found.bistable | found.undecided | found.attracted)[1, 1]
    assert found.combinations["failed"] == 1
    assert sum(found.combinations.values()) == 9


def test_growth_too_slow_to_show_is_counted_apart(around):
    unstable = dataclasses.replace(around, locally_stable=np.zeros_like(around.locally_stable))
    assert unstable.lingering[2, 0]
    assert unstable.counts["lingering"] == around.counts["attracted"] > 0
    assert around.counts["lingering"] == 0


@pytest.mark.parametrize("level", [None, 20.0])
def test_there_and_back(around, tmp_path, level):
    one = around
    if level is not None:
        one = dataclasses.replace(around, level=level, inside_level=around.j1 <= level)
    back = drillctl.open(one.save(tmp_path / "run"))
    same(one, back)
    assert back.summary() == one.summary()
    json.dumps(one.summary(), allow_nan=False)
    with pytest.raises(InputError, match="another design or other settings"):
        claim("regions", one.design, tmp_path / "run")  # these axes are not its own


def test_a_level_of_ones_own_is_another_run(around, tmp_path):
    """On the design's own axes nothing but the level tells them apart."""
    axes = [
        {"path": "controller.torque", "min": "8 kN*m", "max": "12 kN*m", "points": 3},
        {"path": "operating_point.weight_on_bit", "min": "77.347 kN", "max": "117.347 kN",
         "points": 3},
    ]  # fmt: skip
    own = dataclasses.replace(around, design=around.design.replace({"map.axes": axes}))
    own.save(tmp_path / "usual")
    assert claim("regions", own.design, tmp_path / "usual").finished
    dataclasses.replace(own, level=20.0).save(tmp_path / "other")
    with pytest.raises(InputError, match="another design or other settings"):
        claim("regions", own.design, tmp_path / "other")


def test_dataset_has_units(around):
    data = around.data
    assert set(data.data_vars) == {*FIELDS, *MASKS}
    assert data["slope_margin"].attrs["units"] == "N*m*s/rad"
    assert data["deciding_frequency"].attrs["units"] == "Hz"
    assert data["locally_stable"].dims == ("controller.torque", "operating_point.weight_on_bit")
    assert data["controller.torque"].attrs["units"] == "N*m"


@pytest.mark.parametrize("level", [0.0, -1.0, float("nan"), float("inf")])
def test_levels_are_positive(lumped, level):
    with pytest.raises(InputError, match="level"):
        three_regions(lumped, level=level)
