"""Single runs and limit cycles."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

from drillctl.design import Design
from drillctl.simulation.limit_cycle import HarmonicCycle, LimitCycle, Orbit
from drillctl.simulation.limit_cycle.returns import Returns
from drillctl.simulation.measures import Measures
from drillctl.simulation.reference import EnergyAudit
from drillctl.simulation.trajectory import SIGNALS, Simulation
from drillctl.store.kind import Kind

if TYPE_CHECKING:
    import xarray


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


def _asked_of_simulation(result: Simulation) -> tuple[Design, dict[str, Any]]:
    design = result.design
    if result.engine != (design.tables.simulation.engine or "reference"):
        design = design.replace({"simulation.engine": result.engine})
    return design, {}


def _asked_of_cycle(result: LimitCycle) -> tuple[Design, dict[str, Any]]:
    return result.design, {"duration": result.simulated.duration}


KINDS = (
    Kind("simulate", Simulation, read_simulation, _asked_of_simulation),
    Kind("cycle", LimitCycle, read_cycle, _asked_of_cycle),
)
