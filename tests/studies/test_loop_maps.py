"""Maps of loop figures against the figures of single loops."""

from __future__ import annotations

import numpy as np
import pytest

import drillctl
from drillctl import units
from drillctl.ensemble.grid import cell_design
from drillctl.errors import InputError
from drillctl.studies import Axis, loop_map
from tests.alike import same

DESIGN = "monteiro-trindade-140kn"


def axes(kp, ki):
    return Axis("controller.kp", "", np.array(kp)), Axis("controller.ki", "", np.array(ki))


def test_cells_are_the_loops_they_stand_for():
    design = drillctl.load(DESIGN)
    grid = axes([0.0, 300.0, 475.0, 600.0, 700.0], [0.0, 62.5, 100.0, 125.0])
    found = loop_map(design, grid)
    for cell in range(found.stable.size):
        where = np.unravel_index(cell, found.stable.shape)
        if where == (0, 0):
            continue  # no drive at all: the next test
        try:
            alone = drillctl.loop(cell_design(design, grid, cell))
        except InputError:
            assert np.isnan(found.values["slope"][where])
            continue
        value = {name: values[where] for name, values in found.values.items()}
        assert value["slope_margin"] == pytest.approx(alone.slope_margin, rel=1e-4, abs=1e-9)
        assert found.stable[where] == alone.stable
        assert value["spectral_abscissa"] == pytest.approx(alone.spectral_abscissa, abs=1e-10)
        if alone.stable:
            peak = alone.margins.peak_sensitivity
            assert value["peak_sensitivity"] == pytest.approx(peak, rel=1e-3)
            low = min(ratio for f, ratio in alone.oscillations if f < 0.2)
            assert value["low_damping"] == pytest.approx(low, rel=1e-9)
        else:
            assert np.isnan(value["peak_sensitivity"])


def test_drives_that_cannot_turn_the_bit_have_no_figures():
    found = loop_map(drillctl.load(DESIGN), axes([0.0, 200.0], [0.0, 100.0]))
    # Without integral action these gains give less torque than the rock takes.
    for values in found.values.values():
        assert np.isnan(values[:, 0]).all()
    assert np.isfinite(found.values["slope_margin"][:, 1]).all()
    assert found.summary()["cells"] == 4


def test_largest_slope_margin_over_the_gains():
    grid = axes(np.linspace(500, 700, 41), np.linspace(80, 150, 36))
    value, at = loop_map(drillctl.load(DESIGN), grid, ("slope_margin",)).best
    assert value == pytest.approx(370.0, abs=1.0)
    assert at["controller.kp"] == pytest.approx(600.0, abs=10.0)
    assert at["controller.ki"] == pytest.approx(113.0, abs=4.0)


def test_speed_and_weight_are_axes_as_well():
    design = drillctl.load("wob-rpm-chart")
    found = loop_map(design, quantities=("slope_margin",))
    margin = found.values["slope_margin"]
    # D* is the loop's own: neither speed nor weight moves it.
    assert np.ptp(margin) < 1e-9 * margin.mean()
    slope = found.values["slope"]
    assert np.all(np.diff(slope, axis=0) < 0.0)
    speed, weight = found.axes[0].values[7], found.axes[1].values[20]
    there = design.replace(
        {
            "operating_point.speed": units.SI(speed),
            "operating_point.weight_on_bit": units.SI(weight),
        }
    )
    assert slope[7, 20] == pytest.approx(drillctl.loop(there).operating_point.slope, rel=1e-12)


def test_a_shared_axis_changes_the_string():
    grid = (
        Axis("drillstring.sections.pipe.length", "m", np.array([2000.0, 3000.0])),
        Axis("controller.kp", "", np.array([500.0, 625.0])),
    )
    design = drillctl.load(DESIGN)
    found = loop_map(design, grid, ("slope_margin",))
    for cell in range(4):
        alone = drillctl.loop(cell_design(design, grid, cell)).slope_margin
        assert found.values["slope_margin"].ravel()[cell] == pytest.approx(alone, rel=1e-4)


def test_saved_and_read_back(tmp_path):
    found = loop_map(drillctl.load(DESIGN), axes([500.0, 600.0], [100.0, 125.0]))
    back = drillctl.open(found.save(tmp_path / "run"))
    assert back.summary() == found.summary()
    same(back, found)


def test_unknown_quantity_is_refused():
    with pytest.raises(InputError, match="no quantity 'margin'"):
        loop_map(drillctl.load(DESIGN), quantities=("margin",))
