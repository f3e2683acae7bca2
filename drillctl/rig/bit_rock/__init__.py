"""Bit-rock laws: torque on the bit as a function of its speed and of the weight on it.

A law is a `NamedTuple` of numbers (in the batch engine: of one array per number) with two
pure functions. They are written once, free of branches on data, and used three times: the
reference solver calls them with floats, numba compiles them into the kernels, and CasADi
calls them with symbols; hence the exponential comes in as an argument.

- `static_torque(weight)`: largest torque (N m) of a bit at rest.
- `kinetic_torque_at_rest(weight)`: torque (N m) of a bit that turns ever slower.
- `steepest_fall(weight)`: largest falling slope (N m s/rad), which limits the batch step.
- `torque_and_slope(weight, speed, exp)`: torque (N m) of a bit turning at `speed` (rad/s, not
  negative) and its derivative (N m s/rad). For a bit turning backwards the torque changes
  sign. A set-valued law takes, at zero speed, any value between minus and plus the static
  torque.
- `set_valued`: whether it is one. The smooth laws of the literature are not: a bit creeps under
  them where it should stand still. They are here to be compared. The printed law of
  Monteiro & Trindade is another stand-in, which the reference solver alone can run.

Each law has a file, which `drillctl.registry` names: its equation, its keys in a design, how it is
made from them, and its `LAWS` entry with what studies and documents know of it.
"""

from __future__ import annotations

from drillctl.rig.bit_rock.jansen_van_den_steen import JansenVanDenSteen
from drillctl.rig.bit_rock.law import BitRockLaw, changed_rock, contact
from drillctl.rig.bit_rock.navarro_lopez_suarez import (
    NavarroLopezSuarez,
    OverWeight,
    WeightTable,
    over_weight,
)
from drillctl.rig.bit_rock.printed_three_branch import PrintedThreeBranch
from drillctl.rig.bit_rock.stribeck import Stribeck
from drillctl.rig.bit_rock.tabulated import Tabulated, tabulated
from drillctl.rig.bit_rock.tucker_wang import TuckerWang

__all__ = [
    "BitRockLaw",
    "JansenVanDenSteen",
    "NavarroLopezSuarez",
    "OverWeight",
    "PrintedThreeBranch",
    "Stribeck",
    "Tabulated",
    "TuckerWang",
    "WeightTable",
    "changed_rock",
    "contact",
    "over_weight",
    "tabulated",
]
