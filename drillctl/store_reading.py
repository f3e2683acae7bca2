"""Results back from their dataset and summary, one function a verb."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Callable
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np

from drillctl.design import Design
from drillctl.design.validation import validated
from drillctl.linear.loop_analysis import LoopAnalysis
from drillctl.linear.loop_margins import Margins
from drillctl.linear.modal import Mode, Modes
from drillctl.linear.operating_point import OperatingPoint
from drillctl.simulation.batch import FLOATS
from drillctl.simulation.limit_cycle import HarmonicCycle, LimitCycle, Orbit
from drillctl.simulation.limit_cycle.returns import Returns
from drillctl.simulation.measures import Measures
from drillctl.simulation.reference import EnergyAudit
from drillctl.simulation.trajectory import SIGNALS, Simulation
from drillctl.studies.adaptive import AdaptiveMap, banded
from drillctl.studies.adaptive_checks import SelfCheck, full_audit
from drillctl.studies.audit import Audit
from drillctl.studies.comparison import MEASURES, ComparedCase, Comparison
from drillctl.studies.delayed_lanes import MEASURES as DELAY_MEASURES
from drillctl.studies.delayed_lanes import Runs
from drillctl.studies.diagnosis import Doctor
from drillctl.studies.drawn_lanes import Failures
from drillctl.studies.error_estimate import ErrorEstimate
from drillctl.studies.grid import Axis
from drillctl.studies.loop_maps import QUANTITIES, LoopMap
from drillctl.studies.nominal import Nominal, map_dimension, nominal_design
from drillctl.studies.regularisation import Regularisation
from drillctl.studies.sweeps import Sweep
from drillctl.studies.three_regions import FIELDS, MASKS, ThreeRegions
from drillctl.studies.uncertainty import Uncertainty
from drillctl.studies.uncertainty.sensitivity import read_sensitivity
from drillctl.studies.uncertainty.stopping import Look
from drillctl.studies.weight_delay import WeightDelay

if TYPE_CHECKING:
    import xarray


def stored_name(name: str) -> str:
    """Name of a variable on disk: zarr takes a slash, as a section's name may hold, for a group."""
    return name.replace("/", "%2F")


def _axis(path: str, values: xarray.DataArray) -> Axis:
    return Axis(path, values.attrs.get("units", ""), values.values)


def read_sweep(design: Design, data: xarray.Dataset, summary: dict[str, Any]) -> Sweep:
    """A `Sweep` as it was saved."""
    axes = tuple(_axis(path, data[stored_name(path)]) for path in summary["axes"])
    cells = data["audited_cell"].values.astype(np.int64)
    j1 = data["j1"].values
    return Sweep(
        design=design,
        axes=axes,
        levels=design.tables.map.levels,
        measures={name: data[name].values for name in FLOATS if name in data},
        status=data["status"].values.astype(np.int8),
        audit=Audit(cells, j1.ravel()[cells], data["audited_j1"].values),
        step=summary["step"],
        modes=summary["modes"],
        seconds=summary["seconds"],
        total_seconds=summary["total_seconds"],
        provenance={key: str(value) for key, value in data.attrs.items()},
    )


def read_adaptive_map(design: Design, data: xarray.Dataset, summary: dict[str, Any]) -> AdaptiveMap:
    """An `AdaptiveMap` as it was saved."""
    axes = tuple(_axis(path, data[stored_name(path)]) for path in summary["axes"])
    cells, j1 = data["cell"].values.astype(np.int64), data["j1"].values
    audited = data["audited_cell"].values.astype(np.int64)
    over_grid = np.full(len(axes[0]) * len(axes[1]), np.nan)
    over_grid[cells] = j1
    bands, levels = data["band"].values.astype(np.int8), design.tables.map.levels
    check = SelfCheck(
        data["checked_cell"].values.astype(np.int64),
        data["said_band"].values.astype(np.int8),
        data["found_band"].values.astype(np.int8),
        summary["self_check"]["followed"],
    )
    full = None
    if summary["full_audit"] is not None:
        values = banded(bands, levels, cells, j1)
        count = summary["full_audit"]["trajectories"]
        full = full_audit(values, data["full_j1"].values, levels, count)
    return AdaptiveMap(
        design=design,
        axes=axes,
        levels=levels,
        cells=cells,
        measures={name: data[name].values for name in FLOATS},
        status=data["status"].values.astype(np.int8),
        bands=bands,
        audit=Audit(audited, over_grid[audited], data["audited_j1"].values),
        self_check=check,
        full_audit=full,
        **{n: summary[n] for n in ("intervals", "step", "modes", "seconds", "total_seconds")},
        provenance={key: str(value) for key, value in data.attrs.items()},
    )


