"""Signals of a run of the reference solver at any times, compiled."""

from __future__ import annotations

from typing import Any

from drillctl.simulation import reference_rates as f
from drillctl.simulation.law_calls import on_disk


@on_disk
def components_at(rigs: Any, components: Any, time: Any, out: Any) -> None:
    """Components of the tape at times (s), shape (components, times)."""
    rig = rigs[0]
    for i in range(len(time)):
        row = f.tape_row(rig, f.step_at(rig, time[i]))
        share = (time[i] - row[f.BEGIN]) / row[f.LENGTH]
        for k in range(len(components)):
            out[k, i] = f.on_tape(row, components[k], share)


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
        held = f.is_held(phase)
        row = f.tape_row(rig, f.step_at(rig, moment))
        share = (moment - row[f.BEGIN]) / row[f.LENGTH]
        for c in range(len(kept)):
            state[kept[c]] = f.on_tape(row, c, share)
        rock = 0.0 if held else f.slip_torque(rig, moment, state, phase)
        free = 0.0
        if rig.drive_states:
            end = ends[0 if held else 1]
            free = f.on_tape(row, sums, share) + end[0] - end[1] * rock
        gain = f.band(rig, f.HELD_TOP if held else f.FREE_TOP)[0]
        torque = f.drive_torque(rig, moment, state, free, gain, unused)
        if held and rig.wall_nodes > 0:
            rock = f.on_tape(row, sums + 2, share)
        elif held:
            rock = f.on_tape(row, sums + 1, share) + ends[2, 0] + ends[2, 1] * torque
        speed = 0.0 if phase == f.STUCK else abs(f.bit_speed(rig, state))
        out[0, i], out[1, i], out[2, i] = torque, f.weight(rig, moment, speed, state), rock
        out[3, i] = phase
