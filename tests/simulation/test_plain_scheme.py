"""The kernels against the same scheme in plain NumPy, and against themselves in other company."""

import numpy as np
import pytest
from plain_scheme import plain_run

import drillctl
from drillctl.design.tables import AxisTable
from drillctl.ensemble.grid import axes_of, groups
from drillctl.simulation.batch import prepare, run_batch

HOLDS = {
    "kernels": "the same scheme in plain NumPy, J1 to 1e-12",
}

KP, KI = np.linspace(150.0, 900.0, 6), np.linspace(20.0, 400.0, 5)


@pytest.mark.parametrize(
    ("damping", "step"), [("0 s", "20 ms"), ("1 ms", "20 ms"), ("0 s", "50 ms"), ("1 ms", "5 ms")]
)
def test_the_kernel_is_the_plain_scheme(damping, step, figure):
    design = drillctl.load(
        "monteiro-trindade-140kn",
        **{
            "drillstring.sections.pipe.stiffness_damping": damping,
            "simulation.step": step,
            "simulation.modes": 12,
            "simulation.duration": "30 s",
        },
    )
    axes = axes_of(
        design,
        (
            AxisTable(path="controller.kp", min=KP[0], max=KP[-1], points=6),
            AxisTable(path="controller.ki", min=KI[0], max=KI[-1], points=5),
        ),
    )
    (group,) = groups(design, axes)
    lanes = group.lanes
    prepared = prepare(lanes, design.tables.simulation)
    batch = run_batch(lanes, prepared)
    friction = lanes.friction
    j1, stuck = plain_run(
        design.string, 12, prepared.scheme.step, prepared.scheme.steps, *lanes.drive,
        friction.a1[0], friction.a2[0], friction.beta[0], lanes.weight.level[0],
        lanes.set_speed[0], lanes.turning_speed[0],
    )  # fmt: skip
    assert stuck.max() > 5.0
    np.testing.assert_allclose(batch.measures["j1"], j1, rtol=1e-12)
    figure(
        "J1 of the kernels against plain NumPy, relative",
        abs(batch.measures["j1"] / j1 - 1.0).max(),
    )
    np.testing.assert_allclose(batch.measures["stuck_time"], stuck, rtol=0, atol=1e-9)
