"""A bit that cuts its own wake: three independent codes, energy, both engines."""

from __future__ import annotations

import math

import numpy as np
import pytest

import drillctl
from drillctl import units
from drillctl.design.paths import tuned_ranges
from drillctl.errors import InputError
from drillctl.simulation import cutting
from drillctl.simulation.batch import prepare, run_batch
from drillctl.simulation.lanes import Lanes, Start, lane_numbers, lanes_of
from drillctl.simulation.measures import AXIAL_MEASURES
from drillctl.studies.compare import STUDY
from drillctl.studies.tune.problem import alike
from drillctl.studies.tune.search import search_problem
from drillctl.studies.tune.tuned import spread, tuned_parameters
from drillctl.units import SI

UNIT = math.sqrt(116.0 / 938.0)  # s
SECOND = {  # sharp wear flats at twice the speed, where contact is lost
    "bit_rock.wear_flat_length": "1.2 mm",
    "operating_point.weight_on_bit": "23.4093 kN",
    "operating_point.speed": "11.374503 rad/s",
    "start.bit_speed": "9.952691 rad/s",
    "simulation.duration": "4 s",
}


@pytest.fixture(scope="module")
def design():
    """The shipped case."""
    return drillctl.load("richard-detournay-2dof")


@pytest.fixture(scope="module")
def run(design):
    """Its run with located events."""
    return drillctl.simulate(design)


def times(run, kind):
    """Moments of events in units of the torsional swing."""
    return np.array([one.time for one in run.events if one.kind == kind]) / UNIT


def test_events_are_those_of_independent_codes(run):
    assert times(run, "axial_stick")[0] == pytest.approx(2.31200, abs=1e-4)
    sticks = [11.5431, 16.8474, 23.1084, 29.2025, 35.6081, 41.9721]
    assert times(run, "stick")[:6] == pytest.approx(sticks, abs=1e-4)
    assert times(run, "release")[:4] == pytest.approx(
        [11.7774, 17.9366, 24.2344, 30.6121], abs=1e-4
    )
    assert run.measures.peak_bit_speed * UNIT == pytest.approx(4.85144, abs=1e-4)
    assert len(times(run, "lost_contact")) == 0
    assert run.measures.lost_contact_time == 0.0


def test_without_twist_the_bit_waits_for_the_spring(design, monkeypatch):
    wound = Lanes.begin.func

    def untwisted(self):
        begin = wound(self)
        return Start(tuple((0.0 * shape, x) for shape, x in begin.twists), begin.turns)

    monkeypatch.setattr(Lanes, "begin", property(untwisted))
    free = {"controller.ki": 0.0, "simulation.duration": "1.2 s"}
    run = drillctl.simulate(design.replace(free))
    # It stands still at once, and sinks no more until the spring is wound up.
    assert times(run, "release")[0] == pytest.approx(2.956, abs=2e-4)


def test_contact_is_lost_where_independent_codes_lose_it(design):
    run = drillctl.simulate(design.replace(SECOND))
    assert times(run, "axial_stick")[0] == pytest.approx(2.3894, abs=1e-4)
    assert times(run, "lost_contact")[0] == pytest.approx(6.5425, abs=1e-4)
    assert run.measures.lost_contact_time > 0.0
    assert run.energy.relative_residual < 1e-6


LANDING = "9.938323814206907 rad/s"
"""A start after which the bit comes down within the share of a step that its flat would stop it."""


def test_a_bit_that_lands_keeps_its_motion(design):
    """In fixed steps too, whatever the share of the step that it falls freely."""
    one = design.replace(SECOND | {"start.bit_speed": LANDING, "simulation.duration": "5 s"})
    exact, batch = drillctl.simulate(one), drillctl.simulate(one, "batch")
    assert exact.measures.lost_contact_time > 0.5
    for name in ("j1", "work_at_bit", "rate_of_penetration", "lost_contact_time",
                 "peak_bit_speed", "min_bit_speed"):  # fmt: skip
        value = getattr(exact.measures, name)
        assert getattr(batch.measures, name) == pytest.approx(value, rel=2e-2), name


