"""What `drillctl uncertainty` does: claim or take up a folder, compute, save, draw, print."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from drillctl import console
from drillctl.errors import InputError
from drillctl.verbs import DPI, conclude, draw, running, shown_again

if TYPE_CHECKING:
    from pathlib import Path

    from drillctl import units
    from drillctl.cli import Options
    from drillctl.design import Design
    from drillctl.progress import Progress
    from drillctl.store import RunFolder
    from drillctl.studies import Uncertainty
    from drillctl.studies.uncertainty.running import Workers


@dataclass(frozen=True)
class How:
    """How a run is carried out; its result does not depend on it.

    Attributes
    ----------
    resume : bool
        Whether there must be a run to go on with.
    allow_mixed : bool
        Whether processors may be of several types.
    scheduler : str or None
        Address of a dask.distributed scheduler.
    interim : float or None
        Time between interim pictures (s); None for none.
    """

    resume: bool
    allow_mixed: bool
    scheduler: str | None
    interim: float | None


def uncertainty(design: Design, how: How, options: Options) -> None:
    """Regions of a map under uncertainty, with pictures and tables."""
    from drillctl import printing_uncertainty, store

    if how.resume:
        _refuse_nothing_to_resume(options.out)
    folder = store.claim(
        "uncertainty", design, options.out, store.growing_realizations(design), how.allow_mixed
    )
    if shown_again(
        folder, options,
        lambda: printing_uncertainty.uncertainty(store.open(folder.path), options.units),
    ):  # fmt: skip
        return
    with running(folder), console.progress() as bar:
        result = _computed(design, how, folder, bar, options.units)
    summary = result.summary()
    store.write_data(result, folder.path)
    _tables_and_pictures(result, folder.path, options.units)
    for lacking in (one for one in summary["best"].values() if "reason" in one):
        console.note(f"note: {lacking['reason']}")
        break
    if result.audit.verdict == "look":
        console.note("audit: look: the engines differ by more than 1 % in J1 in some lane")
    if not options.json:
        printing_uncertainty.uncertainty(result, options.units)
    conclude(folder, summary, options)


def _refuse_nothing_to_resume(out: Path | None) -> None:
    if out is None:
        raise InputError("goes with --out, the folder of the run to go on with", "--resume")
    if not (out / "run.json").is_file():
        raise InputError(f"{out} holds no run to go on with", "--resume")


def _computed(
    design: Design, how: How, folder: RunFolder, bar: Progress, system: units.System
) -> Uncertainty:
    from drillctl import studies
    from drillctl.studies.uncertainty.cluster import Cluster, connect

    shelf = folder.shelf()
    interim = None if how.interim is None else _Interim(how.interim, folder.path, system)
    if how.scheduler is None:
        return studies.uncertainty(design, progress=bar, shelf=shelf, interim=interim)
    with connect(how.scheduler) as client:
        workers: Workers = Cluster(client, how.allow_mixed)
        return studies.uncertainty(
            design, progress=bar, shelf=shelf, workers=workers, interim=interim
        )


class _Interim:
    """Pictures of what is finished, from time to time."""

    def __init__(self, every: float, folder: Path, system: units.System) -> None:
        self._every, self._folder, self._system = every, folder, system
        self._next = time.monotonic() + every

    def __call__(self, so_far: Callable[[], Uncertainty]) -> None:
        if time.monotonic() < self._next:
            return
        from drillctl import plots

        part = self._folder / "interim.part.png"
        if len(so_far().axes) == 2:
            figure = plots.probability_map(so_far(), system=self._system)
            figure.savefig(part, dpi=DPI)
            part.replace(self._folder / "interim.png")
        self._next = time.monotonic() + self._every


def _tables_and_pictures(result: Uncertainty, path: Path, system: units.System) -> None:
    from drillctl import plots, studies

    studies.write_uncertainty_tables(result, path)
    draw(plots.area_convergence(result), path / "convergence.png")
    draw(plots.cell_distributions(result, system=system), path / "distributions.png")
    flat = {"": result} if len(result.axes) == 2 else {}
    flat |= {f"-{k}": one for k, one in enumerate(result.slices().values(), start=1)}
    for ending, one in flat.items():
        draw(plots.uncertain_regions(one, system=system), path / f"regions{ending}.png")
        draw(plots.probability_map(one, system=system), path / f"probability{ending}.png")
        draw(plots.region_error(one, system=system), path / f"sampling-error{ending}.png")
    if result.sensitivity is not None:
        draw(plots.sensitivity_bars(result), path / "sensitivity.png")
    (path / "interim.png").unlink(missing_ok=True)
