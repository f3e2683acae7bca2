"""Realizations over a map: each lane is the design it stands for, whoever computed it and when."""

from __future__ import annotations

import numba
import numpy as np
import pytest

import drillctl
from drillctl import units
from drillctl.ensemble import grid as grid_module
from drillctl.ensemble import realizations as realizations_module
from drillctl.ensemble import running as running_module
from drillctl.ensemble.grid import axes_of, cell_design
from drillctl.ensemble.realizations import Realizations
from drillctl.ensemble.running import pieces
from drillctl.ensemble.storing import MemoryBlocks
from drillctl.errors import InputError
from drillctl.simulation.batch import prepare, run_batch
from drillctl.simulation.lanes import single_lane
from drillctl.simulation.measures import STATUSES
from drillctl.studies.uncertainty.compute import uncertainty

HOLDS = {
    "realizations over a map": "each lane the design it stands for, to the bit; blocks, threads, "
    "draws that fail; Ishigami's indices",
}

A1, A2, WEIGHT = "bit_rock.a1_factor", "bit_rock.a2_factor", "operating_point.weight_on_bit"
LENGTH, INERTIA = "drillstring.sections.pipe.length", "bha.inertia"
FIVE = {"distribution": "lognormal", "cov": 0.05}
GAINS = [
    {"path": "controller.kp", "min": 500.0, "max": 700.0, "points": 3},
    {"path": "controller.ki", "min": 100.0, "max": 150.0, "points": 2},
]
FAILED = STATUSES.index("failed")


def small(*paths, **values):
    """Six cells of the paper's map, runs of 20 s."""
    given = {"simulation.duration": "20 s", "simulation.accuracy": "fast", "map.audit_cells": 0,
             "map.axes": GAINS, "map.levels": [12.0, 15.0, 18.0],
             "uncertainty.full": True}  # fmt: skip
    if paths:
        given["uncertain"] = dict.fromkeys(paths, FIVE)
    return drillctl.load("monteiro-trindade-140kn", **(given | values))


def lane(design, axes, cell, drawn):
    """J1 of one cell of one realization, through the design alone."""
    one = cell_design(design, axes, cell).replace({p: units.SI(v) for p, v in drawn.items()})
    lanes = single_lane(one)
    return run_batch(lanes, prepare(lanes, one.tables.simulation)).measures["j1"][0]


def check_lanes(design, result):
    for row in range(result.realizations):
        drawn = {path: column[row] for path, column in result.drawn.items()}
        for cell in range(result.nominal.size):
            expected = lane(design, result.axes, cell, drawn)
            assert result.j1[row].ravel()[cell] == expected


# --- lanes -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "paths", [(A1, A2), (A2, LENGTH), (INERTIA,)], ids=["friction", "length", "inertia"]
)
def test_every_lane_is_the_design_it_stands_for(paths):
    design = small(*paths)
    check_lanes(design, uncertainty(design, realizations=4, seed=5))


def test_a_drawn_weight_may_leave_the_friction_table():
    law = {"distribution": "uniform", "min": "150 kN", "max": "180 kN"}
    design = small(uncertain={WEIGHT: law})
    result = uncertainty(design, realizations=4)
    assert result.drawn[WEIGHT].max() > 160e3
    check_lanes(design.replace({"bit_rock.outside_table": "extrapolate"}), result)


def test_what_axis_and_draw_make_together_is_resolved_cell_by_cell():
    """The friction follows weight and factors: neither tells a lane's coefficients alone."""
    axes = [GAINS[0], {"path": WEIGHT, "min": "90 kN", "max": "150 kN", "points": 3}]
    design = small(A1, "bit_rock.beta_factor", **{"map.axes": axes})
    check_lanes(design, uncertainty(design, realizations=2))


def test_axes_that_change_the_string():
    axes = [GAINS[0], {"path": LENGTH, "min": "2500 m", "max": "3000 m", "points": 2}]
    design = small(A2, INERTIA, **{"map.axes": axes})
    check_lanes(design, uncertainty(design, realizations=2))


@pytest.mark.slow  # a kernel of its own
def test_draws_that_make_other_laws_run_by_themselves():
    """A delay of zero is no delay: half of these draws take another kernel."""
    law = {"distribution": "samples", "samples": ["0 s", "0.5 s"]}
    design = small(uncertain={"controller.drive.lag": law}, **{
        "controller.drive.torque_limit": "60 kN*m",
    })  # fmt: skip
    result = uncertainty(design, realizations=6)
    assert len(set(result.drawn["controller.drive.lag"])) == 2
    check_lanes(design, result)


