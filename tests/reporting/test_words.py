"""Numbers and units as people read them."""

from __future__ import annotations

import math

import pytest

from drillctl.reporting.blocks import Words
from drillctl.store.tables import between, chance, number, percent


@pytest.mark.parametrize(
    ("value", "told"),
    [
        (19.45694, "19.46"), (0.0, "0"), (-0.5, "−0.5"), (123456.7, "123457"), (1e6, "1 × 10⁶"),
        (-4.0172e-7, "−4.017 × 10⁻⁷"), (None, "–"), (math.nan, "–"), (math.inf, "∞"),
        (0.006753, "0.006753"), (100.0, "100"), (0.00012346, "0.0001235"),
    ],
)  # fmt: skip
def test_numbers(value, told):
    assert number(value) == told


def test_shares_and_spans():
    assert percent(0.9485) == "94.8 %"
    assert between(20.0, 30.5) == "20 to 30.5"
    assert chance(0.5, (0.4, 0.6)) == "50 % (40 to 60 %)"
    assert chance(0.5, (None, 0.6)) == "50 %"


def test_quantities_in_either_system():
    assert Words("si").quantity(140e3, "N") == "140 kN"
    assert Words("field").quantity(140e3, "N") == "31.47 klbf"
    assert Words("field").quantity(3000.0, "m") == "9843 ft"
    assert Words("si").quantity(3000.0, "m") == "3000 m"
    assert Words("si").diameter(0.127) == "127 mm"
    assert Words("field").diameter(0.127) == "5 in"
    assert Words("si").quantity(40612.0, "J") == "40.61 kJ"
    assert Words("field").quantity(40612.0, "J") == "29.95 klbf ft"
    assert Words("field").quantity(290.1, "N*m*s/rad") == "0.02241 klbf ft/rpm"
    assert Words("field").quantity(2122.3, "kg*m^2") == "50363 lb ft²"
    assert Words("field").quantity(473.0, "N*m/rad") == "2.192 klbf ft/rev"
    assert Words("si").quantity(290.1, "N*m*s/rad") == "290.1 N m s"
