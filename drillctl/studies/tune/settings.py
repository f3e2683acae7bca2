"""Keys of `[tune]`: what is tuned, to what end, within which limits, and how it is certified."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field, field_validator, model_validator

from drillctl.design.uncertain_tables import flattened
from drillctl.errors import InputError
from drillctl.rig import table as q
from drillctl.rig.table import Table, number_or_quantity

KEY = "tune"
FRESH = 1_000_003  # from the seed of a search to that of its certificate, where none is given


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
    """What tuned gains must keep; nothing is required where nothing is given.

    Of the runs: the `quantile` of the peak top torque over the realizations, and the mean weight
    on bit. Of the linear loop, at every string: how far its slope margin stands above the slope
    of the rock (`slope_reserve`), its largest sensitivity at the top torque, the least damping
    ratio of its first modes, and a delay at the top torque that it bears.
    """

    peak_top_torque: q.TorqueLimit = None
    mean_weight_on_bit: q.PositiveWeight | None = None
    slope_reserve: q.Damping | None = None
    peak_sensitivity: q.PositiveNumber | None = None
    damping_ratio: q.PartialShare | None = None
    modes: q.Count = 1
    delay: q.Time | None = None

    @field_validator("peak_sensitivity")
    @classmethod
    def _above_one(cls, value: float | None) -> float | None:
        if value is not None and value <= 1.0:
            raise InputError(f"must be more than 1, which any loop has, got {value:g}")
        return value


class TuneCertificateTable(Table):
    """How gains are certified: runs that the search has not seen.

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
    result is certified against: P(J1 <= level) >= probability. `starts`: at how many
    gains that are apart, the best of the search's population, its last stage begins. `realizations`
    and `seed` of the search.
    """

    parameters: dict[str, RangeTable] = Field(default_factory=dict)
    objective: Literal["mean", "quantile", "cvar", "worst"] = "quantile"
    quantile: q.PartialShare = 0.95
    weights: TuneWeightsTable = TuneWeightsTable()
    constraints: TuneConstraintsTable = TuneConstraintsTable()
    level: q.PositiveNumber = 33.0
    probability: q.PartialShare = 0.95
    realizations: q.Several = 1000
    seed: q.CountOrZero = 2012
    starts: q.Count = 3
    certificate: TuneCertificateTable = TuneCertificateTable()

    @field_validator("parameters", mode="before")
    @classmethod
    def _paths(cls, value: object) -> Any:
        return flattened(value) if isinstance(value, dict) else value

    @model_validator(mode="after")
    def _fresh(self) -> TuneTable:
        if self.certificate.seed == self.seed:
            raise InputError(
                f"certificate.seed {self.seed} is that of the search, whose draws certify nothing; "
                "give another, or none"
            )
        return self

    @property
    def objective_name(self) -> str:
        """The objective with its quantile, if it has one."""
        named = self.objective in ("quantile", "cvar")
        return self.objective + (f" {self.quantile:g}" if named else "")

    @property
    def objective_said(self) -> str:
        """The objective in words."""
        share = f"{100 * self.quantile:g} %"
        return {
            "mean": "mean of J1",
            "quantile": f"{share} quantile of J1",
            "cvar": f"mean of J1 beyond its {share} quantile",
            "worst": "worst J1",
        }[self.objective]

    @property
    def fresh_seed(self) -> int:
        """Seed of the certificate's draws."""
        given = self.certificate.seed
        return self.seed + FRESH if given is None else given


Settings = TuneTable
