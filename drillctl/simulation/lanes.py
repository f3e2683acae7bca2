"""State of the string at time zero, in the frame that turns at the set speed.

What a lane of the batch engine is: the numbers of one rig on a shared string.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design
from drillctl.rig.axial import AxialString
from drillctl.rig.bit_rock import contact
from drillctl.rig.bit_rock.variation import NoVariation, Variation
from drillctl.rig.drillstring import Drillstring
from drillctl.rig.program import Program
from drillctl.rig.top_drive import RealDrive
from drillctl.rig.weight_on_bit import AlarmWeight
from drillctl.rig.well.wall import Wall

if TYPE_CHECKING:
    from drillctl.linear.observer import Observer

Array = NDArray[np.float64]
Kind = Literal["rest", "turning", "wound_up", "steady"]


Shapes = tuple[tuple[Array, Array], ...]
"""Shapes along the string, (nodes,), each with what it is to be multiplied with, (lanes,)."""


@dataclass(frozen=True, eq=False)
class Start:
    """Motion of the string at time zero, in the frame."""

    twists: Shapes  # angles (rad)
    turns: Shapes  # speeds (rad/s)

    @property
    def angles(self) -> Array:
        """Angles of every node in the frame (rad), shape (nodes, lanes)."""
        return _outer(self.twists)

    @property
    def speeds(self) -> Array:
        """Speeds of every node in the frame (rad/s), shape (nodes, lanes)."""
        return _outer(self.turns)


def _outer(shapes: Shapes) -> Array:
    return functools.reduce(np.add, (np.outer(*pair) for pair in shapes))


def rest_under_drag(string: Drillstring) -> Array:
    """Angles per set speed with which the string carries its drag to ground; top at zero.

    K rest = -g + e_top sum(g): in the coordinates u - rest Omega the whole drag acts at the
    top, where the drive's torque acts too.
    """
    carried_below = string.ground_damping.sum() - np.cumsum(string.ground_damping)[:-1]
    return np.concatenate([[0.0], -np.cumsum(carried_below / string.element_stiffness)])


CUTTING_STEPS = 160.0  # fewest in a period of the cutting, and between two blades
SETTLING_STEPS = 60.0  # fewest while the cutters relax against the pipe above the bit
SPEEDS = 161  # speeds at which a slope is looked for, from rest to eight times the set speed


@dataclass(frozen=True, eq=False)
class Lanes:
    """Any number of rigs that share a string, the types of their laws and the kind of start."""

    string: Drillstring  # shared by all lanes
    # laws with an array, shape (lanes,), for each of their numbers
    friction: Any
    drive: Any
    weight: Any
    set_speed: Array  # shape (lanes,): Final set speed (rad/s)
    # shape (lanes,): Speed of all nodes at time zero of a start that turns (rad/s)
    turning_speed: Array
    nominal_weight: Array  # shape (lanes,): Nominal weight on bit (N)
    # shape (lanes,): Range of the friction table (N)
    table_low: Array
    table_high: Array
    before: Any  # bit-rock law before the rock changes, of the type of `friction`
    variation: Variation | NoVariation  # of the rock along the way
    program: Program  # what changes by the clock, with an array for each number
    observer: Observer | None  # of the bit, shared by all lanes
    axial: AxialString | None  # of a bit that cuts its own wake, shared by all lanes
    bit_speed: Array  # shape (lanes,): of the bit alone as steady drilling begins (rad/s)
    start: Kind  # {'rest', 'turning', 'wound_up', 'steady'}: Kind of start
    wall: Wall | None = None  # friction of the wall, its torque of shape (nodes, lanes)

    def __len__(self) -> int:
        return len(self.set_speed)

    def __getitem__(self, chosen: slice | NDArray[np.int64]) -> Lanes:
        """Some of the lanes."""

        def some(law: Any) -> Any:
            return type(law)(*(numbers[chosen] for numbers in law))

        return Lanes(
            string=self.string,
            friction=some(self.friction),
            drive=some(self.drive),
            weight=some(self.weight),
            set_speed=self.set_speed[chosen],
            turning_speed=self.turning_speed[chosen],
            nominal_weight=self.nominal_weight[chosen],
            table_low=self.table_low[chosen],
            table_high=self.table_high[chosen],
            before=some(self.before),
            variation=some(self.variation),
            program=Program(
                some(self.program.speed), some(self.program.weight), self.program.rock_until[chosen]
            ),
            observer=self.observer,
            axial=self.axial,
            bit_speed=self.bit_speed[chosen],
            start=self.start,
            wall=None if self.wall is None else self.wall._replace(
                torque=np.ascontiguousarray(self.wall.torque[:, chosen])
            ),
        )  # fmt: skip

    @cached_property
    def begin(self) -> Start:
        """Motion at time zero."""
        ones, none = np.ones(self.string.nodes), np.zeros(self.string.nodes)
        if self.start == "rest":
            return Start(((none, 0.0 * self.set_speed),), ((ones, -self.set_speed),))
        if self.start == "turning":
            turning = self.turning_speed - self.set_speed
            return Start(((none, 0.0 * self.set_speed),), ((ones, turning),))
        compliance = np.concatenate([[0.0], np.cumsum(1.0 / self.string.element_stiffness)])
        rock = self.before if np.any(self.program.rock_until > 0.0) else self.friction
        torque = rock.static_torque(self.weight_at_rest)
        if self.start == "wound_up":
            shape = compliance / compliance[-1]
            return Start(((compliance, -torque),), ((shape, -self.set_speed),))
        # The drive gives what rock and drag take: an ideal one by the angle that it has come to.
        _, held = self.drive.gains()
        held = np.broadcast_to(np.asarray(held, dtype=float), torque.shape)
        held = np.where(isinstance(self.drive, RealDrive), 0.0, held)
        top = np.where(held > 0.0, -self.begin_torque / np.where(held > 0.0, held, 1.0), 0.0)
        speed, last = self.begin_speed, np.eye(self.string.nodes)[-1]
        return Start(
            ((compliance, -torque), (rest_under_drag(self.string), speed), (ones, top)),
            ((ones, speed - self.set_speed), (last, self.bit_speed - speed)),
        )

    @property
    def begin_speed(self) -> Array:
        """Set speed at time zero (rad/s)."""
        path = self.program.speed
        late = getattr(path, "lag", 0.0) > 0.0
        return self.set_speed + sum(
            np.where((ramp.end > 0.0) | late, ramp.first, 0.0) for ramp in path.ramps
        )

    @property
    def begin_torque(self) -> Array:
        """Torque (N m) with which the drive drills steadily at time zero."""
        rock = self.before if np.any(self.program.rock_until > 0.0) else self.friction
        torque = rock.static_torque(self.weight_at_rest)
        return np.asarray(torque + self.string.ground_damping.sum() * self.begin_speed)

    @cached_property
    def steepest_fall(self) -> float:
        """Steepest falling slope of the rock in any lane (N m s/rad)."""
        steepest = max(self._steepest(rock) for rock in (self.friction, self.before))
        if isinstance(self.variation, NoVariation):
            return steepest
        return steepest * float(np.max(self.variation.highest))

    @property
    def longest_step(self) -> float:
        """Longest step (s) that follows the rock along the way, and the cutting."""
        if self.axial is not None:
            rock = self.friction
            delay = 2.0 * math.pi / (rock.blades * self.set_speed)
            stiffness = rock.blades * rock.force_per_depth
            swing = 2.0 * math.pi * np.sqrt(self.axial.total / stiffness)
            followed = float(np.min(np.minimum(delay, swing))) / CUTTING_STEPS
            if self.axial.impedance > 0.0:  # by itself, before a wave has come back
                settles = float(np.min(self.axial.impedance / stiffness))
                followed = min(followed, settles / SETTLING_STEPS)
            rate = rock.rate(self.weight_at_rest, self.set_speed)
            return min(followed, self._longest_on_rock(rate))
        return self._longest_on_rock(0.0)

    def _longest_on_rock(self, rate: float | Array) -> float:
        if isinstance(self.variation, NoVariation):
            return math.inf
        return float(np.min(self.variation.longest_step(self.set_speed, rate)))

    def _steepest(self, rock: Any) -> float:
        if self.weight.moves:
            # The weight moves with the speed: looked for, up to far beyond any stick-slip.
            speeds = self.set_speed * np.linspace(0.0, 8.0, SPEEDS)[:, None]
            _, slope = contact(rock, self.weight, speeds, np.exp)
            return float(max(0.0, np.max(-slope)))
        return float(np.max(rock.steepest_fall(self._weights())))

    def _weights(self) -> Any:
        """Weights (N) that a law which does not act at once may ask for."""
        # Ramps that rise from below take from it: those that fall bound it alone.
        over = 1.0 + sum(np.maximum(ramp.first, 0.0) for ramp in self.program.weight.ramps)
        if not hasattr(self.weight, "gain"):
            return self.weight[0] * over
        speeds = self.set_speed * np.linspace(0.0, 8.0, SPEEDS)[:, None]
        return self.weight.command(speeds, self.weight.nominal * over)

    @property
    def weight_at_rest(self) -> Array:
        """Weight on a bit at rest at time zero (N)."""
        over = 1.0 + sum(
            np.where(ramp.end > 0.0, ramp.first, 0.0) for ramp in self.program.weight.ramps
        )
        nominal = self.weight[0] * over
        if isinstance(self.weight, AlarmWeight):
            return np.asarray(nominal)
        if hasattr(self.weight, "command"):
            return np.asarray(self.weight.command(0.0, nominal))
        law = self.weight._replace(**{self.weight._fields[0]: nominal})
        return np.asarray(law.weight(0.0))


def kinds(design: Design) -> tuple[Any, ...]:
    """What lanes that run together have in common: types of laws and programs, and sampling."""
    laws = (
        design.bit_rock, design.top_drive, design.weight_on_bit, design.program.speed,
        design.variation,
    )  # fmt: skip
    return (*(type(law) for law in laws), getattr(design.weight_on_bit, "period", 0.0) > 0.0)


def lane_numbers(design: Design) -> dict[str, float]:
    """Every number of a design that may differ from lane to lane, by name."""
    program = design.program
    laws = {
        "friction": design.bit_rock, "drive": design.top_drive, "weight": design.weight_on_bit,
        "before": design.bit_rock_before, "variation": design.variation,
        "speed_program": program.speed,
        "weight_program": program.weight,
    }  # fmt: skip
    numbers = {
        f"{part}.{field}": float(value)
        for part, law in laws.items()
        for field, value in law._asdict().items()  # type: ignore[attr-defined]
    }
    if design.wall is not None:
        torques = design.wall.torque.tolist()
        numbers |= {f"wall.{node}": torque for node, torque in enumerate(torques)}
    turning = design.tables.start.speed
    numbers["rock_until"] = program.rock_until
    numbers["set_speed"] = design.speed
    numbers["turning_speed"] = design.speed if turning is None else turning
    alone = design.tables.start.bit_speed
    numbers["bit_speed"] = design.speed + program.speed.at(0.0) if alone is None else alone
    numbers["nominal_weight"] = design.tables.operating_point.weight_on_bit
    numbers["table_low"], numbers["table_high"] = design.table_range
    return numbers


TIMED = (
    "speed_program.", "weight_program.", "rock_until", "drive.period", "variation.spread",
    "variation.spacing", "variation.advance",
)  # fmt: skip
"""How the names of those numbers begin that the ends of steps, and their length, follow from."""


def timed(numbers: dict[str, Any]) -> tuple[Any, ...]:
    """Those numbers: lanes that agree on them can share a prepared string."""
    return tuple(value for name, value in numbers.items() if name.startswith(TIMED))


def lanes_of(design: Design, numbers: dict[str, Array]) -> Lanes:
    """Lanes on the string of `design`, with the types of its laws."""
    from drillctl.linear.observer import observer_of  # SciPy, which axes need not wait for

    def law(part: str, like: Any) -> Any:
        return type(like)(*(np.ascontiguousarray(numbers[f"{part}.{f}"]) for f in like._fields))

    return Lanes(
        string=design.string,
        friction=law("friction", design.bit_rock),
        drive=law("drive", design.top_drive),
        weight=law("weight", design.weight_on_bit),
        set_speed=numbers["set_speed"],
        turning_speed=numbers["turning_speed"],
        nominal_weight=numbers["nominal_weight"],
        table_low=numbers["table_low"],
        table_high=numbers["table_high"],
        before=law("before", design.bit_rock_before),
        variation=law("variation", design.variation),
        program=Program(
            law("speed_program", design.program.speed),
            law("weight_program", design.program.weight),
            numbers["rock_until"],
        ),
        observer=observer_of(design),
        axial=design.axial,
        bit_speed=numbers["bit_speed"],
        start=design.tables.start.kind,
        wall=None if design.wall is None else design.wall._replace(
            torque=np.stack([numbers[f"wall.{k}"] for k in range(len(design.wall.nodes))])
        ),
    )  # fmt: skip


def single_lane(design: Design) -> Lanes:
    """One lane: the design as it stands."""
    return lanes_of(design, {k: np.array([v]) for k, v in lane_numbers(design).items()})
