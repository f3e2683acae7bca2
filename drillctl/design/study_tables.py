"""Tables of studies that are not yet beside what they are of."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import Field, field_validator, model_validator

from drillctl.design.uncertain_tables import flattened
from drillctl.errors import InputError
from drillctl.rig import table as q
from drillctl.rig.table import Table, number_or_quantity
from drillctl.units import RPM

# Cases that are compared.


class CaseTable(Table):
    """A case: its name, and values by dotted path that replace those of the design."""

    name: str
    values: dict[str, Any] = Field(default_factory=dict, alias="set")

    @field_validator("name")
    @classmethod
    def _not_empty(cls, name: str) -> str:
        if not name.strip() or not name.isprintable():
            raise InputError(f"{name!r} is not allowed: a case needs a name to be told apart by")
        return name


class CompareTable(Table):
    """What is compared: the first case is the baseline; without cases, the design alone.

    `equal_mean_weight` shifts the nominal weight of a case whose weight on bit moves until its
    mean over the draws, after the start, is that of a constant weight. `maps` asks for the map of
    every case over the axes of `[map]`, at its own values.
    """

    cases: tuple[CaseTable, ...] = ()
    equal_mean_weight: bool = False
    maps: bool = True

    @field_validator("cases")
    @classmethod
    def _named_once(cls, cases: tuple[CaseTable, ...]) -> tuple[CaseTable, ...]:
        names = [case.name for case in cases]
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"two cases are called {name!r}; names must differ")
        return cases


# A weight on bit that follows the bit speed, late.

VARIED = ("weight_on_bit.gain", "weight_on_bit.path.delay")
"""What the study runs over."""
LAW = "weight_on_bit."
"""Where the paths of its law begin."""


class WeightDelayTable(Table):
    """Gains and delays of a weight on bit that follows the bit speed, for `drillctl delay`.

    `gains` and `delays` are sorted. `set`: values of `[weight_on_bit]` by dotted path that replace
    those of the design, such as law, limits and hoist lag where the design's own weight is
    constant.
    """

    gains: tuple[q.WeightGain, ...] = (0.0, 1e3, 2e3, 4e3, 6e3, 8e3)
    delays: tuple[q.TimeOrZero, ...] = (
        0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0,
    )  # fmt: skip
    values: dict[str, Any] = Field(default_factory=dict, alias="set")

    @field_validator("gains", "delays")
    @classmethod
    def _sorted(cls, found: tuple[float, ...]) -> tuple[float, ...]:
        if not found:
            raise InputError("is empty: at least one value is needed")
        return tuple(sorted(set(found)))

    @field_validator("values", mode="before")
    @classmethod
    def _by_path(cls, value: object) -> object:
        return paths_of_weight(value, VARIED)


def paths_of_weight(value: object, varied: tuple[str, ...]) -> object:
    """Values of `[weight_on_bit]` by dotted path."""
    if not isinstance(value, Mapping):
        return value
    values = _leaves(value)
    for path in values:
        if not path.startswith(LAW):
            raise InputError(f"{path!r} is not allowed: paths begin with {LAW!r}")
        if path in varied:
            raise InputError(f"{path!r} is not allowed: it is what the study runs over")
    return values


def _leaves(tree: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Values by dotted path, whether the paths were quoted in the file or not."""
    found: dict[str, Any] = {}
    for key, value in tree.items():
        path = f"{prefix}{key}"
        found |= _leaves(value, f"{path}.") if isinstance(value, Mapping) else {path: value}
    return found


# PI against PI with such a weight.

GAIN = LAW + "gain"
REAL_PATH = {f"{LAW}path.delay": "0.2 s", f"{LAW}path.hoist_lag": "0.5 s"}
"""Way of the weight where a design says nothing of one: wired pipe, and a hoist."""


class AdvantageTable(Table):
    """PI against PI with a weight on bit that follows the bit speed, for `drillctl advantage`.

    Both are tuned to the objective of `[tune]`, the gains of the drive within the bounds that
    stand there, the gain of the weight up to `largest_gain`. `set`: values of `[weight_on_bit]`
    by dotted path for the law that follows, such as limits, delay and hoist lag; a delay of 0.2 s
    and a hoist lag of 0.5 s where no path is given at all. `realizations` and `seed`: fresh
    draws, which everything found is measured at. `weights` and `speeds`: of front and map;
    `delays`: of the way from the bit. Front and map are tuned at `sweep_realizations`, table
    and delays at `tune.realizations`. `region_points` along each axis of the regions over both
    gains of the drive, at `region_realizations`. `material`: share of the constant weight's
    objective under which an advantage is called none.
    """

    largest_gain: q.WeightGain = 10e3
    values: dict[str, Any] = Field(default_factory=dict, alias="set")
    realizations: q.Count = 1000
    seed: q.CountOrZero = 7
    weights: tuple[q.PositiveWeight, ...] = tuple(1e3 * kn for kn in range(100, 161, 10))
    speeds: tuple[q.PositiveSpeed, ...] = tuple(RPM * rpm for rpm in range(80, 141, 10))
    delays: tuple[q.TimeOrZero, ...] = (
        0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0,
    )  # fmt: skip
    sweep_realizations: q.Count = 200
    region_points: q.Count = 21
    region_realizations: q.Count = 200
    material: q.PositiveNumber = 0.01

    @field_validator("weights", "speeds", "delays")
    @classmethod
    def _sorted(cls, found: tuple[float, ...]) -> tuple[float, ...]:
        if not found:
            raise InputError("is empty: at least one value is needed")
        return tuple(sorted(set(found)))

    @field_validator("values", mode="before")
    @classmethod
    def _by_path(cls, value: object) -> object:
        return paths_of_weight(value, (GAIN,))

    @model_validator(mode="after")
    def _enough(self) -> AdvantageTable:
        for key in ("realizations", "sweep_realizations", "region_realizations"):
            if getattr(self, key) < 2:
                raise InputError(f"{key} must be 2 or more")
        if self.region_points < 2:
            raise InputError("region_points must be 2 or more")
        if not self.material < 1.0:
            raise InputError(f"material must be less than 1, got {self.material:g}")
        return self


