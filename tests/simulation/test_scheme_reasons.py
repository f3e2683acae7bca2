"""The reasons given for a scheme lead to the scheme that was chosen."""

from __future__ import annotations

import numpy as np
import pytest

import drillctl
from benchmarks.cost import count
from drillctl import catalog
from drillctl.simulation.batch import prepare
from drillctl.simulation.lanes import single_lane
from drillctl.simulation.propagator import string_step
from drillctl.studies.doctor.compute import explain

PAPER = "monteiro-trindade-140kn"


def reasons(name, **values):
    design = drillctl.load(name, **values)
    lanes, table = single_lane(design), design.tables.simulation
    return explain(lanes, table, prepare(lanes, table))


@pytest.mark.parametrize("accuracy", ["fast", "standard", "fine"])
@pytest.mark.parametrize("name", [*catalog.names("designs"), *catalog.names("models")])
def test_reasons_give_the_scheme_of_every_shipped_file(name, accuracy):
    found = reasons(name, **{"simulation.accuracy": accuracy})
    assert found["step"] <= min(found["bounds"].values()) * (1.0 + 1e-12)
    assert set(found["bounds"]) <= {"accuracy", "elastic_mode", "friction", "rock"}


STIFF = {"drillstring.sections.pipe.length": "1500 m"}
STEEP = {
    "bit_rock.law": "navarro-lopez-suarez", "bit_rock.a1": 0.03, "bit_rock.a2": 0.07,
    "bit_rock.beta": 0.6,
}  # fmt: skip
LIMITED = {
    "controller.drive.torque_limit": "20 kN*m", "controller.drive.sampling_period": "13 ms",
}  # fmt: skip
RAMPED = {"scenario.speed.start": "0 rpm", "scenario.speed.end": "17.31 s"}


@pytest.mark.parametrize(
    ("values", "decided_by", "modes_by"),
    [
        ({}, "accuracy", "turn"),
        (STIFF, "elastic_mode", "turn"),
        (STEEP, "friction", "turn"),
        (LIMITED, "sampling", "turn"),
        (RAMPED, "program", "turn"),
        ({"simulation.step": "11 ms"}, "given", "turn"),
        ({"simulation.modes": 5}, "accuracy", "given"),
        ({"simulation.modes": 999}, "accuracy", "given"),
        ({"simulation.step": "1 ms"}, "given", "all"),
        ({"simulation.step": "200 ms"}, "given", "turn"),
    ],
    ids=str,
)
def test_what_decides(values, decided_by, modes_by):
    found = reasons(PAPER, **values)
    assert (found["decided_by"], found["modes_by"]) == (decided_by, modes_by)
    assert found["modes_left_out"] == 31 - found["modes"]
    if decided_by in ("accuracy", "elastic_mode", "friction", "given"):
        bounds = found["bounds"]
        assert min(bounds, key=bounds.get) == decided_by
        # Only whole steps to the run make it shorter.
        assert bounds[decided_by] * 0.99 < found["step"] <= bounds[decided_by] * 1.0000001


def test_the_string_is_told_by_its_form():
    assert reasons(PAPER)["string"] == "undamped"
    assert reasons(PAPER, **{"drillstring.modal_damping": 0.02})["string"] == "blocks"


class Counted:
    """A number that counts the operations that it goes through."""

    operations = 0

    def __init__(self, value):
        self.value = value

    def __mul__(self, other):
        Counted.operations += 1
        return Counted(self.value * other.value)

    def __add__(self, other):
        Counted.operations += 1
        return Counted(self.value + other.value)


def block_by_hand(string, state, top, bit):
    """The step of `kernels/string_step.py` for 2 x 2 blocks, written out."""
    free, push, pipe = (np.vectorize(Counted)(a) for a in (string.free, string.push, string.pipe))
    sums = [Counted(0.0) for _ in range(3)]
    for i in range(len(free)):
        x = state[2 * i] + push[i, 0] * top + push[i, 1] * bit
        y = state[2 * i + 1] + push[i, 2] * top + push[i, 3] * bit
        sums[0] = sums[0] + pipe[i, 0] * x + pipe[i, 1] * y
        sums[1] = sums[1] + (free[i, 0] * x + free[i, 1] * y)
        sums[2] = sums[2] + (free[i, 2] * x + free[i, 3] * y)
    return sums


def test_operations_of_blocks_are_counted_right():
    design = drillctl.load(PAPER, **{"drillstring.modal_damping": 0.02})
    string = string_step(design.string, 0.02, 12).string
    state = np.vectorize(Counted)(np.zeros(24))
    Counted.operations = 0
    block_by_hand(string, state, Counted(1.0), Counted(1.0))
    assert Counted.operations == 12 * count(string).flops
