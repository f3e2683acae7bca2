"""Adaptive maps of rigs: the full grid's outlines, lanes of the same bits, checks, misuse."""

from __future__ import annotations

import numpy as np
import pytest

import drillctl
from drillctl.errors import InputError
from drillctl.studies import Axis
from drillctl.studies.adaptive import checks as adaptive_checks
from drillctl.studies.adaptive.checks import Mismatch, full_audit, mismatch
from drillctl.studies.adaptive.contour_search import bands_of
from drillctl.studies.adaptive.study import AdaptiveMap, adaptive_map
from drillctl.studies.regions import region

HOLDS = (
    (
        "adaptive maps",
        "outlines and bits of the full grid, to the last; known functions with islands, "
        "holes, jumps, saddles and failures; random ones: each contour whole or missed whole; "
        "samples of known mismatch",
    ),
)

DESIGN = "monteiro-trindade-140kn"


def gains(kp, ki):
    return (
        Axis("controller.kp", "N*m*s/rad", np.linspace(0.0, 1000.0, kp)),
        Axis("controller.ki", "N*m/rad", np.linspace(0.0, 500.0, ki)),
    )


@pytest.fixture(scope="module")
def design():
    return drillctl.load(DESIGN)


@pytest.fixture(scope="module")
def full(design):
    return drillctl.sweep(design, gains(161, 161), audit_cells=0)


@pytest.fixture(scope="module")
def found(design):
    return adaptive_map(design, gains(161, 161), audit_cells=2)


def test_the_papers_map(found, full):
    assert isinstance(found, AdaptiveMap)
    np.testing.assert_array_equal(found.bands, bands_of(full.j1, found.levels))
    for level in found.levels:
        mine, whole = found.regions[level], full.regions[level]
        assert mine.polygons.equals_exact(whole.polygons)
        assert mine.summary() == whole.summary()
    assert found.trajectories == len(set(found.cells.tolist())) == int(found.simulated.sum())
    assert found.share == found.trajectories / 161**2
    assert found.share < 0.2
    assert found.minimum == full.minimum


def test_lanes_have_the_bits_of_the_full_map(found, full):
    for name, values in found.measures.items():
        np.testing.assert_array_equal(values, full.measures[name].ravel()[found.cells])
    np.testing.assert_array_equal(found.status, full.status.ravel()[found.cells])
    np.testing.assert_array_equal(found.j1.compressed(), full.j1[found.simulated])
    np.testing.assert_array_equal(~found.j1.mask, found.simulated)
    assert (found.step, found.modes) == (full.step, full.modes)


def test_it_is_audited_with_the_reference_solver(found):
    assert len(found.audit.cells) == 2
    assert set(found.audit.cells) <= set(found.cells)
    assert found.audit.verdict == "ok"


def test_self_check(found):
    check = found.self_check
    assert (len(check.cells), check.followed, check.verdict) == (300, 0, "ok")
    assert set(check.cells) <= set(found.cells)
    told = found.summary()["self_check"]
    assert told["mismatches"] == 0
    assert told["interval_95"] == [0.0, pytest.approx(0.0122, abs=1e-4)]


def test_full_audit(design, found, full, tmp_path):
    audited = adaptive_map(design, gains(161, 161), audit_cells=0, full_grid=True)
    np.testing.assert_array_equal(audited.cells, found.cells)
    np.testing.assert_array_equal(audited.full_audit.j1, full.j1)
    assert audited.full_audit.trajectories + audited.trajectories == 161**2
    told = audited.summary()["full_audit"]
    assert told["verdict"] == "ok"
    assert set(told["regions"]) == {"20", "30", "40", "50"}
    for one in told["regions"].values():
        assert one == {
            "cells": 0, "area_fraction": 0.0, "farthest": 0.0, "hausdorff": 0.0,
            "same_to_one_cell": True,
        }  # fmt: skip
    assert audited.share == found.share  # what the audit took is told apart
    back = drillctl.open(audited.save(tmp_path / "run"))
    assert back.summary() == audited.summary()
    np.testing.assert_array_equal(back.full_audit.j1, full.j1)


def test_saved_and_read_back(found, tmp_path):
    back = drillctl.open(found.save(tmp_path / "run"))
    assert back.summary() == found.summary()
    assert back.provenance == found.provenance
    for name in ("cells", "status", "bands", "values", "simulated"):
        np.testing.assert_array_equal(getattr(back, name), getattr(found, name))
    for name, values in found.measures.items():
        np.testing.assert_array_equal(back.measures[name], values)
    for level in found.levels:
        assert back.regions[level].polygons.equals_exact(found.regions[level].polygons)
    data = found.data
    assert data["band"].dims == ("controller.kp", "controller.ki")
    assert data["j1"].dims == ("trajectory",)
    assert data["j1"].attrs["units"] == "s"
    assert not any(np.isnan(data[name]).any() for name in ("j1", "band", "cell", "simulated"))


def test_strings_and_kinds_of_law_along_the_axes():
    """Every length is a string of its own; no delay is another law than some delay."""
    base = drillctl.load(DESIGN, **{"simulation.duration": "5 s", "map.levels": [2.0, 3.0]})
    pipe = base.tables.drillstring.sections[0].name
    axes = (
        Axis(f"drillstring.sections.{pipe}.length", "m", np.linspace(800.0, 1200.0, 5)),
        Axis("controller.drive.torque_lag", "s", np.linspace(0.0, 0.2, 5)),
    )
    found = adaptive_map(base, axes, intervals=2, check_cells=3, audit_cells=0)
    whole = drillctl.sweep(base, axes, audit_cells=0)
    np.testing.assert_array_equal(found.measures["j1"], whole.j1.ravel()[found.cells])
    np.testing.assert_array_equal(found.status, whole.status.ravel()[found.cells])
    assert 9 <= found.trajectories <= 25


