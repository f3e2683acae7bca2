"""The batch engine's scheme in CasADi: J1 of a lane and its derivatives over what is tuned.

One step is one function of the lane's state; tuned values and the lane's numbers are states that
do not move, so that nothing need be copied from step to step. Beside the state goes its
derivative over the tuned values, by CasADi's forward mode through the step: a handful of gains
takes a handful of directions, and no state of the past need be kept. The step is folded over
time and mapped over lanes. No compiler is needed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design
from drillctl.errors import InputError
from drillctl.rig.bit_rock.law import contact
from drillctl.rig.top_drive import PI, ConstantTorque, RealDrive
from drillctl.rig.weight_on_bit import ConstantWeight, FollowingSpeed
from drillctl.simulation.batch import Prepared
from drillctl.simulation.lanes import Lanes, start
from drillctl.studies.robust.bit_step import Bit, meet_rock
from drillctl.studies.robust.drive_steps import Ideal, Real, Top
from drillctl.studies.robust.string_matrices import StringMatrices, string_matrices
from drillctl.studies.robust.tuned import (
    Tuned,
    controller_paths,
    drive_numbers,
    string_numbers,
    tracked,
)

Array = NDArray[np.float64]

FAR = 1e30
"""In place of infinity, whose derivative is no number."""
MEASURED = ("j1", "peak_top_torque", "mean_weight_on_bit", "effort")
"""What a trajectory measures: those of `simulation.batch` by the same definitions, and `effort`,
the root mean square of the mean top torque of each step less its steady value (N m)."""


@dataclass(frozen=True, eq=False)
class Sensitivities:
    """Measures of lanes and their derivatives."""

    values: dict[str, Array]  # shape (lanes,): By the names of `MEASURED` (SI)
    # shape (lanes, parameters): Their derivatives over the tuned values (SI)
    slopes: dict[str, Array]


def why_not(design: Design, lanes: Lanes, tuned: tuple[Tuned, ...]) -> str | None:
    """Why trajectories of a design have no derivatives here; None if they have."""
    if not lanes.friction.set_valued:
        return "the friction law is not set-valued"
    if not isinstance(lanes.drive, (PI, ConstantTorque, RealDrive)):
        return "the drive is sampled"
    if not isinstance(lanes.weight, (ConstantWeight, FollowingSpeed)):
        return "the weight on bit has a memory"
    program = lanes.program
    moves = np.any(program.speed.first != 0.0) or np.any(program.weight.first != 0.0)
    if moves or np.any(program.rock_until > 0.0):
        return "a program changes the run by the clock"
    allowed = [*controller_paths(design)]
    if isinstance(lanes.weight, FollowingSpeed):
        allowed.append("weight_on_bit.gain")
    other = [t.path for t in tuned if t.path not in allowed]
    return f"{', '.join(other)} has no derivative here" if other else None


class Trajectories:
    """Trajectories of lanes that share a string, as functions of what is tuned.

    Parameters
    ----------
    design : Design
        Of the lanes; gives the controller's law.
    lanes : Lanes
        Realizations.
    prepared : Prepared
        String and scheme, those of the batch engine.
    tuned : tuple of Tuned
        Over what derivatives are taken.

    Raises
    ------
    InputError
        The laws have no derivatives here; see `why_not`.
    """

    def __init__(
        self, design: Design, lanes: Lanes, prepared: Prepared, tuned: tuple[Tuned, ...]
    ) -> None:
        reason = why_not(design, lanes, tuned)
        if reason is not None:
            raise InputError(f"no derivatives of J1: {reason}", "tune")
        self.lanes, self.prepared, self.tuned = lanes, prepared, tuned
        self._numbers = _numbers(lanes)
        self._step = _Step(design, lanes, prepared, tuned, string_matrices(prepared.stepper.string))
        self._folded: dict[bool, Any] = {}

    def measures(self, values: Array, chosen: NDArray[np.int64] | None = None) -> dict[str, Array]:
        """Measures of lanes at tuned values (SI), shape (parameters,); all lanes by default."""
        return self._run(values, chosen, False).values

    def sensitivities(
        self, values: Array, chosen: NDArray[np.int64] | None = None
    ) -> Sensitivities:
        """The same and their derivatives."""
        return self._run(values, chosen, True)

    def _run(self, values: Array, chosen: NDArray[np.int64] | None, slopes: bool) -> Sensitivities:
        numbers = self._numbers if chosen is None else self._numbers[:, chosen]
        lanes = numbers.shape[1]
        if slopes not in self._folded:
            self._folded[slopes] = self._step.folded(slopes)
        whole = self._folded[slopes].map(lanes)
        result = whole.call([np.repeat(np.asarray(values, float)[:, None], lanes, 1), numbers])
        found = np.asarray(result[0])
        named = {name: found[k] for k, name in enumerate(MEASURED)}
        if not slopes:
            return Sensitivities(named, {})
        rows = np.asarray(result[1]).reshape(len(MEASURED), lanes, len(self.tuned))
        return Sensitivities(named, {name: rows[k] for k, name in enumerate(MEASURED)})


def _numbers(lanes: Lanes) -> Array:
    """Every number of the lanes, shape (numbers, lanes); a limit that is none is far away."""
    parts = [*lanes.friction, *lanes.drive, *lanes.weight]
    numbers = np.stack([*parts, lanes.set_speed, lanes.turning_speed])
    return np.clip(numbers, -FAR, FAR)


def _drive_step(drive: Any, step: float) -> Ideal:
    """How the drive of some lanes moves."""
    if not isinstance(drive, RealDrive):
        return Ideal(step)
    lags = [bool(np.any(lag > 0.0)) for lag in (drive.encoder, drive.torque_filter, drive.lag)]
    return Real(step, (lags[0], lags[1], lags[2]))


class _Step:
    """One step of a lane, and the run that it is folded into."""

    def __init__(
        self, design: Design, lanes: Lanes, prepared: Prepared, tuned: tuple[Tuned, ...],
        matrices: StringMatrices,
    ) -> None:  # fmt: skip
        import casadi as ca

        self.design, self.lanes, self.prepared, self.tuned = design, lanes, prepared, tuned
        self.matrices = matrices
        self.states = len(matrices.push)
        self.drive = _drive_step(lanes.drive, prepared.scheme.step)
        self.p = ca.SX.sym("p", len(tuned))
        self.r = ca.SX.sym("r", len(_numbers(lanes)))
        self.string = string_numbers(design.string)

    def laws(self, p: Any, r: Any) -> tuple[Any, Any, Any, Any, Any]:
        """Friction, drive, weight, set speed, speed of a turning start."""
        values = {t.path: p[k] for k, t in enumerate(self.tuned)}
        made, at = [], 0
        for law in (self.lanes.friction, self.lanes.drive, self.lanes.weight):
            made.append(type(law)(*(r[at + k] for k in range(len(law)))))
            at += len(law)
        friction, drive, weight = made
        drive = drive._replace(**self._tuned_drive(values, drive))
        if "weight_on_bit.gain" in values:
            weight = weight._replace(gain=values["weight_on_bit.gain"])
        return friction, drive, weight, r[at], r[at + 1]

    def _tuned_drive(self, values: Mapping[str, Any], drive: Any) -> dict[str, Any]:
        """Fields that the tuned values set; others stay the lane's own."""
        if not any(path.startswith("controller.") for path in values):
            return {}
        numbers = tracked(self.design, drive_numbers(self.design, values, self.string))
        return {k: v for k, v in numbers.items() if k in drive._fields}

    def begin(self) -> Any:
        """State at time zero, as a vector of symbols."""
        import casadi as ca

        friction, drive, weight, omega, turning = self.laws(self.p, self.r)
        string, stepper = self.lanes.string, self.prepared.stepper
        one = np.ones(1)
        shapes = start(string, self.lanes.start, one, 2.0 * one, one)
        static = friction.static_torque(weight.weight(0.0 * omega))
        speed, angle = {
            "rest": (-omega, 0.0), "turning": (turning - omega, 0.0),
            "wound_up": (-omega, -static),
        }[self.lanes.start]  # fmt: skip
        z = ca.DM(stepper.angle_to_state @ shapes.twist) * angle
        z += ca.DM(stepper.speed_to_state @ shapes.turn) * speed
        z -= ca.DM(stepper.angle_to_state @ stepper.rest) * omega
        bit_speed = shapes.turn[-1] * speed + omega
        torque, slope = contact(friction, weight, ca.fabs(bit_speed), ca.exp)
        direction = ca.sign(bit_speed)
        top_speed = shapes.turn[0] * speed
        memory = self.drive.begin(drive, top_speed, omega)
        bit = Bit(bit_speed, direction, direction * torque, slope, -1.0)
        steady = contact(friction, weight, omega, ca.exp)[0] + stepper.string.drag * omega
        sums = (steady, 0.0, 0.0, 0.0, 0.0, 0.0)
        return ca.vertcat(z, 0.0, top_speed, 0.0, *bit, *memory, *sums)

    def advance(self, x: Any, p: Any, r: Any) -> Any:
        """State after one step."""
        import casadi as ca

        friction, drive, weight, omega, _ = self.laws(p, r)
        m, fixed, n = self.matrices, self.prepared.stepper.string, self.states
        z, angle, top_speed, torque = x[:n], x[n], x[n + 1], x[n + 2]
        bit, memory = Bit(*(x[n + 3 + k] for k in range(5))), x[n + 8 : n + 8 + self.drive.size]
        drag = fixed.drag * omega
        swing = ca.mtimes(ca.sparsify(ca.DM(m.free)), z)
        top = Top(
            angle,
            top_speed,
            ca.dot(ca.DM(m.top_angle), swing) - fixed.angle_by_top * drag,
            # An ideal drive acts on the angle alone.
            ca.dot(ca.DM(m.top_speed), swing) - fixed.top_speed_by_top * drag
            if self.drive.size
            else 0.0,
            omega,
            torque,
        )
        line, kept = self.drive.line(drive, memory, top, fixed)
        shrink = 1.0 / (
            1.0 + line.slope * fixed.angle_by_top + line.speed_slope * fixed.top_speed_by_top
        )
        alone = line.offset - line.slope * top.free_angle - line.speed_slope * top.free_speed
        alone *= shrink
        share = line.slope * fixed.angle_by_bit + line.speed_slope * fixed.top_speed_by_bit
        share *= shrink
        free = omega + ca.dot(ca.DM(m.bit_speed), swing) + fixed.speed_by_top * (alone - drag)
        met = meet_rock(
            friction, weight, free, fixed.speed_by_bit - fixed.speed_by_top * share, bit
        )
        given = alone + share * met.torque
        z = swing + ca.mtimes(ca.DM(m.push), ca.vertcat(given - drag, met.torque))
        after = (
            top.free_angle + fixed.angle_by_top * given - fixed.angle_by_bit * met.torque,
            top.free_speed + fixed.top_speed_by_top * given - fixed.top_speed_by_bit * met.torque
            if self.drive.size
            else 0.0,
        )
        moved = self.drive.follow(drive, memory, kept, top, after, given)
        sums = x[n + 8 + self.drive.size :]
        measured = self._measure(sums, bit, met.bit, given, weight, omega)
        return ca.vertcat(z, *after, met.torque, *met.bit, *moved, measured)

    def _measure(
        self, sums: Any, before: Bit, after: Bit, top: Any, weight: Any, omega: Any
    ) -> Any:
        """Measures with one step added, after the steady torque; the last counts the steps."""
        import casadi as ca

        step, begin = self.prepared.scheme.step, sums[5] * self.prepared.scheme.step
        late = (begin + step - self.prepared.j1_from) / step
        within = ca.fmin(1.0, ca.fmax(0.0, late)) if self.prepared.j1_from > 0.0 else 1.0
        error, error_after = before.speed - omega, after.speed - omega
        size, size_after = ca.fabs(error), ca.fabs(error_after)
        both = ca.if_else(error * error_after < 0.0, size + size_after, 1.0)
        crossing = ca.if_else(error * error_after < 0.0, size * size_after / both, 0.0)
        j1 = step * within * (0.5 * (size + size_after) - crossing) / omega
        loads = weight.weight(ca.fabs(before.speed)) + weight.weight(ca.fabs(after.speed))
        return ca.vertcat(
            sums[0],
            sums[1] + j1,
            ca.fmax(sums[2], ca.fabs(top)),
            sums[3] + 0.5 * step * loads / self.prepared.duration,
            sums[4] + step * (top - sums[0]) ** 2 / self.prepared.duration,
            sums[5] + 1.0,
        )

    def folded(self, slopes: bool) -> Any:
        """The whole run: (tuned values, numbers) -> measures, and their derivatives if asked."""
        import casadi as ca

        begin = self.begin()
        size, n = begin.numel(), self.p.numel()
        x = ca.SX.sym("x", size + n + self.r.numel())
        # Values and numbers ride along: their columns do not move.
        p, r = x[size : size + n], x[size + n :]
        after = self.advance(x[:size], p, r)
        whole = ca.vertcat(after, p, r)
        state = [ca.vertcat(begin, self.p, self.r)]
        if slopes:
            seeds = ca.SX.sym("s", size, n)
            directions = ca.vertcat(seeds, ca.DM.eye(n), ca.DM.zeros(self.r.numel(), n))
            moved = ca.jtimes(after, x, directions)
            both = ca.vertcat(x, ca.vec(seeds))
            step = ca.Function("step", [both], [ca.vertcat(whole, ca.vec(moved))])
            state.append(ca.vec(ca.jacobian(begin, self.p)))
        else:
            step = ca.Function("step", [x], [whole])
        first = ca.Function("begin", [self.p, self.r], [ca.vertcat(*state)])
        values, numbers = ca.MX.sym("p", n), ca.MX.sym("r", self.r.numel())
        end = step.fold(self.prepared.scheme.steps)(first(values, numbers))
        place = size - 5
        measured = _rooted(end[place : place + 4])
        if not slopes:
            return ca.Function("run", [values, numbers], [measured])
        last = ca.reshape(end[x.numel() :], size, n)[place : place + 4, :]
        # The effort is a root of a mean square.
        root = ca.vertcat(1.0, 1.0, 1.0, 0.5 / ca.fmax(measured[3], 1e-300))
        return ca.Function("run", [values, numbers], [measured, ca.repmat(root, 1, n) * last])


def _rooted(sums: Any) -> Any:
    import casadi as ca

    return ca.vertcat(sums[0], sums[1], sums[2], ca.sqrt(sums[3]))
