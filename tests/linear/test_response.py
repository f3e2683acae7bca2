"""Frequency response against the state-space plant and against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

import drillctl
from drillctl.errors import InputError
from drillctl.linear import frequency_response
from drillctl.linear.state_space import INPUTS, OUTPUTS

DESIGN = "monteiro-trindade-140kn"
PIPE = "drillstring.sections.pipe"


def test_two_inertias_by_hand():
    j, jb, k, c, cr, cb = 2122.0, 471.9698, 861.5336, 172.3067, 425.0, 50.0
    frequency = np.array([0.05, 0.2377, 1.0])
    s = 2j * math.pi * frequency
    result = frequency_response(drillctl.load("navarro-lopez-2dof").string, frequency)
    link = c * s + k
    top, bit = j * s**2 + cr * s + link, jb * s**2 + cb * s + link
    whole = top * bit - link**2
    for source, target, expected in (
        ("top_torque", "top_speed", s * bit / whole),
        ("top_torque", "bit_speed", s * link / whole),
        ("bit_torque", "bit_speed", -s * top / whole),
        ("bit_torque", "top_speed", -s * link / whole),
        ("top_torque", "pipe_torque", link * (bit - link) / whole),
        ("top_torque", "twist", (bit - link) / whole),
    ):
        np.testing.assert_allclose(result.between(source, target), expected, rtol=1e-11)


def test_slow_torque_turns_the_whole_string():
    string = drillctl.load(DESIGN).string
    result = frequency_response(string, 1e-3)
    whole = 1 / (2j * math.pi * 1e-3 * string.mass.sum())
    assert result.between("top_torque", "bit_speed")[0] == pytest.approx(whole, rel=1e-3)


def test_pipe_of_infinite_length_shows_its_impedance():
    # So much drag that nothing comes back from the bit: the drive sees the pipe's impedance
    # sqrt((rho J s + drag) G J) beside its own inertia.
    string = drillctl.load(DESIGN, **{f"{PIPE}.drag": "10 N*s/rad", f"{PIPE}.elements": 300}).string
    s = 2j * math.pi * 0.3
    moment = math.pi / 32 * (0.127**4 - 0.1086**4)
    impedance = np.sqrt((7850.0 * moment + 10.0 / s) * 79.6e9 * moment)
    expected = 1 / (500.0 * s + impedance)
    computed = frequency_response(string, 0.3).between("top_torque", "top_speed")[0]
    assert computed == pytest.approx(expected, rel=2e-3)


def test_default_frequencies_and_data():
    result = frequency_response(drillctl.load(DESIGN).string)
    assert result.frequency_hz[0] == pytest.approx(0.02)
    assert result.frequency_hz[-1] == pytest.approx(5.0)
    data = result.data
    assert data.frequency.attrs["units"] == "Hz"
    assert len(data) == len(INPUTS) * len(OUTPUTS)
    assert data.pipe_torque_per_top_torque.attrs["units"] == "1"
    np.testing.assert_array_equal(
        data.bit_speed_per_bit_torque, result.between("bit_torque", "bit_speed")
    )


@pytest.mark.parametrize("frequency", [[], 0.0, [1.0, -0.5], [math.nan], [math.inf], [[1.0]]])
def test_impossible_frequencies_are_refused(frequency):
    with pytest.raises(InputError, match="frequency_hz"):
        frequency_response(drillctl.load(DESIGN).string, frequency)


def test_unknown_signals_are_refused_with_the_nearest():
    result = frequency_response(drillctl.load(DESIGN).string, 1.0)
    with pytest.raises(InputError, match="did you mean 'bit_speed'"):
        result.between("top_torque", "bit_sped")
    with pytest.raises(InputError, match="no signal 'twist'"):
        result.between("twist", "bit_speed")
