"""Numbers of a page are those of the commands, to the bit, and pictures show them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

import drillctl
from drillctl.ensemble.grid import axes_of
from drillctl.explorer import computed, figures, form
from drillctl.explorer.work import Dropped, Until
from drillctl.linear.loop_analysis import loop

AXES = [
    {"path": "controller.kp", "min": 300, "max": 700, "points": 14},
    {"path": "controller.ki", "min": 50, "max": 250, "points": 13},
]


@pytest.fixture(scope="module")
def design():
    return drillctl.load("monteiro-trindade-140kn", **{"map.axes": AXES, "map.audit_cells": 4})


@pytest.fixture(scope="module")
def pictures(design):
    found = computed.mapped(design, axes_of(design), "stick_slip_index")
    return [one for one in found if one is not None]


def test_a_map_is_coarse_first_and_then_that_of_the_command(design, pictures):
    expected = drillctl.stability_map(design, measures=["stick_slip_index"])
    assert pictures[0].whole is None
    assert pictures[0].values.shape == (14, 13)
    coarse = [computed.thinned(axis, computed.COARSE) for axis in axes_of(design)]
    assert [len(axis) for axis in coarse] == [11, 11]
    whole = pictures[-1].whole
    for name, values in expected.measures.items():
        assert whole.measures[name].tobytes() == values.tobytes(), name
    assert whole.status.tobytes() == expected.status.tobytes()
    # A coarse cell is the cell itself, where it is one.
    own = expected.measures["stick_slip_index"]
    i = np.searchsorted(axes_of(design)[0].values, coarse[0].values)
    j = np.searchsorted(axes_of(design)[1].values, coarse[1].values)
    assert pictures[0].values[np.ix_(i, j)].tobytes() == own[np.ix_(i, j)].tobytes()
    (audit,) = computed.audited(whole, Until())
    assert audit.cells.tolist() == expected.audit.cells.tolist()
    assert audit.worst == expected.audit.worst


def test_an_axis_of_the_string_gives_the_same(design):
    axes = [AXES[0] | {"points": 3},
            {"path": "drillstring.sections.pipe.length", "min": "2000 m", "max": "3000 m",
             "points": 3}]  # fmt: skip
    other = design.replace({"map.axes": axes})
    expected = drillctl.stability_map(other, audit_cells=0, measures=["j1"])
    *_, last = computed.mapped(other, axes_of(other), "j1")
    assert last.whole.j1.tobytes() == expected.j1.tobytes()


def test_slices_of_a_map_come_one_by_one(design, monkeypatch):
    monkeypatch.setattr(computed, "SLICE", 1e-9)
    monkeypatch.setattr(computed, "BETWEEN_PICTURES", 0.0)
    monkeypatch.setattr(computed, "FIRST", 16)
    parts = list(computed.mapped(design, axes_of(design), "j1"))
    assert len(parts) == 1 + -(-14 * 13 // 16)
    assert all(one.whole is None for one in parts[:-1])
    known = [(one.values == parts[-1].values).sum() for one in parts]
    assert known == sorted(known)


def test_a_response_is_that_of_the_command(design):
    (run,) = computed.response(design)
    assert run.measures == drillctl.simulate(design, engine="batch").measures
    assert run.time[-1] == 100.0


@pytest.mark.parametrize("kp", [625.0, 200.0])
def test_margins_are_those_of_the_command(design, kp):
    at = design.replace({"controller.kp": kp})
    *_, last = computed.loop(at)
    expected = loop(at)
    assert (last.slope_margin, last.margins) == (expected.slope_margin, expected.margins)
    assert last.stable == expected.stable == (kp == 625.0)


def test_the_table_has_each_number_under_its_name(design):
    (run,) = computed.response(design)
    *_, last = computed.loop(design)
    told = {row[0]: row[1:] for row in form.readouts([run, None], [last, None], "si")}
    expected = loop(design)
    numbers = {
        "J1": ("s", run.measures.j1),
        "stick-slip index": ("", run.measures.stick_slip_index),
        "time stuck": ("s", run.measures.stuck_time),
        "peak torque": ("kN m", run.measures.peak_pipe_torque / 1e3),
        "slope of rock": ("N m s", expected.operating_point.slope),
        "slope tolerated": ("N m s", expected.slope_margin),
        "disk margin": ("", expected.margins.disk),
        "peak sensitivity": ("", expected.margins.peak_sensitivity),
        "delay margin": ("s", expected.margins.delay),
    }
    for name, (unit, value) in numbers.items():
        assert told.pop(name) == [unit, f"{value:.5g}", None]
    assert told == {"ends as": ["", run.status, None], "settles in": ["", "none", None]}


def test_a_loop_that_is_unstable_without_any_slope_tolerates_none():
    *_, last = computed.loop(drillctl.load("torque-limited-140kn"))
    assert np.isnan(last.slope_margin)
    rows = form.readouts([None], [last], "si")
    assert ["slope tolerated", "", "none"] in rows


def test_the_share_of_rocks_is_that_of_uncertainty(design):
    small = design.replace({"map.axes": [one | {"points": 4} for one in AXES]})
    parts = list(computed.probability(small, axes_of(small), 30.0, 9))
    assert parts[0].draws == computed.FEWEST
    assert parts[-1].draws == 9
    expected = drillctl.uncertainty(small, realizations=9, audit_cells=0)
    found = expected.probability(30.0)
    assert parts[-1].values.tobytes() == (found.counts / 9).tobytes()
    assert 0.0 < parts[-1].values.max() <= 1.0


def test_long_work_ends_when_it_is_dropped(pictures):
    until = Until()
    until.dropped = True
    with pytest.raises(Dropped):
        next(computed.audited(pictures[-1].whole, until))


def test_the_boundary_is_that_of_the_loop(design):
    *_, last = computed.boundary(design, axes_of(design))
    x, y = np.meshgrid(*(axis.values for axis in last.axes), indexing="ij")
    from drillctl.linear import gain_boundary

    region = gain_boundary(design, window=((300, 700), (50, 250)))
    inside = np.vectorize(region.contains)(x, y)
    within = (slice(1, -1), slice(1, -1))  # the region ends with its window
    assert ((last.ratio > 1.0) == inside)[within].all()
    assert len(last.lines) >= 1


def marks(picture, colour):
    return [one for one in picture["marks"] if one.get("colour") == colour]


def test_pictures_of_a_run_are_in_the_units_that_are_shown(design):
    (run,) = computed.response(design)
    (other,) = computed.response(design.replace({"controller.kp": 300.0}))
    drawn = figures.of_run(run, other, "field")
    (bit,), (a,) = marks(drawn["speed"], "blue"), marks(drawn["speed"], "purple")
    assert bit["x"].tobytes() == run.time.tobytes()
    assert bit["y"] == pytest.approx(run.signals["bit_speed"] * 30.0 / np.pi, rel=1e-14)
    assert a["y"] == pytest.approx(other.signals["bit_speed"] * 30.0 / np.pi, rel=1e-14)
    (torque,) = marks(drawn["torque"], "red")
    assert drawn["torque"]["y"]["label"] == "torque (klbf ft)"
    assert torque["y"] == pytest.approx(run.signals["top_torque"] / 1355.8179483314004, rel=1e-9)
    for one in drawn.values():  # everything that is drawn is inside
        for axis in "xy":
            low = min(mark[axis].min() for mark in one["marks"])
            high = max(mark[axis].max() for mark in one["marks"])
            assert one[axis]["low"] <= low < high <= one[axis]["high"]


def test_the_disk_of_the_margin_touches_the_nyquist_curve(design):
    *_, last = computed.loop(design)
    drawn = figures.of_loop(last, None)["nyquist"]
    (disk,), (curve,) = marks(drawn, "orange"), marks(drawn, "blue")
    middle = 0.5 * (disk["x"].min() + disk["x"].max())
    distance = np.nanmin(np.hypot(curve["x"] - middle, curve["y"]))
    assert distance == pytest.approx(np.ptp(disk["x"]) / 2, rel=1e-3)


@pytest.mark.parametrize("system", ["si", "field"])
def test_levels_of_a_map_run_where_its_values_are(design, pictures, system):
    last = replace(pictures[-1], measure="j1", values=pictures[-1].whole.j1)
    drawn = figures.stability(axes_of(design), system, last, (30.0, 50.0), ())
    lines, labels = drawn["marks"]
    x, y = (figures.shown(axis, system) for axis in axes_of(design))
    found = RegularGridInterpolator((x, y), last.values, bounds_error=False, fill_value=None)
    known = ~np.isnan(lines["x"])
    values = found(np.column_stack([lines["x"][known], lines["y"][known]]))
    assert np.minimum(abs(values - 30.0), abs(values - 50.0)).max() < 1e-6
    assert {"30", "50"} >= set(labels["texts"]) != set()
    assert drawn["image"]["values"].reshape(13, 14).T.tobytes() == last.values.tobytes()
    unit = {"si": "Kp (N m s)", "field": "Kp (klbf ft/rpm)"}[system]
    assert drawn["x"]["label"] == unit
