"""Poles followed over a parameter."""

from __future__ import annotations

import numpy as np
import pytest

import drillctl
from drillctl.errors import InputError
from drillctl.linear import critical_weight_on_bit, root_locus


def test_every_row_holds_the_poles_of_its_design(design):
    found = root_locus(design, "controller.kp", np.linspace(300.0, 900.0, 61))
    for row in (0, 30, 60):
        poles = drillctl.loop(design.replace({"controller.kp": found.values[row]})).poles
        far = np.abs(found.poles[row][:, None] - poles[None, :]).min(axis=1)
        assert far.max() == 0.0


def test_tracks_are_continuous(design):
    found = root_locus(design, "controller.kp", np.linspace(300.0, 900.0, 301))
    assert np.isfinite(found.poles).all()
    # Where poles meet on the real axis they part at a right angle, fast but without a jump.
    assert np.abs(np.diff(found.poles, axis=0)).max() < 0.1


def test_crossing_is_the_critical_weight(design):
    critical = critical_weight_on_bit(design)
    found = root_locus(
        design, "operating_point.weight_on_bit", critical + np.linspace(-50.0, 50.0, 3)
    )
    low = found.poles[:, np.abs(found.poles[0]) < 1.0]
    growing = low.real.max(axis=1)
    assert growing[0] < 0.0 < growing[2]
    assert abs(growing[1]) < 1e-10
    assert found.data.coords["operating_point.weight_on_bit"].attrs["units"] == "N"


def test_length_of_the_string(design):
    found = root_locus(
        design, "drillstring.sections.pipe.length", np.linspace(2000.0, 4000.0, 21), count=6
    )
    # A longer string swings slower.
    third = found.poles[:, 4].imag
    assert np.all(np.diff(np.abs(third)) < 0.0)


def test_misuse(design):
    with pytest.raises(InputError, match=r"controller\.kpp"):
        root_locus(design, "controller.kpp", [1.0])
    with pytest.raises(InputError, match="one value or more"):
        root_locus(design, "controller.kp", [])
