"""Keys of `[weight_delay]`: gains and delays of a weight on bit that follows the bit speed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import Field, field_validator

from drillctl.errors import InputError
from drillctl.rig import table as q
from drillctl.rig.table import Table

KEY = "weight_delay"
VARIED = ("weight_on_bit.gain", "weight_on_bit.path.delay")  # what the study runs over
LAW = "weight_on_bit."  # where the paths of its law begin


class FollowingTable(Table):
    """A table with values of a weight that follows the bit speed, and with what is run over."""

    varied: ClassVar[tuple[str, ...]]  # paths of that weight which the study itself sets

    @field_validator("gains", "delays", "weights", "speeds", check_fields=False)
    @classmethod
    def _sorted(cls, result: tuple[float, ...]) -> tuple[float, ...]:
        if not result:
            raise InputError("is empty: at least one value is needed")
        return tuple(sorted(set(result)))

    @field_validator("values", mode="before", check_fields=False)
    @classmethod
    def _by_path(cls, value: object) -> object:
        """Values of `[weight_on_bit]` by dotted path."""
        if not isinstance(value, Mapping):
            return value
        values = _leaves(value)
        for path in values:
            if not path.startswith(LAW):
                raise InputError(f"{path!r} is not allowed: paths begin with {LAW!r}")
            if path in cls.varied:
                raise InputError(f"{path!r} is not allowed: it is what the study runs over")
        return values


class Settings(FollowingTable):
    """Gains and delays of a weight on bit that follows the bit speed, for `drillctl delay`.

    `gains` and `delays` are sorted. `set`: values of `[weight_on_bit]` by dotted path that replace
    those of the design, such as law, limits and hoist lag where the design's own weight is
    constant.
    """

    varied = VARIED

    gains: tuple[q.WeightGain, ...] = (0.0, 1e3, 2e3, 4e3, 6e3, 8e3)
    delays: tuple[q.TimeOrZero, ...] = (
        0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0,
    )  # fmt: skip
    values: dict[str, Any] = Field(default_factory=dict, alias="set")


def _leaves(tree: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Values by dotted path, whether the paths were quoted in the file or not."""
    results: dict[str, Any] = {}
    for key, value in tree.items():
        path = f"{prefix}{key}"
        results |= _leaves(value, f"{path}.") if isinstance(value, Mapping) else {path: value}
    return results
