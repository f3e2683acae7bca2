"""Responses of the loops by every route, by name, with their units."""

from __future__ import annotations

import numpy as np
import pytest

import drillctl
from drillctl.errors import InputError
from drillctl.linear import closed_loop, frequency_response, open_loop, plant, response_of

DESIGN = "monteiro-trindade-140kn"
PIPE = "drillstring.sections.pipe"
FREQUENCY = np.geomspace(0.02, 5.0, 37)


def close(found, expected):
    scale = np.abs(expected).max(axis=0)
    assert np.all(np.abs(found - expected) <= 1e-9 * np.abs(expected) + 1e-12 * scale)


@pytest.mark.parametrize("loop", ["plant", "open_loop", "closed_loop"])
@pytest.mark.parametrize(
    ("name", "values"),
    [
        (DESIGN, {}),
        (DESIGN, {"controller.ki": 0.0, "controller.kp": 900.0}),
        (DESIGN, {"drillstring.modal_damping": 0.02, "bha.damping": "20 N*m*s/rad"}),
        ("navarro-lopez-4dof", {}),
        ("aarsnes-shor-well-a", {f"{PIPE}.damping": "5 N*m*s/rad"}),
    ],
)
def test_every_route_gives_the_state_spaces_response(name, values, loop):
    design = drillctl.load(name, **values)
    system = {
        "plant": lambda: plant(design.string),
        "open_loop": lambda: open_loop(design),
        "closed_loop": lambda: closed_loop(design),
    }[loop]()
    expected = response_of(system, FREQUENCY)
    for model in ("finite-elements", "matrices"):
        found = frequency_response(design, FREQUENCY, loop, model=model)
        assert (found.inputs, found.outputs) == (expected.inputs, expected.outputs)
        close(found.response, expected.response)


def test_the_continuum_is_near_and_not_the_same():
    design = drillctl.load(DESIGN)
    fe = frequency_response(design, FREQUENCY, "closed_loop")
    wave = frequency_response(design, FREQUENCY, "closed_loop", model="wave")
    ratio = wave.between("set_speed", "bit_speed") / fe.between("set_speed", "bit_speed")
    assert 1e-8 < np.abs(ratio[0] - 1.0) < 1e-3
    assert "continuum" in wave.title


def test_units_and_dataset():
    found = frequency_response(drillctl.load(DESIGN), FREQUENCY, "closed_loop")
    assert found.unit("set_speed", "bit_speed") == "1"
    assert found.unit("set_speed", "twist") == "s"
    assert found.unit("bit_torque", "bit_speed") == "rad/s/(N*m)"
    assert found.data["top_torque_per_set_speed"].attrs["units"] == "N*m/(rad/s)"


def test_two_thousand_elements_cost_no_more_than_one():
    design = drillctl.load(DESIGN, **{f"{PIPE}.elements": 2000})
    fine = frequency_response(design, FREQUENCY)
    exact = frequency_response(design, FREQUENCY, model="wave")
    ratio = fine.between("top_torque", "bit_speed") / exact.between("top_torque", "bit_speed")
    assert np.abs(ratio - 1.0).max() < 1e-3


def test_misuse_is_told():
    design = drillctl.load(DESIGN)
    with pytest.raises(InputError, match="closed_loop"):
        frequency_response(design, FREQUENCY, "closed-loop")
    with pytest.raises(InputError, match="wave"):
        frequency_response(design, FREQUENCY, model="waves")
    with pytest.raises(InputError, match="give a design"):
        frequency_response(design.string, FREQUENCY, "open_loop")
    with pytest.raises(InputError, match="no signal 'top_speeed'"):
        frequency_response(design, FREQUENCY).between("top_torque", "top_speeed")
    with pytest.raises(InputError, match="more than 0 Hz"):
        response_of(design.plant(), [0.0])
    with pytest.raises(InputError, match="no continuum"):
        frequency_response(
            drillctl.load(DESIGN, **{"drillstring.modal_damping": 0.01}), FREQUENCY, model="wave"
        )
