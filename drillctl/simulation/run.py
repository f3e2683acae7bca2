"""Signals and measures of a run of the reference solver.

One run of a design, by either engine.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design
from drillctl.simulation import measures as m
from drillctl.simulation.reference import EnergyAudit, Event, Motion, Piece
from drillctl.store.codec import label
from drillctl.store.result import Result

Array = NDArray[np.float64]

FINE = 0.01  # interval (s) on which what is not located is measured, whatever the signals' own
FEWEST_SAMPLES = 500  # fewest intervals in a run for that; it is finer in a short run

MOST_EVENTS = 200  # events of a kind that a summary lists; the data hold all

SIGNALS = {
    "top_speed": ("rad/s", "speed of the top drive"),
    "bit_speed": ("rad/s", "speed of the bit"),
    "twist": ("rad", "top angle minus bit angle"),
    "top_angle": ("rad", "angle of the top drive in the frame that turns at the set speed"),
    "bit_angle": ("rad", "angle of the bit in the frame that turns at the set speed"),
    "top_torque": ("N*m", "torque of the drive"),
    "pipe_torque": ("N*m", "torque in the uppermost element"),
    "bit_torque": ("N*m", "torque on the bit, positive when it brakes"),
    "weight_on_bit": ("N", "weight on bit"),
    "stuck": ("", "1 while the bit is at rest"),
}


def _unit(signal: str) -> str:
    return SIGNALS[signal][0]


def _meaning(signal: str) -> str:
    return SIGNALS[signal][1]


@dataclass(frozen=True, eq=False)
class Simulation(Result):
    """One run: its signals, events, measures and energy balance."""

    kind: ClassVar[str] = "simulate"

    design: Design = label(means="what was simulated")
    time: Array = label("time", unit="s", name="time", means="sampling times")
    signals: dict[str, Array] = label(
        "time", unit=_unit, means=_meaning, flat=True
    )  # by the names of `SIGNALS`
    events: tuple[Event, ...] = label(means="sticks and releases; none of the batch engine")
    measures: m.Measures = label(means="over the whole run")
    status: str = label(means="one of `measures.STATUSES`")
    engine: str = label(means="`reference` or `batch`")
    step: float | None = label(unit="s", means="fixed step of the batch engine")
    modes: int | None = label(means="modes that the batch engine carried")
    energy: EnergyAudit | None = label(means="energy balance of the reference solver")

    @property
    def share_of_yield(self) -> float | None:
        """Peak pipe torque over the torsional yield of the uppermost pipe; None if unknown."""
        limit = self.design.string.yield_torque
        return self.measures.peak_pipe_torque / limit if math.isfinite(limit) else None

    def summary(self) -> dict[str, Any]:
        """Measures, status, engine, step, modes, energy; SI units, None where undefined."""
        return {
            "measures": self.measures.as_dict(),
            "status": self.status,
            "engine": self.engine,
            "step": self.step,
            "modes": self.modes,
            "energy": None if self.energy is None else self.energy.summary(),
            "events": {
                kind: self._times(kind) for kind in dict.fromkeys(e.kind for e in self.events)
            },
        }

    def _times(self, kind: str) -> list[float]:
        return [event.time for event in self.events if event.kind == kind][:MOST_EVENTS]

    def requested(self) -> tuple[Design, dict[str, Any]]:
        """The design with the engine that was used."""
        design = self.design
        if self.engine != (design.tables.simulation.engine or "reference"):
            design = design.replace({"simulation.engine": self.engine})
        return design, {}


def sample(motion: Motion, interval: float = 0.01) -> Simulation:
    """Signals at equal intervals and the measures of a run."""
    design = motion.design
    duration = design.tables.simulation.duration
    fine = _grid(duration, min(FINE, duration / FEWEST_SAMPLES))
    fine_signals = _signals(motion, fine)
    measured = _measures(motion, fine, fine_signals)
    time = _grid(duration, interval)
    signals = fine_signals
    if len(time) != len(fine):
        signals = _signals(motion, time)
    status = m.status_of(
        all(bool(np.isfinite(values).all()) for values in fine_signals.values()),
        _stuck_between(motion, duration - min(m.WINDOW, duration), duration),
        min(m.WINDOW, duration),
        measured.settling_time_wide,
    )
    return Simulation(
        design, time, signals, motion.events, measured, status, "reference", None, None,
        motion.energy,
    )  # fmt: skip


def _grid(duration: float, interval: float) -> Array:
    """Equally spaced times from zero to the very end, at most `interval` apart."""
    return np.linspace(0.0, duration, max(1, math.ceil(duration / interval * (1 - 1e-9))) + 1)


def _states(pieces: tuple[Piece, ...], time: Array) -> tuple[Array, Array, Array]:
    """State, shape (states, samples), phase and direction of slip, shape (samples,)."""
    ends = np.array([piece.end for piece in pieces])
    which = np.minimum(np.searchsorted(ends, time), len(pieces) - 1)
    columns, phases, directions = [], [], []
    for index, piece in enumerate(pieces):
        chosen = np.minimum(time[which == index], piece.end)
        if chosen.size:
            columns.append(piece.solution(chosen))
            phases.append(np.full(chosen.size, piece.phase))
            directions.append(np.full(chosen.size, float(piece.direction)))
    return np.concatenate(columns, axis=1), np.concatenate(phases), np.concatenate(directions)


def _signals(motion: Motion, time: Array) -> dict[str, Array]:
    design, system = motion.design, motion.system
    state, phase, direction = _states(motion.pieces, time)
    nodes = design.string.nodes
    angle, speed = state[:nodes], state[nodes : 2 * nodes]
    bit_speed = system.bit_speeds(state, direction)
    if system.simple:
        turning = direction if design.bit_rock.set_valued else np.sign(bit_speed)
        top_torque = np.asarray(design.top_drive.torque(angle[0], speed[0])) + 0.0 * angle[0]
        law: Any = design.weight_on_bit
        weight = np.broadcast_to(law.weight(np.abs(bit_speed)), bit_speed.shape)
        friction, _ = design.bit_rock.torque_and_slope(weight, np.abs(bit_speed), np.exp)
        reaction = system.reaction
        holding = reaction.motion @ state[: 2 * nodes] + reaction.load + reaction.top * top_torque
        bit_torque = np.where(direction == 0.0, holding, turning * friction)
    else:
        top_torque, weight, bit_torque = _one_by_one(motion, time, state, phase)
    stiffness, damping = design.string.element_stiffness[0], design.string.element_damping[0]
    return {
        "top_speed": speed[0] + design.speed,
        "bit_speed": bit_speed,
        "twist": angle[0] - angle[-1],
        "top_angle": angle[0],
        "bit_angle": angle[-1],
        "top_torque": top_torque,
        "pipe_torque": stiffness * (angle[0] - angle[1]) + damping * (speed[0] - speed[1]),
        "bit_torque": bit_torque,
        "weight_on_bit": np.array(weight),
        "stuck": (direction == 0.0).astype(float),
    }


def _one_by_one(
    motion: Motion, time: Array, state: Array, phase: Array
) -> tuple[Array, Array, Array]:
    """Top torque, weight and bit torque of a rig with memory, program or phases of its own."""
    result = np.empty((3, len(time)))
    for i, moment in enumerate(time):
        result[:, i] = motion.system.told(moment, state[:, i], int(phase[i]))
    return result[0], result[1], result[2]


def _measures(motion: Motion, time: Array, signals: dict[str, Array]) -> m.Measures:
    design = motion.design
    duration = design.tables.simulation.duration
    since = design.tables.simulation.j1_from
    bit = signals["bit_speed"]
    low, high = _extremes(motion, 0.0, bit)
    window = min(m.WINDOW, duration)
    late = time >= duration - window
    late_low, late_high = _extremes(motion, duration - window, bit[late])
    mean = design.speed + _bit_angle_change(motion, 0.0, duration) / duration
    late_mean = design.speed + _bit_angle_change(motion, duration - window, duration) / window
    j1 = deviation(motion, since, duration) / design.speed
    weight = float(np.trapezoid(signals["weight_on_bit"], time) / duration)
    return m.Measures(
        j1=j1,
        j1_rate=j1 / (duration - since),
        stuck_time=_stuck_between(motion, 0.0, duration),
        sticks=_sticks(motion),
        stick_slip_index=m.ssi(late_low, late_high, late_mean),
        mean_bit_speed=mean,
        min_bit_speed=low,
        peak_bit_speed=high,
        peak_pipe_torque=float(np.abs(signals["pipe_torque"]).max()),
        peak_top_torque=float(np.abs(signals["top_torque"]).max()),
        settling_time=_settling(design, time, bit, m.NARROW_BAND),
        settling_time_wide=_settling(design, time, bit, m.WIDE_BAND),
        mean_weight_on_bit=weight,
        rop_proxy=_rop_proxy(design, time, signals),
        work_at_bit=motion.energy.bit,
        work_per_turn=m.per_turn(motion.energy.bit, mean, duration),
        time_outside_table=_outside_table(design, time, signals["weight_on_bit"]),
    )


def _outside_table(design: Design, time: Array, weight: Array) -> float:
    """Time (s) with the weight outside the friction table, from samples."""
    low, high = design.table_range
    outside = (weight < low) | (weight > high)
    return float(np.trapezoid(outside.astype(float), time))


def _rop_proxy(design: Design, time: Array, signals: dict[str, Array]) -> float:
    nominal = design.tables.operating_point.weight_on_bit * design.speed
    if nominal == 0.0:
        return math.nan
    power = signals["weight_on_bit"] * np.abs(signals["bit_speed"])
    return float(np.trapezoid(power, time) / (time[-1] * nominal))


def _settling(design: Design, time: Array, bit: Array, band: float) -> float | None:
    """Settling time by linear interpolation between samples (s)."""
    excess = np.abs(bit - design.speed) - band * design.speed
    outside = np.flatnonzero(excess > 0.0)
    if outside.size == 0:
        return 0.0
    last = outside[-1]
    if last + 1 >= len(time):
        return None
    share = excess[last] / (excess[last] - excess[last + 1])
    moment = float(time[last] + share * (time[last + 1] - time[last]))
    return m.settled(moment, float(time[-1]))


def _bit_angle(nodes: int, piece: Piece, time: Array | float) -> Array:
    return np.asarray(piece.solution(time)[nodes - 1])


def _bit_angle_change(motion: Motion, begin: float, end: float) -> float:
    """Angle of the bit in the frame between two times (rad)."""
    first = next(p for p in motion.pieces if p.end >= begin)
    nodes = motion.system.nodes
    return float(_bit_angle(nodes, motion.pieces[-1], end) - _bit_angle(nodes, first, begin))


def deviation(motion: Motion, begin: float, end: float) -> float:
    """Integral of abs(bit speed - set speed) (rad).

    Between two crossings of the set speed the deviation keeps its sign, and its integral is
    the change of the bit's angle in the turning frame: exact, with no kink to integrate over.
    """
    total = 0.0
    for piece in motion.pieces:
        low, high = max(piece.begin, begin), min(piece.end, end)
        if high <= low:
            continue
        inside = piece.crossings[(piece.crossings > low) & (piece.crossings < high)]
        knots = np.concatenate([[low], inside, [high]])
        angle = _bit_angle(motion.system.nodes, piece, knots)
        total += float(np.abs(np.diff(angle)).sum())
    return total


def _sticks(motion: Motion) -> int:
    """Times the bit came to rest; a start at rest counts, even if it breaks loose at once."""
    at_rest = motion.pieces[0].direction == 0 or motion.design.tables.start.kind != "turning"
    return int(at_rest) + sum(event.kind == "stick" for event in motion.events)


def _stuck_between(motion: Motion, begin: float, end: float) -> float:
    return sum(
        max(0.0, min(piece.end, end) - max(piece.begin, begin))
        for piece in motion.pieces
        if piece.direction == 0
    )


def _extremes(motion: Motion, since: float, samples: Array) -> tuple[float, float]:
    """Smallest and largest bit speed from `since` on (rad/s), at located extremes."""
    values = [float(samples.min()), float(samples.max())]
    for piece in motion.pieces:
        moments = piece.extremes[piece.extremes >= since]
        if piece.direction != 0 and moments.size:
            state = piece.solution(moments)
            speed = state[2 * motion.system.nodes - 1] + motion.design.speed
            values += [float(speed.min()), float(speed.max())]
    return min(values), max(values)


def simulate(
    design: Design,
    engine: Literal["reference", "batch"] | None = None,
    interval: float = 0.01,
    **values: Any,
) -> Simulation:
    """Simulate a design.

    Parameters
    ----------
    design : Design
        Rig, control, start and duration.
    engine : {'reference', 'batch'}, optional
        By default the design's `simulation.engine`, and the reference solver if it has none.
    interval : float
        Sampling interval of the signals (s).
    **values
        Dotted path to value, laid over the design first.

    Returns
    -------
    Simulation
        Signals, events, measures, status.

    Raises
    ------
    InputError
        Unknown path or impossible value; a step too long for the friction law.
    SimulationError
        The reference solver could not finish.
    """
    design = design.replace(values) if values else design
    engine = engine or design.tables.simulation.engine or "reference"
    if engine == "reference":
        from drillctl.simulation.reference import solve

        return sample(solve(design), interval)
    return _by_batch(design, interval)


def _by_batch(design: Design, interval: float) -> Simulation:
    from drillctl.simulation.batch import measures_of, prepare, run_batch, trace
    from drillctl.simulation.lanes import single_lane

    lanes = single_lane(design)
    prepared = prepare(lanes, design.tables.simulation)
    batch = run_batch(lanes, prepared)
    time, traced = trace(lanes, prepared, interval)
    scheme = prepared.scheme
    return Simulation(
        design=design,
        time=time,
        signals=_batch_signals({name: values[:, 0] for name, values in traced.items()}),
        events=(),
        measures=measures_of(batch, 0),
        status=m.STATUSES[batch.status[0]],
        engine="batch",
        step=scheme.step,
        modes=scheme.modes,
        energy=None,
    )


def _batch_signals(traced: dict[str, Array]) -> dict[str, Array]:
    """The signals of a `Simulation` from those of a trace."""
    top_angle, top_speed = traced["top_angle"], traced["top_speed"]
    return {
        "top_speed": top_speed,
        "bit_speed": traced["bit_speed"],
        "twist": top_angle - traced["bit_angle"],
        "top_angle": top_angle,
        "bit_angle": traced["bit_angle"],
        "top_torque": traced["top_torque"],
        "pipe_torque": traced["pipe_torque"],
        "bit_torque": traced["bit_torque"],
        "weight_on_bit": traced["weight_on_bit"],
        "stuck": traced["stuck"],
    }
