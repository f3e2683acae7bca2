"""Stick-slip cycles: one harmonic, exact orbits, and long runs that repeat or do not."""

import importlib.util
import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import iv

import drillctl
from drillctl.errors import InputError, SimulationError
from drillctl.linear.ends import ends_of
from drillctl.plots.over_time import limit_cycle as drawn
from drillctl.simulation.limit_cycle import (
    find_orbit,
    harmonic_cycles,
    harmonic_guess,
    limit_cycle,
)
from drillctl.simulation.limit_cycle.describing import mean_torque_and_slope
from drillctl.simulation.limit_cycle.flow import Flow
from drillctl.simulation.limit_cycle.returns import take_returns
from drillctl.simulation.reference import solve_whole
from drillctl.simulation.reference_rates import BIT_SPEED

HOLDS = {
    "exact cycles": "event-accurate flow followed until it repeats to 1e-8; monodromy against "
    "differences",
}

DOCS = Path(__file__).resolve().parents[2] / "docs"
LITTLE_DAMPING = {"drillstring.sections.pipe.stiffness_damping": "1 ms"}


def lumped(**values):
    return drillctl.load("navarro-lopez-2dof-bistable", **values)


def paper(kp=200, ki=100, **values):
    return drillctl.load(
        "monteiro-trindade-120kn", **{"controller.kp": kp, "controller.ki": ki, **values}
    )


@pytest.fixture(scope="module")
def from_rest():
    return limit_cycle(lumped(), start="rest")


@pytest.fixture(scope="module")
def unstable():
    design = lumped()
    _, smooth, _ = harmonic_cycles(design, modes=1)
    return smooth, find_orbit(design, harmonic_guess(design, smooth), smooth.period)


# --- one harmonic ----------------------------------------------------------------------------


def test_a_bit_that_never_stops_has_a_closed_form():
    design = paper()
    law, weight, mean = design.bit_rock, 120e3, 10.0
    amplitude = np.array([1e-3, 1.0, 5.0, 9.99])
    torque, slope = mean_torque_and_slope(design, mean, amplitude)
    falling = (law.a2 - law.a1) * weight * np.exp(-law.beta * mean)
    assert torque == pytest.approx(law.a1 * weight + falling * iv(0, law.beta * amplitude), 1e-13)
    assert slope == pytest.approx(2 * falling * iv(1, law.beta * amplitude) / amplitude, rel=1e-9)
    assert slope[0] == pytest.approx(law.beta * falling, rel=1e-8)  # minus dT/dw


@pytest.mark.parametrize("amplitude", [10.01, 12.0, 40.0])
def test_past_the_stick_limit_the_torque_turns(amplitude):
    design = paper()
    law, weight, mean = design.bit_rock, 120e3, 10.0

    def torque(angle):
        speed = mean + amplitude * np.cos(angle)
        share = law.a1 + (law.a2 - law.a1) * np.exp(-law.beta * abs(speed))
        return weight * share * np.sign(speed)

    turn = np.arccos(-mean / amplitude)
    around = {"points": [turn], "epsabs": 1e-8, "epsrel": 1e-12}
    steady = quad(torque, 0, np.pi, **around)[0] / np.pi
    first = quad(lambda x: torque(x) * np.cos(x), 0, np.pi, **around)[0]
    found = mean_torque_and_slope(design, mean, amplitude)
    assert found[0] == pytest.approx(steady, rel=1e-9)
    assert found[1] == pytest.approx(-2 * first / (np.pi * amplitude), rel=1e-9)


PROPORTIONAL = {
    "controller.law": "pi", "controller.kp": 500, "controller.ki": 0,
    "operating_point.speed": "22 rad/s",
}  # fmt: skip


