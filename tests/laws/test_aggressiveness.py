"""Friction in drillers' numbers: definition, coefficients and back, typical numbers."""

from __future__ import annotations

import math

import pytest

import drillctl
from drillctl.ensemble.parameters import uncertain_parameters
from drillctl.errors import InputError
from drillctl.rig.bit_rock import NavarroLopezSuarez
from drillctl.rig.bit_rock.aggressiveness import (
    SLIDING,
    SPREAD,
    STRENGTH,
    DrillersNumbers,
    drillers_numbers,
    typical,
)

INCH, POUND = 0.0254, 4.4482216152605
PAPER = "monteiro-trindade-140kn"
PDC = {"law": "bit-aggressiveness", "bit_diameter": "8 1/2 in", "bit_type": "pdc"}


def of(**more):
    return drillctl.load(PAPER, bit_rock=PDC | more)


def test_the_definition_is_that_of_pessier_and_fear():
    torque, diameter, weight = 5000.0 * 12.0 * INCH * POUND, 8.5 * INCH, 20e3 * POUND
    theirs = 36.0 * 5000.0 / (8.5 * 20e3)
    assert theirs == pytest.approx(1.0588, abs=5e-5)
    law = DrillersNumbers(theirs, 0.4, 10.0).law(diameter)
    assert law.static_torque(weight) == pytest.approx(torque, rel=1e-12)


def test_there_and_back():
    law = NavarroLopezSuarez(0.026, 0.085, 0.098)
    numbers = drillers_numbers(law, 0.2159)
    assert numbers == pytest.approx((1.18110, 0.305882, 10.20408), rel=1e-5)
    assert numbers.law(0.2159) == pytest.approx(law, rel=1e-14)
    with pytest.raises(InputError, match="does not fall"):
        drillers_numbers(NavarroLopezSuarez(0.05, 0.05, 0.0), 0.2159)


@pytest.mark.parametrize("bit", SLIDING)
@pytest.mark.parametrize("rock", STRENGTH)
def test_typical_numbers_give_the_usual_coefficient_at_120_rpm(bit, rock):
    law = typical(bit, rock).law(3.0)  # so that torque over weight is the coefficient
    at_speed, _ = law.torque_and_slope(1.0, 4.0 * math.pi, math.exp)
    assert at_speed == pytest.approx(SLIDING[bit] * STRENGTH[rock], rel=0.015)


def test_a_design_with_a_typical_rock_says_so_and_draws_widely():
    design = of()
    assert design.bit_rock == design.tables.bit_rock.numbers.law(8.5 * INCH)
    (said,) = [one for one in design.warnings if one.key == "bit_rock.aggressiveness"]
    assert "typical of a pdc bit in medium rock, not measured" in said.text
    drawn = {one.path: one.cov for one in uncertain_parameters(design)}
    assert drawn == {f"bit_rock.{key}": cov for key, cov in SPREAD.items()}
    assert of(bit_type="roller-cone").bit_rock.a2 < 0.6 * design.bit_rock.a2


def test_a_design_with_measured_numbers_does_not():
    design = of(aggressiveness=0.9, high_speed_ratio=0.5, speed_scale="80 rpm")
    assert not [one for one in design.warnings if one.key.startswith("bit_rock")]
    drawn = {one.path: one.cov for one in uncertain_parameters(design)}
    assert drawn == {"bit_rock.aggressiveness": 0.05, "bit_rock.high_speed_ratio": 0.05}


def test_without_type_and_number_both_are_named():
    with pytest.raises(InputError, match='missing: give it, or bit_type = "pdc"'):
        drillctl.load(PAPER, bit_rock={"law": "bit-aggressiveness", "bit_diameter": "8 1/2 in"})


def test_types_are_read_in_capitals_and_a_wrong_one_is_the_only_error():
    assert of(bit_type="PDC", rock="Hard").bit_rock == of(rock="hard").bit_rock
    assert of(bit_type="Roller cone").tables.bit_rock.bit_type == "roller-cone"
    for more in ({"rock": "granite"}, {"bit_type": "tricone"}, {"rock": ["hard"]}):
        with pytest.raises(InputError) as caught:
            of(**more)
        assert "is missing" not in str(caught.value)
