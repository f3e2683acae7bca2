"""The batch engine held to the reference solver, and to itself whatever the lanes' order."""

import json
import os
import platform
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from test_reference import EVENT_ACCURATE, paper

import drillctl
import drillctl.errors
from drillctl.design import Design
from drillctl.simulation.batch import measures_of, prepare, run_batch
from drillctl.simulation.lanes import lane_numbers, lanes_of, single_lane
from drillctl.simulation.measures import BATCH_MEASURES, STATUSES

HOLDS = {
    "batch engine": "the same six runs: 3e-4 at 20 ms, 2e-5 at 5 ms; order 2",
    "lanes given up": "the whole lanes until then; any company",
    "both engines": "lumped, distributed, unequal dampers, dampers to ground, every start",
    "bits": "any order, company, block width and number of threads",
}

SETTLED = [row for row in EVENT_ACCURATE if row[0] >= 600]


def measured(design: Design):
    lanes = single_lane(design)
    return measures_of(run_batch(lanes, prepare(lanes, design.tables.simulation)), 0)


def stepped(row, step: str, modes: int | None = 31):
    values = {"simulation.step": step}
    if modes:
        values["simulation.modes"] = modes
    return measured(paper(*row[:3], **values))


@pytest.mark.parametrize(("step", "tolerance"), [("20 ms", 3e-4), ("5 ms", 2e-5)])
@pytest.mark.parametrize("row", SETTLED, ids=str)
def test_settled_rows(row, step, tolerance):
    found = stepped(row, step)
    assert found.j1 == pytest.approx(row[3], rel=tolerance)
    assert found.stuck_time == pytest.approx(row[4], rel=1e-3)
    assert found.peak_bit_speed == pytest.approx(row[5], rel=1e-3)


@pytest.mark.parametrize("row", [r for r in EVENT_ACCURATE if r[0] < 600], ids=str)
def test_rows_that_stick_and_slip_to_the_end(row):
    found = stepped(row, "5 ms")
    assert found.j1 == pytest.approx(row[3], rel=2e-5)
    assert found.stuck_time == pytest.approx(row[4], rel=1e-3)


@pytest.mark.parametrize(
    ("accuracy", "tolerance"), [("fast", 3.5e-3), ("standard", 1e-3), ("fine", 5e-5)]
)
def test_accuracies_on_the_table(accuracy, tolerance):
    """Half of what each promises at the 99th percentile over the paper's map."""
    for row in EVENT_ACCURATE:
        found = measured(paper(*row[:3], **{"simulation.accuracy": accuracy}))
        assert found.j1 == pytest.approx(row[3], rel=tolerance)


def test_order_two_over_whole_stick_slip_runs(figure):
    steps = np.array([40.0, 20.0, 10.0, 5.0])
    errors = np.array(
        [[stepped(row, f"{h} ms").j1 / row[3] - 1.0 for row in EVENT_ACCURATE] for h in steps]
    )
    # The table is good to about 1e-7; the error of all rows together, over three halvings.
    size = np.sqrt((errors**2).mean(axis=1))
    order = np.polyfit(np.log(steps), np.log(size), 1)[0]
    assert order == pytest.approx(2.0, abs=0.15)
    figure("order of J1 in the step, batch engine", order)
    figure("error of J1 at 5 ms, relative, all modes", size[-1])


