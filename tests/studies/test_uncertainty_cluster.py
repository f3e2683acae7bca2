"""Blocks on dask.distributed: the same bits as here, whoever dies on the way."""

from __future__ import annotations

import os
import signal
import threading
from socketserver import BaseRequestHandler, ThreadingTCPServer
from typing import NamedTuple

import pytest

import drillctl
from drillctl.ensemble import realizations as realizations_module
from drillctl.ensemble import running as cluster_module
from drillctl.ensemble.grid import axes_of
from drillctl.ensemble.realizations import Realizations
from drillctl.ensemble.running import Cluster, connect
from drillctl.ensemble.sweeps import sweep
from drillctl.errors import InputError, SimulationError
from drillctl.studies.uncertainty.compute import uncertainty

HOLDS = {
    "clusters": "two worker processes, one killed half-way: the same bits",
}

distributed = pytest.importorskip("distributed")

GAINS = [
    {"path": "controller.kp", "min": 500.0, "max": 700.0, "points": 5},
    {"path": "controller.ki", "min": 100.0, "max": 150.0, "points": 5},
]
FIVE = {"distribution": "lognormal", "cov": 0.05}
STRING = "drillstring.sections.pipe.length"


def design(*paths):
    """25 cells of the paper's map, runs of 20 s."""
    values = {"simulation.duration": "20 s", "simulation.accuracy": "fast", "map.audit_cells": 0,
              "map.axes": GAINS}  # fmt: skip
    if paths:
        values["uncertain"] = dict.fromkeys(paths, FIVE)
    return drillctl.load("monteiro-trindade-140kn", **values)


@pytest.fixture(scope="module")
def client():
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as local,
        distributed.Client(local, set_as_default=False) as found,
    ):
        yield found


@pytest.fixture(autouse=True)
def _small_blocks(monkeypatch):
    monkeypatch.setattr(realizations_module, "LANES", 25 * 4)


@pytest.mark.slow
@pytest.mark.parametrize("paths", [(), (STRING,)], ids=["friction", "strings"])
def test_two_workers_give_the_bits_of_this_process(client, paths):
    here = uncertainty(design(*paths), realizations=40)
    there = uncertainty(design(*paths), realizations=40, client=client)
    assert there.j1.tobytes() == here.j1.tobytes()
    assert there.status.tobytes() == here.status.tobytes()


@pytest.mark.slow
def test_a_worker_may_be_killed_half_way(client):
    here = uncertainty(design(), realizations=400)
    victim = min(client.run(os.getpid).values())
    blocks = []

    class Killing(Cluster):
        def __call__(self, job, pieces):
            for block in super().__call__(job, pieces):
                blocks.append(block.first)
                if len(blocks) == 40:
                    os.kill(victim, signal.SIGKILL)
                yield block

    there = uncertainty(design(), realizations=400, workers=Killing(client))
    assert len(blocks) == 100
    assert sorted(blocks) == list(range(0, 400, 4))
    assert victim not in client.run(os.getpid).values()
    assert there.j1.tobytes() == here.j1.tobytes()


@pytest.mark.slow
def test_a_scheduler_is_found_by_its_address(client):
    client.wait_for_workers(2, timeout=60)  # one that was killed takes a second to come back
    with connect(client.scheduler.address) as other:
        assert len(other.nthreads()) == 2


@pytest.mark.slow
def test_a_server_of_something_else_is_refused(tmp_path):
    class Web(BaseRequestHandler):
        def handle(self):
            self.request.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n")

    with ThreadingTCPServer(("127.0.0.1", 0), Web) as web:
        threading.Thread(target=web.serve_forever, daemon=True).start()
        with pytest.raises(InputError, match="is no scheduler"):
            connect(f"tcp://127.0.0.1:{web.server_address[1]}")
        web.shutdown()