def test_an_ensemble_of_starts_has_the_same_mean_in_both_engines(design):
    """After loss of contact single runs are samples; their mean over small changes is not."""
    one = design.replace(SECOND | {"simulation.duration": "8 s"})
    shares = 1.0 + 1e-3 * np.linspace(-1.8, 1.8, 96)
    numbers = {name: np.full(96, value) for name, value in lane_numbers(one).items()}
    numbers["bit_speed"] = 9.952691 * shares
    lanes = lanes_of(one, numbers)
    drawn = run_batch(lanes, prepare(lanes, one.tables.simulation)).measures["j1"]
    exact = [
        drillctl.simulate(one.replace({"start.bit_speed": SI(9.952691 * share)})).measures.j1
        for share in shares[::8]
    ]
    assert drawn.mean() == pytest.approx(np.mean(exact), rel=1e-2)


def test_energy_of_drive_and_hook_is_that_of_rock_and_string(run, design):
    assert run.energy.hook > 0.0
    assert run.energy.relative_residual < 1e-6
    # What the bit has drilled is the hook's work over its weight, and the volume's energy.
    depth = run.signals["bit_depth"][-1]
    assert depth == pytest.approx(run.energy.hook / 102546.7, rel=1e-6)
    volume = math.pi * design.bit_rock.radius**2 * depth
    assert run.measures.specific_energy == pytest.approx(run.energy.bit / volume, rel=1e-6)


def batch_times(design, step):
    """Sticks of the batch engine at a step in units of the torsional swing."""
    fixed = design.replace({"simulation.step": SI(step * UNIT)})
    run = drillctl.simulate(fixed, "batch", interval=step * UNIT)
    still = run.signals["stuck"] > 0.5
    return run.time[1:][still[1:] & ~still[:-1]][:6] / UNIT


def test_fixed_steps_meet_the_events(design, run):
    exact = times(run, "stick")[:6]
    errors = [np.abs(batch_times(design, step) - exact).max() for step in (1e-3, 2.5e-4)]
    assert errors[0] < 3e-3  # measured to the length of a step
    assert errors[1] < 1e-3


def test_fixed_steps_are_of_second_order_through_sticks(design):
    """Of J1, on the mean over starts: where in a step the bit sticks is chance."""
    steps, errors = np.array([4e-3, 2e-3, 1e-3, 5e-4]), []
    for share in np.linspace(0.64, 0.76, 8):
        one = design.replace({
            "start.bit_speed": SI(share * design.speed), "simulation.duration": "10 s",
        })  # fmt: skip
        exact = drillctl.simulate(one)
        assert exact.measures.sticks > 0
        found = [
            drillctl.simulate(one.replace({"simulation.step": SI(h * UNIT)}), "batch").measures.j1
            for h in steps
        ]
        errors.append(np.array(found) / exact.measures.j1 - 1.0)
    mean = np.sqrt((np.array(errors) ** 2).mean(axis=0))
    order = np.polyfit(np.log(steps), np.log(mean), 1)[0]
    assert order > 1.7  # measured: 1.97
    assert mean[-1] < 3e-5


def test_engines_agree_at_the_step_that_standard_chooses(design, run):
    batch = drillctl.simulate(design, engine="batch")
    assert batch.measures.j1 == pytest.approx(run.measures.j1, rel=1e-2)
    for name in ("rate_of_penetration", "depth_of_cut", "specific_energy", "work_at_bit",
                 "mean_weight_on_bit", "axial_stick_time"):  # fmt: skip
        exact, value = getattr(run.measures, name), getattr(batch.measures, name)
        assert value == pytest.approx(exact, rel=1e-2), name
    assert batch.measures.sticks == run.measures.sticks


def test_steady_drilling_stays_steady(design):
    """Started without a disturbance, at a speed at which the axial motion decays."""
    calm = design.replace({
        "operating_point.speed": "20 rad/s", "start.bit_speed": "20 rad/s",
        "simulation.duration": "3 s",
    })  # fmt: skip
    point = cutting.steady(calm.bit_rock, 102546.7, 20.0)
    for engine in ("reference", "batch"):
        run = drillctl.simulate(calm, engine)
        assert run.measures.j1 < 1e-6
        assert run.measures.rate_of_penetration == pytest.approx(point.velocity, rel=1e-6)
        assert run.measures.depth_of_cut == pytest.approx(point.depth_of_cut, rel=1e-6)


