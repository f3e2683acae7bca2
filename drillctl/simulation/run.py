"""Signals and measures of a run of the reference solver.

One run of a design, by either engine.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

import numpy as np

from drillctl.arrays import Array, own_errstate
from drillctl.design import Design
from drillctl.progress import SILENT, Progress
from drillctl.rig.top_drive import RealDrive
from drillctl.rig.top_drive.real_drive import curve_torque
from drillctl.rig.well.wall import edges_of
from drillctl.simulation import measures as m
from drillctl.simulation.reference import EnergyAudit, Event, Motion, stuck_between
from drillctl.simulation.strain import section_peaks
from drillctl.store.codec import label
from drillctl.store.json_files import picked
from drillctl.store.result import Result

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
    # of axial motion alone
    "bit_depth": ("m", "depth drilled by the bit"),
    "penetration": ("m/s", "speed of the bit along its axis"),
}


OF_WALL = {"stuck_length": ("m", "length of string that the friction of the wall holds")}
"""Signals of a string on which the wall rubs."""


def _unit(signal: str) -> str:
    return (SIGNALS | OF_WALL)[signal][0]


def _meaning(signal: str) -> str:
    return (SIGNALS | OF_WALL)[signal][1]


@dataclass(frozen=True, eq=False)
class Simulation(Result, kind="simulate"):
    """One run: its signals, events, measures and energy balance."""

    design: Design = label(means="what was simulated")
    time: Array = label("time", unit="s", name="time", means="sampling times")
    signals: dict[str, Array] = label(
        "time", unit=_unit, means=_meaning, flat=True
    )  # by the names of `SIGNALS`
    events: tuple[Event, ...] = label(means="sticks and releases; none of the batch engine")
    measures: m.Measures = label(means="over the whole run")
    status: str = label(means="one of `measures.STATUSES`")
    engine: str = label(means="`reference` or `batch`")
    method: str | None = label(means="steps of the reference solver: DOP853 or Rodas5P")
    step: float | None = label(unit="s", means="fixed step of the batch engine")
    modes: int | None = label(means="modes that the batch engine carried")
    energy: EnergyAudit | None = label(means="energy balance of the reference solver")
    section_torque: dict[str, float] = label(
        unit="N*m", means="largest in each section whose torsional yield is known",
        default_factory=dict,
    )  # fmt: skip
    wall_depth: Array | None = label(
        "edge", unit="m", means="depths between which the string belongs to each node of the wall",
        default=None,
    )  # fmt: skip
    wall_stuck: Array | None = label(
        "time", "wall_node", means="1 while the wall holds a node, the bit last", default=None
    )

    @property
    def share_of_yield(self) -> float | None:
        """Peak pipe torque over the torsional yield of the uppermost pipe; None if unknown."""
        limit = self.design.string.yield_torque
        return self.measures.peak_pipe_torque / limit if math.isfinite(limit) else None

    @property
    def yields(self) -> dict[str, dict[str, float]]:
        """Peak torque and torsional yield (N m) of the sections whose yield is known, by name."""
        limits = {one.name: one.yield_torque for one in self.design.string.parts.sections}
        return {
            name: {
                "peak_torque": peak,
                "torsional_yield": limits[name],
                "share": peak / limits[name],
            }
            for name, peak in self.section_torque.items()
        }

    def summary(self) -> dict[str, Any]:
        """Measures, status, engine, step, modes, energy; SI units, None where undefined."""
        return {
            "measures": self.measures.as_dict(),
            **picked(self, "status", "engine", "method", "step", "modes"),
            "energy": None if self.energy is None else self.energy.summary(),
            "yield": self.yields,
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


def sample(motion: Motion, interval: float = 0.01, sections: bool = False) -> Simulation:
    """Signals at equal intervals and the measures of a run; torque in all sections on request."""
    design = motion.design
    duration = design.tables.simulation.duration
    fine = _grid(duration, min(FINE, duration / FEWEST_SAMPLES))
    axial = hasattr(motion, "axial_measures")
    signals_of = motion.signals if axial else partial(_signals, motion)  # type: ignore[attr-defined]
    fine_signals = signals_of(fine)
    measured = _measures(motion, fine, fine_signals)
    time = _grid(duration, interval)
    signals = fine_signals
    if len(time) != len(fine):
        signals = signals_of(time)
    wall = {} if design.wall is None else _sticking(design, motion.wall_stuck(time), signals)
    status = m.status_of(
        all(bool(np.isfinite(values).all()) for values in fine_signals.values()),
        stuck_between(motion, duration - min(m.WINDOW, duration), duration),
        min(m.WINDOW, duration),
        measured.settling_time_wide,
    )
    return Simulation(
        design, time, signals, motion.events, measured, status, "reference",
        motion.method, None, None, motion.energy,
        section_peaks(design, fine, fine_signals) if sections else {}, **wall,
    )  # fmt: skip


def _sticking(design: Design, stuck: Array, signals: dict[str, Array]) -> dict[str, Any]:
    """Fields of a run of which nodes of the wall stick; the length that does joins the signals."""
    assert design.wall is not None
    edges = edges_of(design.wall, design.string.depth)
    signals["stuck_length"] = stuck @ np.diff(edges)
    return {"wall_depth": edges, "wall_stuck": stuck}


def _grid(duration: float, interval: float) -> Array:
    """Equally spaced times from zero to the very end, at most `interval` apart."""
    return np.linspace(0.0, duration, max(1, math.ceil(duration / interval * (1 - 1e-9))) + 1)


def _signals(motion: Motion, time: Array) -> dict[str, Array]:
    from drillctl.simulation import reference_rates as f

    design = motion.design
    top_angle, top_speed, next_angle, next_speed, bit_angle, bit_speed = motion.components(
        [f.TOP_ANGLE, f.TOP_SPEED, f.NEXT_ANGLE, f.NEXT_SPEED, f.BIT_ANGLE, f.BIT_SPEED], time
    )
    top_torque, weight, bit_torque, phase = motion.torques(time)
    stiffness, damping = design.string.element_stiffness[0], design.string.element_damping[0]
    return {
        "top_speed": top_speed + design.speed,
        "bit_speed": np.where(phase == f.STUCK, 0.0, bit_speed + design.speed),
        "twist": top_angle - bit_angle,
        "top_angle": top_angle,
        "bit_angle": bit_angle,
        "top_torque": top_torque,
        "pipe_torque": stiffness * (top_angle - next_angle) + damping * (top_speed - next_speed),
        "bit_torque": bit_torque,
        "weight_on_bit": weight,
        "stuck": (np.abs(phase) != 1.0).astype(float),
    }


def _measures(motion: Motion, time: Array, signals: dict[str, Array]) -> m.Measures:
    design = motion.design
    duration = design.tables.simulation.duration
    since = design.tables.simulation.j1_from
    bit = signals["bit_speed"]
    low, high = _extremes(motion, 0.0, bit)
    window = min(m.WINDOW, duration)
    late = time >= duration - window
    late_low, late_high = _extremes(motion, duration - window, bit[late])
    mean = motion.mean_speed(0.0, duration)
    late_mean = motion.mean_speed(duration - window, duration)
    j1 = deviation(motion, since, duration) / design.speed
    weight = float(np.trapezoid(signals["weight_on_bit"], time) / duration)
    return m.Measures(
        j1=j1,
        j1_rate=j1 / (duration - since),
        stuck_time=stuck_between(motion, 0.0, duration),
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
        work_at_wall=motion.energy.wall,
        work_per_turn=m.per_turn(motion.energy.bit, mean, duration),
        time_outside_table=_outside_table(design, time, signals["weight_on_bit"]),
        **_strain(design, time, signals),
        **(
            motion.axial_measures()
            if hasattr(motion, "axial_measures")
            else dict.fromkeys(m.AXIAL_MEASURES)
        ),
    )


def _strain(design: Design, time: Array, signals: dict[str, Array]) -> dict[str, Any]:
    """Times (s) at the limits of the drive, from samples, and its peak power (W)."""
    drive = design.top_drive
    names = ("time_at_torque_limit", "time_at_power_limit", "time_over_continuous")
    if not isinstance(drive, RealDrive):
        return dict.fromkeys(names, 0.0) | {"peak_drive_power": None}
    torque = signals["top_torque"]
    power = torque * signals["top_speed"]
    most = drive.most
    if math.isfinite(drive.curve):
        most = np.minimum(most, curve_torque(drive, signals["top_speed"]))
    there = (torque >= m.AT_LIMIT * most, power >= m.AT_LIMIT * drive.power,
             torque > drive.continuous)  # fmt: skip
    times = (float(np.trapezoid(one.astype(float), time)) for one in there)
    return dict(zip(names, times, strict=True)) | {"peak_drive_power": float(power.max())}


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


def deviation(motion: Motion, begin: float, end: float) -> float:
    """Integral of abs(bit speed - set speed) (rad).

    Between two crossings of the set speed the deviation keeps its sign, and its integral is
    the change of the bit's angle in the turning frame: exact, with no kink to integrate over.
    """
    turns = np.concatenate([motion.ends, motion.crossings[:, 0]])
    inside = np.sort(turns[(turns > begin) & (turns < end)])
    angle = motion.bit_angle(np.concatenate([[begin], inside, [end]]))
    return float(np.abs(np.diff(angle)).sum())


def _sticks(motion: Motion) -> int:
    """Times the bit came to rest; a start at rest counts, even if it breaks loose at once."""
    held = ("rest", "wound_up")
    at_rest = motion.directions[0] == 0 or motion.design.tables.start.kind in held
    return int(at_rest) + sum(event.kind == "stick" for event in motion.events)


def _extremes(motion: Motion, since: float, samples: Array) -> tuple[float, float]:
    """Smallest and largest bit speed from `since` on (rad/s), at located extremes."""
    time, speed = motion.extremes.T
    values = np.concatenate([samples, speed[time >= since] + motion.design.speed])
    return float(values.min()), float(values.max())


@own_errstate()
def simulate(
    design: Design,
    engine: Literal["reference", "batch"] | None = None,
    interval: float = 0.01,
    progress: Progress = SILENT,
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
    progress : Progress
        Of the reference solver: simulated seconds.
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

        return sample(solve(design, progress=progress), interval, sections=True)
    return _by_batch(design, interval)


def _by_batch(design: Design, interval: float) -> Simulation:
    from drillctl.simulation.batch import measures_of, prepare, run_batch, trace
    from drillctl.simulation.lanes import single_lane

    lanes = single_lane(design)
    prepared = prepare(lanes, design.tables.simulation)
    batch = run_batch(lanes, prepared)
    time, traced = trace(lanes, prepared, interval)
    signals = {name: values[:, 0] for name, values in traced.items() if values.ndim == 2}
    signals["twist"] = signals["top_angle"] - signals["bit_angle"]
    shown = {name: signals[name] for name in SIGNALS if name in signals}
    wall = {} if design.wall is None else _sticking(design, traced["wall_stuck"][:, :, 0], shown)
    scheme = prepared.scheme
    return Simulation(
        design=design,
        time=time,
        signals=shown,
        events=(),
        measures=measures_of(batch, 0),
        status=m.STATUSES[batch.status[0]],
        engine="batch",
        method=None,
        step=scheme.step,
        modes=scheme.modes,
        energy=None,
        section_torque=section_peaks(design, time, signals),
        **wall,
    )