@pytest.mark.parametrize(
    "design", [lumped(), paper(), lumped(**PROPORTIONAL)], ids=["constant", "PI", "P"]
)
def test_both_balances_hold(design):
    assert harmonic_cycles(design)
    drag = design.string.ground_damping.sum()
    kp, ki = design.top_drive.gains()
    for cycle in harmonic_cycles(design):
        s = 2j * np.pi * np.array([cycle.frequency_hz])
        impedance = ends_of(design.string).bit_impedance(s, kp + ki / s)[0]
        torque, slope = mean_torque_and_slope(design, cycle.mean_speed, cycle.amplitude)
        assert impedance == pytest.approx(complex(slope), rel=1e-6)
        if ki:
            assert cycle.mean_speed == design.speed
        else:
            drive = design.top_drive.torque(0.0, cycle.mean_speed - design.speed)
            assert drive - drag * cycle.mean_speed == pytest.approx(float(torque), rel=1e-9)


def test_cycles_of_the_bistable_string():
    low, smooth, sticking = harmonic_cycles(lumped())
    assert not low.stable  # it belongs to the steady speed that no drive holds
    assert not smooth.stable
    assert smooth.least_speed > 0.0
    assert sticking.stable
    assert sticking.least_speed < 0.0
    assert sticking.peak_speed == pytest.approx(6.945236, rel=0.01)


def test_a_stiff_loop_has_no_cycle():
    assert harmonic_cycles(paper(625, 125)) == ()


def test_lowest_frequency_first():
    found = harmonic_cycles(paper(), modes=5)
    frequencies = [cycle.frequency_hz for cycle in found]
    assert frequencies == sorted(frequencies)
    assert len(set(frequencies)) == 5
    assert harmonic_cycles(paper(), modes=1) == found[:1]


# --- exact orbits ----------------------------------------------------------------------------


@pytest.mark.parametrize("start", ["before the stop", "through two stops"])
def test_monodromy_is_the_derivative_of_the_flow(start, from_rest):
    flow, orbit = Flow(lumped(), 1e-12), from_rest.orbit
    turns = 0.2 if start == "before the stop" else 1.7
    matrix = flow.follow(orbit.point, turns * orbit.period).matrix
    for column in range(len(orbit.point)):
        step = np.zeros(len(orbit.point))
        step[column] = 1e-4
        ahead, behind = (
            flow.follow(orbit.point + x, turns * orbit.period, matrix=False).point
            for x in (step, -step)
        )
        assert (ahead - behind) / 2e-4 == pytest.approx(matrix[:, column], rel=1e-5, abs=1e-6)


def test_monodromy_where_the_bit_turns_back():
    # A long pull back: the bit goes through zero speed without a stop, and the torque jumps.
    design = lumped(**{"controller.torque": "-4 kN*m"})
    flow = Flow(design, 1e-12)
    point = flow.point(np.array([0.0, 25.0, -8.0 - design.speed, 1.0 - design.speed]))
    flight = flow.follow(point, 0.6)
    assert [leg.direction for leg in flight.legs] == [1, -1]
    step = np.array([1e-4, 0.0, 0.0])
    ahead, behind = (flow.follow(point + x, 0.6, matrix=False).point for x in (step, -step))
    assert (ahead - behind) / 2e-4 == pytest.approx(flight.matrix[:, 0], rel=1e-5)


def test_lumped_string_from_rest(from_rest):
    orbit = from_rest.orbit
    assert from_rest.status == "periodic"
    assert orbit.period == pytest.approx(5.092533, abs=1e-6)
    assert orbit.peak_bit_speed == pytest.approx(6.945236, abs=1e-6)
    assert orbit.min_bit_speed == 0.0
    assert orbit.residual < 1e-9
    assert np.abs(orbit.multipliers).max() < 1.0
    assert orbit.multipliers.shape == (2,)


def test_lumped_orbit_is_where_the_motion_goes(from_rest):
    design = lumped(**{"start.kind": "rest", "simulation.duration": "220 s"})
    agrees_with_the_flow(from_rest.orbit, solve_whole(design, 1e-11))


def agrees_with_the_flow(orbit, motion):
    """The bar: within 1e-6 of the reference solver's motion, which repeats to 1e-8."""
    returns = take_returns(motion, orbit.period, level=float(orbit.bit_speed[0]))
    assert np.abs(returns.points[-1] - returns.points[-2]).max() < 1e-8
    assert returns.periods[-1] == pytest.approx(orbit.period, abs=1e-6)
    assert returns.peaks[-1] == pytest.approx(orbit.peak_bit_speed, abs=1e-6)
    assert returns.stuck[-1] == pytest.approx(orbit.stuck_time, abs=1e-6)
    assert returns.points[-1] == pytest.approx(orbit.point, abs=1e-6)