def test_the_command_takes_a_scheduler(client, tmp_path, monkeypatch, capsys):
    from drillctl.cli import run

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("drillctl.cli.verb.draw", lambda figure, path: path.touch())
    options = ["--set", "simulation.duration=20 s", "--realizations", "8", "--audit", "0",
               "--axis", "controller.kp=500:700:3",
               "--axis", "controller.ki=100:150:2"]  # fmt: skip
    name = "monteiro-trindade-140kn"
    assert run(["uncertainty", name, *options, "--out", "here"]) == 0
    address = ["--scheduler", client.scheduler.address]
    assert run(["uncertainty", name, *options, *address, "--out", "there"]) == 0
    assert drillctl.open("here").j1.tobytes() == drillctl.open("there").j1.tobytes()


# --- without a cluster -------------------------------------------------------------------------


class Worker(NamedTuple):
    """What dask tells of a worker that died."""

    address: str


class Pretended:
    """As much of a client as `Cluster` asks for; every block is computed at once."""

    loop = None

    def __init__(self, found, errors=()):
        self.found, self.errors = found, list(errors)

    def run(self, function):
        return {"worker": self.found}

    def nthreads(self):
        return {"worker": 1}

    def submit(self, function, *arguments, **options):
        return Future(self, function, arguments)


class Future:
    count = 0

    def __init__(self, client, function, arguments):
        Future.count += 1
        self.key = str(Future.count)
        self.error = client.errors.pop(0) if client.errors else None
        self.call = lambda: function(*arguments)

    def exception(self):
        return self.error

    def result(self):
        return self.call()

    def release(self):
        pass


class Completed(list):
    """`as_completed` of those: the last submitted is the first finished."""

    def __init__(self, futures, loop):
        super().__init__(futures)

    def add(self, future):
        self.append(future)

    def __iter__(self):
        while self:
            yield self.pop()


@pytest.fixture
def job(monkeypatch):
    monkeypatch.setattr(distributed, "as_completed", Completed)
    one = design()
    return Realizations(one, axes_of(one), 1, ("j1",), None)


def here():
    from drillctl.provenance import provenance

    return dict(provenance())


def test_every_block_comes_once_in_whatever_order(job):
    pieces = [(4 * k, 4) for k in range(9)]
    blocks = list(Cluster(Pretended(here()))(job, pieces))
    assert [block.first for block in blocks] != [first for first, _ in pieces]
    assert sorted(block.first for block in blocks) == [first for first, _ in pieces]
    assert list(Cluster(Pretended(here()))(job, [])) == []


def test_the_cells_of_a_map_go_to_workers_too(job):
    length = {"path": STRING, "min": "2500 m", "max": "3000 m", "points": 2}
    axes = [GAINS[0] | {"points": 3}, length]
    one = design().replace({"map.axes": axes})
    workers = Cluster(Pretended(here()))
    there, alone = sweep(one, workers=workers), sweep(one)
    assert there.j1.tobytes() == alone.j1.tobytes()
    assert there.status.tobytes() == alone.status.tobytes()
    assert (there.step, there.modes) == (alone.step, alone.modes)


def test_blocks_of_dead_workers_are_given_out_again(job):
    dead = distributed.KilledWorker("block", Worker("tcp://there:1"), 3)
    blocks = list(Cluster(Pretended(here(), [dead, dead]))(job, [(0, 2), (2, 2)]))
    assert sorted(block.first for block in blocks) == [0, 2]
    deadly = [dead] * (cluster_module.DEATHS + 1)
    with pytest.raises(SimulationError, match="workers died 21 times over one block"):
        list(Cluster(Pretended(here(), deadly))(job, [(0, 2)]))
    with pytest.raises(ZeroDivisionError):
        list(Cluster(Pretended(here(), [ZeroDivisionError()]))(job, [(0, 2)]))


def test_workers_of_another_kind_are_refused(job):
    other = here() | {"processor": "Abacus", "numba": "0.1"}
    with pytest.raises(InputError, match=r"numba 0.1, .*--allow-other-machine lets it"):
        list(Cluster(Pretended(other))(job, [(0, 2)]))
    workers = Cluster(Pretended(other), allow_other_machine=True)
    assert len(list(workers(job, [(0, 2)]))) == 1
    assert workers.origin["processor"] == f"{here()['processor']} + Abacus"
    older = here() | {"drillctl": "0.1"}
    with pytest.raises(InputError, match=r"a worker has drillctl 0\.1, this process"):
        list(Cluster(Pretended(older), allow_other_machine=True)(job, [(0, 2)]))
