"""What smoothing the friction does to a map."""

from __future__ import annotations

import numpy as np
import pytest

import drillctl
from drillctl import regularisation
from drillctl.ensemble.grid import Axis
from drillctl.errors import InputError
from tests.alike import same

DESIGN = "monteiro-trindade-140kn"


@pytest.fixture(scope="module")
def result():
    return regularisation(drillctl.load(DESIGN), widths=(0.05, 0.5))


def test_half_a_radian_per_second_doubles_the_best_region(result):
    # Figures of the reconstructed case: the region under 20 about doubles, J1 shifts by 9 %, at
    # worst by half.
    assert result.widths.tolist() == [0.5, 0.05]
    wide, narrow = result.summary()["widths"]
    assert result.cells(20.0)[0] == 10
    assert 20 <= wide["cells"]["20"] <= 25
    assert wide["median_shift"] == pytest.approx(0.09, abs=0.005)
    assert 0.45 < wide["worst_shift"] < 0.6
    assert narrow["median_shift"] < 0.15 * wide["median_shift"]


def test_the_set_valued_map_is_the_map(result):
    found = drillctl.stability_map(drillctl.load(DESIGN), audit_cells=0)
    np.testing.assert_array_equal(result.j1, found.j1)


def test_a_smoothed_cell_is_a_run_of_the_smoothed_law(result):
    kp, ki = result.axes[0].values[26], result.axes[1].values[10]
    values = {"controller.kp": kp, "controller.ki": ki, "bit_rock.regularised_over": "0.5 rad/s"}
    alone = drillctl.simulate(drillctl.load(DESIGN, **values), engine="batch")
    assert result.smoothed[0, 26, 10] == pytest.approx(alone.measures.j1, rel=1e-12)
    exact = drillctl.simulate(drillctl.load(DESIGN, **values))
    assert result.smoothed[0, 26, 10] == pytest.approx(exact.measures.j1, rel=1e-3)


def test_changed_cells_are_counted_on_both_sides(result):
    for level in result.levels:
        exact, smoothed = result.cells(level)
        for cells, changed in zip(smoothed, result.changed(level), strict=True):
            assert changed >= abs(cells - exact)


def test_saved_and_read_back(tmp_path):
    axes = (
        Axis("controller.kp", "", np.array([500.0, 600.0])),
        Axis("controller.ki", "", np.array([100.0, 125.0])),
    )
    found = regularisation(drillctl.load(DESIGN), (0.2,), axes)
    back = drillctl.open(found.save(tmp_path / "run"))
    assert back.summary() == found.summary()
    same(back, found)


@pytest.mark.parametrize(
    ("values", "widths", "message"),
    [
        ({"bit_rock": {"law": "coulomb", "a": 0.05}}, (0.1,), "no regularised form"),
        ({"bit_rock.regularised_over": "0.1 rad/s"}, (0.1,), "leave it out"),
        ({"weight_on_bit": {"law": "navarro-lopez-suarez", "gain": "1 kN*s/rad"}}, (0.1,),
         "a weight that moves"),
        ({}, (0.0,), "more than 0 rad/s"),
    ],
)  # fmt: skip
def test_misuse_is_refused(values, widths, message):
    with pytest.raises(InputError, match=message):
        regularisation(drillctl.load(DESIGN, **values), widths)