def test_a_steep_draw_has_a_step_of_its_own():
    """The step is bounded by the friction of the realization, not by that of its company."""
    laws = {
        "bit_rock.beta_factor": {"distribution": "samples", "samples": [1.0, 30.0]},
    }
    design = small(uncertain=laws)
    result = uncertainty(design, realizations=6)
    assert len(set(result.drawn["bit_rock.beta_factor"])) == 2
    check_lanes(design, result)


def test_the_steepest_cell_bounds_the_step_of_a_realization():
    """Gains alone leave the friction as it is; any other axis may make it steeper."""
    axes = [GAINS[0], {"path": "bit_rock.beta_factor", "min": 1.0, "max": 30.0, "points": 2}]
    design = small(A1, **{"map.axes": axes})
    result = uncertainty(design, realizations=3)
    for row in range(3):
        drawn = {A1: result.drawn[A1][row]}
        for cell in (1, 3, 5):  # beta_factor 30
            assert result.j1[row].ravel()[cell] == lane(design, result.axes, cell, drawn)


def test_what_the_first_cell_does_not_tell_is_found_at_the_last(monkeypatch):
    """Numbers that a draw changes at high gains only: no law here has such, another might."""
    whole = realizations_module.lane_numbers

    def coupled(design):
        numbers = whole(design)
        extra = (design.tables.controller.kp - 500.0) * (design.tables.bit_rock.a1_factor - 1.0)
        return numbers | {"turning_speed": numbers["turning_speed"] + 0.01 * extra}

    design = small(A1)
    plain = uncertainty(design, realizations=2)
    monkeypatch.setattr(realizations_module, "lane_numbers", coupled)
    monkeypatch.setattr(grid_module, "lane_numbers", coupled)
    result = uncertainty(design, realizations=2)
    assert (result.j1[:, 0] == plain.j1[:, 0]).all()  # kp 500
    assert not (result.j1[:, 1:] == plain.j1[:, 1:]).any()


def test_nominal_map_is_that_of_the_design():
    design = small()
    result = uncertainty(design, realizations=2)
    assert (result.nominal == drillctl.stability_map(design).j1).all()


# --- the same bits -----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def whole():
    return uncertainty(small(), realizations=21)


def test_blocks_change_nothing(whole, monkeypatch):
    for lanes in (1, 6 * 4, 6 * 7):
        monkeypatch.setattr(realizations_module, "LANES", lanes)
        again = uncertainty(small(), realizations=21)
        assert again.j1.tobytes() == whole.j1.tobytes()
        assert again.status.tobytes() == whole.status.tobytes()


def test_threads_change_nothing(whole):
    most = numba.get_num_threads()
    try:
        numba.set_num_threads(1)
        again = uncertainty(small(), realizations=21)
    finally:
        numba.set_num_threads(most)
    assert again.j1.tobytes() == whole.j1.tobytes()


@pytest.mark.parametrize("sampling", ["monte-carlo", "sobol"])
def test_more_realizations_begin_with_the_same_ones(sampling):
    design = small(**{"uncertainty.sampling": sampling, "uncertainty.realizations": 8})
    few = uncertainty(design, realizations=8)
    many = uncertainty(design, realizations=24)
    assert many.j1[:8].tobytes() == few.j1.tobytes()
    assert not (many.j1[8:16] == few.j1).all()


def test_compared_designs_see_the_same_draws(whole):
    other = uncertainty(small(**{"simulation.duration": "10 s"}), realizations=21)
    for path, values in whole.drawn.items():
        assert (values == other.drawn[path]).all()


def test_a_job_goes_by_post():
    import pickle

    design = small()
    axes = axes_of(design)
    job = Realizations(design, axes, 2012, ("j1", "stuck_time"), None)
    prepared = job.prepared(lambda number, make: make())
    here = prepared.run(3, 2)
    sent = pickle.loads(pickle.dumps(prepared))
    assert sent.strings[0].scheme == prepared.strings[0].scheme
    there = sent.run(3, 2)
    assert there.measures["stuck_time"].tobytes() == here.measures["stuck_time"].tobytes()
    assert there.first == 3


def test_pieces_are_cut_at_blocks():
    done = np.zeros(10, dtype=bool)
    assert pieces(done, 4) == [(0, 4), (4, 4), (8, 2)]
    done[4:8] = done[:2] = True
    assert pieces(done, 4) == [(2, 2), (8, 2)]
    done[:] = True
    assert pieces(done, 4) == []


def test_kept_in_memory_grows():
    design = small()
    axes = axes_of(design)
    job = Realizations(design, axes, 1, ("j1",), None)
    kept = MemoryBlocks(job)
    for first, count in kept.missing(3):
        kept.keep(job.run(first, count))
    assert kept.missing(3) == []
    assert kept.missing(5) == [(3, 2)]
    kept.keep(job.run(3, 2))
    assert kept.read(5)[0]["j1"].tobytes() == job.run(0, 5).measures["j1"].tobytes()


