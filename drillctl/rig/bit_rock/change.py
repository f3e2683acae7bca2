"""Another rock under the same law: its torques and its decay scaled."""

from __future__ import annotations

from typing import Any

from drillctl.errors import InputError
from drillctl.rig.bit_rock.jansen_van_den_steen import JansenVanDenSteen
from drillctl.rig.bit_rock.navarro_lopez_suarez import NavarroLopezSuarez
from drillctl.rig.bit_rock.over_weight import OverWeight
from drillctl.rig.bit_rock.printed_three_branch import PrintedThreeBranch
from drillctl.rig.bit_rock.stribeck import Stribeck
from drillctl.rig.bit_rock.tabulated import Tabulated
from drillctl.rig.bit_rock.tucker_wang import TuckerWang

_TORQUES = {
    NavarroLopezSuarez: (("a2",), ("a1",), ("beta",)),
    PrintedThreeBranch: (("a2",), ("a1",), ("beta",)),
    JansenVanDenSteen: (("a2",), ("a1",), ()),
    Stribeck: (("static",), ("sliding",), ("decay",)),
    OverWeight: (
        tuple(f"q{k}" for k in range(8)),
        tuple(f"p{k}" for k in range(8)),
        tuple(f"b{k}" for k in range(8)),
    ),
    Tabulated: (
        ("static",),
        ("start", "rise", "fall", *(f"c{k}" for k in range(1, 13))),
        (),
    ),
    TuckerWang: ((), ("a",), ()),
}
"""Of each law the numbers that are static torque, sliding torque and decay."""


def changed_rock(law: Any, static: float, sliding: float, decay: float) -> Any:
    """The law of another rock.

    Parameters
    ----------
    law : BitRockLaw
        Of the rock there is.
    static, sliding, decay : float
        Factors on static torque, sliding torque and decay with speed.

    Raises
    ------
    InputError
        The law has no such number, or static torque would be under the sliding one.
    """
    groups = _TORQUES[type(law)]
    for name, factor, fields in zip(
        ("static", "sliding", "decay"), (static, sliding, decay), groups, strict=True
    ):
        if factor != 1.0 and not fields:
            raise InputError(
                f"{type(law).__name__} has no {name} number of its own", f"{name}_factor"
            )
    values = {
        field: getattr(law, field) * factor
        for factor, fields in zip((static, sliding, decay), groups, strict=True)
        for field in fields
    }
    made = law._replace(**values)
    weight = 1.0
    if made.static_torque(weight) < made.kinetic_torque_at_rest(weight) or _rising(made):
        raise InputError("static torque would be less than the sliding one", "static_factor")
    return made


def _rising(law: Any) -> bool:
    if isinstance(law, (NavarroLopezSuarez, PrintedThreeBranch)):
        return bool(law.a2 < law.a1)
    return isinstance(law, Stribeck) and bool(law.static < law.sliding)
