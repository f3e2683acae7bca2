"""Torque in each section of a run, against its torsional yield.

The engines carry the torque of the uppermost element. Below it the string is linear between the
torques at its two ends, which a run has sampled: its modes are driven by them once more, exactly
for torques that are straight between samples.
"""

from __future__ import annotations

import math

import numpy as np
import scipy.linalg

from drillctl.arrays import Array
from drillctl.design import Design
from drillctl.simulation.lanes import single_lane


def section_peaks(design: Design, time: Array, signals: dict[str, Array]) -> dict[str, float]:
    """Largest torque (N m) in each section whose torsional yield is known, by name."""
    sections = design.string.parts.sections
    last = np.cumsum([one.elements for one in sections])
    known = [x for x in zip(sections, last, strict=True) if x[0].yield_torque < math.inf]
    if not known:
        return {}
    angles, speeds = _modal_motion(design, time, signals)
    _, shapes = design.string.undamped_modes
    stiffness, damping = design.string.element_stiffness, design.string.element_damping
    peaks = {}
    for one, end in known:
        elements = slice(end - one.elements, end)
        twist = shapes[:-1, 1:][elements] - shapes[1:, 1:][elements]
        torque = (stiffness[elements, None] * twist) @ angles
        torque += (damping[elements, None] * twist) @ speeds
        peaks[one.name] = float(np.abs(torque).max())
    return peaks


def _modal_motion(design: Design, time: Array, signals: dict[str, Array]) -> tuple[Array, Array]:
    """Elastic modal coordinates and their rates at the samples, shape (modes, times).

    The damping of a mode is its own part of C; what couples modes, of drag alone, is left out.
    """
    string = design.string
    frequency, shapes = string.undamped_modes
    frequency, shapes = frequency[1:], shapes[:, 1:]
    begin = single_lane(design).begin
    q = shapes.T @ (string.mass @ begin.angles[:, 0])
    v = shapes.T @ (string.mass @ begin.speeds[:, 0])
    force = np.outer(signals["top_torque"], shapes[0])
    force -= np.outer(signals["bit_torque"], shapes[-1])
    force -= shapes.T @ string.ground_damping * design.speed
    step = float(time[1] - time[0])
    block = np.zeros((len(frequency), 4, 4))  # angle, rate, force, slope of the force
    block[:, 0, 1] = block[:, 1, 2] = block[:, 2, 3] = step
    block[:, 1, 0] = -(frequency**2) * step
    block[:, 1, 1] = -np.einsum("nm,nm->m", shapes, string.damping @ shapes) * step
    moved = scipy.linalg.expm(block)
    slope = np.diff(force, axis=0) / step
    driven = moved[:, :2, 2] * force[:-1, :, None] + moved[:, :2, 3] * slope[:, :, None]
    angles, speeds = np.empty((2, len(frequency), len(time)))
    angles[:, 0], speeds[:, 0] = q, v
    for n, (more_q, more_v) in enumerate(np.moveaxis(driven, 2, 1), 1):
        q, v = (
            moved[:, 0, 0] * q + moved[:, 0, 1] * v + more_q,
            moved[:, 1, 0] * q + moved[:, 1, 1] * v + more_v,
        )
        angles[:, n], speeds[:, n] = q, v
    return angles, speeds