def read_doctor(design: Design, data: xarray.Dataset, summary: dict[str, Any]) -> Doctor:
    """A `Doctor` as it was saved."""
    cells, audited = data["cell"].values, data["audited_cell"].values
    estimate = ErrorEstimate(data["j1"].values)
    batch = estimate.j1[0][np.searchsorted(cells, audited)]
    told = ("speed", "refused", "advice", "total_seconds")
    scheme = summary["scheme"]
    return Doctor(
        design=design,
        axes=tuple(
            Axis(path, data[stored_name(path)].attrs["units"], np.linspace(*ends.values()))
            for path, ends in summary["axes"].items()
        ),
        cells=cells.astype(np.int64),
        estimate=estimate,
        status=data["status"].values.astype(np.int8),
        scheme=scheme and {key: value for key, value in scheme.items() if key != "strings"},
        strings=scheme["strings"] if scheme else 0,
        audit=Audit(audited.astype(np.int64), batch, data["audited_j1"].values),
        asked=summary["audit"]["asked"],
        **{name: summary[name] for name in told},
        provenance={key: str(value) for key, value in data.attrs.items()},
    )


_TERMS = ("drive", "bit", "damping", "stored")


def read_simulation(design: Design, data: xarray.Dataset, summary: dict[str, Any]) -> Simulation:
    """A `Simulation` as it was saved; its events are not kept."""
    energy = {key: value for key, value in (summary["energy"] or {}).items() if key in _TERMS}
    return Simulation(
        design=design,
        time=data["time"].values,
        signals={name: data[name].values for name in SIGNALS},
        events=(),
        measures=Measures(**summary["measures"]),
        status=summary["status"],
        engine=summary["engine"],
        step=summary["step"],
        modes=summary["modes"],
        energy=EnergyAudit(**energy) if energy else None,
    )


def read_modes(design: Design, data: xarray.Dataset, summary: dict[str, Any]) -> Modes:
    """`Modes` as they were saved."""
    return Modes(
        free_free=_modes(data, "free_free"),
        fixed_top=_modes(data, "fixed_top"),
        node_depth=data["node_depth"].values,
        element_depth=data["element_depth"].values,
        design=design,
    )


def _modes(data: xarray.Dataset, support: str) -> tuple[Mode, ...]:
    columns = (
        data[f"{support}_{name}"].values
        for name in ("frequency", "damping_ratio", "overdamped", "shape", "torque_shape")
    )
    return tuple(
        Mode(float(frequency), None if np.isnan(ratio) else float(ratio), bool(real), *shapes)
        for frequency, ratio, real, *shapes in zip(*columns, strict=True)
    )


def read_loop(design: Design, data: xarray.Dataset, summary: dict[str, Any]) -> LoopAnalysis:
    """A `LoopAnalysis` as it was saved."""
    found = summary["margins"]
    if found is not None:  # what JSON cannot say is infinite
        found = {
            key: math.inf if value is None and key in ("gain_db", "delay") else value
            for key, value in found.items()
        }
    return LoopAnalysis(
        design=design,
        operating_point=OperatingPoint(
            summary["operating_speed"], summary["bit_torque"], summary["slope"]
        ),
        stable=summary["stable"],
        poles=data["pole_real"].values + 1j * data["pole_imag"].values,
        slope_margin=float(data.attrs["slope_margin"]),
        deciding_frequency_hz=float(data.attrs["deciding_frequency_hz"]),
        continuum_slope_margin=summary["continuum_slope_margin"],
        margins=None if found is None else Margins(**found),
        weight_delay_margin=summary["weight_delay_margin"],
        critical_speed=summary["critical_speed"],
        critical_weight_on_bit=summary["critical_weight_on_bit"],
    )


def read_loop_map(design: Design, data: xarray.Dataset, summary: dict[str, Any]) -> LoopMap:
    """A `LoopMap` as it was saved."""
    axes = tuple(_axis(path, data[stored_name(path)]) for path in summary["axes"])
    values = {name: data[name].values for name in QUANTITIES if name in data}
    return LoopMap(design, axes, values, summary["total_seconds"])


def read_three_regions(
    design: Design, data: xarray.Dataset, summary: dict[str, Any]
) -> ThreeRegions:
    """`ThreeRegions` as they were saved."""
    told = ("level", "horizon", "band", "window", "total_seconds")
    values: dict[str, Any] = {name: summary[name] for name in told}
    values |= {name: data[name].values for name in FIELDS}
    values |= {name: data[name].values.astype(bool) for name in MASKS}
    axes = tuple(_axis(path, data[stored_name(path)]) for path in summary["axes"])
    return ThreeRegions(design=design, axes=axes, **values)