def test_a_bit_at_rest_bears_what_it_is_held_by(design):
    """However far the cutters have gone in: by the momentum of the string, the hook's force."""
    sharp = {"bit_rock.wear_flat_length": "0.01 mm", "simulation.duration": "4 s"}
    exact = drillctl.simulate(design.replace(RIG | sharp))
    assert exact.measures.stuck_time > 1.0
    # What is left are forces that jump between two samples.
    assert exact.measures.mean_weight_on_bit == pytest.approx(102546.7, rel=2e-2)
    still = exact.signals["stuck"] > 0.5
    assert exact.signals["weight_on_bit"][still] == pytest.approx(102546.7)


@pytest.mark.parametrize("weight", ["0 kN", "30 kN"])
def test_a_bit_that_does_not_drill_rests_on_its_flats(design, weight):
    light = design.replace(RIG | {
        "operating_point.weight_on_bit": weight, "simulation.duration": "2 s",
    })  # fmt: skip
    exact, batch = drillctl.simulate(light), drillctl.simulate(light, "batch")
    for one in (exact, batch):
        assert one.measures.rate_of_penetration == 0.0
        assert one.measures.mean_weight_on_bit == pytest.approx(units.parse(weight, units.FORCE))
        assert one.measures.lost_contact_time == 0.0
    assert batch.measures.j1 == pytest.approx(exact.measures.j1, rel=1e-4)


def test_a_varying_rock_is_the_same_in_both_engines(design):
    short = design.replace({
        "bit_rock.variation": {"cv": 0.1, "length": "2 cm"}, "simulation.duration": "4 s",
    })  # fmt: skip
    exact, batch = drillctl.simulate(short), drillctl.simulate(short, "batch")
    assert exact.energy.relative_residual < 1e-6
    assert batch.measures.j1 == pytest.approx(exact.measures.j1, rel=5e-3)
    plain = drillctl.simulate(design.replace({"simulation.duration": "4 s"}), "batch")
    assert abs(batch.measures.j1 / plain.measures.j1 - 1.0) > 0.01


def test_lanes_do_not_see_each_other(design):
    axes = [{"path": "operating_point.speed", "min": "50 rpm", "max": "60 rpm", "points": 3}]
    result = drillctl.sweep(design.replace({"map.axes": axes, "map.audit_cells": 0}))
    alone = drillctl.simulate(design.replace({"operating_point.speed": "60 rpm"}), "batch")
    assert result.j1[2] == alone.measures.j1


PIPE = {  # the cutting bit below a string of the paper's pipe, in few elements
    "bit_rock": {
        "law": "richard-detournay", "blades": 4, "radius": "108 mm", "intrinsic_energy": "60 MPa",
        "wear_flat_length": "11 mm", "contact_stress": "60 MPa",
    },
    "operating_point.weight_on_bit": "118.95 kN", "controller.kp": 625.0, "controller.ki": 125.0,
    "start": {"kind": "steady", "bit_speed": "70 rpm"}, "drillstring.sections.pipe.elements": 8,
    "simulation.duration": "4 s",
}  # fmt: skip


@pytest.mark.parametrize("top", ["force", "velocity"])
def test_a_pipe_of_elements_is_the_same_in_both_engines(top):
    """Steps follow the answer of the pipe above the bit, not that of its whole mass."""
    one = drillctl.load("monteiro-trindade-140kn").replace(
        PIPE | {"axial": {"model": "elements", "top": top}}
    )
    exact, batch = drillctl.simulate(one), drillctl.simulate(one, "batch")
    assert exact.energy.relative_residual < 1e-6
    for measure in ("j1", "work_at_bit", "depth_of_cut", "rate_of_penetration"):
        value = getattr(exact.measures, measure)
        assert getattr(batch.measures, measure) == pytest.approx(value, rel=1e-2), measure
    assert exact.measures.axial_stick_time > 0.3
    relaxes = one.axial.impedance / (one.bit_rock.blades * one.bit_rock.force_per_depth)
    assert batch.step < relaxes / 59.0


def test_short_pieces_of_a_tally_have_their_part_of_the_axial_string():
    """Those that are lumped into a neighbour in torsion are so along the axis."""
    values = {key: PIPE[key] for key in ("bit_rock", "operating_point.weight_on_bit", "start")}
    one = drillctl.load("typical-land").replace(values | {"axial.model": "elements"})
    assert any(section.lumped for section in one.string.parts.sections)
    assert one.axial.nodes == one.string.nodes
    assert one.axial.total == pytest.approx(one.replace({"axial.model": "lumped"}).axial.total)
    assert one.axial.total > 1.3e5