# Robust gains.

FRESH = 1_000_003
"""From the seed of a search to that of its certificate, where none is given."""


def _inside(value: float) -> float:
    if not 0.0 < value < 1.0:
        raise InputError(f"must be more than 0 and less than 1, got {value:g}")
    return value


class RangeTable(Table):
    """Least and largest value of a tuned parameter, as they would be written at its path."""

    min: float | str
    max: float | str

    @field_validator("min", "max", mode="before")
    @classmethod
    def _number_or_quantity(cls, value: object) -> object:
        return number_or_quantity(value)


class TuneWeightsTable(Table):
    """What other measures add to the objective, in seconds of J1.

    `effort`: per root mean square deviation of the top torque from its steady value, over the
    static torque of the bit. `peak_top_torque`: per peak, over the same. `lost_weight`: per share
    of the nominal weight on bit that the mean weight falls short of it.
    """

    effort: q.NonNegativeNumber = 0.0
    peak_top_torque: q.NonNegativeNumber = 0.0
    lost_weight: q.NonNegativeNumber = 0.0


class TuneConstraintsTable(Table):
    """What tuned gains must keep; nothing is asked where nothing is given.

    Of the runs: the `quantile` of the peak top torque over the realizations, and the mean weight
    on bit. Of the linear loop, at every string: how far its slope margin stands above the slope
    of the rock (`slope_reserve`), its largest sensitivity at the top torque, the least damping
    ratio of its first modes, and a delay at the top torque that it bears.
    """

    peak_top_torque: q.Torque | None = None
    mean_weight_on_bit: q.Weight | None = None
    slope_reserve: q.Damping | None = None
    peak_sensitivity: q.PositiveNumber | None = None
    damping_ratio: q.PositiveNumber | None = None
    modes: q.Count = 1
    delay: q.Time | None = None

    @field_validator("peak_sensitivity")
    @classmethod
    def _above_one(cls, value: float | None) -> float | None:
        if value is not None and value <= 1.0:
            raise InputError(f"must be more than 1, which any loop has, got {value:g}")
        return value

    @field_validator("damping_ratio")
    @classmethod
    def _under_one(cls, value: float | None) -> float | None:
        return None if value is None else _inside(value)


class TuneCertificateTable(Table):
    """How found gains are certified: runs that the search has not seen.

    `realizations` fresh draws, always independent ones (`monte-carlo`), at the accuracy of the
    design; `seed` of them, by default that of the search and 1000003, never that of the search;
    `audit`: how many of them the reference solver runs again.
    """

    realizations: q.Count = 2000
    seed: q.CountOrZero | None = None
    audit: q.CountOrZero = 8


class TuneTable(Table):
    """What is tuned, to what end.

    `parameters` names the paths and their bounds; by default those of the controller's law. The
    objective is J1 over the realizations: its `mean`, its `quantile`, the mean of what lies
    beyond that quantile (`cvar`), or the `worst` of all. `level` and `probability` are what the
    result is certified against: P(J1 <= level) >= probability. `starts`: how many of the best
    gains of the first look are followed further. `realizations` and `seed` of the search.
    """

    parameters: dict[str, RangeTable] = Field(default_factory=dict)
    objective: Literal["mean", "quantile", "cvar", "worst"] = "quantile"
    quantile: q.PositiveNumber = 0.95
    weights: TuneWeightsTable = TuneWeightsTable()
    constraints: TuneConstraintsTable = TuneConstraintsTable()
    level: q.PositiveNumber = 33.0
    probability: q.PositiveNumber = 0.95
    realizations: q.Count = 1000
    seed: q.CountOrZero = 2012
    starts: q.Count = 3
    certificate: TuneCertificateTable = TuneCertificateTable()

    @field_validator("parameters", mode="before")
    @classmethod
    def _paths(cls, value: object) -> Any:
        return flattened(value) if isinstance(value, dict) else value

    @field_validator("quantile", "probability")
    @classmethod
    def _inside(cls, value: float) -> float:
        return _inside(value)

    @model_validator(mode="after")
    def _enough(self) -> TuneTable:
        if self.realizations < 2:
            raise InputError("realizations must be 2 or more")
        if self.certificate.seed == self.seed:
            raise InputError(
                f"certificate.seed {self.seed} is that of the search, whose draws certify nothing; "
                "give another, or none"
            )
        return self

    @property
    def fresh_seed(self) -> int:
        """Seed of the certificate's draws."""
        given = self.certificate.seed
        return self.seed + FRESH if given is None else given
