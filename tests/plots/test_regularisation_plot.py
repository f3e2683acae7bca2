"""The picture of what smoothing the friction does."""

from __future__ import annotations

import numpy as np

import drillctl
from drillctl import plots, regularisation
from drillctl.ensemble.grid import Axis


def test_panels_show_the_shift_and_the_regions():
    axes = (
        Axis("controller.kp", "", np.linspace(500.0, 650.0, 3)),
        Axis("controller.ki", "", np.linspace(75.0, 150.0, 3)),
    )
    result = regularisation(drillctl.load("monteiro-trindade-140kn"), (0.1, 0.5), axes)
    left, right = plots.regularisation(result).axes
    assert "(rpm)" in left.get_xlabel()
    assert "%" in left.get_ylabel()
    median = left.get_lines()[0]
    np.testing.assert_allclose(median.get_ydata(), 100 * np.median(np.abs(result.shifts), (1, 2)))
    exact, cells = result.cells(30.0)
    shown = next(x for x in right.get_lines() if "30 s" in x.get_label())
    np.testing.assert_allclose(shown.get_ydata(), np.array(cells) / exact)
