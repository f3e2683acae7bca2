"""The discrete law of a drive as assignments: read off the functions that a simulation runs.

`sample` of `rig.top_drive.real_drive` is called once with terms in place of numbers. So the text
is the law that drillctl simulates, and what a design does not have is not in it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from drillctl import units
from drillctl.rig.program import Path, Ramp
from drillctl.rig.top_drive import SampledDrive
from drillctl.rig.top_drive import real_drive as law
from drillctl.rig.top_drive.real_drive import KNOTS
from drillctl.studies.export.terms import Term, Value, choose, made, named, number, of_terms


class Dimension(NamedTuple):
    """Powers of torque, speed and time, and the name of the unit in terms of torque and speed."""

    torque: int = 0
    speed: int = 0
    unit: str = "{torque}"
    si: str = "N*m"  # as `units` has it


TORQUE, SPEED = Dimension(1), Dimension(0, 1, "{speed}", "rad/s")
TIME, RATE = Dimension(unit="s", si="s"), Dimension(unit="1/s", si="1/s")
TRUTH, SHARE = Dimension(unit="", si=""), Dimension(0, 0, "", "")


class Symbol(NamedTuple):
    """A parameter or a variable."""

    name: str
    means: str
    dimension: Dimension


PARAMETERS = {
    "feedforward": Symbol("torque_0", "torque at no error", TORQUE),
    "kp": Symbol("kp", "proportional gain", Dimension(1, -1, "{torque}/{speed}", "N*m*s/rad")),
    "ki": Symbol("ki", "integral gain", Dimension(1, -1, "{torque}/({speed} s)", "N*m/rad")),
    "mobility": Symbol(
        "mobility", "speed by which torque fed back lowers the set speed",
        Dimension(-1, 1, "{speed}/({torque})", "rad/(N*m*s)"),
    ),
    "sensed_inertia": Symbol(
        "sensed_inertia", "inertia whose torque is taken off that of the motor",
        Dimension(1, -1, "{torque} s/{speed}", "kg*m^2"),
    ),
    "corner": Symbol("corner", "corner of the high-pass on the torque", RATE),
    "torque_filter": Symbol("torque_filter", "time constant of the torque's filter", TIME),
    "lag": Symbol("lag", "time constant of the motor", TIME),
    "least": Symbol("least_torque", "least torque", TORQUE),
    "most": Symbol("most_torque", "largest torque", TORQUE),
    "power": Symbol("power", "largest power", Dimension(1, 1, "{torque} {speed}", "W")),
    "rate": Symbol("torque_rate", "largest rate of the motor torque",
                   Dimension(1, 0, "{torque}/s", "N*m/s")),
    "tracking": Symbol("tracking", "rate of the way back of a limited integral",
                       RATE),
    "period": Symbol("period", "sampling period", TIME),
    "slowness": Symbol("slowness", "one over the largest speed",
                       Dimension(0, -1, "1/{speed}", "s/rad")),
    "curve": Symbol("curve_torque", "largest torque at rest by the motor's curve", TORQUE),
    **{
        f"w{k}": Symbol(f"curve_speed_{k}", "speed at which the slope of that curve changes", SPEED)
        for k in range(1, KNOTS + 1)
    },
    **{
        f"c{k}": Symbol(f"curve_slope_{k}", "by how much it changes there",
                        Dimension(1, -1, "{torque}/{speed}", "N*m*s/rad"))
        for k in range(1, KNOTS + 1)
    },
    "ramp": Symbol("ramp", "largest change of the set speed in a second", SPEED),
    "set_speed_lag": Symbol("set_speed_lag", "time constant behind the set speed", TIME),
}  # fmt: skip
"""Numbers of a law by the field of `RealDrive`, and of its program of speed."""

VARIABLES = {
    one.name: one
    for one in (
        Symbol("enable", "whether the law works; else it follows the drive", TRUTH),
        Symbol("bumpless", "whether it takes over at the present torque and speed", TRUTH),
        Symbol("set_speed", "set speed", SPEED),
        Symbol("speed", "speed of the drive, as its encoder shows it", SPEED),
        Symbol("limit_speed", "speed without the encoder's lag, by which power limits", SPEED),
        Symbol("torque", "torque of the motor, its mean over the last period", TORQUE),
        Symbol("command", "torque to be given until the next sample", TORQUE),
        Symbol("set_speed_now", "set speed that the ramp has come to", SPEED),
        Symbol("set_change", "its change in this period", SPEED),
        Symbol("set_now", "the same at this sample", SPEED),
        Symbol("set_speed_late", "that behind its lag", SPEED),
        Symbol("set_behind", "how far the lag is behind a ramp in the end", SPEED),
        Symbol("late_now", "the same at this sample", SPEED),
        Symbol("filtered_torque", "torque of the pipe, filtered", TORQUE),
        Symbol("pipe_torque", "the same at this sample", TORQUE),
        Symbol("slow_torque", "its slow part, which is not fed back", TORQUE),
        Symbol("integral", "integral of the speed error", Dimension(0, 1, "{speed} s", "rad")),
        Symbol("next_command", "command for the next sample", TORQUE),
        Symbol("last_speed", "speed at the last sample", SPEED),
        Symbol("least", "least torque at this speed", TORQUE),
        Symbol("most", "largest torque at this speed", TORQUE),
        Symbol("speed_error", "speed error less what the torque takes off", SPEED),
        Symbol("wanted", "torque before limits", TORQUE),
        Symbol("given", "torque within limits", TORQUE),
        Symbol("motor_torque", "torque of the motor at the end of the period", TORQUE),
        Symbol("mean_torque", "its mean over the period", TORQUE),
        Symbol("gap", "command less the torque", TORQUE),
        Symbol("moved", "change of torque at the largest rate", TORQUE),
        Symbol("time_moving", "time for which it changes so", TIME),
        Symbol("distance", "torque less the command after that", TORQUE),
        Symbol("kept", "share of that distance which is left", SHARE),
    )
}  # fmt: skip
"""What changes from sample to sample."""
INPUTS = ("bumpless", "set_speed", "speed", "limit_speed", "torque", "command")


@dataclass(frozen=True)
class Block:
    """A function block: what it remembers, and assignments in their order."""

    name: str
    means: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    memory: tuple[str, ...]
    parameters: tuple[str, ...]
    work: tuple[str, ...]  # names that hold a value within one call
    steps: tuple[tuple[str, Term], ...]
    idle: tuple[tuple[str, Term], ...] = ()  # in place of `steps` while it is not enabled


SI_NAMES = "N m", "rad/s"


@dataclass(frozen=True)
class Base:
    """Units of torque (N m) and speed (rad/s) that a text is in."""

    torque: float = 1.0
    speed: float = 1.0
    names: tuple[str, str] = SI_NAMES

    def unit(self, dimension: Dimension) -> str:
        """Name of a unit."""
        torque, speed = self.names
        if self.names == SI_NAMES:
            return dimension.si.replace("*", " ").replace("^", "")
        return dimension.unit.format(torque=torque, speed=speed)

    def of(self, value: float, dimension: Dimension) -> float:
        """A number (SI) in these units."""
        return value / (self.torque**dimension.torque * self.speed**dimension.speed)


SI = Base()
FIELD = Base(units.factor("klbf*ft", units.TORQUE), units.RPM, ("klbf ft", "rpm"))


@dataclass(frozen=True)
class DriveLaw:
    """The controller and, of a drive with a lag, its motor."""

    blocks: tuple[Block, ...]
    numbers: Mapping[str, float]  # by the name of the parameter, in `base`
    base: Base


def drive_law(drive: SampledDrive, program: Ramp | Path, base: Base = SI) -> DriveLaw:
    """The law of a sampled drive with its program of the set speed, in some units."""
    fields = {name: float(value) for name, value in drive._asdict().items() if name in PARAMETERS}
    fields |= {"ramp": _steepest(program), "set_speed_lag": float(getattr(program, "lag", 0.0))}
    values = {
        name: base.of(value, PARAMETERS[name].dimension) if math.isfinite(value) else value
        for name, value in fields.items()
    }
    terms = {name: named(PARAMETERS[name].name, value) for name, value in values.items()}
    of_program = terms.pop("ramp"), terms.pop("set_speed_lag")
    known = drive._replace(**terms)
    blocks = [_controller(known, *of_program)]
    if drive.lag > 0.0:
        blocks.append(_motor(known))
    used = {name for block in blocks for name in block.parameters}
    numbers = {one.name: values[key] for key, one in PARAMETERS.items() if one.name in used}
    return DriveLaw(tuple(blocks), numbers, base)


def _steepest(program: Ramp | Path) -> float:
    """Largest slope of the set speed (rad/s2); infinite of one that stands still or steps."""
    moving = [ramp for ramp in program.ramps if ramp.first != 0.0]
    if not moving or any(ramp.end == ramp.begin for ramp in moving):
        return math.inf
    return max(abs(ramp.first) / (ramp.end - ramp.begin) for ramp in moving)


class _Names:
    """Names that terms get, in the order of their first use."""

    def __init__(self) -> None:
        self._of: dict[int, str] = {}
        self.steps: list[tuple[str, Term]] = []

    def give(self, name: str, term: Term) -> Term:
        """Name a term, unless it is simple or has a name."""
        if term.parts:
            self._of.setdefault(id(term), name)
        return term

    def written(self, term: Term) -> Term:
        """A term by the names of its parts; what has one is assigned before."""
        if not term.parts:
            return term
        name = self._of.get(id(term))
        if name is not None and any(name == made for made, _ in self.steps):
            return named(name)
        inside = replace(term, parts=tuple(map(self.written, term.parts)))
        if name is None:
            return inside
        self.steps.append((name, inside))
        return named(name)


def _clipped(value: Term, least: Value, most: Value) -> Term:
    return made("limit", least, value, most)


def _followed(
    names: _Names, before: Term, late: Term, asked: Term, drive: Any, ramp: Term, lag: Term
) -> tuple[Term, Term]:  # fmt: skip
    """Set speed a period later, and behind its lag: exact for straight lines and steps."""
    change = number(0.0)
    if math.isfinite(ramp.fixed):
        most = ramp * drive.period
        change = names.give("set_change", _clipped(asked - before, -most, most))
        asked = before + change
    now = names.give("set_now", asked)
    if lag.fixed == 0.0:
        return now, now
    behind = names.give("set_behind", lag * (change / drive.period))
    kept = made("exp", -(drive.period / lag))
    late_now = before + change - behind + (late - before + behind) * kept
    return now, names.give("late_now", late_now)


def _controller(drive: Any, ramp: Term, lag: Term) -> Block:
    """What happens at a sample: the function of the simulation, with terms."""
    names, idly = _Names(), _Names()
    bumpless, set_speed, speed, torque, before, late = map(named, (
        "bumpless", "set_speed", "speed", "torque", "set_speed_now", "set_speed_late"
    ))  # fmt: skip
    now, lead = _followed(names, before, late, set_speed, drive, ramp, lag)
    _, begin = _followed(idly, speed, speed, set_speed, drive, ramp, lag)

    def limits(drive: Any, speed: Term) -> tuple[Term, Term]:
        curve = of_terms(law.curve_torque, above=lambda x: made("max", x, 0.0))
        least, most = of_terms(law.limits, curve_torque=curve)(drive, speed)
        return names.give("least", least), names.give("most", most)

    def clipped(value: Term, least: Term, most: Term) -> Term:
        return names.give("given", _clipped(names.give("wanted", value), least, most))

    def integral_rate(drive: Any, error: Term, command: Term, given: Term) -> Term:
        names.give("speed_error", error)
        return of_terms(law._integral_rate)(drive, error, command, given)

    # Power limits by the speed itself, whatever the encoder shows.
    limited = min(drive.power.fixed, drive.curve.fixed) < math.inf or drive.slowness > 0.0
    by_limit = named("limit_speed") if drive.encoder > 0.0 and limited else speed
    filtered, slow, integral, pending, last = map(named, (
        "filtered_torque", "slow_torque", "integral", "next_command", "last_speed"
    ))  # fmt: skip
    unused = number(0.0)
    memory = (
        speed, filtered, slow, integral, unused, unused, pending, last, torque * drive.period
    )  # fmt: skip
    after = of_terms(
        law.sample, limits=limits, clipped=clipped, _integral_rate=integral_rate
    )(drive, memory, speed, lead, by_limit)  # fmt: skip
    changed = {
        "command": after[5], "next_command": after[6], "integral": after[3],
        "slow_torque": after[2], "filtered_torque": names.give("pipe_torque", after[1]),
        "last_speed": speed, "set_speed_now": now, "set_speed_late": lead,
    }  # fmt: skip
    whole = torque - drive.feedforward - drive.kp * (begin - speed)
    present = choose(bumpless, torque, 0.0)
    idle = {
        "command": present, "next_command": present, "slow_torque": present,
        "filtered_torque": present, "last_speed": speed,
        "integral": choose(bumpless, whole / drive.ki, 0.0) if drive.ki > 0.0 else unused,
        "set_speed_now": choose(bumpless, speed, set_speed),
        "set_speed_late": choose(bumpless, speed, set_speed),
    }  # fmt: skip
    return _block(
        "speed_controller", "speed controller: call it once a period", ("command",), names,
        changed, idle, idly,
    )  # fmt: skip


def _motor(drive: Any) -> Block:
    """How the motor follows a command that is held for a period: exactly."""
    names = _Names()
    command, torque = named("command"), named("motor_torque")
    moved, moving = number(0.0), number(0.0)
    if math.isfinite(drive.rate.fixed):
        far, most = drive.rate * drive.lag, drive.rate * drive.period
        gap = names.give("gap", command - torque)
        moved = names.give("moved", _clipped(gap - _clipped(gap, -far, far), -most, most))
        moving = names.give("time_moving", made("abs", moved) / drive.rate)
    left = drive.period - moving
    kept = names.give("kept", made("exp", -(left / drive.lag)))
    distance = names.give("distance", torque + moved - command)
    after = command + distance * kept
    area = (torque + 0.5 * moved) * moving + command * left + distance * drive.lag * (1.0 - kept)
    changed = {"mean_torque": area / drive.period, "motor_torque": after}
    return _block(
        "motor", "motor: torque at the end of a period at a command", ("motor_torque",
        "mean_torque"), names, changed, {}, _Names(),
    )  # fmt: skip


def _block(
    name: str, means: str, outputs: tuple[str, ...], names: _Names, changed: dict[str, Term],
    idle: dict[str, Term], idly: _Names,
) -> Block:  # fmt: skip
    """A block of what its outputs follow from, and of nothing else."""
    needed = list(outputs)
    for one in needed:
        inside = [*changed[one].inside(), *(idle[one].inside() if one in idle else ())]
        new = dict.fromkeys(n for n in _variables(inside) if n in changed)
        needed += [n for n in new if n not in needed]
    values = {one: names.written(changed[one]) for one in needed}
    steps = (*names.steps, *_in_order(values))
    values = {one: idly.written(idle[one]) for one in needed if one in idle}
    begins = (*idly.steps, *values.items())
    read = [t for _, value in (*steps, *begins) for t in value.inside() if t.kind == "name"]
    seen = dict.fromkeys(t.name for t in read if t.value is None)
    work = tuple(dict.fromkeys(name for name, _ in (*names.steps, *idly.steps)))
    inputs = ("enable",) * bool(begins) + tuple(
        one for one in INPUTS if one in seen and one not in (*needed, *work)
    )
    return Block(
        name, means, inputs, outputs, tuple(one for one in needed if one not in outputs),
        tuple(dict.fromkeys(t.name for t in read if t.value is not None)), work, steps, begins,
    )  # fmt: skip


def _variables(terms: Iterable[Term]) -> Iterator[str]:
    return (term.name for term in terms if term.kind == "name" and term.value is None)


def _in_order(values: dict[str, Term]) -> Iterator[tuple[str, Term]]:
    """Assignments of what is remembered, each before what it is read from changes."""
    left = dict(values)
    while left:
        read = {
            name: {n for other, term in left.items() if other != name for n in
                   _variables(term.inside())}
            for name in left
        }  # fmt: skip
        name = next(name for name in left if name not in read[name])
        yield name, left.pop(name)