def test_a_missed_island_is_told_and_mended(monkeypatch, design):
    """A lane that reads 5 s where nobody expects it, drawn into the sample by its seed."""
    from drillctl.studies.adaptive import chosen_cells

    real = chosen_cells.ChosenCells.simulate
    hit = {}

    def simulate(self, cells):
        batch = real(self, cells)
        if hit:
            batch.measures["j1"][np.isin(cells, hit["cells"])] = 5.0
        return batch

    monkeypatch.setattr(chosen_cells.ChosenCells, "simulate", simulate)
    short = design.replace({"simulation.duration": "20 s"})
    high = short.replace({"map.levels": [5.5, 6.0]})
    clean = adaptive_map(high, gains(161, 161), audit_cells=0, check_cells=40)
    near = np.array([-1, 1, -161, 161, -162, 162])
    lonely = next(
        cell for cell in clean.self_check.cells
        if not np.isin(cell + near, clean.cells).any() and clean.bands.ravel()[cell] == 2
    )  # fmt: skip
    hit["cells"] = [lonely, lonely + 1]
    mended = adaptive_map(high, gains(161, 161), audit_cells=0, check_cells=40, full_grid=True)
    assert mended.self_check.mismatches.tolist() == [lonely]
    assert mended.self_check.verdict == "look"
    assert mended.self_check.followed == 11  # the other cell and ten around the two
    assert mended.bands.ravel()[[lonely, lonely + 1]].tolist() == [0, 0]
    assert mended.full_audit.verdict == "ok"
    low, high_end = mended.summary()["self_check"]["interval_95"]
    assert 0.0 < low < 1.0 / 40.0 < high_end


def square(shape, rows, columns):
    values = np.full(shape, 90.0)
    values[rows, columns] = 10.0
    return values


def compared(found, full, level=20.0):
    axes = tuple(Axis(str(n), "", np.arange(k, dtype=float)) for n, k in enumerate(full.shape))
    return mismatch(region(found, axes, level), region(full, axes, level))


def test_mismatch_by_hand():
    shape = (60, 80)
    whole = square(shape, slice(20, 30), slice(20, 40))
    assert compared(whole, whole) == Mismatch(0, 0.0, 0.0, 0.0)
    # A row more: the ten cells lie next to the edge, the outline is one cell off.
    more = square(shape, slice(20, 31), slice(20, 40))
    one = compared(more, whole)
    assert (one.cells, one.area_fraction, one.farthest) == (20, 20 / 4800, 1.0)
    assert one.hausdorff == pytest.approx(1.0)
    assert one.to_one_cell
    two = compared(square(shape, slice(20, 32), slice(20, 40)), whole)
    assert (two.cells, two.farthest) == (40, 2.0)
    assert two.hausdorff == pytest.approx(2.0)
    assert not two.to_one_cell


def test_a_missed_island_is_no_match_however_small():
    whole = square((60, 80), slice(20, 30), slice(20, 40))
    island = whole.copy()
    island[50, 70] = 10.0
    missed = compared(whole, island)
    assert (missed.cells, missed.farthest) == (1, 1.0)  # it is its own edge
    assert missed.hausdorff > 30.0
    assert not missed.to_one_cell
    nothing = compared(np.full((60, 80), 90.0), whole)
    assert nothing.hausdorff == np.inf
    assert nothing.summary()["same_to_one_cell"] is False
    nowhere = compared(whole, np.full((60, 80), 90.0))
    assert (nowhere.farthest, nowhere.hausdorff) == (np.inf, np.inf)


def test_a_full_audit_that_finds_an_island():
    values = square((60, 80), slice(20, 30), slice(20, 40))
    full = values.copy()
    full[50:53, 60:63] = 25.0
    audit = full_audit(values, full, (20.0, 30.0), 4000)
    assert audit.mismatches[20.0].to_one_cell
    assert audit.mismatches[30.0].cells == 9
    assert audit.verdict == "look"
    assert audit.summary()["regions"]["30"]["same_to_one_cell"] is False


def test_counts_and_seed_of_the_check(design):
    short = design.replace({"simulation.duration": "5 s"})
    one = adaptive_map(short, gains(101, 90), audit_cells=0, check_cells=0)
    assert one.self_check.verdict == "none"
    assert one.summary()["self_check"]["interval_95"] is None
    assert adaptive_checks.CHECK_CELLS == 300


def test_a_small_grid_is_simulated_whole(design):
    short = design.replace({"simulation.duration": "5 s"})
    found = adaptive_map(short, gains(5, 7), audit_cells=0, full_grid=True)
    assert (found.share, found.trajectories) == (1.0, 35)
    assert found.self_check.verdict == "none"
    assert found.full_audit.trajectories == 0
    assert found.full_audit.verdict == "ok"


@pytest.mark.parametrize(
    ("axes", "options", "message"),
    [
        (gains(41, 41)[:1], {}, "over 2 parameters, got 1"),
        ((*gains(3, 3), Axis("bit_rock.a1_factor", "", np.array([0.9, 1.1]))), {},
         "over 2 parameters, got 3; a sweep"),
        (gains(41, 41), {"intervals": 0}, "intervals: must be at least 1, got 0"),
        (gains(41, 41), {"check_cells": -1}, "check_cells: must not be negative, got -1"),
        (gains(200_000, 200_000), {}, "fewer points"),
    ],
)  # fmt: skip
def test_misuse_is_refused(design, axes, options, message):
    with pytest.raises(InputError, match=message):
        adaptive_map(design, axes, **options)
