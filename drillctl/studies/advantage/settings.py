"""Keys of `[advantage]`: PI against PI with a weight on bit that follows the bit speed."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from drillctl.rig import table as q
from drillctl.studies.delay.settings import LAW, FollowingTable
from drillctl.units import RPM

KEY = "advantage"
GAIN = LAW + "gain"
REAL_PATH = {f"{LAW}path.delay": "0.2 s", f"{LAW}path.hoist_lag": "0.5 s"}
"""Way of the weight where a design gives none: wired pipe, and a hoist."""


class Settings(FollowingTable):
    """PI against PI with a weight on bit that follows the bit speed, for `drillctl advantage`.

    Both are tuned to the objective of `[tune]`, the gains of the drive within the bounds that
    stand there, the gain of the weight up to `largest_gain`. `set`: values of `[weight_on_bit]`
    by dotted path for the law that follows, such as limits, delay and hoist lag; a delay of 0.2 s
    and a hoist lag of 0.5 s where no path is given at all. `realizations` and `seed`: fresh
    draws, which all gains are compared at. `weights` and `speeds`: of front and map;
    `delays`: of the way from the bit. Front and map are tuned at `sweep_realizations`, table
    and delays at `tune.realizations`. `region_points` along each axis of the regions over both
    gains of the drive, at `region_realizations`. `material`: share of the constant weight's
    objective under which an advantage counts as none.
    """

    varied = (GAIN,)

    largest_gain: q.WeightGain = 10e3
    values: dict[str, Any] = Field(default_factory=dict, alias="set")
    realizations: q.Several = 1000
    seed: q.CountOrZero = 7
    weights: tuple[q.PositiveWeight, ...] = tuple(1e3 * kn for kn in range(100, 161, 10))
    speeds: tuple[q.PositiveSpeed, ...] = tuple(RPM * rpm for rpm in range(80, 141, 10))
    delays: tuple[q.TimeOrZero, ...] = (
        0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0,
    )  # fmt: skip
    sweep_realizations: q.Several = 200
    region_points: q.Several = 21
    region_realizations: q.Several = 200
    material: q.PartialShare = 0.01
