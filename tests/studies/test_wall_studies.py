"""Studies on a string on whose wall friction rubs, its factor drawn: smallest sizes, to the end."""

from __future__ import annotations

import numpy as np
import pytest

import drillctl
from drillctl.simulation import simulate

FACTOR, KP = "well.friction_factor", "controller.kp"


@pytest.fixture(scope="module")
def design():
    """Well A with few nodes and elements, drilling, for three seconds."""
    rock = drillctl.load("aarsnes-shor-well-a").tree["bit_rock"]
    return drillctl.load("well-a-off-bottom").replace({
        "bit_rock": rock, "operating_point.weight_on_bit": "100 kN", "well.friction_nodes": 3,
        "drillstring.sections.pipe.elements": 12, "drillstring.sections.bha.elements": 3,
        "simulation.duration": "2 s", "simulation.j1_from": "0 s", KP: 900.0,
        "controller.ki": 300.0, "start.kind": "turning", "scenario.speed": {},
        "map.axes": [{"path": KP, "min": 600.0, "max": 900.0, "points": 2}],
        "compare.cases": [{"name": "as it is"}, {"name": "soft", "set": {KP: 600.0}}],
        "tune": {
            "parameters": {KP: {"min": 500.0, "max": 900.0}}, "realizations": 2, "starts": 1,
            "level": 9.0, "certificate": {"realizations": 4, "audit": 1},
        },
    })  # fmt: skip


def test_draws_of_the_friction_factor_are_the_runs_of_that_factor(design):
    found = drillctl.uncertainty(design, realizations=3, seed=1)
    factors = found.drawn[FACTOR]
    assert len(np.unique(factors)) == len(np.unique(found.j1[:, 0])) == 3
    for number, factor in enumerate(factors):
        alone = simulate(design.replace({FACTOR: float(factor), KP: 600.0}), "batch").measures.j1
        assert found.j1[number, 0] == pytest.approx(alone, rel=1e-12)


def test_cases_are_compared_at_drawn_friction(design):
    found = drillctl.compare(design, realizations=3)
    j1 = [case.measures["j1"] for case in found.cases]
    assert np.isfinite(j1).all()
    assert len(np.unique(j1)) == 6


def test_gains_are_tuned_and_certified_at_drawn_friction(design):
    longer = {"simulation.duration": "12 s"}  # until the bit breaks loose
    found = drillctl.tune(design.replace(longer))
    assert 500.0 <= found.gains[KP] <= 900.0
    assert len(np.unique(found.certificate.drawn[FACTOR])) == 4
    assert np.isfinite(found.certificate.runs.j1).all()
