"""The linear design: against maps, grids and the figures of `drillctl.loop`."""

import numpy as np
import pytest

import drillctl
from drillctl.errors import InputError
from drillctl.linear.ends import ends_of
from drillctl.linear.slope_margin import slope_margins
from drillctl.studies.tune.linear_design import linear_design
from drillctl.studies.tune.loops import least_seen, loops_of
from drillctl.studies.tune.settings import TuneConstraintsTable
from drillctl.studies.tune.tuned import by_path, tuned_parameters

HOLDS = {
    "linear design": "maps and grids of the slope margin, figures of `drillctl.loop`; derivatives "
    "of D* against differences",
}

PAPER = "monteiro-trindade-140kn"
DAMPED = {"drillstring.sections.pipe.stiffness_damping": "1 ms"}
LATE = {
    "weight_on_bit.law": "navarro-lopez-suarez",
    "weight_on_bit.gain": "2 kN*s/rad",
    "weight_on_bit.path.delay": "0.3 s",
}
UNCERTAIN = {
    "uncertain": {
        "drillstring.sections.pipe.length": {
            "distribution": "uniform", "min": "2800 m", "max": "3200 m",
        },
        "bha.inertia": {"distribution": "lognormal", "cov": 0.1},
        "drillstring.sections.pipe.stiffness_damping": {"distribution": "lognormal", "cov": 0.3},
    }
}  # fmt: skip


def asking(**required):
    return TuneConstraintsTable(**required)


def test_the_papers_rig_has_its_largest_slope_margin_found():
    design = drillctl.load(PAPER)
    found = linear_design(design)
    kp, ki = found.values
    assert found.feasible
    assert abs(kp - 600) < 10
    assert abs(ki - 112) < 10
    assert found.slope_margin == pytest.approx(370.0, abs=3.0)
    assert found.processor_seconds < 2.0
    grid = np.meshgrid(np.linspace(550, 650, 101), np.linspace(80, 140, 61))
    best = slope_margins(ends_of(design.string), *grid).slope.max()
    assert best <= found.slope_margin <= best + 0.5  # between points of the grid
    assert found.excess == pytest.approx(found.slope_margin - 290.0747, abs=0.01)


@pytest.mark.parametrize(
    ("more", "points"),
    [
        ({"controller.law": "soft-torque"}, 301),
        ({"controller.law": "stiff-speed"}, 21),
        ({"controller.law": "z-torque", **DAMPED}, 201),
        ({"controller.law": "torsional-rectification", **DAMPED}, 51),
        ({"controller.law": "active-damping", **DAMPED}, 21),
        ({**LATE, **DAMPED}, 25),
    ],
)
def test_no_grid_has_better_gains(more, points):
    design = drillctl.load(PAPER, **more)
    found = linear_design(design)
    tuned = tuned_parameters(design)
    (loop,) = loops_of([design], tuned)
    axes = np.meshgrid(*(np.linspace(t.low, t.high, points) for t in tuned))
    values = np.stack([a.ravel() for a in axes], axis=1)
    best = max(least_seen(loop, by_path(tuned, v)) for v in values)
    # The grid's own slope margins are those of interpolated crossings.
    assert found.slope_margin >= best * (1 - 5e-3)
    assert drillctl.loop(found.design).slope_margin == pytest.approx(found.slope_margin, rel=1e-9)


def test_the_gain_of_a_late_weight_is_tuned_with_the_drive():
    bounds = {
        "controller.kp": {"min": 100, "max": 1000}, "controller.ki": {"min": 10, "max": 300},
        "weight_on_bit.gain": {"min": "0.1 kN*s/rad", "max": "8 kN*s/rad"},
    }  # fmt: skip
    held = linear_design(drillctl.load(PAPER, **LATE, **DAMPED))
    free = linear_design(drillctl.load(PAPER, **LATE, **DAMPED, tune={"parameters": bounds}))
    assert free.excess > held.excess + 10.0
    checked = drillctl.loop(free.design)
    assert checked.stable
    assert checked.slope_margin == pytest.approx(free.slope_margin, rel=1e-9)


def test_gains_hold_for_a_set_of_strings():
    design = drillctl.load(PAPER, **DAMPED, **UNCERTAIN)
    alone, many = linear_design(design), linear_design(design, strings=8, seed=5)
    assert many.loops == 9
    assert many.excess < alone.excess
    # At the gains of the design alone some string of the set is worse off.
    tuned = tuned_parameters(design)
    from drillctl.ensemble.parameters import draw
    from drillctl.studies.tune.tuned import designs_at

    loops = loops_of([design, *designs_at(design, draw(design, 8, 5))], tuned)
    worst = min(least_seen(x, alone.gains) - x.slope for x in loops)
    assert worst < many.excess - 1.0


@pytest.mark.parametrize(
    "required",
    [{"peak_sensitivity": 6.0}, {"damping_ratio": 0.1}, {"delay": "0.32 s"}],
)
def test_requirements_are_kept_as_the_loop_has_them(required):
    design = drillctl.load(PAPER, **DAMPED)
    free = linear_design(design, asked=asking())
    found = linear_design(design, asked=asking(**required))
    assert found.feasible, found.message
    assert found.excess <= free.excess + 1e-6
    checked = drillctl.loop(found.design)
    if "peak_sensitivity" in required:
        assert checked.margins.peak_sensitivity <= 6.0 * (1 + 1e-3)
    elif "delay" in required:
        assert checked.margins.delay >= 0.32 * (1 - 1e-4)
        assert drillctl.loop(free.design).margins.delay < 0.318  # it was not so without
    else:
        assert min(ratio for _, ratio in checked.oscillations[:2]) >= 0.1 * (1 - 1e-4)


def test_what_cannot_be_met_is_told_with_the_closest_point(capfd):
    design = drillctl.load(PAPER, **DAMPED)
    found = linear_design(design, asked=asking(damping_ratio=0.6))
    assert not found.feasible
    assert "cannot all be met" in found.message
    assert "controller.kp = " in found.message
    damping = min(ratio for _, ratio in drillctl.loop(found.design).oscillations[:2])
    assert found.violations["damping_ratio"] == pytest.approx(0.6 - damping, abs=1e-3)
    reserve = linear_design(design, asked=asking(slope_reserve="500 N*m*s/rad"))
    assert list(reserve.violations) == ["slope_reserve"]
    captured = capfd.readouterr()
    assert captured.out == captured.err == ""  # no dump of a solver


def test_what_the_linear_loop_does_not_know_is_refused():
    other = {"bit_rock.a1_factor": {"min": 0.5, "max": 1.5}}
    with pytest.raises(InputError, match=r"'bit_rock.a1_factor' is not tuned in the linear loop"):
        linear_design(drillctl.load(PAPER, tune={"parameters": other}))
    with pytest.raises(InputError, match="no loop that could be tuned"):
        linear_design(drillctl.load("navarro-lopez-2dof-bistable"))


def test_a_design_is_written_ready_to_run(tmp_path):
    found = linear_design(drillctl.load(PAPER))
    folder = found.save(tmp_path / "linear")
    again = drillctl.load(folder / "design.toml")
    assert again.top_drive.kp == pytest.approx(found.values[0], rel=1e-12)
    assert drillctl.loop(again).slope_margin == pytest.approx(found.slope_margin, rel=1e-9)