def test_stuck_time_converges_with_order_two():
    row = EVENT_ACCURATE[0]
    exact = drillctl.simulate(paper(*row[:3])).measures.stuck_time
    errors = [abs(stepped(row, f"{h} ms").stuck_time - exact) for h in (20, 10, 5)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders.mean() == pytest.approx(2.0, abs=0.4)


UNEQUAL_DAMPERS = {
    "drillstring.sections.pipes.damping": "20 N*m*s/rad",
    "drillstring.sections.collars.damping": "300 N*m*s/rad",
    "top_drive.damping": "425 N*m*s/rad",
    "bha.damping": "50 N*m*s/rad",
}


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("navarro-lopez-4dof", {}),
        ("navarro-lopez-4dof", UNEQUAL_DAMPERS),
        ("navarro-lopez-2dof", {}),
        ("navarro-lopez-2dof", {"start.kind": "wound_up"}),
        ("monteiro-trindade-2012", {"drillstring.modal_damping": 0.02}),
        ("monteiro-trindade-2012", {"start.kind": "wound_up", "bha.damping": "30 N*m*s/rad"}),
        ("monteiro-trindade-2012", {"start.kind": "rest", "top_drive.damping": "80 N*m*s/rad"}),
        (
            "monteiro-trindade-2012",
            {
                "drillstring.sections.pipe.stiffness_damping": "2e-3 s",
                "drillstring.sections.pipe.drag": "0.02 N*s/rad",
            },
        ),
        (
            # With an inertia at the bit: its last short element alone would chatter.
            "aarsnes-shor-well-a",
            {"controller.kp": 900, "controller.ki": 300, "bha.inertia": "100 kg*m^2"},
        ),
    ],
    ids=str,
)
def test_both_engines_agree(name, values):
    design = drillctl.load(name, **{"simulation.duration": "40 s", **values})
    exact = drillctl.simulate(design).measures
    fine = measured(design.replace({"simulation.step": "2 ms", "simulation.modes": 999}))
    assert fine.j1 == pytest.approx(exact.j1, rel=1e-5)
    assert fine.stuck_time == pytest.approx(exact.stuck_time, abs=1e-3)  # half a step
    assert fine.sticks == exact.sticks
    assert fine.peak_bit_speed == pytest.approx(exact.peak_bit_speed, rel=1e-4)
    assert fine.min_bit_speed == pytest.approx(exact.min_bit_speed, rel=1e-3, abs=1e-3)
    assert fine.mean_bit_speed == pytest.approx(exact.mean_bit_speed, rel=1e-5)
    assert fine.peak_top_torque == pytest.approx(exact.peak_top_torque, rel=1e-3)
    assert fine.peak_pipe_torque == pytest.approx(exact.peak_pipe_torque, rel=1e-3)
    assert fine.work_at_bit == pytest.approx(exact.work_at_bit, rel=1e-4)
    assert fine.rop_proxy == pytest.approx(exact.rop_proxy, rel=1e-4)
    assert (fine.settling_time_wide is None) == (exact.settling_time_wide is None)
    if exact.settling_time_wide is not None:
        assert fine.settling_time_wide == pytest.approx(exact.settling_time_wide, abs=5e-3)


@pytest.mark.parametrize("controller", [{}, {"drive": {"torque_limit": "30 kN*m"}}], ids=str)
def test_the_top_torque_of_the_first_moment_counts(controller):
    # A drive this stiff gives its largest torque before anything has moved.
    values = {"simulation.duration": "5 s", "start.speed": "30 rpm"}
    design = paper(1e4, 125, 140, **values, **{f"controller.{k}": v for k, v in controller.items()})
    exact = drillctl.simulate(design).measures.peak_top_torque
    assert measured(design).peak_top_torque == pytest.approx(exact, rel=1e-9)


def test_signals_agree():
    design = paper(625, 125, 140, **{"simulation.duration": "30 s", "simulation.step": "2 ms"})
    exact = drillctl.simulate(design, interval=0.1)
    batch = drillctl.simulate(design, engine="batch", interval=0.1, **{"simulation.modes": 31})
    assert batch.time == pytest.approx(exact.time)
    for name in ("top_speed", "bit_speed", "twist", "top_torque", "pipe_torque"):
        scale = np.abs(exact.signals[name]).max()
        assert np.abs(batch.signals[name] - exact.signals[name]).max() < 2e-3 * scale, name


def test_both_engines_find_both_answers_of_the_lumped_string():
    design = drillctl.load("navarro-lopez-2dof-bistable", **{"simulation.duration": "150 s"})
    assert drillctl.simulate(design, engine="batch").status == "ok"
    sticking = drillctl.simulate(design.replace({"start.kind": "rest"}), engine="batch")
    assert sticking.status == "sticking"
    late = sticking.signals["bit_speed"][sticking.time > 130]
    assert late.max() == pytest.approx(6.945236, rel=1e-3)


