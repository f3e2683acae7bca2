"""Three regions in one picture: what is drawn, marked and told."""

from __future__ import annotations

import numpy as np
import pytest
from looks import drawn, legend
from matplotlib.figure import Figure

import drillctl
from drillctl.errors import InputError
from drillctl.plots.map import OUTLINE, three_regions
from drillctl.studies import Axis
from drillctl.studies.three_regions.compute import FIELDS, MASKS, ThreeRegions

KP = Axis("controller.kp", "N*m*s/rad", np.linspace(0.0, 400.0, 5))
WEIGHT = Axis("operating_point.weight_on_bit", "N", np.linspace(100e3, 160e3, 4))


@pytest.fixture(scope="module")
def design():
    return drillctl.load("monteiro-trindade-140kn", **{"title": "A title"})


def made(design, axes=(KP, WEIGHT), reference=None, **masks):
    """Regions that hold these cells of the grid and no others."""
    shape = tuple(len(a) for a in axes)
    fields = {name: np.full(shape, 40.0) for name in FIELDS}
    fields["reference_speed"] = np.full(shape, design.speed if reference is None else reference)
    flat = {name: np.zeros(shape, dtype=bool) for name in MASKS}
    for name, cells in masks.items():
        for cell in cells:
            flat[name][cell] = True
    return ThreeRegions(
        design=design, axes=axes, level=33.0, **fields, **flat,
        horizon=200.0, band=0.02, window=20.0, total_seconds=0.1,
    )  # fmt: skip


@pytest.fixture
def result(design):
    """Stable 4 cells: one attracted, one bistable, two undecided; one unstable lingers."""
    return made(
        design,
        locally_stable=[(1, 1), (1, 2), (2, 1), (2, 2)],
        inside_level=[(1, 1), (0, 1)],
        from_rest=[(1, 1), (3, 3), (2, 2)],
        from_wound_up=[(1, 1), (3, 3)],
        sticking_from_rest=[(1, 2), (0, 0)],
        failed=[(4, 0)],
    )


def covered(contours, point):
    return any(path.contains_point(point) for path in contours.get_paths())


def test_each_region_is_drawn_its_own_way(result):
    figure = three_regions(result)
    (ax,) = figure.axes
    assert drawn(figure)
    fill, hatched, outline = ax.collections
    assert covered(fill, (100.0, 120.0))
    assert covered(fill, (0.0, 120.0))
    assert not covered(fill, (200.0, 120.0))
    assert hatched.hatches == ["////"]
    assert covered(hatched, (100.0, 120.0))
    assert covered(hatched, (300.0, 160.0))
    assert not covered(hatched, (200.0, 140.0))  # from rest alone
    assert outline.get_linewidth()[0] == OUTLINE
    (path,) = outline.get_paths()
    corners = path.get_extents()
    assert (corners.xmin, corners.xmax) == (50.0, 250.0)  # the borders of the cells
    assert (corners.ymin, corners.ymax) == (110.0, 150.0)


def test_cells_that_differ_are_marked(result):
    ax = three_regions(result).axes[0]
    found = {
        line.get_label().split(":")[0].split(" (")[0]: (
            line.get_xdata().tolist(), line.get_ydata().tolist(), line.get_marker(),
        )
        for line in ax.get_lines()
    }  # fmt: skip
    assert found == {
        "bistable": ([100.0], [140.0], "o"),
        "undecided": ([200.0, 200.0], [120.0, 140.0], "."),
        "lingering": ([300.0], [160.0], "^"),
        "failed": ([400.0], [100.0], "x"),
    }


def test_legend_and_caption_count(result):
    figure = three_regions(result)
    words = legend(figure.axes[0])
    assert words[:3] == [
        "locally stable, linear (4)", "J1 at or under 33 s (2)", "attracted from both starts (2)",
    ]  # fmt: skip
    assert [w.split(":")[0] for w in words[3:]] == [
        "bistable", "undecided", "lingering", "failed (1)",
    ]  # fmt: skip
    caption = figure.get_supxlabel()
    assert "20 cells. J1 over 100 s, start turning" in caption
    assert "within 2 %" in caption
    assert "last 20 s of 200 s, from rest (3) and wound up (2)" in caption
    assert (
        "Of the locally stable cells 3 are over the level and 3 not attracted; "
        "1 under the level are not stable, 1 not attracted." in caption
    )
    assert "reconstructed" in caption
    assert "own equilibrium" not in caption


def test_other_operating_speeds_are_told(design):
    caption = three_regions(made(design, reference=np.nan)).get_supxlabel()
    assert "the cell's own equilibrium (20 cells have none)" in caption
    speed = Axis("operating_point.speed", "rad/s", np.array([8.0, 9.0, 10.0]))
    for axes, values in (((speed, KP), speed.values[:, None]), ((KP, speed), speed.values)):
        same = made(design, axes=axes, reference=values)
        assert "own equilibrium" not in three_regions(same).get_supxlabel()


def test_nothing_to_draw(design):
    figure = three_regions(made(design))
    assert drawn(figure)
    assert not figure.axes[0].collections
    assert len(legend(figure.axes[0])) == 3


def test_labels_and_units(result):
    ax = three_regions(result).axes[0]
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("Kp (N m s)", "weight on bit (kN)")
    assert ax.get_title(loc="left") == "Local stability, J1 and attraction\nA title"
    assert ax.get_xlim() == (-50.0, 450.0)
    field = three_regions(result, system="field").axes[0]
    assert field.get_ylabel() == "weight on bit (klbf)"
    assert field.get_ylim()[1] == pytest.approx(170e3 / 4448.22, rel=1e-4)


def test_given_axes_and_two_parameters(design, result):
    own = Figure()
    assert three_regions(result, own.subplots()) is own
    with pytest.raises(InputError, match="2 parameters, the result has 1"):
        three_regions(made(design, axes=(KP,)))
