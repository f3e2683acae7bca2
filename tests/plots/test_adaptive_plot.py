"""The picture of an adaptive map: what is drawn and told."""

from __future__ import annotations

import io

import numpy as np
import pytest
from matplotlib.figure import Figure

import drillctl
from drillctl.plots import adaptive_map
from drillctl.simulation.batch import FLOATS
from drillctl.simulation.measures import STATUSES
from drillctl.studies import Axis
from drillctl.studies.adaptive.checks import SelfCheck, full_audit
from drillctl.studies.adaptive.contour_search import search
from drillctl.studies.adaptive.study import AdaptiveMap
from drillctl.studies.audit import Audit

KP = Axis("controller.kp", "N*m*s/rad", np.linspace(0.0, 1000.0, 101))
SPEED = Axis("operating_point.speed", "rad/s", np.linspace(8.0, 12.0, 91))
LEVELS = (20.0, 30.0, 40.0, 50.0)


def made(mismatches=0, failed=False, full=False, least=10.0):
    """A round valley, found by the search itself."""
    x, y = np.meshgrid(np.linspace(-1.0, 1.0, 101), np.linspace(-1.0, 1.0, 91), indexing="ij")
    values = least + 80.0 * np.hypot(x, y)
    if failed:
        values[:9, :9] = np.nan
    found = search(lambda cells: values.ravel()[cells], values.shape, LEVELS)
    cells = np.concatenate(found.order)
    j1 = values.ravel()[cells]
    sample = cells[:20]
    bands = found.bands.ravel()[sample]
    said = bands.copy()
    said[:mismatches] += 1
    none = np.empty(0)
    return AdaptiveMap(
        design=drillctl.load("monteiro-trindade-140kn", **{"title": "A title"}),
        axes=(KP, SPEED), levels=LEVELS, cells=cells,
        measures=dict.fromkeys(FLOATS, j1),
        status=np.where(np.isnan(j1), STATUSES.index("failed"), 0).astype(np.int8),
        bands=found.bands, intervals=40, audit=Audit(none.astype(int), none, none),
        self_check=SelfCheck(sample, said, bands, 0),
        full_audit=full_audit(values, values, LEVELS, 9) if full else None,
        step=0.02, modes=16, seconds=0.1, total_seconds=0.2,
    )  # fmt: skip


def told(figure):
    (legend,) = [ax.get_legend() for ax in figure.axes]
    return [text.get_text() for text in legend.get_texts()]


def test_regions_cells_and_minimum_are_drawn():
    result = made()
    figure = adaptive_map(result)
    (ax,) = figure.axes
    assert told(figure) == [
        *(f"J1 at or under {level:g} s" for level in LEVELS),
        f"simulated: {result.trajectories} of 9191 cells",
        f"minimum {np.nanmin(result.measures['j1']):.2f} s",
    ]
    dots = ax.lines[0].get_xydata()
    i, j = np.unravel_index(result.cells, (101, 91))
    rpm = SPEED.values * 60.0 / (2.0 * np.pi)
    np.testing.assert_allclose(dots, np.column_stack([KP.values[i], rpm[j]]))
    assert ax.get_ylabel() == "set speed (rpm)"
    assert ax.get_title(loc="left") == "A title"
    caption = figure.get_supxlabel()
    assert f"{result.share:.2%} of the full grid's cells" in caption
    assert "0 of 20 cells left out" in caption
    assert "full audit" not in caption


def test_what_went_wrong_is_marked():
    figure = adaptive_map(made(mismatches=2, failed=True, full=True))
    assert {"in another band than said", "failed"} <= set(told(figure))
    assert "self-check: look (2 of 20 cells" in figure.get_supxlabel()
    assert "full audit: ok" in figure.get_supxlabel()


def test_contours_run_where_the_outlines_do():
    result = made()
    (ax,) = adaptive_map(result).axes
    drawn = ax.collections[-1]
    (outline,) = result.regions[30.0].polygons.geoms
    paths = [p for p in drawn.get_paths() if len(p.vertices)]
    assert len(paths) == 4
    x = paths[1].vertices[:, 0]
    assert (x.min(), x.max()) == pytest.approx((outline.bounds[0], outline.bounds[2]))


@pytest.mark.parametrize("least", [200.0, np.nan])
def test_nothing_under_any_level(least):
    figure = adaptive_map(made(least=least))
    assert isinstance(figure, Figure)
    assert not any(name.startswith("J1") for name in told(figure))
    figure.savefig(io.BytesIO())


def test_it_takes_axes():
    ax = Figure().add_subplot()
    assert adaptive_map(made(), ax=ax) is ax.figure