def test_unstable_smooth_cycle(unstable):
    smooth, orbit = unstable
    assert orbit.min_bit_speed > 0.0
    assert orbit.stuck_time == 0.0
    assert abs(orbit.multipliers[0]) > 10.0
    assert not orbit.stable
    assert orbit.period == pytest.approx(smooth.period, rel=0.05)
    assert orbit.period == pytest.approx(4.48492, abs=1e-5)
    assert orbit.peak_bit_speed < 6.945


@pytest.mark.parametrize(("share", "status"), [(0.97, "ok"), (1.03, "sticking")])
def test_unstable_cycle_divides_settling_from_sticking(unstable, share, status):
    _, orbit = unstable
    design = lumped()
    flow = Flow(design)
    steady = flow.point(np.array([0.0, -7622.626 / 861.5336, 0.0, 0.0]))
    flight = flow.follow(steady + share * (orbit.point - steady), 60.0, matrix=False, dense=True)
    sticks = any(leg.direction == 0 for leg in flight.legs if leg.end > 50.0)
    assert sticks == (status == "sticking")


def test_a_guess_that_leads_to_rest_is_no_orbit():
    design = lumped()
    steady = Flow(design).point(np.array([0.0, -7622.6 / 861.5336, 0.01, 0.01]))
    with pytest.raises(SimulationError, match=r"steady drilling|no periodic motion"):
        find_orbit(design, steady, 4.3)


@pytest.mark.slow
def test_damped_string_repeats():
    design = paper(**LITTLE_DAMPING)
    result = limit_cycle(design)
    orbit = result.orbit
    assert result.status == "periodic"
    assert orbit.period == pytest.approx(22.3036, abs=5e-5)
    assert orbit.peak_bit_speed == pytest.approx(26.119, abs=5e-4)
    assert np.abs(orbit.multipliers).max() < 1.0
    assert orbit.mean_bit_speed == pytest.approx(design.speed, rel=1e-9)
    long = design.replace({"start.kind": "wound_up", "simulation.duration": "1200 s"})
    agrees_with_the_flow(orbit, solve_whole(long, 1e-11))


def test_with_a_memory_in_the_drive_the_long_run_decides():
    """A limit out of reach makes the drive one with a memory, and moves nothing."""
    design = lumped(**{"controller.drive.torque_limit": "1000 kN*m"})
    result, exact = limit_cycle(design, periods=30), limit_cycle(lumped(), periods=30)
    assert exact.status == "periodic"
    assert result.status == "repeating"
    assert result.orbit is None
    assert result.simulated.periods[-1] == pytest.approx(exact.orbit.period, abs=1e-5)
    assert drawn(result).axes


@pytest.mark.slow
def test_undamped_string_does_not_repeat():
    result = limit_cycle(paper())
    assert result.status == "not periodic"
    assert result.orbit is None
    assert result.summary()["period"] is None
    low, high = result.summary()["simulated"]["peak_spread"]
    assert 26.31 - 0.02 < low < high < 26.55 + 0.02
    assert high - low > 0.1


@pytest.mark.slow
def test_the_second_mode_has_an_orbit_that_no_motion_keeps():
    design = paper(**LITTLE_DAMPING)
    _, second = harmonic_cycles(design, modes=2)
    orbit = find_orbit(design, harmonic_guess(design, second), second.period)
    assert second.stable
    assert orbit.period == pytest.approx(second.period, rel=0.02)
    assert not orbit.stable


# --- the long run and the result -------------------------------------------------------------


def test_from_twelve_radians_a_second_it_settles():
    result = limit_cycle(lumped(), start=None)
    assert result.status == "equilibrium"
    assert result.orbit is None
    assert result.simulated.mean_speed == pytest.approx(5.004998, abs=1e-4)


