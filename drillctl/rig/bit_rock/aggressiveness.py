"""Dry friction in drillers' numbers: bit size, aggressiveness, and its fall with speed.

They follow from the law of Navarro-Lopez & Suarez and back: a2 = mu D / 3, a1 = a2 times the
ratio, beta = 1 / speed scale.
"""

from __future__ import annotations

import math
from typing import Any, Literal, NamedTuple

from pydantic import model_validator

from drillctl import units
from drillctl.errors import InputError
from drillctl.rig import table as q
from drillctl.rig.bit_rock.law import Form, FrictionLaw, RockTable
from drillctl.rig.bit_rock.navarro_lopez_suarez import NavarroLopezSuarez
from drillctl.rig.bit_rock.stribeck import Stribeck

SLIDING = {"pdc": 0.50, "hybrid": 0.375, "roller-cone": 0.25}
"""Typical coefficient of a turning bit: of PDC and roller-cone bits as usual in calculations of
mechanical specific energy (after Pessier & Fear 1992), of hybrids halfway between (they lie
between the two: Pessier & Damschen 2011)."""
STRENGTH = {"soft": 1.2, "medium": 1.0, "hard": 0.8}
"""A bit bites less into stronger rock (Pessier & Fear 1992); how much less is a guess of ours."""
TURNING = units.parse("120 rpm", units.SPEED)  # speed (rad/s) at which such coefficients are quoted
RATIO = 0.45
"""Torque at high speed over that at zero speed: 0.28 to 0.65 in Table 1 of Monteiro & Trindade."""
SCALE = units.parse("100 rpm", units.SPEED)  # rad/s; 97 to 116 rpm in the same table
EXAMPLE_BIT = units.parse("8 1/2 in", units.LENGTH)  # where a design gives no size of its bit (m)
SPREAD = {"aggressiveness": 0.25, "high_speed_ratio": 0.2, "speed_scale": 0.15}
"""Standard deviation over mean of each typical number: of that size are the differences above."""


class DrillersNumbers(NamedTuple):
    r"""The law of Navarro-Lopez & Suarez in drillers' numbers, for a bit of diameter D.

    .. math:: a_2 = \mu D / 3, \qquad a_1 = r\, a_2, \qquad \beta = 1 / \omega_c

    mu is 3 T / (W D) at zero speed, which is 36 T / (D W) of Pessier & Fear (SPE 24584, 1992) with
    T in ft lbf, D in inches and W in lbf. *Typical, not measured* are the numbers that `bit_type`
    and `rock` (its strength) stand for: mu such that at 120 rpm the bit has the sliding
    coefficient that is usual in calculations of mechanical specific energy, 0.5 for PDC and 0.25
    for roller-cone bits, 0.375 for hybrids, which lie between them (Pessier & Damschen, SPE
    128741), times 1.2 in soft and 0.8 in hard rock (harder rock is bitten less: Pessier & Fear;
    how much less is a guess); r = 0.45 and a scale of 100 rpm from Table 1 of Monteiro & Trindade
    (0.28 to 0.65, 97 to 116 rpm). The sources are cited as is common in the field; the two papers
    of the SPE were not at hand. Draws spread by 25, 20 and 15 %, and every result says that the
    rock was not measured.

    Attributes
    ----------
    aggressiveness : float
        mu at zero speed.
    high_speed_ratio : float
        Torque at high speed over torque at zero speed, r.
    speed_scale : float
        Speed over which the difference falls to 37 % (rad/s).
    """

    aggressiveness: float
    high_speed_ratio: float
    speed_scale: float

    def law(self, bit_diameter: float) -> NavarroLopezSuarez:
        """Coefficients of a bit of a diameter (m)."""
        a2 = self.aggressiveness * bit_diameter / 3.0
        return NavarroLopezSuarez(a2 * self.high_speed_ratio, a2, 1.0 / self.speed_scale)


def drillers_numbers(law: NavarroLopezSuarez, bit_diameter: float) -> DrillersNumbers:
    """The numbers of a bit of a diameter (m) that has these coefficients."""
    if not (law.a2 > 0.0 and law.beta > 0.0):
        raise InputError("torque that does not fall with speed has no speed scale", "bit_rock")
    return DrillersNumbers(3.0 * law.a2 / bit_diameter, law.a1 / law.a2, 1.0 / law.beta)