def read_cycle(design: Design, data: xarray.Dataset, summary: dict[str, Any]) -> LimitCycle:
    """A `LimitCycle` as it was saved."""
    run = summary["simulated"]
    simulated = Returns(
        duration=run["duration"],
        mean_speed=run["mean_bit_speed"],
        swing=data["swing"].values,
        times=data["return_time"].values,
        points=data["return_point"].values,
        peaks=data["return_peak"].values,
        stuck=data["return_stuck"].values,
        time=data["simulated_time"].values,
        bit_speed=data["simulated_bit_speed"].values,
        top_speed=data["simulated_top_speed"].values,
    )
    harmonic = tuple(
        HarmonicCycle(**{f.name: entry[f.name] for f in fields(HarmonicCycle)})
        for entry in summary["harmonic"]
    )
    return LimitCycle(design, summary["status"], harmonic, _orbit(data, summary), simulated)


def _orbit(data: xarray.Dataset, summary: dict[str, Any]) -> Orbit | None:
    found = summary["orbit"]
    if found is None:
        return None
    numbers = (
        "period", "peak_bit_speed", "min_bit_speed", "mean_bit_speed", "stuck_time", "residual",
        "iterations",
    )  # fmt: skip
    return Orbit(
        **{name: found[name] for name in numbers},
        multipliers=data["multiplier"].values,
        point=data["orbit_point"].values,
        time=data["time"].values,
        bit_speed=data["bit_speed"].values,
        top_speed=data["top_speed"].values,
    )


def read_regularisation(
    design: Design, data: xarray.Dataset, summary: dict[str, Any]
) -> Regularisation:
    """A `Regularisation` as it was saved."""
    return Regularisation(
        design=design,
        axes=tuple(_axis(path, data[stored_name(path)]) for path in summary["axes"]),
        levels=design.tables.map.levels,
        widths=data["width"].values,
        j1=data["j1"].values,
        smoothed=data["smoothed_j1"].values,
        total_seconds=summary["total_seconds"],
    )


def read_weight_delay(design: Design, data: xarray.Dataset, summary: dict[str, Any]) -> WeightDelay:
    """A `WeightDelay` as it was saved."""

    def runs(prefix: str) -> Runs:
        measures = {name: data[f"{prefix}{name}"].values for name in DELAY_MEASURES}
        return Runs(measures, data[f"{prefix}status"].values.astype(np.int8))

    return WeightDelay(
        design=design,
        drawn={path: data[stored_name(path)].values for path in summary["uncertain"]},
        runs=runs(""),
        constant=runs("constant_"),
        failures=tuple(Failures(**failure) for failure in summary["failures"]),
        **{name: summary[name] for name in ("step", "modes", "total_seconds")},
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
        nominal=_nominal(nominal_design(design, told["weight_shift"]), data, summary, told),
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
        axes=tuple(
            _axis(path, data[stored_name(map_dimension(path, drawn))]) for path in told["axes"]
        ),
        levels=design.tables.map.levels,
        measures={name: data[f"map_{name}"].values for name in FLOATS},
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


def read_uncertainty(design: Design, data: xarray.Dataset, summary: dict[str, Any]) -> Uncertainty:
    """An `Uncertainty` as it was saved."""
    lanes = data["audited_lane"].values.astype(np.int64)
    keep = design.tables.uncertainty.keep
    measures = {name: data[name].values for name in dict.fromkeys(("j1", *keep))}
    told = summary.get("sensitivity")
    return Uncertainty(
        design=design,
        axes=tuple(_axis(path, data[stored_name(path)]) for path in summary["axes"]),
        levels=design.tables.map.levels,
        drawn={path: data[stored_name(path)].values for path in summary["uncertain"]},
        measures=measures,
        status=data["status"].values.astype(np.int8),
        nominal=data["nominal_j1"].values,
        audit=Audit(lanes, measures["j1"].ravel()[lanes], data["audited_j1"].values),
        failures=tuple(Failures(**failure) for failure in summary["failures"]),
        looks=tuple(
            Look(**{**one, "interval": tuple(one["interval"])}) for one in summary["looks"]
        ),
        sensitivity=None if told is None else read_sensitivity(told),
        **{name: summary[name] for name in ("seconds", "total_seconds")},
        provenance={key: str(value) for key, value in data.attrs.items()},
    )


READERS: dict[str, Callable[[Design, xarray.Dataset, dict[str, Any]], Any]] = {
    "map": read_sweep,
    "adaptive-map": read_adaptive_map,
    "simulate": read_simulation,
    "modes": read_modes,
    "compare": read_comparison,
    "cycle": read_cycle,
    "loop": read_loop,
    "loop-map": read_loop_map,
    "regions": read_three_regions,
    "regularisation": read_regularisation,
    "delay": read_weight_delay,
    "uncertainty": read_uncertainty,
    "doctor": read_doctor,
}
