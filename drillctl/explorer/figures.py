"""Pictures of a page: what is drawn once, and what each result changes in them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import contourpy
import numpy as np
from bokeh.models import (
    ColorBar,
    ColumnDataSource,
    LinearColorMapper,
    Range1d,
    Span,
)
from bokeh.palettes import Viridis256
from bokeh.plotting import figure

from drillctl import units
from drillctl.arrays import Array
from drillctl.ensemble.grid import Axis
from drillctl.explorer.controls import shown_unit
from drillctl.plots.style import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION
from drillctl.simulation.measures import MEASURES

if TYPE_CHECKING:
    from drillctl.ensemble.audit import Audit
    from drillctl.explorer.computed import Boundary, Loop
    from drillctl.simulation import Simulation

FALLING = tuple(Viridis256[46:][::-1])
"""Colours of what should be small, without the darkest end, on which lines would be lost."""
RISING = tuple(Viridis256[46:])
REQUIRED = 1.10  # slope margin over slope that a recommendation requires by default
NEAR = 3.0  # half-width of the Nyquist picture
FAR = 50.0  # beyond it nothing is drawn of the curve
GREY = "#888888"


def names(axes: tuple[Axis, ...], system: units.System) -> list[str]:
    """Labels of axes with their units."""
    from drillctl.design.paths import USUAL_NAMES

    results = []
    for one in axes:
        unit = shown_unit(one.unit, system)[1]
        name = USUAL_NAMES.get(one.path, one.path)
        results.append(f"{name} ({unit})" if unit else name)
    return results


def shown(one: Axis, system: units.System) -> Array:
    """Values of an axis as they are shown."""
    return np.asarray(one.values / shown_unit(one.unit, system)[0])


def contours(x: Array, y: Array, values: Array, levels: Iterable[float]) -> dict[str, list[Any]]:
    """Lines at levels, each with its level and a place to write it."""
    result: dict[str, list[Any]] = {key: [] for key in ("xs", "ys", "level", "x", "y")}
    if min(values.shape) < 2:
        return result
    made = contourpy.contour_generator(x, y, np.ma.masked_invalid(values.T))
    levels = list(levels)
    for number, level in enumerate(levels):
        for line in made.lines(level):
            result["xs"].append(line[:, 0])
            result["ys"].append(line[:, 1])
            result["level"].append(f"{level:g}")
            # Not beside the label of the line before.
            at = line[int((number + 0.5) / len(levels) * (len(line) - 1))]
            result["x"].append(float(at[0]))
            result["y"].append(float(at[1]))
    return result


def _source(*columns: str) -> ColumnDataSource:
    return ColumnDataSource({name: [] for name in columns})


def _plot(name: str, x: str, y: str, **more: Any) -> Any:
    plot = figure(
        name=name, sizing_mode="stretch_both", toolbar_location=None, tools="", min_border=4,
        output_backend="canvas", x_axis_label=x, y_axis_label=y, **more,
    )  # fmt: skip
    for axis in (plot.xaxis, plot.yaxis):
        axis.axis_label_text_font_size = "11px"
        axis.major_label_text_font_size = "10px"
        axis.axis_label_text_font_style = "normal"
        axis.axis_label_standoff = 2
        axis.minor_tick_line_color = None
        axis.ticker.desired_num_ticks = 5  # labels are most of what a browser draws
    plot.xgrid.grid_line_alpha = plot.ygrid.grid_line_alpha = 0.5
    return plot


def _entry(plot: Any) -> Any:
    """The entry of case A in a legend, which waits for one."""
    one = next(item for item in plot.legend.items if str(item.label.value).endswith("A"))
    one.visible = False
    return one


def _legend(plot: Any, location: str = "top_right") -> None:
    plot.legend.location = location
    plot.legend.label_text_font_size = "10px"
    plot.legend.padding, plot.legend.spacing, plot.legend.margin = 3, 0, 3
    plot.legend.glyph_height, plot.legend.label_height = 10, 10
    plot.legend.background_fill_alpha = 0.7


class MapFigure:
    """The map with its levels, what the linear loop says, case A and the cross."""

    def __init__(self) -> None:
        self.colours = LinearColorMapper(palette=FALLING, low=0.0, high=1.0, nan_color="#ffffff")
        self.image = _source("image", "x", "y", "dw", "dh")
        self.levels = _source("xs", "ys", "level", "x", "y")
        self.kept = _source("xs", "ys", "level", "x", "y")
        self.margin = _source("xs", "ys", "level", "x", "y")
        self.lines = _source("xs", "ys")
        self.audited = _source("x", "y")
        self.best = _source("x", "y")
        self.cross = _source("x", "y")
        self.of_a = _source("x", "y")
        self.x_range, self.y_range = Range1d(0, 1), Range1d(0, 1)
        plot = _plot("map", " ", " ", x_range=self.x_range, y_range=self.y_range)
        plot.image(
            "image",
            "x",
            "y",
            "dw",
            "dh",
            source=self.image,
            color_mapper=self.colours,
            level="image",
        )
        plot.multi_line("xs", "ys", source=self.levels, line_color="black", line_width=1.6)
        plot.text("x", "y", text="level", source=self.levels, text_font_size="11px",
                  text_color="black", text_align="center", text_baseline="middle",
                  background_fill_color="white", background_fill_alpha=0.75, padding=1)  # fmt: skip
        plot.multi_line("xs", "ys", source=self.kept, line_color=PURPLE, line_width=2,
                        line_dash="dashed", legend_label="levels of A")  # fmt: skip
        plot.multi_line("xs", "ys", source=self.lines, line_color=VERMILLION, line_width=2,
                        legend_label="boundary of the linear loop")  # fmt: skip
        plot.multi_line("xs", "ys", source=self.margin, line_color=VERMILLION, line_width=1.4,
                        line_dash="dotted", legend_label=f"slope margin {REQUIRED:g}")  # fmt: skip
        plot.scatter("x", "y", source=self.audited, marker="circle", size=7, fill_color=None,
                     line_color=BLUE, line_width=1.3)  # fmt: skip
        plot.scatter("x", "y", source=self.best, marker="star", size=14, fill_color=VERMILLION,
                     line_color="white")  # fmt: skip
        self.spans = [
            Span(
                dimension=d,
                location=0,
                line_color="black",
                line_width=1,
                line_alpha=0.6,
                level="overlay",
            )  # which is drawn again without the map under it
            for d in ("height", "width")
        ]
        for one in self.spans:
            plot.add_layout(one)
        plot.scatter("x", "y", source=self.of_a, marker="square_cross", size=12, fill_color=None,
                     line_color=PURPLE, line_width=2)  # fmt: skip
        plot.scatter("x", "y", source=self.cross, marker="circle_cross", size=18, line_width=2,
                     fill_color="white", fill_alpha=0.6, line_color="black",
                     level="overlay")  # fmt: skip
        bar = ColorBar(color_mapper=self.colours, width=10, padding=4,
                       major_label_text_font_size="10px")  # fmt: skip
        plot.add_layout(bar, "right")
        plot.title.align, plot.title.text_font_size = "right", "11px"
        plot.title.text_font_style = "normal"
        _legend(plot, "top_left")
        self.plot, self.plots, self.of_kept = plot, (plot,), _entry(plot)

    def place(self, axes: tuple[Axis, Axis], system: units.System) -> None:
        """Axes of the map."""
        (x, y), (across, along) = (shown(one, system) for one in axes), names(axes, system)
        for bounds, values in ((self.x_range, x), (self.y_range, y)):
            half = 0.5 * (values[1] - values[0])
            bounds.update(start=float(values[0] - half), end=float(values[-1] + half))
        self.plot.xaxis.axis_label, self.plot.yaxis.axis_label = across, along

    def move(
        self, cross: tuple[float, float], axes: tuple[Axis, Axis], system: units.System
    ) -> None:
        """The cross."""
        x, y = (c / shown_unit(a.unit, system)[0] for c, a in zip(cross, axes, strict=True))
        self.cross.data = {"x": [x], "y": [y]}
        self.spans[0].location, self.spans[1].location = x, y

    def paint(
        self, axes: tuple[Axis, Axis], values: Array, levels: Iterable[float], measure: str,
        system: units.System, share: bool,
    ) -> None:  # fmt: skip
        """Values of the map; `share`: of draws, between 0 and 1."""
        x, y = (shown(one, system) for one in axes)
        one, unit = units.displayed(1.0, "1" if share else MEASURES[measure].unit, system)
        values = values * one
        levels = list(levels)
        if share:
            low, high, colours = 0.0, 1.0, RISING
        elif measure == "j1":
            low, high, colours = 0.0, 2.0 * max(levels), FALLING
        else:
            finite = values[np.isfinite(values)]
            low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
            high, colours = (high if high > low else low + 1.0), FALLING
        title = "share of rocks" if share else f"{MEASURES[measure].label} ({unit})"
        self.plot.title.text = title.removesuffix(" ()")
        self.colours.update(low=low, high=high, palette=colours)
        hx, hy = 0.5 * (x[1] - x[0]), 0.5 * (y[1] - y[0])
        self.image.data = {
            "image": [np.ascontiguousarray(values.T)],
            "x": [float(x[0] - hx)], "y": [float(y[0] - hy)],
            "dw": [float(x[-1] - x[0] + 2 * hx)], "dh": [float(y[-1] - y[0] + 2 * hy)],
        }  # fmt: skip
        drawn = levels if share or measure == "j1" else ()
        self.levels.data = contours(x, y, values, drawn)

    def mark(self, boundary: Boundary | None, system: units.System) -> None:
        """Boundary and margin of the linear loop; none while they are computed."""
        if boundary is None:
            self.lines.data, self.margin.data = {"xs": [], "ys": []}, contours_of_nothing()
            return
        x, y = (shown(one, system) for one in boundary.axes)
        ratio = np.clip(boundary.ratio, 0.0, 10.0)
        if boundary.lines is None:
            found = contours(x, y, ratio, (1.0,))
            self.lines.data = {"xs": found["xs"], "ys": found["ys"]}
        else:
            fx, fy = (1.0 / shown_unit(one.unit, system)[0] for one in boundary.axes)
            self.lines.data = {
                "xs": [line[:, 0] * fx for line in boundary.lines],
                "ys": [line[:, 1] * fy for line in boundary.lines],
            }
        self.margin.data = contours(x, y, ratio, (REQUIRED,))

    def check(self, audit: Audit | None, axes: tuple[Axis, Axis], system: units.System) -> None:
        """Audited cells; none while they are computed."""
        if audit is None or not len(audit.cells):
            self.audited.data = {"x": [], "y": []}
            return
        x, y = (shown(one, system) for one in axes)
        i, j = np.unravel_index(audit.cells, (len(x), len(y)))
        self.audited.data = {"x": x[i], "y": y[j]}

    def keep(self, lines: dict[str, Any] | None, place: tuple[float, float] | None) -> None:
        """Levels of case A and its cross, in the units that are shown; None for none."""
        self.kept.data = contours_of_nothing() if lines is None else lines
        self.of_a.data = _point(place)
        self.of_kept.visible = lines is not None

    def star(self, place: tuple[float, float] | None) -> None:
        """The recommended setting, in the units that are shown; None where it is not on the map."""
        self.best.data = _point(place)


def _point(place: tuple[float, float] | None) -> dict[str, list[float]]:
    return {"x": [], "y": []} if place is None else {"x": [place[0]], "y": [place[1]]}


def contours_of_nothing() -> dict[str, list[Any]]:
    """No lines."""
    return {key: [] for key in ("xs", "ys", "level", "x", "y")}


class ResponseFigures:
    """Speeds, torques and phase portrait of the run at the cross, and of case A.

    Their colours are explained beside them in the page: a legend costs a browser as much as the
    curves.
    """

    def __init__(self) -> None:
        self.speeds, self.torques = _source("time", "bit", "top", "twist"), _source(*TORQUES)
        self.kept, self.kept_torques = _source("time", "bit", "top", "twist"), _source(*TORQUES)
        self.times = Range1d(0, 100)
        speed = _plot("speed", "", "speed (rpm)", x_range=self.times)
        self.set_speed = Span(dimension="width", location=0, line_color=GREY, line_dash="dotted")
        speed.add_layout(self.set_speed)
        speed.line("time", "bit", source=self.kept, color=PURPLE, alpha=0.7)
        speed.line("time", "top", source=self.speeds, color=ORANGE)
        speed.line("time", "bit", source=self.speeds, color=BLUE, width=1.5)
        torque = _plot("torque", "time (s)", "torque", x_range=self.times)
        torque.line("time", "drive", source=self.kept_torques, color=PURPLE, alpha=0.7)
        torque.line("time", "pipe", source=self.torques, color=SKY)
        torque.line("time", "drive", source=self.torques, color=VERMILLION)
        phase = _plot("phase", "twist (rev)", "bit speed (rpm)")
        phase.line("twist", "bit", source=self.kept, color=PURPLE, alpha=0.6)
        phase.line("twist", "bit", source=self.speeds, color=BLUE)
        self.plots = (speed, torque, phase)

    def show(self, run: Simulation) -> None:
        """Speeds and phase portrait of the run at the cross."""
        self.speeds.data = _speeds(run)
        self.times.end = float(run.time[-1])
        self.set_speed.location = run.design.speed / units.RPM

    def show_torques(self, run: Simulation, system: units.System) -> None:
        """Torques of that run."""
        self.torques.data = _torques(run, system)
        self.plots[1].yaxis.axis_label = f"torque ({units.unit_name('N*m', system)})"

    def keep(self, run: Simulation | None, system: units.System) -> None:
        """The run of case A, or none."""
        if run is None:
            self.kept.data = {name: [] for name in self.kept.data}
            self.kept_torques.data = {name: [] for name in TORQUES}
        else:
            self.kept.data, self.kept_torques.data = _speeds(run), _torques(run, system)


TORQUES = ("time", "drive", "pipe")


def _speeds(run: Simulation) -> dict[str, Array]:
    return {
        "time": run.time,
        "bit": run.signals["bit_speed"] / units.RPM,
        "top": run.signals["top_speed"] / units.RPM,
        "twist": run.signals["twist"] / (2.0 * math.pi),
    }


def _torques(run: Simulation, system: units.System) -> dict[str, Array]:
    one = shown_unit("N*m", system)[0]
    drive, pipe = run.signals["top_torque"], run.signals["pipe_torque"]
    return {"time": run.time, "drive": drive / one, "pipe": pipe / one}


class LoopFigures:
    """Nyquist curve with the disk of its margin; impedance and reflection of the drive."""

    def __init__(self) -> None:
        self.curve = _source("re", "im")
        self.mirror = _source("re", "im")
        self.disk = _source("x", "y")
        self.drive = _source("frequency", "impedance", "reflection")
        self.kept = _source("re", "im")
        self.kept_drive = _source("frequency", "impedance", "reflection")
        nyquist = _plot("nyquist", "real part of L", "imaginary part of L",
                        x_range=Range1d(-NEAR, NEAR - 1.0), y_range=Range1d(-NEAR, NEAR),
                        match_aspect=True)  # fmt: skip
        nyquist.patch("x", "y", source=self.disk, fill_color=ORANGE, fill_alpha=0.35,
                      line_color=ORANGE)  # fmt: skip
        angle = np.linspace(0.0, 2.0 * np.pi, 121)
        nyquist.line(np.cos(angle), np.sin(angle), color=GREY, line_dash="dotted")
        nyquist.line("re", "im", source=self.kept, color=PURPLE, alpha=0.7)
        nyquist.line("re", "im", source=self.mirror, color=SKY, line_dash="dashed")
        nyquist.line("re", "im", source=self.curve, color=BLUE, width=1.5)
        nyquist.scatter([-1.0], [0.0], marker="x", size=9, color=VERMILLION, line_width=2)
        impedance = _plot("impedance", "frequency (Hz)", "|Z| / pipe", x_axis_type="log",
                          y_axis_type="log", y_range=Range1d(0.03, 300.0))  # fmt: skip
        impedance.add_layout(Span(dimension="width", location=1.0, line_color=GREY,
                                  line_dash="dotted"))  # fmt: skip
        reflection = _plot("reflection", "frequency (Hz)", "reflection |r|", x_axis_type="log",
                           x_range=impedance.x_range, y_range=Range1d(0.0, 1.25))  # fmt: skip
        for plot, column in ((impedance, "impedance"), (reflection, "reflection")):
            plot.line("frequency", column, source=self.kept_drive, color=PURPLE, alpha=0.7)
            plot.line("frequency", column, source=self.drive, color=GREEN, width=1.5)
        self.plots = (nyquist, impedance, reflection)

    def show(self, loop: Loop | None) -> None:
        """The loop at the cross, or none."""
        columns = _loop_columns(loop)
        self.curve.data = columns[0]
        self.mirror.data = {"re": columns[0]["re"], "im": -np.asarray(columns[0]["im"])}
        self.drive.data = columns[1]
        margins = None if loop is None else loop.margins
        alpha = 2.0 if margins is None else margins.disk
        if margins is None or alpha >= 2.0:
            self.disk.data = {"x": [], "y": []}
            return
        # The circle through (2 + a) / (2 - a) and its inverse, about the real axis.
        near, far = -(2.0 - alpha) / (2.0 + alpha), -(2.0 + alpha) / (2.0 - alpha)
        angle = np.linspace(0.0, 2.0 * np.pi, 91)
        middle, radius = 0.5 * (near + far), 0.5 * (near - far)
        self.disk.data = {"x": middle + radius * np.cos(angle), "y": radius * np.sin(angle)}

    def keep(self, loop: Loop | None) -> None:
        """The loop of case A, or none."""
        self.kept.data, self.kept_drive.data = _loop_columns(loop)


def _loop_columns(loop: Loop | None) -> tuple[dict[str, Any], dict[str, Any]]:
    if loop is None:
        return {"re": [], "im": []}, {k: [] for k in ("frequency", "impedance", "reflection")}
    near = np.where(np.abs(loop.loop) < FAR, loop.loop, np.nan)
    return {"re": near.real, "im": near.imag}, dict(loop.drive)
