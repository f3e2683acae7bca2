"""Pictures of regions under uncertainty: what they show is what the result holds."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

import drillctl
from drillctl import plots
from drillctl.errors import InputError
from drillctl.plots.uncertainty import border
from drillctl.simulation.measures import STATUSES
from drillctl.studies.uncertainty.compute import uncertainty

GAINS = [
    {"path": "controller.kp", "min": 400.0, "max": 800.0, "points": 5},
    {"path": "controller.ki", "min": 50.0, "max": 200.0, "points": 4},
]


@pytest.fixture(scope="module")
def result():
    design = drillctl.load("monteiro-trindade-fig6", **{
        "map.axes": GAINS, "map.audit_cells": 0, "simulation.duration": "30 s",
        "map.levels": [16.0, 20.0, 30.0], "uncertainty.sensitivity.samples": 8,
    })  # fmt: skip
    return uncertainty(design, realizations=40)


def test_of_two_draws_two_contours_are_one(result):
    few = uncertainty(result.design, realizations=2)
    few.maps[few.levels[0]].counts[...] = np.arange(20).reshape(5, 4) // 7
    (lines,) = (x for x in plots.probability_map(few).axes[0].collections if hasattr(x, "levels"))
    assert lines.levels.tolist() == [0.25, 0.75]


PICTURES = [
    plots.uncertain_regions, plots.probability_map, plots.region_error, plots.area_convergence,
    plots.cell_distributions, plots.sensitivity_bars,
]  # fmt: skip


@pytest.mark.parametrize("picture", PICTURES)
def test_pictures_are_drawn_whole(picture, result, tmp_path):
    figure = picture(result)
    assert isinstance(figure, Figure)
    figure.savefig(tmp_path / "picture.png", dpi=50)
    words = " ".join(texts(figure))
    assert "nan" not in words.lower().split()


def texts(figure):
    return [text.get_text() for text in figure.findobj(match=Text)]


def test_variability_and_error_are_named_apart(result):
    for picture in (plots.uncertain_regions, plots.probability_map):
        words = " ".join(texts(picture(result)))
        assert "variability, not error" in words
        assert "sampling error" not in words
    words = " ".join(texts(plots.region_error(result)))
    assert "sampling error" in words
    assert "variability" not in words


def test_a_panel_a_level_with_its_probabilities(result):
    figure = plots.probability_map(result)
    panels = figure.axes[:3]
    assert [panel.get_title(loc="left") for panel in panels] == [
        "J1 <= 16 s", "J1 <= 20 s", "J1 <= 30 s"
    ]  # fmt: skip
    for panel, found in zip(panels, result.maps.values(), strict=True):
        shown = panel.collections[0].get_array()
        np.testing.assert_array_equal(np.ravel(shown), found.probability.T.ravel())
    assert panels[0].get_xlabel() == "Kp (N m s)"


def test_few_draws_are_shown_one_by_one(result):
    def lines(one):
        return sum(len(panel.collections) for panel in plots.uncertain_regions(one).axes)

    import dataclasses

    few = dataclasses.replace(
        result, measures={"j1": result.j1[:6]}, status=result.status[:6],
        drawn={path: values[:6] for path, values in result.drawn.items()},
    )  # fmt: skip
    assert lines(few) > lines(result)
    assert any("each draw" in text for text in texts(plots.uncertain_regions(few)))
    assert not any("each draw" in text for text in texts(plots.uncertain_regions(result)))
    status = few.status.copy()
    status[0, 0, 0] = STATUSES.index("censored")
    stopped = dataclasses.replace(few, status=status)
    assert not any("each draw" in text for text in texts(plots.uncertain_regions(stopped)))


def test_a_design_that_fails_in_all_cells_has_no_outline(result):
    import dataclasses

    lost = dataclasses.replace(result, nominal=np.full_like(result.nominal, np.nan))
    before, after = (
        len(plots.uncertain_regions(one).axes[1].collections) for one in (result, lost)
    )
    assert after == before - 1


@pytest.mark.parametrize("total", [1, 9, 10, 20, 40, 10_000])
@pytest.mark.parametrize("probability", [0.05, 0.5, 0.95])
def test_a_band_ends_between_two_counts(total, probability):
    shares = np.arange(total + 1) / total
    at = border(probability, total)
    assert not np.isclose(shares, at, rtol=0.0, atol=0.4 / total).any()
    assert ((shares > at) == (shares >= probability - 1e-12)).all()
    assert at > 0.0  # what is in no draw is in no region


def test_cells_that_are_known_and_those_that_are_not(result):
    figure = plots.region_error(result)
    low, high = result.maps[30.0].simultaneous
    expected = np.where(low >= 0.95, 2, np.where(high >= 0.95, 1, 0))
    shown = figure.axes[2].collections[0].get_array()
    np.testing.assert_array_equal(np.ravel(shown), expected.T.ravel())
    area = result.areas[30.0][0.95]
    assert any(f"area {area.value:.1%}" in text for text in texts(figure))


def test_convergence_shows_areas_and_intervals(result):
    (ax,) = plots.area_convergence(result).axes
    bars = ax.containers[2]
    values = [100.0 * one.value for one in result.convergence.areas[30.0]]
    np.testing.assert_allclose(bars.lines[0].get_ydata(), values)
    ends = np.array([segment[:, 1] for segment in bars.lines[2][0].get_segments()])
    expected = [[100.0 * e for e in one.interval] for one in result.convergence.areas[30.0]]
    np.testing.assert_allclose(ends, expected, atol=1e-9)


def test_distributions_of_chosen_cells(result):
    (ax,) = plots.cell_distributions(result, cells=[7]).axes
    (line,) = [one for one in ax.get_lines() if len(one.get_xdata()) > 2]
    column = np.sort(result.j1.reshape(40, -1)[:, 7])
    np.testing.assert_array_equal(line.get_xdata()[1:-1], column)
    assert "Kp 500 N m s" in line.get_label()


def test_names_of_the_best_cells_stand_whole_under_the_curves(result):
    figure = plots.cell_distributions(result)
    figure.draw_without_rendering()
    (ax,) = figure.axes
    names, whole = ax.get_legend().get_window_extent(), figure.bbox
    assert names.y1 < ax.get_window_extent().y0
    assert whole.x0 < names.x0 < names.x1 < whole.x1


def test_bars_are_the_indices(result):
    figure = plots.sensitivity_bars(result)
    one = result.sensitivity.indices[0]
    widths = [bar.get_width() for bar in figure.axes[0].patches]
    np.testing.assert_allclose(widths, [*one.first, *one.total])
    assert figure.axes[0].get_title(loc="left").startswith("J1 at Kp 600 N m s, Ki 100 N m")


def test_axes_may_be_given(result):
    from drillctl.plots.style import figure

    fresh = figure(9.0, 3.0)
    panels = fresh.subplots(1, 3)
    assert plots.uncertain_regions(result, ax=panels) is fresh
    with pytest.raises(InputError, match="needs 3 axes, got 2"):
        plots.region_error(result, ax=panels[:2])


def test_what_cannot_be_drawn_is_refused(result):
    import dataclasses

    bare = dataclasses.replace(result, sensitivity=None)
    with pytest.raises(InputError, match="has no Sobol indices"):
        plots.sensitivity_bars(bare)
    line = dataclasses.replace(
        result, axes=result.axes[:1], measures={"j1": result.j1[..., 0]},
        status=result.status[..., 0], nominal=result.nominal[:, 0],
    )  # fmt: skip
    for picture in PICTURES[:3]:
        with pytest.raises(InputError, match="a map shows 2 parameters, the result has 1"):
            picture(line)