# --- impossible draws --------------------------------------------------------------------------


def test_impossible_draws_are_failed_lanes_with_a_reason():
    law = {"distribution": "uniform", "min": 0.1, "max": 1.0}  # static under sliding friction
    result = uncertainty(small(uncertain={A2: law}), realizations=30)
    design = small()
    impossible = result.drawn[A2] < design.bit_rock.a1 / design.bit_rock.a2
    assert 0 < impossible.sum() < 30
    assert (result.possible == ~impossible).all()
    assert (result.status[impossible] == FAILED).all()
    (failure,) = result.failures
    assert failure.count == impossible.sum()
    assert "less than a1" in failure.example
    # They are under no level, and enter no moment.
    assert result.probability(1e9).counts.max() == 30 - impossible.sum()
    mean = result.mean()
    assert mean == pytest.approx(result.j1[~impossible].mean(axis=0))
    assert result.best("mean").value == mean.min()


def test_draws_impossible_at_some_cells_fail_there_alone():
    axes = [GAINS[0], {"path": A1, "min": 0.5, "max": 1.5, "points": 3}]
    laws = {A2: {"distribution": "uniform", "min": 0.3, "max": 0.5}}
    design = small(uncertain=laws, **{"map.axes": axes})
    result = uncertainty(design, realizations=8)
    a1 = design.bit_rock.a1 * axes_of(design)[1].values
    a2 = design.bit_rock.a2 * result.drawn[A2]
    expected = a2[:, None, None] < a1[None, None, :]
    assert expected.any()
    assert not expected.all(axis=(1, 2)).any()
    assert ((result.status == FAILED) == np.broadcast_to(expected, result.status.shape)).all()
    assert np.isnan(result.j1[result.status == FAILED]).all()