def test_fine_strings_stay_stable():
    # 960 elements, every mode carried although a step cannot follow it.
    values = {"drillstring.sections.pipe.elements": 960, "simulation.modes": 961}
    found = measured(paper(625, 125, 140, **{**values, "simulation.step": "20 ms"}))
    assert found.j1 == pytest.approx(19.5136, rel=1e-3)


def lanes_over_gains(design: Design, gains: np.ndarray):
    numbers = {k: np.full(len(gains), v) for k, v in lane_numbers(design).items()}
    numbers["drive.kp"], numbers["drive.ki"] = gains.T.copy()
    return lanes_of(design, numbers)


GAINS = np.random.default_rng(7).uniform([0, 0], [1000, 500], (75, 2))
SHORT = {"simulation.duration": "12 s"}


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**31), count=st.integers(1, 75))
def test_the_same_bits_in_any_order_and_company(seed, count):
    design = paper(600, 100, 140, **SHORT)
    lanes = lanes_over_gains(design, GAINS)
    prepared = prepare(lanes, design.tables.simulation)
    whole = run_batch(lanes, prepared)
    chosen = np.random.default_rng(seed).permutation(75)[:count]
    part = run_batch(lanes[chosen], prepared)
    for name in BATCH_MEASURES:
        assert np.array_equal(part.measures[name], whole.measures[name][chosen], equal_nan=True)
    assert np.array_equal(part.status, whole.status[chosen])


_PRINT_BITS = """
import json, sys
sys.path.insert(0, {folder!r})
import numpy as np, numba
numba.set_num_threads({threads})
from test_batch import GAINS, SHORT, lanes_over_gains, paper
from drillctl.simulation.batch import prepare, run_batch
design = paper(600, 100, 140, **SHORT)
lanes = lanes_over_gains(design, GAINS)
batch = run_batch(lanes, prepare(lanes, design.tables.simulation))
print(json.dumps([float(x).hex() for x in batch.measures["j1"]]))
"""


@pytest.mark.parametrize(
    ("width", "threads"), [(4, 1), (8, 2), pytest.param(64, 1, marks=pytest.mark.slow)]
)
def test_the_same_bits_for_any_block_width_and_threads(width, threads, tmp_path):
    code = _PRINT_BITS.format(folder=os.path.dirname(__file__), threads=threads)  # noqa: PTH120
    environment = os.environ | {"DRILLCTL_BLOCK_WIDTH": str(width)}
    other = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    design = paper(600, 100, 140, **SHORT)
    lanes = lanes_over_gains(design, GAINS)
    here = run_batch(lanes, prepare(lanes, design.tables.simulation)).measures["j1"]
    assert json.loads(other.stdout.splitlines()[-1]) == [float(x).hex() for x in here]


@pytest.mark.parametrize(
    ("features", "lanes"), [("+avx512f,+avx2", 16), ("+avx2,+fma", 8), ("+sse4.2", 4)]
)
def test_rows_have_two_registers_of_the_machine(features, lanes):
    code = "from drillctl.simulation.kernels.rows import PASS; print(PASS)"
    environment = os.environ | {"NUMBA_CPU_NAME": "x86-64", "NUMBA_CPU_FEATURES": features}
    told = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    if platform.machine() in ("x86_64", "AMD64"):
        assert int(told.stdout) == lanes


def test_a_run_that_nobody_can_mean_is_refused_with_the_count():
    long = {"simulation.duration": "1000 s", "simulation.step": "1 us"}
    with pytest.raises(drillctl.errors.InputError, match=r"1e\+09 steps of 1 us .*at most 1e\+08"):
        measured(paper(600, 100, 140, **long))
    sampled = {"controller.drive": {"sampling_period": "1 ns"}}
    with pytest.raises(drillctl.errors.InputError, match="sampling_period"):
        measured(paper(600, 100, 140, **sampled))


# A shell that starts the tests in the background has them ignore the interruption.
_LONG_RUN = """
import signal
import time
import drillctl
signal.signal(signal.SIGINT, signal.default_int_handler)
design = drillctl.load("monteiro-trindade-140kn", **{"simulation.duration": "1 s"})
drillctl.simulate(design, "batch")  # compiled
print("ready", flush=True)
try:
    long = design.replace({"simulation.duration": "100 s", "simulation.step": "2 us"})
    drillctl.simulate(long, "batch")
except KeyboardInterrupt:
    print(time.time(), flush=True)
"""


