"""What a weight-on-bit law must offer, and what a design file and the documents know of it.

The constant weight, which is the default.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, NamedTuple, Protocol

from drillctl import registry
from drillctl.errors import InputError
from drillctl.rig import table as q
from drillctl.rig.table import Table, law_name

HEAVIEST = 1e12  # weight on bit (N) where a law has no upper limit
SHORTEST_LAG = 0.1
"""Time constant (s) of a hoist whose rate is limited, where the design gives a shorter one."""


class WeightLaw(Protocol):
    """Weight on bit; more is offered by a law that acts at once, and by one with a memory."""

    @property
    def moves(self) -> bool:
        """Whether the weight changes at once with the bit speed."""
        ...

    def _asdict(self) -> dict[str, Any]:
        """The law's numbers by name."""
        ...


class PathTable(Table):
    """From the bit speed to the weight on the bit; at once where nothing is given.

    `delay`: from the bit to the driller. `sampling_period`: between two readings. `sensor_lag`,
    `hoist_lag`: time constants of the filter downhole and of the hoist. With `rate_limit` the
    hoist follows with a lag of 0.1 s at least.
    """

    delay: q.TimeOrZero = 0.0
    sampling_period: q.SamplingPeriod = 0.0
    sensor_lag: q.Lag = 0.0
    hoist_lag: q.Lag = 0.0
    rate_limit: q.WeightRateLimit = None

    @property
    def ideal(self) -> bool:
        """Whether nothing of it acts."""
        lags = (self.delay, self.sampling_period, self.sensor_lag, self.hoist_lag)
        return self.rate_limit is None and not any(lags)

    def hoist(self) -> tuple[float, float]:
        """Lag (s) and largest rate (N/s) of the hoist."""
        if self.rate_limit is None:
            return self.hoist_lag, HEAVIEST
        return max(self.hoist_lag, SHORTEST_LAG), self.rate_limit


@dataclass(frozen=True)
class WeightOnBitLaw:
    """A weight-on-bit law as a design file names it."""

    table: type[Table]  # its keys: `law` with its name, `path`, and numbers
    # law of the table, the nominal weight (N) and the set speed (rad/s)
    make: Callable[[Any, float, float], WeightLaw]
    moves: bool = True  # whether the weight changes while the bit drills
    # for docs/laws.md: each `NamedTuple` it makes, how a design requests it, when it is of use
    forms: tuple[tuple[type, str, str], ...] = ()

    @property
    def name(self) -> str:
        """`law` in a design file."""
        return law_name(self.table)


@cache
def weight_laws() -> dict[str, WeightOnBitLaw]:
    """All weight-on-bit laws by name."""
    return {law.name: law for law in registry.gathered(registry.WEIGHT_LAWS, "LAWS")}


def refuse_outside(nominal: float, least: float, most: float) -> None:
    """Refuse (`InputError`) a nominal weight outside of the limits of its law (N)."""
    if not least <= nominal <= most:
        raise InputError(
            f"{nominal / 1e3:g} kN lies outside the limits of the weight-on-bit law, "
            f"{least / 1e3:g} to {most / 1e3:g} kN",
            "operating_point.weight_on_bit",
        )


class ConstantWeight(NamedTuple):
    """Weight on bit held at its operating value.

    Attributes
    ----------
    level : float
        Weight on bit (N).
    """

    level: Any

    @property
    def moves(self) -> bool:
        """Whether the weight changes with the bit speed."""
        return False

    def weight(self, speed: Any) -> Any:
        """Weight on bit (N); the same at any bit speed `speed` (rad/s)."""
        return self.level

    def slope(self, speed: Any) -> Any:
        """Weight per bit speed (N s/rad): none."""
        return 0.0 * speed


class ConstantWeightTable(Table):
    """Weight on bit held at the operating point's value; its path waits for another law."""

    law: Literal["constant"] = "constant"
    path: PathTable = PathTable()


LAWS = (
    WeightOnBitLaw(
        ConstantWeightTable,
        lambda table, nominal, speed: ConstantWeight(nominal),
        moves=False,
        forms=((ConstantWeight, '`law = "constant"`', "The default."),),
    ),
)
