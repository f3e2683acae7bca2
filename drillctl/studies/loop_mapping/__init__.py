"""Stability, slope margin, damping and sensitivity of the loop over two parameters."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import TYPE_CHECKING

from drillctl import plots, units
from drillctl.store.tables import Column, Table
from drillctl.studies.base import Option, Picture, Recipe, Requested, Run, Study, over_two_axes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from drillctl.design import Design
    from drillctl.studies.loop_mapping.compute import LoopMap


def computed(design: Design, run: Run) -> LoopMap:
    """The map of the quantities that are requested, all by default."""
    from drillctl.studies.loop_mapping.compute import QUANTITIES, loop_map

    chosen = run.options["quantities"] or tuple(QUANTITIES)
    return loop_map(design, quantities=chosen, progress=run.progress)


def tables(result: LoopMap) -> Iterator[Table]:
    """A row a cell."""
    columns = (
        *(Column(axis.path, unit=axis.unit) for axis in result.axes),
        *(Column(name, unit=result.unit(name)) for name in result.values),
    )
    points = itertools.product(*(axis.values.tolist() for axis in result.axes))
    values = zip(*(one.ravel().tolist() for one in result.values.values()), strict=True)
    rows = ((*point, *cells) for point, cells in zip(points, values, strict=True))
    yield Table("loop-map", "loop over the parameters", columns, rows, shown=False)


def pictures(result: LoopMap) -> Iterator[Picture]:
    """The slope margin, or the growth of a bit that cuts its own wake."""
    if len(result.axes) != 2:
        return
    if "growth" in result.values:
        yield Picture(
            "cutting-roots",
            "Growth of the rightmost root of the cutting bit over the map, and where all decay.",
            f"Map of the growth; in {int(result.stable.sum())} of {result.stable.size} cells no "
            "root lies in the right half-plane.",
            lambda system: plots.loop_map(result, "growth", system=system),
        )  # fmt: skip
        return
    best = result.best
    largest = (
        ""
        if best is None
        else f" The largest is {units.full(best[0], result.unit('slope_margin'), 4)}."
    )
    yield Picture(
        "slope-margin", "Slope margin over the map: the falling slope that the loop tolerates.",
        f"Map of the slope margin; {int(result.stable.sum())} of {result.stable.size} cells are "
        f"locally stable.{largest}",
        lambda system: slope_margin(result, system),
        paper=True,
    )  # fmt: skip


def slope_margin(result: LoopMap, system: units.System) -> Figure:
    """The slope margin, with the boundary of stable gains on a map over both gains."""
    from drillctl.linear.boundary import boundary_over

    axes = result.axes
    boundary = boundary_over(result.design, (x.path for x in axes), (x.values for x in axes))
    return plots.loop_map(result, boundary=boundary, system=system)


def not_applicable(request: Requested) -> str:
    """Why a report has no map of the slope margin."""
    if request.design.axial is not None:
        return "its torque does not fall, the roots of the cutting bit decide"
    return over_two_axes(request)


STUDY = Study(
    module=__name__,
    name="loop-map",
    help="Map quantities of the loop over two parameters",
    group="Analyse the loop",
    options=(Option("quantities", tuple, "Map these quantities; all by default"),),
    axes=True,
    command=False,
    recipes=(
        Recipe("slope-margin", "the slope margin over the map", not_applicable,
               options={"quantities": ("slope_margin",)}, order=80),
    ),
)  # fmt: skip
