"""Tuned gains."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from drillctl.design import Design
from drillctl.ensemble.audit import Audit
from drillctl.ensemble.draws import Failures
from drillctl.store.kind import Kind
from drillctl.store.kinds.axes import axis_of
from drillctl.store.names import stored_name
from drillctl.studies.robust.baselines import Baseline
from drillctl.studies.robust.certificate import Certificate, FreshRuns, Neighbourhood, Tolerance
from drillctl.studies.robust.search import Tuning
from drillctl.studies.robust.tune_data import drawn_name
from drillctl.studies.robust.tune_study import Tune
from drillctl.studies.robust.tuned import put, tuned_parameters

if TYPE_CHECKING:
    import xarray


def read_tune(design: Design, data: xarray.Dataset, summary: dict[str, Any]) -> Tune:
    """A `Tune` as it was saved."""
    return Tune(
        design=design,
        tuning=_tuning(design, summary),
        certificate=_certificate(design, data, summary["certificate"]),
        baselines=_baselines(data, summary),
        total_seconds=summary["total_seconds"],
        provenance={key: str(value) for key, value in data.attrs.items()},
    )


def _tuning(design: Design, summary: dict[str, Any]) -> Tuning:
    tuned = tuned_parameters(design)
    values = np.array([summary["gains"][t.path] for t in tuned])
    told = (
        "share", "violations", "realizations", "trajectories", "stages", "seconds",
        "processor_seconds",
    )  # fmt: skip
    return Tuning(
        design=put(design, tuned, values),
        tuned=tuned,
        values=values,
        value=_number(summary["value"]),
        message=summary["search_message"],
        **{name: summary[name] for name in told},
    )


def _certificate(design: Design, data: xarray.Dataset, told: dict[str, Any]) -> Certificate:
    drawn_names = {
        str(name).removeprefix(stored_name(drawn_name(""))): name
        for name in data.data_vars
        if str(name).startswith(stored_name(drawn_name("")))
    }
    numbers = data["audited"].values
    j1 = data["j1"].values
    return Certificate(
        runs=FreshRuns(j1, _number(told["value"]), told["level"]),
        required=told["required_probability"],
        seed=told["seed"],
        drawn={path.replace("%2F", "/"): data[name].values for path, name in drawn_names.items()},
        failures=tuple(Failures(**failure) for failure in told["failures"]),
        violations=told["violations"],
        margins=told["margins"] or {},
        no_margins=told["no_margins"] or "",
        audit=Audit(numbers, j1[numbers], data["audited_j1"].values),
        tolerances=tuple(
            Tolerance(
                path=path, unit=data[f"line_{k}_value"].attrs["units"],
                values=data[f"line_{k}_value"].values,
                probability=data[f"line_{k}_probability"].values, **one,
            )
            for k, (path, one) in enumerate(told["tolerance"].items())
        ),
        neighbourhood=Neighbourhood(
            tuple(axis_of(path, data) for path in told["neighbourhood"]["parameters"]),
            data["probability"].values,
            told["neighbourhood"]["realizations"],
        ),
        trajectories=told["trajectories"],
        seconds=told["seconds"],
    )  # fmt: skip


def _baselines(data: xarray.Dataset, summary: dict[str, Any]) -> tuple[Baseline, ...]:
    level = summary["certificate"]["level"]
    columns = dict(zip(data["baseline"].values.tolist(), data["baseline_j1"].values, strict=True))
    found = []
    for name, told in summary["baselines"].items():
        runs = None
        if name in columns:
            runs = FreshRuns(columns[name], _number(told["value"]), level)
        more = told.get("search", {})
        found.append(Baseline(name, told["gains"], runs, told["reason"] or "", more))
    return tuple(found)


def _number(value: float | None) -> float:
    """What stands as null in JSON was infinite."""
    return math.inf if value is None else value


def _asked_of_tune(result: Tune) -> tuple[Design, dict[str, Any]]:
    settings: dict[str, Any] = {}
    if any(one.name == "exhaustive grid" for one in result.baselines):
        settings["exhaustive"] = True
    return result.design, settings


KINDS = (Kind("tune", Tune, read_tune, _asked_of_tune),)
