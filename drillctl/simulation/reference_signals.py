"""Signals of a run of the reference solver at any times, compiled."""

from __future__ import annotations

from typing import Any

from drillctl.simulation.law_calls import on_disk
from drillctl.simulation.reference_rates import (
    BEGIN,
    FREE_TOP,
    HELD_TOP,
    LENGTH,
    STUCK,
    band,
    bit_speed,
    drive_torque,
    is_held,
    on_tape,
    slip_torque,
    step_at,
    tape_row,
    weight,
)


@on_disk
def components_at(rigs: Any, components: Any, time: Any, out: Any) -> None:
    """Components of the tape at times (s), shape (components, times)."""
    rig = rigs[0]
    for i in range(len(time)):
        row = tape_row(rig, step_at(rig, time[i]))
        share = (time[i] - row[BEGIN]) / row[LENGTH]
        for k in range(len(components)):
            out[k, i] = on_tape(row, components[k], share)


@on_disk
def torques_at(
    rigs: Any, kept: Any, ends: Any, pieces: Any, time: Any, state: Any, unused: Any, out: Any
) -> None:
    """Torque of the drive, weight on bit, torque on the bit (N m, N, N m) and phase, (4, times)."""
    rig, last, sums = rigs[0], 0, len(kept)
    for i in range(len(time)):
        moment = time[i]
        while last < len(pieces) - 1 and pieces[last, 1] < moment:
            last += 1
        phase = int(pieces[last, 2])
        held = is_held(phase)
        row = tape_row(rig, step_at(rig, moment))
        share = (moment - row[BEGIN]) / row[LENGTH]
        for c in range(len(kept)):
            state[kept[c]] = on_tape(row, c, share)
        rock = 0.0 if held else slip_torque(rig, moment, state, phase)
        free = 0.0
        if rig.drive_states:
            end = ends[0 if held else 1]
            free = on_tape(row, sums, share) + end[0] - end[1] * rock
        gain = band(rig, HELD_TOP if held else FREE_TOP)[0]
        torque = drive_torque(rig, moment, state, free, gain, unused)
        if held:
            rock = on_tape(row, sums + 1, share) + ends[2, 0] + ends[2, 1] * torque
        speed = 0.0 if phase == STUCK else abs(bit_speed(rig, state))
        out[0, i], out[1, i], out[2, i] = torque, weight(rig, moment, speed, state), rock
        out[3, i] = phase
