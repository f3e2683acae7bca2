"""Viscous torque of the mud: against the flow between two cylinders, section by section."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_bvp

import drillctl
from drillctl.errors import InputError
from drillctl.rig.drillstring.mud import annulus_drag

WELL = {
    "well.mud_viscosity": "20 cP",
    "well.holes": [{"to": "1000 m", "diameter": "12 1/4 in"}, {"diameter": "8 1/2 in"}],
}


def test_the_drag_is_that_of_the_flow_between_two_cylinders():
    """Speeds of the laminar flow, (u/r + u')' = 0, solved numerically; shear at the pipe."""
    viscosity, inner, outer, speed = 0.02, 0.0635, 0.108, 10.0
    radius = np.linspace(inner, outer, 50)
    flow = solve_bvp(
        lambda r, y: np.array([y[1], y[0] / r**2 - y[1] / r]),
        lambda a, b: np.array([a[0] - speed * inner, b[0]]),
        radius, np.vstack([np.linspace(speed * inner, 0.0, 50), np.full(50, -10.0)]), tol=1e-8,
    )  # fmt: skip
    u, slope = flow.sol(inner)
    torque = viscosity * (u / inner - slope) * 2.0 * math.pi * inner**2
    assert annulus_drag(viscosity, 2 * inner, 2 * outer) * speed == pytest.approx(torque, rel=1e-5)


def test_each_section_has_the_drag_of_the_holes_it_runs_through():
    bare = drillctl.load("monteiro-trindade-120kn")
    muddy = bare.replace(WELL)
    expected = 1000 * annulus_drag(0.02, 0.127, 12.25 * 0.0254)
    expected += 2000 * annulus_drag(0.02, 0.127, 8.5 * 0.0254)
    (section,) = muddy.string.parts.sections
    assert section.drag == pytest.approx(expected, rel=1e-12)
    own = muddy.replace({"drillstring.sections.pipe.drag": "0.01 N*s/rad"})
    assert own.string.parts.sections[0].drag == pytest.approx(expected + 30.0, rel=1e-12)
    assert muddy.string.ground_damping.sum() == pytest.approx(expected)
    assert bare.string.undamped


def test_tool_joints_narrow_the_annulus():
    joints = {
        "drillstring.sections.pipe.joint_outer_diameter": "6 5/8 in",
        "drillstring.sections.pipe.joint_inner_diameter": "2 3/4 in",
        "drillstring.sections.pipe.joint_length": "21 in",
    }
    one = drillctl.load("monteiro-trindade-120kn", **WELL).string.ground_damping.sum()
    other = drillctl.load("monteiro-trindade-120kn", **WELL, **joints).string.ground_damping.sum()
    assert 1.02 < other / one < 1.3


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"well.mud_viscosity": "20 cP"}, "mud_viscosity needs holes"),
        ({**WELL, "well.holes": [{"to": "900 m", "diameter": "8 in"}]}, "end at 900 m, above"),
        ({**WELL, "well.holes": [{"diameter": "4 in"}]}, "does not fit the hole of 101.6 mm"),
        ({**WELL, "well.holes": [{"diameter": "9 in"}, {"diameter": "8 in"}]}, "each but the last"),
    ],
)
def test_holes_that_cannot_be_are_refused(values, message):
    with pytest.raises(InputError, match=message):
        drillctl.load("monteiro-trindade-120kn", **values)
