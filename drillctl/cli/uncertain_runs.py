"""How a run under uncertainty is carried out from the command line, and its pictures."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from drillctl.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.figure import Figure

    from drillctl import units
    from drillctl.design import Design
    from drillctl.progress import Progress
    from drillctl.store import RunFolder
    from drillctl.studies import Uncertainty


@dataclass(frozen=True)
class How:
    """How a run is carried out; its result does not depend on it."""

    resume: bool  # whether there must be a run to go on with
    allow_mixed: bool  # whether processors may be of several types
    scheduler: str | None  # address of a dask.distributed scheduler
    interim: float | None  # time between interim pictures (s); None for none


def refuse_nothing_to_resume(out: Path | None) -> None:
    """Refuse (`InputError`) to go on with a run that is not there."""
    if out is None:
        raise InputError("goes with --out, the folder of the run to go on with", "--resume")
    if not (out / "run.json").is_file():
        raise InputError(f"{out} holds no run to go on with", "--resume")


def computed(
    design: Design, how: How, folder: RunFolder, bar: Progress, system: units.System
) -> Uncertainty:
    """The result of a run in its folder."""
    from drillctl import studies
    from drillctl.ensemble.cluster import Cluster, connect
    from drillctl.ensemble.storing import Folder

    interim = None if how.interim is None else _Interim(how.interim, folder.path, system)
    given: dict[str, Any] = {"progress": bar, "store": Folder(folder.path), "interim": interim}
    if how.scheduler is None:
        result = studies.uncertainty(design, **given)
    else:
        with connect(how.scheduler) as client:
            workers = Cluster(client, how.allow_mixed)
            result = studies.uncertainty(design, workers=workers, **given)
    (folder.path / INTERIM).unlink(missing_ok=True)
    return result


INTERIM = "interim.png"


class _Interim:
    """Pictures of what is finished, from time to time."""

    def __init__(self, every: float, folder: Path, system: units.System) -> None:
        self._every, self._folder, self._system = every, folder, system
        self._next = time.monotonic() + every

    def __call__(self, so_far: Callable[[], Uncertainty | None]) -> None:
        if time.monotonic() < self._next:
            return
        from drillctl import plots

        result = so_far()
        if result is not None and len(result.axes) == 2:
            part = self._folder / "interim.part.png"
            plots.probability_map(result, system=self._system).savefig(part)
            part.replace(self._folder / INTERIM)
        self._next = time.monotonic() + self._every


def pictures(result: Uncertainty, system: units.System) -> Iterator[tuple[str, Figure]]:
    """Pictures of a result, one after the other, each with its name."""
    from drillctl import plots

    yield "convergence", plots.area_convergence(result)
    yield "distributions", plots.cell_distributions(result, system=system)
    flat = {"": result} if len(result.axes) == 2 else {}
    flat |= {f"-{k}": one for k, one in enumerate(result.slices().values(), start=1)}
    for ending, one in flat.items():
        yield f"regions{ending}", plots.uncertain_regions(one, system=system)
        yield f"probability{ending}", plots.probability_map(one, system=system)
        yield f"sampling-error{ending}", plots.region_error(one, system=system)
    if result.sensitivity is not None:
        yield "sensitivity", plots.sensitivity_bars(result)