@pytest.mark.skipif(os.name == "nt", reason="no signals to send")
def test_a_long_run_is_interrupted_within_a_second():
    run = subprocess.Popen([sys.executable, "-c", _LONG_RUN], stdout=subprocess.PIPE, text=True)
    assert run.stdout.readline().strip() == "ready"
    time.sleep(1.5)
    assert run.poll() is None
    begin = time.time()
    run.send_signal(signal.SIGINT)
    told, _ = run.communicate(timeout=20)
    assert float(told) - begin < 1.0


def test_a_lane_that_overflows_fails_alone():
    design = paper(600, 100, 140, **SHORT)
    gains = GAINS.copy()
    gains[10] = np.nan
    gains[20] = [-3e4, 0.0]  # a negative gain: speeds grow without bound
    lanes = lanes_over_gains(design, gains)
    prepared = prepare(lanes, design.tables.simulation)
    found = run_batch(lanes, prepared)
    failed = STATUSES.index("failed")
    assert np.flatnonzero(found.status == failed).tolist() == [10, 20]
    assert np.isnan(found.measures["j1"][[10, 20]]).all()
    healthy = np.setdiff1d(np.arange(75), [10, 20])
    alone = run_batch(lanes_over_gains(design, GAINS), prepared)
    assert np.array_equal(found.measures["j1"][healthy], alone.measures["j1"][healthy])


def test_a_lane_given_up_is_the_whole_one_until_then():
    design = paper(600, 100, 140, **SHORT)
    gains = GAINS.copy()
    gains[20] = np.nan  # fails from the first step on: never found over a level
    lanes = lanes_over_gains(design, gains)
    prepared = prepare(lanes, design.tables.simulation)
    whole = run_batch(lanes, prepared)
    j1 = whole.measures["j1"]
    level = float(np.nanmedian(j1))
    found = run_batch(lanes, prepared, level)
    given_up = found.status == STATUSES.index("censored")
    # Judged at every 64th step: whoever is over the level at the last look is told.
    assert np.all(j1[given_up] >= found.measures["j1"][given_up])
    assert np.all(found.measures["j1"][given_up] > level)
    assert given_up.sum() > 10
    kept = ~given_up
    for name in BATCH_MEASURES:
        assert np.array_equal(
            found.measures[name][kept], whole.measures[name][kept], equal_nan=True
        )
        if name != "j1":
            assert np.isnan(found.measures[name][given_up]).all()
    assert np.all(j1[kept & np.isfinite(j1)] <= level * 1.2)
    assert STATUSES[found.status[20]] == "failed"


def test_who_is_given_up_does_not_depend_on_company():
    design = paper(600, 100, 140, **SHORT)
    lanes = lanes_over_gains(design, GAINS)
    prepared = prepare(lanes, design.tables.simulation)
    level = float(np.median(run_batch(lanes, prepared).measures["j1"]))
    whole = run_batch(lanes, prepared, level)
    order = np.random.default_rng(5).permutation(75)
    other = run_batch(lanes[order], prepared, level)
    assert np.array_equal(other.measures["j1"], whole.measures["j1"][order])
    assert np.array_equal(other.status, whole.status[order])
    for lane in (0, 40, 74):
        alone = run_batch(lanes[np.array([lane])], prepared, level)
        assert alone.measures["j1"][0] == whole.measures["j1"][lane]


def test_a_string_kept_for_resumed_runs_comes_back_whole(tmp_path):
    from drillctl.ensemble.storing import Folder
    from drillctl.ensemble.sweeps import Cells

    job = Cells(paper(600, 100, 140), (), ("j1",))
    sampled = {"controller.drive": {"sampling_period": "20 ms", "torque_limit": "30 kN*m"}}
    for number, values in enumerate(({}, sampled, {"bha.damping": "50 N*m*s"})):
        design = paper(600, 100, 140, **SHORT, **values)
        lanes = single_lane(design)
        made = prepare(lanes, design.tables.simulation)
        blocks = Folder(tmp_path)("map", job)
        blocks.prepared(number, lambda made=made: made)
        back = blocks.prepared(number, lambda: pytest.fail("prepared twice"))
        assert back.scheme == made.scheme
        assert type(back.stepper.string) is type(made.stepper.string)
        assert measures_of(run_batch(lanes, back), 0) == measures_of(run_batch(lanes, made), 0)


