"""The peers, one file each, all with the same small protocol.

A module has `TITLE` and `make(job) -> list[Peer]`, and imports what drillctl does not need inside
`make`: a peer whose library is missing is told in the table, and the rest goes on. What has to be
compiled is compiled in `make`.
"""

from __future__ import annotations

import importlib
from typing import NamedTuple, Protocol

from numpy.typing import NDArray

from benchmarks.job import Array, Job

MODULES = (
    "engine", "reference_rows", "scipy_events", "cvode", "cvode_library", "numpy_lanes",
    "diffrax_lanes", "python_control",
)  # fmt: skip


class Peer(Protocol):
    """One way to do the job.

    Attributes
    ----------
    name : str
        Row of the table.
    solves : str
        Which law of friction it solves, and by what method.
    cores : int
        Cores that it is given.
    jobs : tuple of tuple of int
        Cells that are simulated together in one timed call; one call takes one of these.
    """

    name: str
    solves: str
    cores: int
    jobs: tuple[tuple[int, ...], ...]

    def run(self, cells: tuple[int, ...]) -> Array | NDArray:
        """J1 of each of these cells."""
        ...


class Missing(NamedTuple):
    """A peer that cannot take part, and why."""

    name: str
    why: str


def all_peers(job: Job, modules: tuple[str, ...] = MODULES) -> tuple[list[Peer], list[Missing]]:
    """Every peer that can be had here, and those that cannot."""
    peers: list[Peer] = []
    missing = []
    for name in modules:
        module = importlib.import_module(f"benchmarks.peers.{name}")
        try:
            peers += module.make(job)
        except ImportError as error:
            missing.append(Missing(module.TITLE, f"not installed ({error})"))
    return peers, missing
