"""Tables of uncertain parameters and of the draws from them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import field_validator, model_validator

from drillctl.design import quantities as q
from drillctl.design.base import Table, number_or_quantity
from drillctl.errors import InputError

_KEYS = {
    "lognormal": ("mean", "cov"),
    "normal": ("mean", "cov"),
    "uniform": ("min", "max"),
    "triangular": ("min", "max", "mode"),
}
"""Keys that go with each distribution."""
_NEEDED = {
    "lognormal": ("cov",),
    "normal": ("cov",),
    "uniform": ("min", "max"),
    "triangular": ("min", "max"),
}
"""Those of them that have no default."""


class DistributionTable(Table):
    """How an uncertain parameter is distributed; its values as they are written at its path.

    `lognormal` and `normal`: `cov`, the standard deviation over the mean, and `mean`, by default
    the design's own value. `uniform` and `triangular`: `min` and `max`; `mode` of the latter,
    by default halfway.
    """

    distribution: Literal["lognormal", "normal", "uniform", "triangular"]
    mean: float | str | None = None
    cov: q.PositiveNumber | None = None
    min: float | str | None = None
    max: float | str | None = None
    mode: float | str | None = None

    @field_validator("mean", "min", "max", "mode", mode="before")
    @classmethod
    def _number_or_quantity(cls, value: object) -> object:
        return None if value is None else number_or_quantity(value)

    @model_validator(mode="after")
    def _its_own_keys(self) -> DistributionTable:
        keys = _KEYS[self.distribution]
        for key in ("mean", "cov", "min", "max", "mode"):
            if getattr(self, key) is not None and key not in keys:
                raise InputError(f"{key} does not go with {self.distribution}, {_list(keys)} do")
        for key in _NEEDED[self.distribution]:
            if getattr(self, key) is None:
                raise InputError(f"{key} is missing, {self.distribution} takes {_list(keys)}")
        return self


def _list(keys: tuple[str, ...]) -> str:
    return f"{', '.join(keys[:-1])} and {keys[-1]}"


class UncertaintyTable(Table):
    """How many draws of the uncertain parameters, and which.

    A draw is a function of seed and number alone: more realizations begin with the same ones.
    """

    realizations: q.Count = 200
    seed: q.CountOrZero = 2012
    sampling: Literal["monte-carlo"] = "monte-carlo"


def flattened(tree: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Distributions by dotted path, whether the paths were quoted in the file or not.

    Parameters
    ----------
    tree : dict
        As TOML gives `[uncertain]`: `[uncertain."bit_rock.a1_factor"]` is a key with a dot,
        `[uncertain.bit_rock.a1_factor]` a table in a table.
    prefix : str
        Path of `tree` itself.
    """
    found: dict[str, Any] = {}
    for key, value in tree.items():
        path = f"{prefix}{key.strip(chr(34))}"
        inside = isinstance(value, Mapping) and value
        if inside and all(isinstance(v, Mapping) for v in value.values()):
            deeper = flattened(value, f"{path}.")
        else:
            deeper = {path: value}
        for leaf, table in deeper.items():
            both = isinstance(table, Mapping) and isinstance(found.get(leaf), Mapping)
            found[leaf] = {**found[leaf], **table} if both else table
    return found
