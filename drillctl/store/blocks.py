"""Finished blocks of a run as files in its folder, so that a killed run goes on where it was."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drillctl.simulation.batch import FLOATS, Batch, Prepared
from drillctl.simulation.kernels.string_step import BlockString, DenseString, UndampedString
from drillctl.simulation.propagator import StringStep
from drillctl.simulation.scheme import Scheme


@dataclass(frozen=True)
class FolderBlocks:
    """Finished blocks as files; see `studies.blocks.Blocks`."""

    folder: Path  # where they lie

    def prepared(self, number: int, prepare: Callable[[], Prepared]) -> Prepared:
        """The string of a group, read back if it was prepared before."""
        path = self.folder / f"string-{number:06d}.npz"
        if not path.is_file():
            made = prepare()
            _write_npz(path, _string_arrays(made))
            return made
        with np.load(path, allow_pickle=False) as held:
            return _string_from(dict(held))

    def find(self, number: int) -> Batch | None:
        """The block if it was finished before."""
        path = self.folder / f"{number:06d}.npz"
        if not path.is_file():
            return None
        with np.load(path, allow_pickle=False) as held:
            values = held["measures"]
            measures = {name: values[i] for i, name in enumerate(FLOATS)}
            return Batch(measures, held["status"])

    def keep(self, number: int, batch: Batch) -> None:
        """Keep a finished block."""
        values = np.stack([batch.measures[name] for name in FLOATS])
        path = self.folder / f"{number:06d}.npz"
        _write_npz(path, {"measures": values, "status": batch.status})


def _string_arrays(prepared: Prepared) -> dict[str, Any]:
    stepper = prepared.stepper
    fields = {f"kernel.{k}": v for k, v in stepper.string._asdict().items()}
    return fields | {
        "kind": type(stepper.string).__name__,
        "angle_to_state": stepper.angle_to_state,
        "speed_to_state": stepper.speed_to_state,
        "rest": stepper.rest,
        "step": prepared.scheme.step,
        "steps": prepared.scheme.steps,
        "modes": prepared.scheme.modes,
        "sampling": prepared.scheme.sampling,
        "duration": prepared.duration,
        "j1_from": prepared.j1_from,
    }


def _string_from(held: dict[str, Any]) -> Prepared:
    kinds = {kind.__name__: kind for kind in (UndampedString, BlockString, DenseString)}
    kind = kinds[str(held["kind"])]
    string = kind(**{name: _number(held[f"kernel.{name}"]) for name in kind._fields})
    scheme = Scheme(
        float(held["step"]), int(held["steps"]), int(held["modes"]), int(held["sampling"])
    )
    stepper = StringStep(
        string,
        held["angle_to_state"],
        held["speed_to_state"],
        held["rest"],
        scheme.modes,
        scheme.step,
    )
    return Prepared(stepper, scheme, float(held["duration"]), float(held["j1_from"]))


def _number(array: Any) -> Any:
    return float(array) if array.ndim == 0 else array


def _write_npz(path: Path, arrays: dict[str, Any]) -> None:
    """Write beside the target and move: a reader sees a whole file or none."""
    part = path.with_suffix(".part")
    with part.open("wb") as stream:
        np.savez(stream, **arrays)
        stream.flush()
        os.fsync(stream.fileno())
    part.replace(path)
