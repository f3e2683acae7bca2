"""The named accuracies keep what they promise over the paper's map.

The event-accurate values are those of `tests/data/make_paper_map_sample.py`.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import drillctl
from drillctl.ensemble.grid import axes_of, groups
from drillctl.simulation.batch import prepare, run_batch
from drillctl.simulation.scheme import PROMISES

HOLDS = {
    "accuracies": "event-accurate cells of the paper's map; the whole map at 0.5 ms",
}

PATH = Path(__file__).parents[1] / "data" / "paper_map_sample.json"
KNOWN = json.loads(PATH.read_text(encoding="utf-8"))
CELLS = np.array([int(cell) for cell in KNOWN["j1"]])
EXACT = np.array(list(KNOWN["j1"].values()))


@cache
def map_j1(cells=None, **simulation):
    """J1 of the paper's map at all cells, or at those of the sample."""
    design = drillctl.load(
        KNOWN["design"], **{f"simulation.{key}": value for key, value in simulation.items()}
    )
    axes = axes_of(design)
    assert [len(axis) for axis in axes] == KNOWN["shape"]
    (group,) = groups(design, axes)
    lanes = group.lanes if cells is None else group.some(CELLS)
    return run_batch(lanes, prepare(group.telling, design.tables.simulation)).measures["j1"]


def test_the_sample_is_worth_its_name():
    assert len(EXACT) == 40
    assert KNOWN["moved_by_a_tolerance_of_1e-9"] < 1e-7
    assert EXACT.min() < 30.0  # a bit that settles
    assert EXACT.max() > 100.0


@pytest.mark.parametrize("accuracy", PROMISES)
def test_event_accurate_cells(accuracy):
    errors = np.abs(map_j1("sample", accuracy=accuracy) / EXACT - 1.0)
    promise = PROMISES[accuracy]
    assert np.percentile(errors, 99) <= promise.p99
    if promise.median is not None:
        assert np.median(errors) <= promise.median


@pytest.mark.slow
@pytest.mark.parametrize("accuracy", PROMISES)
def test_the_whole_map(accuracy):
    """Against the engine itself at half a millisecond and all modes."""
    errors = np.abs(map_j1(accuracy=accuracy) / map_j1(step="0.5 ms", modes=999) - 1.0)
    promise = PROMISES[accuracy]
    assert errors.shape == (41 * 41,)
    assert np.percentile(errors, 99) <= promise.p99
    if promise.median is not None:
        assert np.median(errors) <= promise.median


@pytest.mark.slow
@pytest.mark.parametrize("accuracy", PROMISES)
@pytest.mark.parametrize("level", [20.0, 30.0, 40.0, 50.0])
def test_no_cell_in_a_wrong_region(accuracy, level):
    """Unless its J1 lies within 1 % of the level."""
    found, truth = map_j1(accuracy=accuracy), map_j1(step="0.5 ms", modes=999)
    wrong = (found <= level) != (truth <= level)
    assert not np.any(wrong & (np.abs(truth / level - 1.0) > 0.01))


@pytest.mark.slow
def test_the_finest_run_is_as_good_as_the_truth():
    errors = np.abs(map_j1(step="0.5 ms", modes=999)[CELLS] / EXACT - 1.0)
    assert errors.max() < 1e-6
