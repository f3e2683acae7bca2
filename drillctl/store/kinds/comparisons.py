"""Comparisons of cases, and of a weight law over its delay."""

from __future__ import annotations

import json
import tomllib
from typing import TYPE_CHECKING, Any

import numpy as np

from drillctl.design import Design, to_toml
from drillctl.design.validation import validated
from drillctl.ensemble.audit import Audit
from drillctl.ensemble.cases import Runs
from drillctl.ensemble.draws import Failures
from drillctl.ensemble.sweeps import Sweep
from drillctl.errors import InputError
from drillctl.simulation.measures import BATCH_MEASURES, Measures
from drillctl.simulation.trajectory import SIGNALS, Simulation
from drillctl.store.kind import Kind
from drillctl.store.kinds.axes import axis_of
from drillctl.store.names import stored_name
from drillctl.studies.compare.cases import Nominal, case_designs, map_dimension, shifted_design
from drillctl.studies.compare.compute import MEASURES, ComparedCase, Comparison
from drillctl.studies.delay.compute import WeightDelay
from drillctl.studies.delay.lanes import MEASURES as DELAY_MEASURES

if TYPE_CHECKING:
    import xarray


def read_weight_delay(design: Design, data: xarray.Dataset, summary: dict[str, Any]) -> WeightDelay:
    """A `WeightDelay` as it was saved."""

    def runs(prefix: str) -> Runs:
        measures = {name: data[f"{prefix}{name}"].values for name in DELAY_MEASURES}
        status = data[f"{prefix}status"].values.astype(np.int8)
        return Runs(measures, status, summary["step"], summary["modes"])

    return WeightDelay(
        design=design,
        drawn={path: data[stored_name(path)].values for path in summary["uncertain"]},
        runs=runs(""),
        constant=runs("constant_"),
        failures=tuple(Failures(**failure) for failure in summary["failures"]),
        total_seconds=summary["total_seconds"],
        provenance={key: str(value) for key, value in data.attrs.items()},
    )


def read_comparison(design: Design, data: xarray.Dataset, summary: dict[str, Any]) -> Comparison:
    """A `Comparison` as it was saved."""
    texts = json.loads(data.attrs["case_designs"])
    told = ("realizations", "seed", "weight_from", "equal_mean_weight", "total_seconds")
    return Comparison(
        design=design,
        cases=tuple(
            _case(name, _resolved(text, design), data.isel(case=number), summary)
            for number, (name, text) in enumerate(zip(summary["cases"], texts, strict=True))
        ),
        levels=design.tables.map.levels,
        **{name: summary[name] for name in told},
        provenance=_provenance(data),
    )


def _case(name: str, design: Design, data: xarray.Dataset, summary: dict[str, Any]) -> ComparedCase:
    told = summary["cases"][name]
    return ComparedCase(
        name=name,
        design=design,
        drawn={path: data[stored_name(path)].values for path in summary["uncertain"]},
        measures={measure: data[measure].values for measure in MEASURES},
        status=data["status"].values.astype(np.int8),
        failures=tuple(Failures(**failure) for failure in told["failures"]),
        weight_shift=told["weight_shift"],
        step=told["step"],
        modes=told["modes"],
        nominal=_nominal(shifted_design(design, told["weight_shift"]), data, summary, told),
    )


def _nominal(
    design: Design, data: xarray.Dataset, summary: dict[str, Any], told: dict[str, Any]
) -> Nominal:
    """Map and response of one case, from the dataset of that case."""
    found = told["nominal"]
    kept = ~np.isnan(data["response_time"].values)  # the rest is padding
    response = Simulation(
        design=design,
        time=data["response_time"].values[kept],
        signals={name: data[f"response_{name}"].values[kept] for name in SIGNALS},
        events=(),
        measures=Measures(**found["measures"]),
        status=found["status"],
        engine=found["engine"],
        step=found["step"],
        modes=found["modes"],
        energy=None,
    )
    made = found["map"] and _case_map(design, data, found["map"], summary["uncertain"])
    return Nominal(made, found["no_map"], response)


def _case_map(
    design: Design, data: xarray.Dataset, told: dict[str, Any], drawn: list[str]
) -> Sweep:
    none = np.empty(0, dtype=np.int64)
    return Sweep(
        design=design,
        axes=tuple(axis_of(path, data, map_dimension(path, drawn)) for path in told["axes"]),
        levels=design.tables.map.levels,
        measures={name: data[f"map_{name}"].values for name in BATCH_MEASURES},
        status=data["map_status"].values.astype(np.int8),
        audit=Audit(none, np.empty(0), np.empty(0)),
        **{name: told[name] for name in ("step", "modes", "seconds", "total_seconds")},
        provenance=_provenance(data),
    )


def _provenance(data: xarray.Dataset) -> dict[str, str]:
    """Of a comparison: its attributes but for the designs of its cases."""
    return {key: str(value) for key, value in data.attrs.items() if key != "case_designs"}


def _resolved(text: str, like: Design) -> Design:
    """A design from the text of a resolved one, named like another."""
    tree = tomllib.loads(text)
    return Design(like.name, validated(tree, like.origin), tree, like.origin)


def _asked_of_comparison(result: Comparison) -> tuple[Design, dict[str, Any]]:
    cases = {case.name: case.design for case in result.cases}
    if list(cases.items()) == _own_cases(result.design):
        return result.design, {}
    return result.design, {"cases": {name: to_toml(case) for name, case in cases.items()}}


def _own_cases(design: Design) -> list[Any] | None:
    try:
        return list(case_designs(design).items())
    except InputError:  # cases given one by one need not be those of their first
        return None


KINDS = (
    Kind("compare", Comparison, read_comparison, _asked_of_comparison),
    Kind("delay", WeightDelay, read_weight_delay),
)
