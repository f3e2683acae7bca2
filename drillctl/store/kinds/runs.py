"""Single runs and limit cycles."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

from drillctl.design import Design
from drillctl.simulation.limit_cycle import HarmonicCycle, LimitCycle, Orbit
from drillctl.simulation.limit_cycle.returns import Returns
from drillctl.store.kind import Kind

if TYPE_CHECKING:
    import xarray


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


def _asked_of_cycle(result: LimitCycle) -> tuple[Design, dict[str, Any]]:
    return result.design, {"duration": result.simulated.duration}


KINDS = (Kind("cycle", LimitCycle, read_cycle, _asked_of_cycle),)
