"""Modes and the linear loop."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from drillctl.design import Design
from drillctl.errors import InputError
from drillctl.linear.loop_analysis import LoopAnalysis
from drillctl.linear.loop_margins import Margins
from drillctl.linear.modal import Mode, Modes
from drillctl.linear.operating_point import OperatingPoint
from drillctl.store.kind import Kind

if TYPE_CHECKING:
    import xarray


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


def _asked_of_modes(result: Modes) -> tuple[Design, dict[str, Any]]:
    if result.design is None:
        raise InputError("modes of a bare string have no design to be saved with", "save")
    return result.design, {"count": max(len(result.free_free), len(result.fixed_top))}


KINDS = (
    Kind("modes", Modes, read_modes, _asked_of_modes),
    Kind("loop", LoopAnalysis, read_loop),
)