# A short stiff string: what its shapes had left of the rigid body twisted it by 1e-6 N m.
@example(inertia=1060.75, bit=1065.75, length=201.0, speed=10.0, elements=21)
@settings(max_examples=25, deadline=None)
@given(
    inertia=st.floats(100, 5000),
    bit=st.floats(50, 2000),
    length=st.floats(200, 6000),
    speed=st.floats(10, 200),
    elements=st.integers(1, 40),
)
def test_a_rig_without_friction_and_control_keeps_its_energy(inertia, bit, length, speed, elements):
    design = drillctl.load(
        "monteiro-trindade-2012",
        **{
            "top_drive.inertia": f"{inertia!r} kg*m^2",
            "bha.inertia": f"{bit!r} kg*m^2",
            "drillstring.sections.pipe.length": f"{length!r} m",
            "drillstring.sections.pipe.elements": elements,
            "operating_point.weight_on_bit": "0 N",
            "bit_rock.outside_table": "extrapolate",
            "controller.kp": 0.0,
            "controller.ki": 0.0,
            "start.speed": f"{speed!r} rpm",
            "simulation.duration": "10 s",
        },
    )
    # No torque acts: every node keeps its speed, whatever modes are carried.
    found = measured(design)
    expected = design.tables.start.speed
    assert found.min_bit_speed == pytest.approx(expected, rel=1e-9)
    assert found.peak_bit_speed == pytest.approx(expected, rel=1e-9)
    assert found.peak_pipe_torque == pytest.approx(0.0, abs=1e-8)
    assert found.work_at_bit == 0.0


@settings(max_examples=20, deadline=None)
@given(data=st.data())
def test_any_valid_design_runs_or_is_refused(data):
    draw = data.draw
    values = {
        "controller.kp": draw(st.floats(-2e3, 2e4)),
        "controller.ki": draw(st.floats(-500, 5e3)),
        "operating_point.speed": f"{draw(st.floats(0.1, 400))!r} rpm",
        "operating_point.weight_on_bit": f"{draw(st.floats(0, 400))!r} kN",
        "bit_rock.outside_table": draw(st.sampled_from(["refuse", "extrapolate"])),
        "drillstring.sections.pipe.length": f"{draw(st.floats(1, 9000))!r} m",
        "drillstring.sections.pipe.elements": draw(st.integers(1, 30)),
        "drillstring.sections.pipe.mass_damping": f"{draw(st.floats(0, 5))!r} 1/s",
        "drillstring.sections.pipe.stiffness_damping": f"{draw(st.floats(0, 0.1))!r} s",
        "bha.inertia": f"{draw(st.floats(0.1, 3e3))!r} kg*m^2",
        "bha.damping": f"{draw(st.floats(0, 500))!r} N*m*s/rad",
        "start.kind": draw(st.sampled_from(["rest", "turning", "wound_up"])),
        "simulation.duration": "5 s",
        "simulation.accuracy": "fast",
    }
    if values["start.kind"] == "turning":
        values["start.speed"] = f"{draw(st.floats(-100, 300))!r} rpm"
    try:
        design = drillctl.load("monteiro-trindade-2012", **values)
        lanes = single_lane(design)
        found = run_batch(lanes, prepare(lanes, design.tables.simulation))
    except drillctl.errors.InputError:
        return
    j1 = found.measures["j1"][0]
    assert np.isfinite(j1) != (STATUSES[found.status[0]] == "failed")


def test_a_step_too_long_for_the_friction_law_is_refused():
    design = paper(600, 100, 140, **{"simulation.step": "1 s"})
    with pytest.raises(drillctl.errors.InputError, match=r"simulation.step.*809.*0\.2"):
        drillctl.simulate(design, engine="batch")