RIG = {
    "top_drive.inertia": "500 kg*m^2", "controller.kp": 400.0, "controller.ki": 200.0,
    "simulation.duration": "7 s", "start.bit_speed": "35 rpm",
}  # fmt: skip
DRIVES = {
    # a limited drive on its way through changes of set speed, hook and rock, under a hook that
    # follows the bit speed late
    "limited": {
        "weight_on_bit": {
            "law": "navarro-lopez-suarez", "gain": "2 kN*s/rad", "path": {
                "delay": "0.3 s", "sensor_lag": "0.1 s", "hoist_lag": "0.2 s",
                "rate_limit": "30 kN/s",
            },
        },
        "controller.drive": {"torque_limit": "5.5 kN*m", "lag": "20 ms", "encoder_lag": "5 ms"},
        "scenario.speed": {"start": "40 rpm", "begin": "1 s", "end": "2 s"},
        "scenario.weight_on_bit": {"start": "95 kN", "begin": "3 s", "end": "3 s"},
        "scenario.bit_rock": {"until": "4 s", "sliding_factor": 0.95},
    },
    # a sampled one, and a hook that follows the bit speed
    "sampled": {
        "controller.drive": {"sampling_period": "10 ms", "torque_limit": "6 kN*m"},
        "weight_on_bit.law": "navarro-lopez-suarez", "weight_on_bit.gain": "1 kN*s/rad",
    },
}  # fmt: skip


@pytest.mark.parametrize("name", DRIVES)
def test_drives_programs_and_hooks_are_the_same_in_both_engines(design, name):
    one = design.replace(RIG | DRIVES[name])
    exact, batch = drillctl.simulate(one), drillctl.simulate(one, "batch")
    assert exact.energy.relative_residual < 1e-6
    for measure in ("j1", "work_at_bit", "mean_weight_on_bit", "peak_top_torque",
                    "rate_of_penetration", "mean_bit_speed"):  # fmt: skip
        value = getattr(exact.measures, measure)
        assert getattr(batch.measures, measure) == pytest.approx(value, rel=2e-3), measure
    plain = drillctl.simulate(design.replace(RIG), "batch").measures.j1
    assert abs(batch.measures.j1 / plain - 1.0) > 0.01
    if name == "limited":
        limit = exact.measures.time_at_torque_limit
        assert limit > 0.3
        assert batch.measures.time_at_torque_limit == pytest.approx(limit, abs=0.02)


FEW = {
    "tune.realizations": 8, "tune.certificate.realizations": 100, "uncertainty.realizations": 8,
    "simulation.duration": "2 s", "map.audit_cells": 0,
}  # fmt: skip


def test_gains_that_change_nothing_are_not_searched(design):
    """The top turns as it likes: a search over its gains would follow rounding."""
    few = design.replace(FEW)
    with pytest.raises(InputError, match="there is nothing to tune"):
        drillctl.tune(few)
    found = drillctl.recommend(few)
    assert "there is nothing to tune" in found.left_out["PI, robust"]
    assert [one.low for one in found.present.tolerance] == [250.0, 125.0]
    assert all(one.low_at_bound and one.high_at_bound for one in found.present.tolerance)
    # Where the top gives way gains matter.
    light = few.replace({"top_drive.inertia": "50 kg*m^2"})
    problem = search_problem(light, tuned_parameters(light))
    assert not alike(problem.points(spread(problem.tuned, 16), 4))


def test_comparisons_list_the_axial_motion(design):
    faster = {"name": "faster", "set": {"operating_point.speed": "60 rpm"}}
    cases = [{"name": "slower"}, faster]
    result = drillctl.compare(design.replace(FEW | {"compare": {"cases": cases, "maps": False}}))
    for name in AXIAL_MEASURES:
        assert result.summary()["cases"]["faster"]["measures"][name]["defined"] == 8, name
    labels = [row[1] for row in next(iter(STUDY.tables(result))).rows]
    assert "mechanical specific energy" in labels
    rates = [one.mean("rate_of_penetration") for one in result.cases]
    assert rates[1] > rates[0] > 0.0


@pytest.mark.slow
def test_constant_and_following_hooks_are_tuned_and_compared(design):
    values = {
        "advantage": {
            "realizations": 6, "sweep_realizations": 4, "region_points": 2,
            "region_realizations": 4, "weights": ["100 kN"], "speeds": ["60 rpm"],
            "delays": ["0 s", "0.5 s"],
        },
    }  # fmt: skip
    result = drillctl.advantage(design.replace(RIG | FEW | values))
    for case in result.cases:
        assert set(AXIAL_MEASURES) <= set(case.summary(result.baseline, (20.0,), 1)["means"])
        assert case.mean("rate_of_penetration") > 0.0
    assert result.front.figures["objective"].size == 3


