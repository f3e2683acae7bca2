"""What other programs get: a nonlinear python-control system and matrices on disk."""

from __future__ import annotations

import control
import numpy as np
import pytest
import scipy.io

import drillctl
from drillctl.errors import InputError
from drillctl.linear.export import nonlinear_system, write_matrices
from drillctl.linear.state_space import plant_matrices

HOLDS = {
    "exported models": "the models themselves; linearisation and motion of the regularised loop",
}

DESIGN = "monteiro-trindade-140kn"


def test_nonlinear_system_settles_as_the_simulation_does():
    design = drillctl.load("navarro-lopez-2dof-bistable", **{"simulation.duration": "40 s"})
    system = nonlinear_system(design)
    time = np.linspace(0.0, 40.0, 4001)
    inputs = [np.full_like(time, design.speed), np.full_like(time, 97_347.0)]
    found = control.input_output_response(
        system, time, inputs, [0.0, 12.0, 12.0], solve_ivp_kwargs={"rtol": 1e-8, "atol": 1e-8}
    )
    exact = drillctl.simulate(design)
    bit = found.outputs[system.output_labels.index("bit_speed")]
    # The bit does not stop from this start, and tanh is 1 at these speeds.
    np.testing.assert_allclose(bit, exact.signals["bit_speed"], atol=1e-5)


@pytest.mark.parametrize(
    "law", [{"law": "constant"}, {"law": "navarro-lopez-suarez", "gain": "4 kN*s/rad"}]
)
def test_nonlinear_system_linearises_to_the_loop(law):
    weight = 130e3  # between rows of the friction table, where its slope over the weight breaks
    design = drillctl.load(DESIGN, weight_on_bit=law, operating_point={"weight_on_bit": "130 kN"})
    system = nonlinear_system(design)
    steady = np.zeros(system.nstates)
    torque = float(design.bit_rock.torque_and_slope(weight, design.speed, np.exp)[0])
    string = design.string
    steady[: string.nodes - 1] = torque / string.element_stiffness
    steady[string.nodes - 1 : -1] = design.speed
    steady[-1] = torque / design.top_drive.ki
    at = [design.speed, weight]
    assert np.abs(system.dynamics(0.0, steady, at)).max() < 1e-9
    linear = system.linearize(steady, at)
    expected = drillctl.loop(design).poles
    found = linear.poles()
    far = np.abs(found[:, None] - expected[None, :]).min(axis=0)
    # Slopes by differences of some 1e-6.
    assert far.max() < 1e-3
    assert {"set_speed", "weight_on_bit"} == set(system.input_labels)
    assert system.state_labels[-1] == "integral"


@pytest.mark.parametrize("name", ["well-a-off-bottom", "richard-detournay-2dof"])
def test_what_the_nonlinear_system_would_leave_out_is_refused(name):
    with pytest.raises(InputError, match="a rock without memory and a well without friction"):
        nonlinear_system(drillctl.load(name))


def test_it_says_that_it_is_regularised():
    assert "REGULARISED" in nonlinear_system.__doc__
    with pytest.raises(InputError, match="more than 0 rad/s"):
        nonlinear_system(drillctl.load(DESIGN), width=0.0)


@pytest.mark.parametrize("suffix", [".mat", ".npz"])
def test_matrices_on_disk_are_the_models(tmp_path, suffix):
    design = drillctl.load(DESIGN)
    path = write_matrices(design, tmp_path / f"model{suffix}")
    if suffix == ".mat":
        raw = scipy.io.loadmat(path, simplify_cells=True)
        read = {
            f"{s}.{k}": v for s, part in raw.items() if isinstance(part, dict)
            for k, v in part.items()
        }  # fmt: skip
    else:
        read = dict(np.load(path, allow_pickle=False))
    plant, closed = design.plant(), design.loop()
    for name, system in (("plant", plant), ("closed_loop", closed)):
        for key in "ABCD":
            np.testing.assert_array_equal(read[f"{name}.{key}"], getattr(system, key))
        assert [str(x).strip() for x in read[f"{name}.states"]] == system.state_labels
        assert [str(x).strip() for x in read[f"{name}.inputs"]] == system.input_labels
    poles = np.linalg.eigvals(read["closed_loop_with_slope.A"])
    assert poles.real.max() == pytest.approx(drillctl.loop(design).spectral_abscissa, rel=1e-6)
    np.testing.assert_array_equal(read["string.K"], design.string.stiffness.toarray())


LATE = {
    "weight_on_bit": {
        "law": "navarro-lopez-suarez",
        "gain": "4 kN*s/rad",
        "path": {"delay": "0.2 s", "hoist_lag": "0.5 s"},
    },
}


@pytest.mark.parametrize("values", [LATE, {"controller.drive.lag": "20 ms"}, {}])
def test_the_loop_on_disk_has_the_poles_of_the_analysis(tmp_path, values):
    design = drillctl.load(DESIGN, **values)
    read = np.load(write_matrices(design, tmp_path / "model.npz"))
    poles = np.linalg.eigvals(read["closed_loop_with_slope.A"])
    expected = drillctl.loop(design).poles
    assert np.abs(poles[:, None] - expected[None, :]).min(axis=0).max() < 1e-7
    assert len(read["closed_loop_with_slope.states"]) == len(expected)


def test_a_wall_that_the_string_slides_along_is_in_the_plant_on_disk(tmp_path):
    design = drillctl.load("well-a-off-bottom", **{"well.axial_speed": "0.1 m/s"})
    assert design.sliding_string is not design.string
    read = np.load(write_matrices(design, tmp_path / "model.npz"))
    np.testing.assert_array_equal(read["plant.A"], plant_matrices(design.sliding_string).a)


def test_other_endings_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"\.mat or \.npz"):
        write_matrices(drillctl.load(DESIGN), tmp_path / "model.csv")
    with pytest.raises(InputError, match="cannot be written"):
        write_matrices(drillctl.load(DESIGN), tmp_path / "nowhere" / "model.mat")