def test_near_the_margin_a_run_is_still_settling():
    design = paper(**LITTLE_DAMPING, **{"operating_point.speed": "150 rpm"})
    result = limit_cycle(design, periods=16)
    assert result.status == "settling"
    assert [cycle.stable for cycle in result.harmonic] == [False, True]  # it could stick as well


def test_too_little_torque_stalls():
    design = lumped(**{"controller.torque": "5 kN*m"})
    result = limit_cycle(design, start="rest")
    assert result.status == "stalled"
    json.dumps(result.summary(), allow_nan=False)
    drawn(result)


def test_returns_do_not_count_ripples_or_micro_slips():
    # At 18 rad/s the way up has a ripple; and this string, undamped, has micro-slips.
    design = paper(**{"start.kind": "wound_up", "simulation.duration": "300 s"})
    motion = solve_whole(design, 1e-6)
    run = take_returns(motion, 21.37, level=18.0)
    assert np.all(np.abs(run.periods - 22.3) < 0.3)
    (fine,) = motion.components([BIT_SPEED], np.arange(run.times[0], 300.0, 0.01))
    above = fine + design.speed > 18.0
    releases = [x for x in motion.events if x.kind == "release" and x.time > run.times[0]]
    assert np.sum(above[1:] & ~above[:-1]) > len(run.times) + 2
    assert len(releases) > len(run.times) + 2


def test_summary_and_data(from_rest):
    summary = from_rest.summary()
    json.dumps(summary, allow_nan=False)
    assert summary["orbit"]["period"] == summary["period"] == from_rest.orbit.period
    data = from_rest.data
    assert all("units" in data[name].attrs for name in [*data.data_vars, *data.coords])
    assert float(data.time[-1]) == from_rest.orbit.period
    assert float(data.bit_speed.max()) == pytest.approx(6.945236, abs=1e-3)
    # All three begin where the bit rises through its mean.
    assert float(data.simulated_bit_speed[0]) == pytest.approx(float(data.bit_speed[0]), abs=1e-6)
    assert float(data.harmonic_bit_speed[0]) == from_rest.predicted.mean_speed


@pytest.mark.parametrize(
    ("options", "message"),
    [({"periods": 3}, "periods"), ({"start": "wound"}, "wound_up"), ({"modes": 0}, "modes")],
)
def test_options_that_cannot_be(options, message):
    with pytest.raises(InputError, match=message):
        limit_cycle(lumped(), **options)


def test_the_figure_shows_all_three(from_rest):
    figure = drawn(from_rest)
    (axes,) = figure.axes
    labels = axes.get_legend_handles_labels()[1]
    assert labels == ["exact orbit, 5.09 s", "last simulated, 5.09 s", "one harmonic, 4.30 s"]
    exact = axes.lines[0].get_ydata()
    assert exact.max() == pytest.approx(6.945236 * 30 / np.pi, rel=1e-4)


# --- the page --------------------------------------------------------------------------------


def script():
    spec = importlib.util.spec_from_file_location(
        "make_limit_cycles", DOCS / "make_limit_cycles.py"
    )
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look there for the types of their fields
    spec.loader.exec_module(module)
    return module


def rows_of_the_page():
    text = (DOCS / "limit-cycles.md").read_text(encoding="utf-8")
    begin, end = script().MARKS
    inside = text.split(begin)[1].split(end)[0]
    return [line for line in inside.splitlines() if re.match(r"\| \d", line)]


def test_the_table_has_ten_rows():
    assert len(rows_of_the_page()) == len(script().CASES) == 10


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 8])
def test_the_table_is_what_the_code_gives(number):
    module = script()
    assert module.row(number, module.CASES[number - 1]) == rows_of_the_page()[number - 1]


def test_a_bit_that_the_drive_cannot_turn_is_no_equilibrium():
    design = drillctl.load("navarro-lopez-2dof-bistable", **{"controller.torque": "1 kN*m"})
    found = limit_cycle(design, periods=16)
    assert found.status == "stalled"
    assert json.dumps(found.summary(), allow_nan=False)
    last = found.summary()["simulated"]["last_distance"]
    assert last is None or last < 1e3