def test_gains_of_a_drive_that_nothing_slows_down_have_bounds(design):
    """So that searches over them begin: its inertia would allow more than a design can have."""
    for path, (_, most) in tuned_ranges(design).items():
        assert design.replace({path: most}).tables.controller.ki <= 1e8


HOOKS = {
    "late": {
        "law": "navarro-lopez-suarez", "gain": "2 kN*s/rad", "path": {"delay": "0.7 s"},
    },
    "read at times": {
        "law": "navarro-lopez-suarez", "gain": "2 kN*s/rad",
        "path": {"delay": "0.3 s", "sampling_period": "0.5 s"},
    },
    "on an alarm": {
        "law": "stick-slip-alarm", "window": "1.5 s", "alarm": 0.15, "calm": 0.05,
        "path": {"delay": "0.2 s"},
    },
    "observed": {
        "law": "surface-observer", "gain": "2 kN*s/rad", "observer_modes": 1,
        "path": {"delay": "0.1 s", "hoist_lag": "0.2 s"},
    },
}  # fmt: skip


@pytest.mark.slow  # a kernel for each
@pytest.mark.parametrize("name", HOOKS)
def test_hooks_with_a_memory_are_the_same_in_both_engines(design, name):
    one = design.replace(RIG | {"weight_on_bit": HOOKS[name]})
    exact, batch = drillctl.simulate(one), drillctl.simulate(one, "batch")
    assert exact.energy.relative_residual < 1e-6
    for measure in ("j1", "work_at_bit", "mean_weight_on_bit", "rate_of_penetration"):
        value = getattr(exact.measures, measure)
        assert getattr(batch.measures, measure) == pytest.approx(value, rel=2e-3), measure
    constant = drillctl.simulate(design.replace(RIG)).measures.j1
    assert abs(exact.measures.j1 / constant - 1.0) > 0.01


def test_what_it_does_not_go_with_is_refused(design):
    held = {"axial.top": "velocity", "axial.model": "elements"}
    program = {"scenario.weight_on_bit": {"start": "90 kN", "begin": "1 s", "end": "2 s"}}
    with pytest.raises(InputError, match="no hook sets a force"):
        drillctl.load("monteiro-trindade-140kn").replace(PIPE | held | program)
    well = {"survey": [["0 m", "0 deg", "0 deg"], ["100 m", "60 deg", "0 deg"]]}
    with pytest.raises(InputError, match="no solver has both"):
        design.replace({"well": well | {"friction_factor": 0.3}})


@pytest.mark.slow
def test_engines_agree_over_random_sets_until_contact_is_lost(design):
    """J1 at steps of 2.5e-4 of the torsional swing, within 1e-3."""
    random, worst = np.random.default_rng(7), 0.0
    for _ in range(40):
        speed = random.uniform(1.5, 5.0) / UNIT
        flat = random.uniform(1.0, 12.0)
        one = design.replace({
            "operating_point.speed": SI(speed),
            "start.bit_speed": SI(speed * random.uniform(0.7, 0.95)),
            "bit_rock.blades": int(random.integers(3, 8)),
            "bit_rock.wear_flat_length": f"{flat} mm",
            "bit_rock.intrinsic_energy": f"{random.uniform(40, 80)} MPa",
            "simulation.duration": SI(40.0 * UNIT),
        })  # fmt: skip
        weight = one.bit_rock.flat_force + random.uniform(10e3, 50e3)
        one = one.replace({"operating_point.weight_on_bit": SI(weight)})
        lost = [e.time for e in drillctl.simulate(one).events if e.kind == "lost_contact"]
        until = min(lost[0] if lost else math.inf, 40.0 * UNIT)
        if until < 1.0 * UNIT:
            continue
        short = one.replace({
            "simulation.duration": SI(until), "simulation.step": SI(2.5e-4 * UNIT),
        })  # fmt: skip
        exact, batch = drillctl.simulate(short), drillctl.simulate(short, "batch")
        worst = max(worst, abs(batch.measures.j1 / exact.measures.j1 - 1.0))
    assert worst < 1e-3  # measured: 7.6e-4
