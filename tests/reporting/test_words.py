"""Numbers and units as people read them."""

from __future__ import annotations

import math

import pytest

from drillctl.reporting.blocks import Words
from drillctl.reporting.pages import _figures
from drillctl.store.tables import Column, between, chance, number, open_estimate, percent


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


@pytest.mark.parametrize(
    ("cells", "aligned"),
    [
        (("0.1598", "rigid body", "0"), True),  # of modes
        (("−3.02 (−3.42 to −2.59)", "+93 (+92.5 to +93.5)", "–"), True),
        (("yes", "no", "–"), False),
        (("19.4", "20.2", "lanes were stopped at the highest level"), False),
    ],
)
def test_numbers_stand_under_each_other_and_a_word_among_them(cells, aligned):
    assert _figures(tuple(("row", cell) for cell in cells), 1) == aligned
    assert not _figures(tuple((cell, "row") for cell in cells), 0)


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


@pytest.mark.parametrize(
    ("ends", "told"),
    [
        ((25.7, None), "29.3 (at least 25.7)"),  # runs that were stopped
        ((None, 31.0), "29.3 (at most 31)"),
        ((25.7, 31.0), "29.3 (25.7 to 31)"),
        ((None, None), "29.3"),
    ],
)
def test_an_interval_with_an_open_end(ends, told):
    text = Column("q95", interval=True).text(open_estimate(29.3, ends), "si")
    assert text == told
    assert _figures((("row", text),), 1)
