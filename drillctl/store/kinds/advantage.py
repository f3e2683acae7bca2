"""A constant weight against one that follows the bit speed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from drillctl.design import Design
from drillctl.ensemble.cases import Crossing, Estimate
from drillctl.store.kind import Kind
from drillctl.studies.advantage import Advantage
from drillctl.studies.advantage.cases import MEASURES, Case
from drillctl.studies.advantage.delays import DelayCurve, DelayLine
from drillctl.studies.advantage.sweeps import FIGURES, Chart, Regions

if TYPE_CHECKING:
    import xarray


def read_advantage(design: Design, data: xarray.Dataset, summary: dict[str, Any]) -> Advantage:
    """An `Advantage` as it was saved."""
    told = list(summary["cases"].values())
    return Advantage(
        design=design,
        cases=tuple(_case(one, data.isel(case=k)) for k, one in enumerate(told)),
        regions=tuple(
            _regions(name, one["gain"], design, data.isel(policy=k))
            for k, (name, one) in enumerate(summary["regions"].items())
        ),
        front=_chart("front", np.array(summary["front"]["speeds"]), data),
        chart=_chart("map", data["speed"].values, data),
        delay=DelayCurve(
            np.array(summary["delay"]["delays"]),
            summary["delay"]["constant"],
            _line("kept", data, summary["delay"]),
            _line("anew", data, summary["delay"]),
        ),
        total_seconds=summary["total_seconds"],
        provenance={key: str(value) for key, value in data.attrs.items()},
    )


def _case(told: dict[str, Any], data: xarray.Dataset) -> Case:
    return Case(
        **{key: told[key] for key in ("policy", "terms", "gains", "shift", "off", "tuned_value")},
        at_bounds=tuple(told["at_bounds"]),
        objective=_estimate(told["objective"]),
        objective_less=_estimate(told["objective_difference"]),
        measures={name: data[f"case_{name}"].values for name in MEASURES},
        status=data["case_status"].values.astype(np.int8),
        step=told["step"],
        modes=told["modes"],
    )


def _estimate(told: dict[str, Any]) -> Estimate:
    ends = told["interval_95"]
    return Estimate(told["value"], None if ends is None else (ends[0], ends[1]))


def _regions(name: str, gain: float, design: Design, data: xarray.Dataset) -> Regions:
    return Regions(
        policy=name,
        gain=gain,
        kp=data["kp"].values,
        ki=data["ki"].values,
        j1=data["region_j1"].values,
        nominal=data["region_nominal_j1"].values,
        levels=design.tables.map.levels,
        seed=design.tables.advantage.seed,
    )


def _chart(prefix: str, speeds: Any, data: xarray.Dataset) -> Chart:
    shape = (data.sizes["policy"], data.sizes["weight"], len(speeds))
    figures = {name: data[f"{prefix}_{name}"].values.reshape(shape) for name in FIGURES}
    names = tuple(str(name) for name in data["policy"].values)
    return Chart(data["weight"].values, speeds, names, figures)


def _line(prefix: str, data: xarray.Dataset, told: dict[str, Any]) -> DelayLine:
    names = ("gains", "objective", "advantage", "low", "high")
    arrays = {name: data[f"{prefix}_{name}"].values for name in names}
    zero, material = (_crossing(told[prefix][name]) for name in ("zero", "material"))
    delays = data[f"{prefix}_delay"].values
    return DelayLine(delays, **arrays, zero=zero, material=material)


def _crossing(told: dict[str, Any]) -> Crossing:
    low, high = told["interval_95"]
    return Crossing(told["delay"], (low, high), told["within"])


KINDS = (Kind("advantage", Advantage, read_advantage),)
"""What the store knows of the study."""