def typical(bit_type: str, rock: str) -> DrillersNumbers:
    """Typical numbers, not measured ones: the sliding coefficient led back to zero speed."""
    fallen = RATIO + (1.0 - RATIO) * math.exp(-TURNING / SCALE)
    return DrillersNumbers(round(SLIDING[bit_type] * STRENGTH[rock] / fallen, 2), RATIO, SCALE)


class BitAggressivenessTable(RockTable):
    """Friction in drillers' numbers: a2 = mu D / 3, a1 = a2 ratio, beta = 1 / speed scale.

    `aggressiveness` mu = 3 T / (W D) at zero speed: 36 T / (D W) of Pessier & Fear (1992) with T in
    ft lbf, D in inches, W in lbf. `high_speed_ratio`: torque at high speed over that at zero speed;
    `speed_scale`: speed over which the difference falls to 37 %. What is not given is typical of
    `bit_type` in `rock` (by its strength), not measured.
    """

    law: Literal["bit-aggressiveness"]
    bit_diameter: q.Diameter
    bit_type: Literal["pdc", "hybrid", "roller-cone"] | None = None
    rock: Literal["soft", "medium", "hard"] = "medium"
    aggressiveness: q.PositiveNumber
    high_speed_ratio: q.Share = RATIO
    speed_scale: q.PositiveSpeed = SCALE
    regularised_over: q.PositiveSpeed | None = None

    @model_validator(mode="before")
    @classmethod
    def _typical_of_its_type(cls, data: Any) -> Any:
        if not isinstance(data, dict):
            return data
        words = {key: data[key] for key in ("bit_type", "rock") if isinstance(data.get(key), str)}
        data = {**data, **{key: "-".join(word.lower().split()) for key, word in words.items()}}
        if data.get("aggressiveness") is not None or "bit_type" not in words:
            return data
        bit, rock = data["bit_type"], data.get("rock", "medium")
        # What is wrong with them is the one error.
        known = bit in SLIDING and isinstance(rock, str) and rock in STRENGTH
        return {**data, "aggressiveness": typical(bit, rock).aggressiveness if known else 1.0}

    @model_validator(mode="before")
    @classmethod
    def _given_or_typical(cls, data: Any) -> Any:
        if isinstance(data, dict) and not {"aggressiveness", "bit_type"} & set(data):
            raise InputError('aggressiveness is missing: give it, or bit_type = "pdc" for one')
        return data

    @property
    def typical(self) -> bool:
        """Whether nothing of it was measured."""
        return self.bit_type is not None and self.numbers == typical(self.bit_type, self.rock)

    @property
    def numbers(self) -> DrillersNumbers:
        """Those that make the law."""
        return DrillersNumbers(self.aggressiveness, self.high_speed_ratio, self.speed_scale)


def _law(table: BitAggressivenessTable, weight: float, moves: bool) -> NavarroLopezSuarez:
    return table.numbers.law(table.bit_diameter)


def _regularised(law: Any, table: Any) -> Stribeck:
    return Stribeck(law.a2, law.a1, law.beta, 1.0 / table.regularised_over)


def _remark(table: BitAggressivenessTable) -> str:
    return (
        f"the rock is typical of a {table.bit_type} bit in {table.rock} rock, not measured "
        f"(aggressiveness {table.aggressiveness:g})"
    )


LAWS = (
    FrictionLaw(
        BitAggressivenessTable,
        _law,
        draws=("aggressiveness", "high_speed_ratio"),
        spread=lambda table: SPREAD if table.typical else {},
        remark=lambda table: _remark(table) if table.typical else "",
        forms=(
            Form(
                DrillersNumbers,
                keys='`law = "bit-aggressiveness"` (bit_diameter, aggressiveness, '
                "high_speed_ratio, speed_scale; or bit_diameter, bit_type, rock)",
                use="Where the torque of a bit is known, or nothing but its type.",
                curves=(
                    (
                        "typical PDC bit of 8 1/2 in in medium rock",
                        typical("pdc", "medium").law(EXAMPLE_BIT),
                    ),
                ),
            ),
        ),
        regularised=_regularised,
    ),
)