@pytest.mark.parametrize(
    ("design", "message"),
    [
        (lambda: small(uncertain={"controller.kp": FIVE}), "is an axis of the map"),
        (lambda: small(**{"uncertainty.axes": GAINS[:1]}), "two axes run over 'controller.kp'"),
        (lambda: small(uncertain={"bit_rock.a1_factr": FIVE}), "did you mean 'bit_rock.a1_factor'"),
        (lambda: small(**{"uncertainty.keep": ["peak_speed"]}), "no measure 'peak_speed'"),
        (lambda: small(**{"uncertainty.until.level": 5}), "5 is no level of the map"),
        (
            lambda: small(**{"uncertainty.realizations": 10**9}),
            "1,000,000,000 realizations of 6 cells need about",
        ),
        (
            lambda: small(**{"uncertainty.sensitivity.cells": [{"controller.kd": 1}]}),
            "'controller.kd' is no axis of the map",
        ),
        (
            lambda: small(A1, A2, **{
                "uncertainty.sensitivity.samples": 4,
                "uncertainty.correlations": [{"between": [A1, A2], "value": 0.1}],
            }),
            "Sobol indices are of independent parameters",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_before_a_lane_is_run(design, message, monkeypatch):
    def fail(*arguments):
        raise AssertionError("a lane was run")

    monkeypatch.setattr(running_module, "run_batch", fail)
    with pytest.raises(InputError) as caught:
        uncertainty(design())
    assert message in str(caught.value)


# --- what follows ------------------------------------------------------------------------------


def test_other_measures_are_kept_on_request():
    result = uncertainty(small(**{"uncertainty.keep": ["peak_bit_speed"]}), realizations=2)
    assert list(result.measures) == ["j1", "peak_bit_speed"]
    assert (result.measures["peak_bit_speed"] > 0.0).all()
    assert result.data["peak_bit_speed"].attrs["units"] == "rad/s"


def test_audited_lanes_are_those_of_their_draw():
    result = uncertainty(small(), realizations=3, audit_cells=2)
    assert len(result.audit.cells) == 2
    assert (result.audit.batch["j1"] == result.j1.ravel()[result.audit.cells]).all()
    assert result.audit.worst < 5e-3


def test_a_run_stops_when_the_area_is_known():
    rule = {"uncertainty.until.half_width": 0.4, "uncertainty.until.first_look": 8,
            "uncertainty.until.level": 15.0}  # fmt: skip
    result = uncertainty(small(**rule), realizations=64)
    assert [one.realizations for one in result.looks] == [
        8 * 2**k for k in range(len(result.looks))
    ]
    assert result.realizations == result.looks[-1].realizations
    assert {one.confidence for one in result.looks} == {1.0 - 0.05 / 4}  # looks at 8, 16, 32, 64
    assert all(not one.enough(0.4) for one in result.looks[:-1])
    assert result.looks[-1].enough(0.4) or result.realizations == 64
    endless = uncertainty(small(**rule | {"uncertainty.until.half_width": 1e-9}), realizations=20)
    assert [one.realizations for one in endless.looks] == [8, 16, 20]


def test_slices_of_a_third_axis():
    axis = {"path": WEIGHT, "min": "120 kN", "max": "140 kN", "points": 2}
    result = uncertainty(small(**{"uncertainty.axes": [axis]}), realizations=4)
    slices = result.slices()
    assert list(slices) == [120e3, 140e3]
    assert slices[140e3].j1.tobytes() == np.ascontiguousarray(result.j1[..., 1]).tobytes()
    assert "weight on bit 140 kN" in slices[140e3].design.tables.title
    assert slices[140e3].design.tables.operating_point.weight_on_bit == 140e3
    flat = uncertainty(small(), realizations=4)
    assert flat.slices() == {}
    assert slices[140e3].j1.tobytes() == flat.j1.tobytes()


def test_contours_of_each_realization(whole):
    from drillctl.ensemble.sweeps import region

    expected = region(whole.j1[2], whole.axes, 15.0).polygons
    assert whole.contours(15.0, 2).equals(expected)


def test_labels(whole):
    data = whole.data
    assert data["j1"].dims == ("realization", "controller.kp", "controller.ki")
    assert data["count"].dims == ("level", "controller.kp", "controller.ki")
    assert (data["count"].values[1] == (whole.j1 <= 15.0).sum(axis=0)).all()
    assert data["j1_mean"].values == pytest.approx(whole.j1.mean(axis=0))
    assert data[A1].attrs["units"] == ""
    assert data.attrs["processor"]


def test_stopped_lanes_are_refused_by_name():
    values = {"map.levels": [12.0, 14.0]}
    full = uncertainty(small(**values), realizations=12)
    short = uncertainty(small(**values, **{"uncertainty.full": False}), realizations=12)
    assert short.censored.any()
    for level in short.levels:
        assert (short.maps[level].counts == full.maps[level].counts).all()
        assert short.areas[level] == full.areas[level]
    for refused in (short.mean, lambda: short.quantile(0.95), short.tail_mean):
        with pytest.raises(InputError, match="run with --full"):
            refused()
    with pytest.raises(InputError, match="run with --full"):
        short.probability(15.0)
    with pytest.raises(InputError, match="run with --full"):
        short.contours(12.0, int(np.flatnonzero(short.censored.any(axis=(1, 2)))[0]))
    told = short.summary()
    assert told["statuses"]["censored"] == short.censored.sum()
    for name in ("mean", "q95"):
        found = told["best"][name]
        assert found["value"] is not None or "--full" in found["reason"]


def test_sobol_indices_of_a_known_function():
    """Ishigami's function, whose indices are known in closed form."""
    from drillctl.studies.uncertainty.sensitivity import indices, points

    laws = {path: {"distribution": "uniform", "min": 0.5, "max": 1.5}
            for path in (A1, A2, "bit_rock.beta_factor")}  # fmt: skip
    columns = points(small(uncertain=laws), 1024, 7)
    x, y, z = (2.0 * np.pi * (column - 1.0) for column in columns.values())
    found = indices("", "", np.sin(x) + 7 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x),
                    tuple(columns), 7)  # fmt: skip
    assert found.first == pytest.approx([0.3139, 0.4424, 0.0], abs=0.03)
    assert found.total == pytest.approx([0.5576, 0.4424, 0.2437], abs=0.03)
    assert (found.total_error < 0.1).all()
    one, again = (indices("", "", x + y, tuple(columns), 0).first_error for _ in range(2))
    assert (one == again).all()  # seed 0 is a seed


def test_sensitivity_of_a_small_map():
    design = small(A1, A2, **{
        "uncertainty.sensitivity.samples": 16,
        "uncertainty.sensitivity.cells": [{"controller.kp": 690, "controller.ki": 104}],
    })  # fmt: skip
    result = uncertainty(design, realizations=2)
    found = result.sensitivity
    assert found.trajectories == 16 * 4 * 6
    assert result.trajectories == 2 * 6 + 6 + found.trajectories
    assert found.indices[0].of.startswith("J1 at controller.kp 700")
    names = [one.of for one in found.indices[1:]]
    assert names == ["area of J1 <= 12", "area of J1 <= 15", "area of J1 <= 18"]
    assert np.isfinite(found.indices[0].total).all()
    assert np.isfinite(found.indices[2].total).all()
