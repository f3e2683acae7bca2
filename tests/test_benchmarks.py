"""The benchmark suite measures what it says: peers that do the job, operations that are there."""

from __future__ import annotations

import json
import subprocess
import sys
from functools import cache

import numpy as np
import pytest

from benchmarks import peaks as machine
from benchmarks import run
from benchmarks.cost import count
from benchmarks.exact import exact_j1
from benchmarks.job import CELLS, Job, load_job
from benchmarks.peers import MODULES, all_peers
from benchmarks.timing import in_turn, interleave, row_of
from drillctl.simulation.lanes import Start
from drillctl.simulation.propagator import string_step

HORIZON = "10 s"  # the bit of the well damped cell sticks and slips twice in it
CLASS = {
    "reference_rows": 1e-7, "scipy_events": 2e-6, "cvode": 5e-6, "cvode_library": 5e-6,
    "numpy_lanes": 5e-5, "diffrax_lanes": 2e-2, "python_control": 2e-2,
}  # fmt: skip
"""Relative error in J1 that each peer is good for."""


@cache
def short_job():
    """The well damped cell over a short horizon."""
    job = load_job()
    design = job.design.replace({"simulation.duration": HORIZON})
    short = Job(design, job.axes, {CELLS[0]: 0.0})
    return Job(design, job.axes, {CELLS[0]: exact_j1(short.cell(CELLS[0]), 1e-9)})


def test_every_peer_has_a_class():
    assert {"engine", *CLASS} == set(MODULES)


@pytest.mark.parametrize(
    "module",
    [pytest.param(m, marks=pytest.mark.slow if m == "diffrax_lanes" else ()) for m in CLASS],
)
def test_a_peer_does_the_job(module):
    job = short_job()
    peers, missing = all_peers(job, (module,))
    if missing:
        pytest.skip(missing[0].why)
    for peer in peers:
        cells = job.cells if module != "diffrax_lanes" else peer.jobs[0]
        j1 = np.asarray(peer.run(cells))
        assert j1.shape == (len(cells),)
        error = abs(j1[0] / job.exact[CELLS[0]] - 1.0)
        assert error < CLASS[module], peer.name
        assert error > 0.0  # a peer is no copy of the exact value


def test_a_missing_library_is_told(monkeypatch):
    import benchmarks.peers.numpy_lanes as module

    def make(job):
        raise ModuleNotFoundError("No module named 'nonesuch'")

    monkeypatch.setattr(module, "make", make)
    peers, missing = all_peers(short_job(), ("numpy_lanes",))
    assert peers == []
    assert missing[0].name == module.TITLE
    assert "not installed" in missing[0].why
    assert "nonesuch" in missing[0].why


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


def step_by_hand(string, state, top, bit):
    """The formula of the modal pass, written out: next state and the three sums."""
    kinds = (string.ratio, string.push, string.pipe, string.kappa, string.bit_speed)
    ratio, push, pipe, kappa, speed = (np.vectorize(Counted)(a) for a in kinds)
    sums = [Counted(0.0) for _ in range(3)]
    moved = np.empty_like(state)
    for mode in range(len(kappa)):
        force = top + ratio[mode] * bit  # the sign of the bit torque is a matter of the caller
        x = state[2 * mode] + push[mode, 0] * force
        y = state[2 * mode + 1] + push[mode, 1] * force
        sums[0] = sums[0] + pipe[mode] * x
        y = y + Counted(-kappa[mode].value) * x
        x = x + y
        moved[2 * mode], moved[2 * mode + 1] = x, y
        sums[1] = sums[1] + x
        sums[2] = sums[2] + speed[mode, 0] * x + speed[mode, 1] * y
    return moved, sums


@pytest.mark.parametrize("modes", [2, 16])
def test_operations_of_the_modal_pass_are_counted_right(modes):
    design = load_job().design
    stepper = string_step(design.string, 0.02, modes)
    string = stepper.string
    assert string.kappa.shape == (modes,)
    start = Start(((np.zeros(31), np.zeros(1)),), ((np.full(31, -1.0), np.ones(1)),))
    state = stepper.state(start, np.zeros(1))[:, 0]
    Counted.operations = 0
    moved, sums = step_by_hand(string, np.vectorize(Counted)(state), Counted(0.0), Counted(0.0))
    counted = count(string)
    assert Counted.operations == modes * counted.flops
    assert counted.bytes == 8 * (len(state) + len(moved)) / modes
    # It is the step of a string: untwisted and free it turns on, -1 rad/s for 20 ms.
    assert sums[1].value == pytest.approx(-0.02, rel=1e-9)
    assert sums[2].value == pytest.approx(-1.0, rel=1e-9)


@pytest.mark.parametrize("width", machine.WIDTHS)
def test_the_peak_loop_does_what_it_counts(width):
    rounds = 1000
    # Each accumulator begins at one and is made a 1 + 1 in every round; one lane of each is added.
    loop = machine._fma(width)
    assert loop.call(rounds) == machine.ACCUMULATORS * (rounds + 1)
    assert loop.counts == 2 * width * machine.ACCUMULATORS


def test_runs_take_turns():
    order = []
    jobs = {name: lambda name=name: order.append(name) for name in "ab"}
    calls = in_turn(jobs, {"a": 3, "b": 1})
    assert "".join(order) == "abaa"
    assert [len(made) for made in calls.values()] == [3, 1]


def test_a_row_is_the_median_of_its_cells():
    class Peer:
        name, solves, cores, jobs = "peer", "nothing", 1, ((1,), (2,))

        def run(self, cells):
            return np.array([10.0 * cell for cell in cells])

    job = Job(None, (), {1: 10.0, 2: 25.0})
    (row,) = interleave([Peer()], 4)
    assert [len(calls) for calls in row.of_cells.values()] == [2, 2]
    found = row_of(row, job, 2)
    assert found["j1_error"] == pytest.approx(0.2)
    assert found["machine_s"] == pytest.approx(found["as_run_s"] / 2)
    assert found["core_s"] >= 0.0
    assert found["low_s"] <= found["as_run_s"] <= found["high_s"]


@pytest.mark.slow
def test_a_whole_run_is_printed_written_and_drawn(tmp_path, capsys):
    modules = ("engine", "scipy_events", "numpy_lanes")
    found = run.run(short_job(), modules, 1, 3_162, lambda text: None) | {"seconds": 1.0}
    run.report(found, tmp_path)
    kept = json.loads((tmp_path / "bench.json").read_text())
    assert {row["name"] for row in kept["rows"]} >= {"drillctl, standard", "SciPy RK45, rtol 1e-6"}
    assert all(0.0 < row["j1_error"] < 1e-2 for row in kept["rows"])
    assert (tmp_path / "bench.png").stat().st_size > 10_000
    printed = capsys.readouterr().out
    assert "Gflop/s" in printed
    assert "not measured" in printed  # CVODE was left out


@pytest.mark.slow
def test_ten_million_lanes_stay_under_a_gibibyte():
    """In a process of its own: its peak counts whatever it has ever held."""
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.memory"], capture_output=True, text=True, check=True
    )
    found = json.loads(done.stdout)
    assert found["lanes"] >= 10_000_000
    assert 0.0 < found["shares"]["0.874876"] < 1.0
    assert found["before_bytes"] < found["peak_bytes"] < 2**30
