"""What to set: criteria, verdicts, windows and numbers against other rooms and by hand."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import drillctl
from drillctl import plots, units
from drillctl.errors import InputError
from drillctl.linear import loop
from drillctl.linear.loop_margins import Margins
from drillctl.reporting.sections.summary import _margins
from drillctl.simulation import simulate
from drillctl.simulation.measures import STATUSES
from drillctl.studies.recommend import help as help_
from drillctl.studies.recommend import remarks, tables
from drillctl.studies.recommend.assess import FAILS, FRAGILE, PASSES, best_of
from drillctl.studies.recommend.candidates import (
    ROBUST,
    Confirmed,
    by_rules,
    gains_of,
    pi_problem,
    present,
)
from drillctl.studies.recommend.compute import recommend
from drillctl.studies.recommend.criteria import (
    LoopFigures,
    loop_criteria,
    loop_figures,
    mode_at,
    own_delay,
    run_criteria,
)
from drillctl.studies.recommend.deeper import at_depth, depth_of
from drillctl.studies.recommend.window import Line, window
from drillctl.studies.recommend.words import (
    _told_apart,
    in_drive_units,
    numbers_of,
    others,
)
from drillctl.studies.tune.certificate import FreshDraws
from drillctl.studies.tune.search import search

HOLDS = {
    "recommended settings": "the search of `tune`, and probabilities by its certificate, to the "
    "last bit; windows by single runs at both sides of their ends; criteria and ranks by hand",
}
SMALL = {
    "tune": {
        "realizations": 24, "starts": 1, "probability": 0.7, "certificate": {"realizations": 120},
        "parameters": {"controller.kp": {"min": 400, "max": 800},
                       "controller.ki": {"min": 0, "max": 200}},
    },
    "simulation.accuracy": "fast",
    "recommend.laws": ["pi", "soft-torque"],
    "recommend.rated_torque": "50 kN*m",
    "recommend.speed_step": "4 rpm",
    "recommend.weight_step": "4 kN",
}  # fmt: skip


@pytest.fixture(scope="module")
def design():
    return drillctl.load("monteiro-trindade-140kn", **SMALL)


@pytest.fixture(scope="module")
def result(design):
    return recommend(design)


def test_the_robust_gains_are_those_of_tune(design, result):
    robust = next(one for one in result.candidates if one.name == ROBUST)
    found = search(design)
    assert robust.gains == found.gains
    _, runs = FreshDraws(design, found.tuned).of_gains(found.values)
    assert np.array_equal(runs.j1, robust.j1)
    assert (robust.probability, robust.interval) == (runs.probability, runs.interval)
    assert robust.objective == runs.value


def test_a_window_ends_where_single_runs_stick(result):
    one = result.recommended
    for line, end, outwards in (
        (one.window.speed, one.window.lowest_speed, -1),
        (one.window.weight, one.window.highest_weight, 1),
    ):
        at = int(np.flatnonzero(line.values == end)[0])
        inside, outside = (line.values[k] for k in (at, at + outwards))
        ends = [
            simulate(one.design, "batch", **{line.path: units.SI(value)}).status
            for value in (inside, outside)
        ]
        assert ends[0] in ("ok", "not_settled")
        assert ends[1] in ("sticking", "stalled")


def test_a_window_ends_where_the_drive_does():
    land = drillctl.load(
        "typical-land",
        **{"recommend.speed_step": "40 rpm", "recommend.weight_step": "60 kN",
           "simulation.duration": "5 s", "simulation.accuracy": "fast"},
    )  # fmt: skip
    speeds = window(land).speed.values
    assert speeds[-1] == pytest.approx(200.0 * units.RPM)  # it turns 220 rpm at most


def line(words, own=3.0):
    status = np.array([STATUSES.index("ok" if w == "." else "sticking") for w in words], np.int8)
    values = np.arange(len(words), dtype=float)
    return Line("operating_point.speed", "rad/s", own, values, values, status)


def test_ends_of_what_is_free():
    assert line("x.....").ends() == (1.0, 5.0)
    assert line(".x..x.").ends() == (2.0, 3.0)  # islands beyond do not count
    assert line(".x..x.").islands()
    assert not line("xx....").islands()
    assert line("xxxx..").ends() == (None, None)
    assert line("xxxx..").nearest(1) == 4.0
    assert line("xxxx.x").nearest(1) is None
    assert line("..xx..").nearest(-1) == 1.0
    assert line(".x.x..").nearest(-1) == 0.0


def figures(slope=100.0, margin=150.0, peak=2.0, delay=0.05):
    one = Margins(5.0, 0.1, 0.1, 1.0, 6.0, 0.1, delay, 1.0)
    part = Margins(peak, 0.1, 0.5, 3.0, 20.0, 0.1, 0.1, 1.0)
    return LoopFigures(slope, margin, 0.12, one if slope < margin else None, part, "")


@pytest.mark.parametrize(
    ("changed", "missed"),
    [
        ({}, []),
        ({"margin": 105.0}, ["slope_reserve"]),
        ({"margin": 90.0}, ["stable", "slope_reserve", "delay"]),
        ({"margin": math.nan}, ["stable", "slope_reserve", "delay"]),
        ({"peak": 2.6}, ["peak_sensitivity"]),
        ({"peak": 2.5}, []),
        ({"delay": 0.01}, ["delay"]),
        ({"slope": -10.0}, []),
    ],
)
def test_each_criterion_of_the_loop_is_kept_or_missed_alone(changed, missed):
    drive = {"controller.drive": {"sampling_period": "10 ms", "one_sample_delay": True}}
    design = drillctl.load("monteiro-trindade-140kn", **drive)
    assert own_delay(design.tables.controller.drive) == pytest.approx(0.015)
    kept = loop_criteria(design, figures(**changed), design.tables.recommend)
    assert [one.name for one in kept if not one.kept] == missed
    assert all(bool(one.said) != one.kept for one in kept)
    assert all((one.miss > 0.0) != one.kept for one in kept)


@pytest.mark.parametrize(
    ("j1", "status", "interval", "missed"),
    [
        (20.0, "ok", (0.96, 0.98), []),
        (20.0, "not_settled", (0.95, 0.97), []),
        (34.0, "ok", (0.96, 0.98), ["j1"]),
        (20.0, "sticking", (0.96, 0.98), ["j1"]),
        (20.0, "ok", (0.94, 0.98), ["probability"]),
    ],
)
def test_criteria_of_the_runs(j1, status, interval, missed):
    share = SimpleNamespace(value=0.96, interval=interval, total=1000)
    kept = run_criteria(j1, status, 33.0, share, 0.95)
    assert [one.name for one in kept if not one.kept] == missed


@pytest.mark.parametrize(
    ("share", "interval", "ending"),
    [
        (0.944, (0.92, 0.962), "94.4 % (92 to 96.2 %), 95 % is not shown"),
        (0.742, (0.701, 0.78), "74.2 % (70.1 to 78 %), 95 % required"),
    ],
)
def test_draws_that_leave_it_open_are_told_from_those_that_say_no(share, interval, ending):
    share = SimpleNamespace(value=share, interval=interval, total=1000)
    _, probable = run_criteria(20.0, "ok", 33.0, share, 0.95)
    assert probable.said == f"P(J1 <= 33 s) is {ending}"


def test_what_is_kept_is_told_with_its_numbers(result):
    design = drillctl.load("monteiro-trindade-140kn")
    kept = loop_criteria(design, figures(), design.tables.recommend)
    told = [one.detail for one in kept]
    assert told[0] == "the loop bears 150 N*m*s/rad, the rock falls by 100 N*m*s/rad"
    assert told[1:] == ["1.5 times", "2", "it bears 50 ms, 0 ms asked"]
    for one in result.candidates:
        assert all(criterion.detail for criterion in one.criteria)


@pytest.mark.parametrize(("slope", "told"), [(0.0, "the rock does not fall"), (100.0, "1.5 times")])
def test_a_rock_that_does_not_fall_is_no_number_of_times(slope, told):
    design = drillctl.load("monteiro-trindade-140kn")
    kept = loop_criteria(design, figures(slope=slope), design.tables.recommend)
    assert {one.name: one.detail for one in kept}["slope_reserve"] == told


def test_a_report_asks_for_the_margins_too():
    design = drillctl.load("monteiro-trindade-140kn")

    def asked(**changed):
        kept = loop_criteria(design, figures(**changed), design.tables.recommend)
        summary = {"candidates": {"in the drive now": {"criteria": [x.summary() for x in kept]}}}
        study = SimpleNamespace(summary=summary)
        have = {"recommend": study}.get
        return _margins(
            SimpleNamespace(have=have, design=design, words=SimpleNamespace(system="si"))
        )

    assert asked().answer is True
    assert asked(peak=71.0).answer is False
    assert "peak sensitivity 71" in asked(peak=71.0).detail
    assert asked(margin=105.0).detail.endswith("110 N m s needed)")


def test_what_passes_goes_before_what_is_fragile_and_that_before_the_least_bad():
    def one(verdict, objective, miss=0.0):
        return SimpleNamespace(verdict=verdict, objective=objective, badness=(miss, objective))

    bad, worse = one(FAILS, 9.0, 0.2), one(FAILS, 1.0, 0.3)
    fragile, good, better = one(FRAGILE, 2.0), one(PASSES, 8.0), one(PASSES, 7.0)
    assert best_of([worse, bad]) is bad
    assert best_of([bad, fragile]) is fragile
    assert best_of([bad, fragile, good, better]) is better


def test_figures_of_the_loop_are_those_of_loop(design):
    one, whole = loop_figures(design, 0.5), loop(design)
    assert one.slope == whole.operating_point.slope
    assert one.slope_margin == whole.slope_margin
    assert one.whole.peak_sensitivity == pytest.approx(whole.margins.peak_sensitivity, rel=1e-9)
    # Its delay margin lies above what the elements follow: that one is not counted.
    assert whole.mesh_limited == {"delay_margin": None}
    assert one.whole.delay > 3.0 * whole.margins.delay
    assert one.part.peak_sensitivity == pytest.approx(1.93, abs=0.01)


def test_a_drive_that_is_late_is_told_what_would_help():
    late = drillctl.load("torque-limited-140kn")
    one = loop_figures(late, 0.5)
    # Some modes above what its elements follow grow; they are no matter of the rig.
    assert one.aside
    assert np.isfinite(one.slope_margin)
    own = own_delay(late.tables.controller.drive)
    assert own == pytest.approx(0.027)
    assert 0.02 < help_._borne(late) < own


def test_a_land_rig_is_told_which_mode_is_unstable():
    land = drillctl.load("typical-land")
    made = {one.name: one.design for one in by_rules(land)}
    soft, matched = (loop_figures(made[name], 0.5) for name in ("soft torque", "Z-torque"))
    assert not soft.stable
    assert matched.stable
    (unstable, *_) = loop_criteria(land, soft, land.tables.recommend)
    assert "second mode" in unstable.said or "third mode" in unstable.said
    assert mode_at(land, soft.deciding_hz) in unstable.said


def test_gains_of_rules_are_those_of_the_string(design):
    soft = next(one for one in by_rules(design) if one.name == "soft torque")
    assert soft.law == "soft-torque"
    string = design.string
    assert gains_of(soft.design) == {
        "controller.kp": 4.0 * string.pipe_impedance,
        "controller.ki": pytest.approx(string.stick_slip_frequency**2 * string.top_inertia),
    }


def test_numbers_in_units_of_drives(result):
    one = next(x for x in result.candidates if x.name == "in the drive now")
    told = in_drive_units(one)
    assert told["kp"]["N*m*s/rad"] == 625.0
    assert told["kp"]["klbf*ft/rpm"] == pytest.approx(625.0 * math.pi / 30.0 / 1355.8179483)
    assert told["ki"]["klbf*ft/rev"] == pytest.approx(125.0 * 2.0 * math.pi / 1355.8179483)
    assert told["kp"]["per unit"] == pytest.approx(625.0 * one.design.speed / 50e3)
    assert told["integral_time"] == 5.0


def test_what_is_in_the_drive_now_may_be_named(design):
    named = design.replace({"recommend.present": {"kp": 500.0}})
    assert present(named).top_drive.kp == 500.0
    assert present(design) is design
    other = design.replace({"recommend.present": {"law": "soft-torque", "share": 0.5}})
    assert present(other).tables.controller.share == 0.5
    with pytest.raises(InputError, match=r"recommend\.present"):
        present(design.replace({"recommend.present": {"kq": 1.0}}))


def test_a_rig_without_a_pi_has_one_to_tune():
    lumped = drillctl.load("navarro-lopez-2dof-bistable")
    assert pi_problem(lumped).tables.controller.law == "pi"


def test_the_sentence_names_setting_limit_and_room(result):
    best = result.recommended
    assert numbers_of(best.design, best.gains) in result.sentence
    assert all(text in result.sentence for text in (*result.limits, "What limits it is"))
    said = others(result)
    assert len(said) == len(result.candidates) - 1
    (soft,) = (text for text in said if text.startswith("soft torque: unstable in the first mode"))
    (of_soft,) = (one for one in result.candidates if one.name == "soft torque")
    assert soft.endswith(f"it misses {len(of_soft.missed) - 1} other criteria")
    last, fails = result.until
    assert last >= depth_of(best.design) - 1e-9
    assert f"passes {'at' if fails is None else 'down to'} {units.full(last, 'm', 5)}" in (
        result.sentence
    )
    if fails is not None:
        assert not help_._passes(at_depth(best.design, fails))
    summary = result.summary()
    assert summary["recommended"]["gains"] == best.gains
    assert set(summary["candidates"]) == {one.name for one in result.candidates}
    assert summary["candidates"]["soft torque"]["verdict"] == FAILS


def test_a_weight_that_follows_stands_beside_the_constant_one_where_it_is_asked(design):
    asked = design.replace(
        {
            "recommend.laws": ["soft-torque"],
            "recommend.dynamic_weight": {"gain": "6 kN*s/rad"},
            "tune.certificate.realizations": 10,
            "recommend.speed_step": "50 rpm",
            "recommend.weight_step": "70 kN",
        }
    )
    result = recommend(asked)
    names = [one.name for one in result.candidates]
    assert names == [
        "in the drive now", "soft torque", "in the drive now, dynamic weight",
        "soft torque, dynamic weight",
    ]  # fmt: skip
    _, constant, _, moving = result.candidates
    assert moving.design.tables.weight_on_bit.gain == 6e3
    assert moving.loop.slope < 0.1 * constant.loop.slope  # the weight takes the slope away
    assert np.median(moving.j1) < np.median(constant.j1)


@pytest.mark.parametrize("margin", [math.nan, -3.0, 0.0])
def test_a_loop_that_is_unstable_under_a_rock_that_does_not_fall_is_told(margin):
    """Such as that of a cutting bit, whose torque has no slope to divide by."""
    design = drillctl.load("monteiro-trindade-140kn")
    asked = design.tables.recommend
    figures = loop_figures(design, asked.slope_share)
    flat = replace(figures, slope=0.0, slope_margin=margin)
    found = {one.name: one for one in loop_criteria(design, flat, asked)}
    assert not found["stable"].kept
    assert not found["slope_reserve"].kept
    assert found["stable"].miss == found["slope_reserve"].miss == 1.0


def test_laws_left_out_for_the_same_reason_are_told_in_one_line(result):
    told = replace(result, left_out={"stiff": "no pipe", "soft torque": "no pipe", "PI": "no"})
    assert list(remarks(told, "si"))[-2:] == [
        "left out: stiff, soft torque: no pipe",
        "left out: PI: no",
    ]


def test_a_loop_that_is_unstable_is_told_once(result):
    """Margins that it has not follow from it."""
    design = drillctl.load("monteiro-trindade-140kn")
    missed = [x for x in loop_criteria(design, figures(margin=90.0), design.tables.recommend)
              if not x.kept]  # fmt: skip
    assert [one.name for one in _told_apart(missed)] == ["stable"]
    least_bad = replace(result.recommended, criteria=tuple(missed))
    told = replace(result, candidates=(least_bad,), until=None)
    assert "which misses by 10 %: unstable in the first mode" in told.sentence
    assert "margin" not in told.sentence
    tables_ = {one.name: one.title for one in tables(told)}
    assert tables_["settings"].endswith("(* the least bad: none passes)")
    assert tables_["numbers"].endswith(", which does not pass")
    assert "the least bad" in plots.recommended(told).get_supxlabel()


def test_a_long_title_leaves_the_panels_beside_each_other(result):
    design = result.design.replace({"title": "Six drives " * 8})
    figure = plots.recommended(replace(result, design=design))
    figure.draw_without_rendering()
    first, second = (ax.get_window_extent() for ax in figure.axes[:2])
    assert second.x0 - first.x1 < 0.3 * first.width


@pytest.mark.parametrize(
    ("counts", "told"),
    [
        ((0, 0, 0), "none keeps the slope margin"),
        ((30, 0, 0), "30 keep the slope margin, none of these the probability"),
        ((30, 2, 1), "30 keep the slope margin, 2 of these the probability, 1 of these all else"),
    ],
)
def test_what_a_grid_says(counts, told):
    assert Confirmed("PI", 169, *counts).sentence == f"PI, grid of 169 settings: {told}"
