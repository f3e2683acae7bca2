"""Roots and boundary of a bit that cuts its own wake: the closed form, other codes, simulation."""

from __future__ import annotations

import math

import numpy as np
import pytest

import drillctl
from drillctl.errors import InputError
from drillctl.linear.regenerative import (
    Characteristic,
    axial_boundary,
    axial_mobility,
    count_roots,
    cutting_loop,
)
from drillctl.rig.axial import AxialTable, axial_string
from drillctl.studies import Axis, loop_map
from drillctl.units import SI

UNIT = math.sqrt(116.0 / 938.0)
SHARP = {
    "bit_rock.wear_flat_length": "1.2 mm",
    "operating_point.weight_on_bit": "23.4093 kN",
    "operating_point.speed": "11.374503 rad/s",
    "start.bit_speed": "9.952691 rad/s",
}


@pytest.fixture(scope="module")
def design():
    """The shipped case."""
    return drillctl.load("richard-detournay-2dof")


def test_roots_are_those_of_other_codes(design):
    found = cutting_loop(design.replace(SHARP))
    expected = [1.0300738 + 9.3976237j, 3.94394e-4 + 1.0086095j]
    assert found.roots[:2] * UNIT == pytest.approx(expected, abs=2e-6)
    assert found.unstable_roots == 4
    assert found.whole  # none beyond the limit


@pytest.mark.parametrize(("blades", "expected"), [(4, 5.318219), (6, 4.342308)])
def test_axial_boundary_is_the_closed_form(design, blades, expected):
    found = axial_boundary(design.replace({"bit_rock.blades": blades})) * UNIT
    psi = 0.6 * 60e6 * 0.108 * UNIT**2 / 34000.0
    assert found == pytest.approx(math.sqrt(8.0 * psi / blades), rel=1e-9)
    assert found == pytest.approx(expected, abs=2e-6)


def test_the_number_of_roots_changes_at_the_boundary(design):
    boundary = axial_boundary(design)
    for share, count in ((0.99, 2), (1.01, 0)):
        chi = Characteristic(design.replace({"operating_point.speed": SI(share * boundary)}), False)
        assert count_roots(chi, 1e-9 * chi.scale - 60j, 60.0 + 60j) == count


@pytest.mark.parametrize(("share", "grows"), [(0.99, True), (1.01, False)])
def test_simulation_meets_the_boundary(design, share, grows):
    speed = share * axial_boundary(design)
    one = design.replace({
        "operating_point.speed": SI(speed), "start.bit_speed": SI(speed * (1.0 - 1e-3)),
        "operating_point.weight_on_bit": SI(1.02 * design.bit_rock.flat_force),
        "simulation.duration": "16 s",
    })  # fmt: skip
    swing = drillctl.simulate(one, "batch", interval=0.02).signals["penetration"]
    swing = np.abs(swing - swing.mean())
    early, late = (swing[int(a * len(swing)) : int(b * len(swing))].max()
                   for a, b in ((0.2, 0.4), (0.8, 1.0)))  # fmt: skip
    assert (late > 1.1 * early) if grows else (late < 0.95 * early)


def test_mobility_of_coupled_dampers_is_that_of_the_matrices():
    table = AxialTable(model="elements", damping=SI(2e4), stiffness_damping=SI(1e-3), top="force")
    string = axial_string(table, np.full(3, 4e6), np.full(3, 900.0), consistent=True)
    s = np.array([0.3 + 7.0j, 0.1 + 90.0j])
    for one, found in zip(s, axial_mobility(string, s), strict=True):
        dynamic = one * string.mass + string.damping + string.stiffness / one
        assert found == pytest.approx(np.linalg.inv(dynamic)[-1, -1], rel=1e-9)


@pytest.mark.parametrize(("top", "share"), [("force", 0.0), ("velocity", 0.5)])
def test_a_string_of_elements_is_a_rod(top, share):
    """Frequencies and mobility of a uniform rod, free or held at the top, in closed form."""
    spring, mass, count = 8e5, 8e4, 60
    each = np.full(count, spring * count), np.full(count, mass / count)
    string = axial_string(AxialTable(model="elements", top=top), *each, consistent=True)
    travel, impedance = math.sqrt(mass / spring), math.sqrt(mass * spring)
    exact = (np.arange(1, 6) - share) * math.pi / travel
    assert string.modes[0][1:6] == pytest.approx(exact, rel=(5 * math.pi / count) ** 2 / 20)
    s = np.array([0.4 + 3.0j, 0.9 + 11.0j])
    answer = 1.0 / np.tanh(s * travel) if top == "force" else np.tanh(s * travel)
    assert axial_mobility(string, s) == pytest.approx(answer / impedance, rel=2e-3)
    assert string.impedance == pytest.approx(impedance)


def test_a_hook_that_follows_the_speed_damps_as_its_root_says(design):
    """The decay of a simulated swing, above the axial boundary."""
    one = design.replace({
        "bit_rock.wear_flat_length": "1.2 mm", "operating_point.weight_on_bit": "23.4093 kN",
        "operating_point.speed": "22 rad/s", "start.bit_speed": "21.99 rad/s",
        "weight_on_bit.law": "navarro-lopez-suarez", "weight_on_bit.gain": "1 kN*s/rad",
        "weight_on_bit.minimum": "10 kN", "weight_on_bit.maximum": "40 kN",
        "simulation.duration": "9 s",
    })  # fmt: skip
    root = cutting_loop(one).roots[0]
    run = drillctl.simulate(one)
    swing, period = np.abs(run.signals["bit_speed"] - 22.0), 2.0 * math.pi / root.imag
    early, late = (swing[(run.time > a) & (run.time < a + period)].max()
                   for a in (2.0, 2.0 + 2.0 * period))  # fmt: skip
    assert math.log(late / early) / (2.0 * period) == pytest.approx(root.real, rel=0.02)
    assert root.real < -0.3
    with pytest.raises(InputError, match="at intervals"):
        cutting_loop(one.replace({"weight_on_bit.path": {"sampling_period": "1 s"}}))


def test_a_map_of_roots_holds_the_roots_of_its_cells(design):
    axes = (Axis("operating_point.speed", "rad/s", np.array([8.0, 16.0])),
            Axis("operating_point.weight_on_bit", "N", np.array([60e3, 80e3])))  # fmt: skip
    found = loop_map(design, axes, ("growth", "unstable_roots"))
    assert np.isnan(found.values["growth"][:, 0]).all()  # the wear flat bears it all
    for row, speed in enumerate(axes[0].values):
        alone = cutting_loop(design.replace({
            "operating_point.speed": SI(speed), "operating_point.weight_on_bit": SI(80e3),
        }))  # fmt: skip
        assert found.values["growth"][row, 1] == pytest.approx(alone.roots[0].real, rel=1e-9)
        assert found.values["unstable_roots"][row, 1] == alone.unstable_roots
    # Above the axial boundary the slow root beside the pole of torsion is left.
    assert found.values["unstable_roots"][:, 1].tolist() == [4, 2]
    assert 0.0 < found.values["growth"][1, 1] < 0.01
    with pytest.raises(InputError, match="no quantity 'growth'"):
        loop_map(drillctl.load("monteiro-trindade-140kn"), quantities=("growth",))


def test_a_loop_with_this_bit_tells_its_roots(design):
    result = drillctl.loop(design)
    assert not result.stable
    assert result.summary()["cutting"]["unstable_roots"] == 4
    with pytest.raises(InputError, match="richard-detournay"):
        cutting_loop(drillctl.load("monteiro-trindade-140kn"))
