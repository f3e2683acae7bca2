r"""Linear robust design: gains with the largest friction-slope margin over a set of loops.

Starts spread over the bounds are looked at on the frequency grid. From the best of them programs
are solved within a reach that grows where a program was right about what it promised and shrinks
where other crossings had become the lowest: a trust region whose model is exact but for the
crossings that it does not know of.

A program is solved by IPOPT. The slope margin is a minimum over crossings, and where each lies
follows from the gains: not smooth. With the crossings' frequencies as variables and the margin
above the slope, t, as another (the epigraph), it is

.. math:: \max\; t - c\,v \quad\text{with}\quad \mathrm{Im}\,Z_k(p, \omega_k) = 0, \quad
          \mathrm{Re}\,Z_k(p, \omega_k) - D_k \ge t, \quad v \ge 0,

over the crossings k of all loops. Poles of the first modes, and the delays that a loop bears, are
followed in the same way by the characteristic equation. Sensitivities are limited at the
frequencies of their peaks. What is required may be missed by v, at a price that pays for nothing:
a program without a feasible point ends at the closest one. Crossings, poles and peaks are computed
again at the result, as others may have become the lowest.

Crossings, poles, delays and sensitivities are CasADi functions that take the tuned values first;
the string comes as data, the series of a circle, and what differs from loop to loop as constants:
one function serves all loops whose laws are of one kind. Derivatives are exact, first and second.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from drillctl.arrays import Array, own_errstate
from drillctl.design import Design
from drillctl.ensemble.parameters import draw
from drillctl.errors import InputError
from drillctl.linear.loop_analysis import tolerated_slope
from drillctl.store.codec import documented, label
from drillctl.store.json_files import picked, strict
from drillctl.studies.tune.loops import (
    TERMS,
    WITHIN,
    Chain,
    Circle,
    Crossing,
    Loop,
    Loops,
    LoopsState,
    LoopState,
    Pair,
    chain,
    chain_at,
    circles,
    least_seen,
    loops_of,
    pair,
    refuse_not_linear,
)
from drillctl.studies.tune.settings import TuneConstraintsTable
from drillctl.studies.tune.tuned import (
    StringNumbers,
    Tuned,
    TunedGains,
    by_path,
    designs_at,
    drive_numbers,
    put,
    spelled,
    spread,
    tuned_parameters,
    unmet,
)

PRICE = 100.0  # of missing a requirement, over what a unit of it could gain in margin
WIDER = 1.6  # crossings up to this many times the lowest are in the program
MOST = 12  # crossings of a loop in it
BESIDE = 1.0 + 0.1j  # where the size of a characteristic function is read, over its root


class Point(NamedTuple):
    """One point of a loop: its function, its data, and the beginning of its own variables."""

    name: str
    loop: Loop
    data: Array
    begin: tuple[float, ...]
    reach: tuple[tuple[float, float], ...]
    negative: bool = False


class LinearProgram:
    """Programs about given gains."""

    def __init__(self, problem: Loops, verbose: bool = False) -> None:
        self.problem, self.verbose = problem, verbose
        self.solves = 0
        self._functions: dict[Any, PointFunctions] = {}

    def step(self, state: LoopsState, reach: float) -> Array:
        """The best values (SI), shape (parameters,), at most `reach` of the bounds' width away."""
        import casadi as ca

        tuned = self.problem.tuned
        low = np.array([t.low for t in tuned])
        width = np.array([t.high - t.low for t in tuned])
        at = (state.values - low) / width
        points = list(_points(state))
        excess = state.excess / self.problem.scale
        begin = [*at, excess if np.isfinite(excess) else 0.0, state.violation + 1e-3]
        least = [*np.maximum(0.0, at - reach), -1e3, 0.0]
        most = [*np.minimum(1.0, at + reach), 1e3, 1e3]
        for point in points:
            begin += point.begin
            least += [a for a, _ in point.reach]
            most += [b for _, b in point.reach]
        x = ca.MX.sym("x", len(begin))
        n = len(tuned)
        equal, more = self._constraints(points, x, x[:n] * width + low, x[n], x[n + 1])
        result = self._solve(x, -x[n] + PRICE * x[n + 1], equal, more, begin, least, most)
        return np.clip(low + width * result[:n], low, low + width)

    def _constraints(
        self, points: list[Point], x: Any, values: Any, t: Any, v: Any
    ) -> tuple[list[Any], list[Any]]:
        """What is zero and what is not negative; points with one function are one mapped call."""
        import casadi as ca

        first = len(self.problem.tuned) + 2
        places = np.cumsum([first, *(len(point.begin) for point in points)])
        groups: dict[tuple[Any, ...], list[int]] = {}
        for k, point in enumerate(points):
            kind = kind_of(point.loop, self.problem.tuned)
            groups.setdefault((point.name, kind, point.negative), []).append(k)
        equal: list[Any] = []
        more: list[Any] = []
        for (name, _, negative), members in groups.items():
            some = [points[k] for k in members]
            count = len(members)
            own = [x[int(places[k]) : int(places[k + 1])] for k in members]
            if name == "sensitivity":
                own = [ca.MX(p.data[-1]) for p in some]
            data = np.stack([p.data[:-1] if name == "sensitivity" else p.data for p in some], 1)
            known = np.stack([constants_of(p.loop) for p in some], 1)
            function = getattr(self._of(some[0].loop), name).map(count)
            called = function(ca.repmat(values, 1, count), known, data, ca.horzcat(*own))
            zero, kept = self._meaning(name, negative, called, some, own, t, v)
            equal += [ca.vec(zero)] if zero is not None else []
            more.append(ca.vec(kept))
        asked = self.problem.asked
        if asked.slope_reserve is not None:
            more.append(t + v - asked.slope_reserve / self.problem.scale)
        elif self.problem.needs_stability:
            more.append(t + v)
        return equal, more

    def _meaning(
        self, name: str, negative: bool, called: Any, some: list[Point], own: Any, t: Any, v: Any
    ) -> tuple[Any, Any]:
        """What the values of a kind of points must be: zero, and not negative."""
        import casadi as ca

        asked, scale = self.problem.asked, self.problem.scale
        if name == "crossing":
            slope, imaginary = called
            if negative:
                return imaginary / scale, v - slope / scale
            own_slopes = np.array([[p.loop.slope for p in some]])
            return imaginary / scale, (slope - own_slopes) / scale - t
        if name == "pole":
            return called[0], called[1] - asked.damping_ratio + v
        if name == "late":
            return called, ca.horzcat(*own)[1, :] / asked.delay - 1.0 + v
        over, under = called
        most = asked.peak_sensitivity or 0.0
        return None, most**2 * under * (1.0 + v) ** 2 - over

    def _of(self, loop: Loop) -> PointFunctions:
        kind = kind_of(loop, self.problem.tuned)
        if kind not in self._functions:
            self._functions[kind] = point_functions(loop, self.problem.tuned)
        return self._functions[kind]

    def _solve(
        self, x: Any, objective: Any, equal: list[Any], more: list[Any],
        begin: list[float], least: list[float], most: list[float],
    ) -> Array:  # fmt: skip
        import casadi as ca

        options: dict[str, Any] = {
            "print_time": False, "error_on_fail": False, "ipopt.max_iter": 150,
            "ipopt.tol": 1e-9, "ipopt.acceptable_tol": 1e-6, "ipopt.sb": "yes",
            "ipopt.print_level": 5 if self.verbose else 0, "ipopt.mu_init": 1e-3,
            "show_eval_warnings": self.verbose,
        }  # fmt: skip
        zero, kept = ca.vertcat(*equal), ca.vertcat(*more)
        solver = ca.nlpsol(
            "linear", "ipopt", {"x": x, "f": objective, "g": ca.vertcat(zero, kept)}, options
        )
        upper = np.concatenate([np.zeros(zero.numel()), np.full(kept.numel(), np.inf)])
        begin = [min(max(b, low), high) for b, low, high in zip(begin, least, most, strict=True)]
        result = solver(x0=begin, lbx=least, ubx=most, lbg=np.zeros(len(upper)), ubg=upper)
        self.solves += 1
        return np.asarray(result["x"]).ravel()


def _points(state: LoopsState) -> Iterator[Point]:
    """Everything that may decide near the gains of a state."""
    named = by_path(state.problem.tuned, state.values)
    inside = (-WITHIN, WITHIN)
    for one in state.loops:
        for crossing in _deciding(one):
            u = (crossing.omega - crossing.circle.centre.imag) / crossing.circle.radius
            data = circle_data(crossing.circle)
            yield Point("crossing", one.loop, data, (u,), (inside,), crossing.slope <= 0.0)
        for circle, pole in _about(one.loop, one.poles):
            data = circle_data(circle, _size(one.loop, named, complex(pole) * BESIDE))
            half = (-WITHIN / 2, WITHIN / 2)
            yield Point("pole", one.loop, data, (0.0, 0.0), (half, half))
        for circle, late in _about(one.loop, 1j * np.array([d.omega for d in one.delays])):
            data = circle_data(circle, _size(one.loop, named, complex(late) * BESIDE))
            delay = next(d.delay for d in one.delays if d.omega == circle.centre.imag)
            yield Point("late", one.loop, data, (0.0, delay), (inside, (0.0, np.inf)))
        for peak in one.peaks:
            known = chain(one.loop.ends, np.array([1j * peak.omega]))
            flat = chain_data(
                type(known)(*(x[0] for x in known)), abs(complex(known.alpha[0])) ** 2
            )
            yield Point("sensitivity", one.loop, np.append(flat, peak.omega), (), ())


def _about(loop: Loop, places: Any) -> Iterator[tuple[Circle, Any]]:
    """Circles about complex frequencies (1/s)."""
    if len(places):
        yield from zip(circles(loop.ends, places), places, strict=True)


def _size(loop: Loop, named: dict[str, float], s: complex) -> float:
    """Magnitude of the characteristic function next to a root."""
    at = np.array([s])
    rock = loop.rock(named, at) - loop.slope
    return abs(complex(chain(loop.ends, at).characteristic(loop.drive(named, at), rock)[0]))


def _deciding(state: LoopState) -> list[Crossing]:
    """Crossings that may decide near the gains of a state."""
    positive = [c for c in state.crossings if c.slope > 0.0]
    negative = [c for c in state.crossings if c.slope <= 0.0]
    limit = WIDER * positive[0].slope if positive else 0.0
    chosen = [c for c in positive if c.slope <= limit][: MOST - 1]
    # The one of lowest frequency moves most with the gains.
    lowest = min(positive, key=lambda c: c.omega, default=None)
    if lowest is not None and not any(lowest is c for c in chosen):
        chosen.append(lowest)
    return chosen + negative[-2:]


DATA = 8 * TERMS + 4  # numbers that describe a circle
CONSTANTS = 6  # numbers in which a loop differs from another of its kind


@dataclass(frozen=True, eq=False)
class PointFunctions:
    """CasADi functions of loops of one kind."""

    # (values, constants, circle, u) -> slope at which poles lie at centre + i radius u, and its
    # imaginary part, zero at a crossing (N m s/rad)
    crossing: Any
    # (values, constants, circle, u), u a pair -> characteristic function (2,) over a size, and
    # the damping ratio of a pole there
    pole: Any
    # (values, constants, circle, (u, delay)) -> characteristic function (2,) over a size with the
    # drive later by a delay (s), on the axis
    late: Any
    # (values, constants, chain, omega) -> squares of numerator and denominator of the sensitivity
    # at the top torque, over a size
    sensitivity: Any


def kind_of(loop: Loop, tuned: tuple[Tuned, ...]) -> tuple[Any, ...]:
    """What loops have in common that share their functions."""
    values = {t.path: 1.0 for t in tuned}
    fixed = drive_numbers(loop.design, values, loop.string)
    law: Any = loop.design.linear_drive
    # The anti-windup plays no part in a linear loop.
    kept = tuple(v for k, v in law._asdict().items() if k not in {*fixed, "tracking"})
    side = loop.weight
    path = None if side is None else (side.gain, side.path.delay, side.path.sensor, side.path.hoist)
    return type(law), kept, loop.design.tables.controller.model_dump_json(), path


def constants_of(loop: Loop) -> Array:
    """Numbers in which a loop differs from another of its kind."""
    return np.array([*loop.string, loop.slope, 0.0 if loop.weight is None else loop.weight.torque])


def point_functions(loop: Loop, tuned: tuple[Tuned, ...]) -> PointFunctions:
    """Functions of the loops of one kind over the values (SI) of what is tuned."""
    import casadi as ca

    p, known = ca.SX.sym("p", len(tuned)), ca.SX.sym("constants", CONSTANTS)
    # As pairs, so that the laws' equations never mix symbols and pairs.
    values = {t.path: pair(p[k]) for k, t in enumerate(tuned)}
    string = StringNumbers(*(pair(known[k]) for k in range(4)))
    side = None if loop.weight is None else replace(loop.weight, torque=pair(known[5]))
    loop = replace(loop, string=string, slope=known[4], weight=side)
    data = ca.SX.sym("circle", DATA)
    terms, centre, radius, size = _read(data)

    def function(name: str, own: Any, results: list[Any]) -> Any:
        return ca.Function(name, [p, known, data, own], results)

    def root(s: Pair, u: Pair, drive: Pair) -> Any:
        end = chain_at(terms, u).characteristic(drive, loop.rock(values, s) - loop.slope)
        return ca.vertcat(end.re, end.im) / size

    u, both = ca.SX.sym("u"), ca.SX.sym("u", 2)
    s = Pair(0.0, centre.im + radius * u)
    over, under = chain_at(terms, Pair(0.0, u)).bit(loop.drive(values, s))
    impedance = over * under.conjugate() * (1.0 / under.square) + loop.rock(values, s)
    crossing = function("crossing", u, [impedance.re, impedance.im])
    at = Pair(both[0], both[1])
    s = centre + at * radius
    ratio = -s.re / ca.sqrt(s.square)
    pole = function("pole", both, [root(s, at, loop.drive(values, s)), ratio])
    s = Pair(0.0, centre.im + radius * both[0])
    drive = loop.drive(values, s) * (-s * both[1]).exp()
    late = function("late", both, [root(s, Pair(0.0, both[0]), drive)])
    return PointFunctions(crossing, pole, late, _sensitivity(loop, values, p, known))


def _read(data: Any) -> tuple[tuple[Any, Any], Pair, Any, Any]:
    """Series, centre, radius and size of a circle."""
    import casadi as ca

    half = 4 * TERMS
    terms = ca.reshape(data[:half], 4, TERMS), ca.reshape(data[half : 2 * half], 4, TERMS)
    rest = data[2 * half :]
    return terms, Pair(rest[0], rest[1]), rest[2], rest[3]


def _sensitivity(loop: Loop, values: dict[str, Any], p: Any, known: Any) -> Any:
    import casadi as ca

    omega, flat = ca.SX.sym("omega"), ca.SX.sym("chain", 9)
    s = Pair(0.0, omega)
    chain = Chain(*(Pair(flat[k], flat[k + 4]) for k in range(4)))
    rock = loop.rock(values, s) - loop.slope
    above = chain.alpha + rock * chain.gamma
    whole = chain.characteristic(loop.drive(values, s), rock)
    squares = [above.square / flat[8], whole.square / flat[8]]
    return ca.Function("sensitivity", [p, known, flat, omega], squares)


def circle_data(circle: Circle, size: float = 1.0) -> Array:
    """A circle as the functions take it; `size` scales the characteristic function."""
    terms = circle.terms
    return np.concatenate([
        terms.real.ravel(order="F"), terms.imag.ravel(order="F"),
        [circle.centre.real, circle.centre.imag, circle.radius, size],
    ])  # fmt: skip


def chain_data(chain: Chain, size: float) -> Array:
    """Chain parameters at one frequency as the functions take them."""
    flat = np.array([complex(part) for part in chain])
    return np.concatenate([flat.real, flat.imag, [size]])


LOOKED_AT = 48  # starts that are looked at on the grid, for each tuned parameter
LOOPS_LOOKED_AT = 4  # loops at which they are
STARTS = 2
"""Of them, followed further; never two within `APART` of each other, over the bounds' width."""
APART = 0.15
FIRST_REACH = 0.25  # longest first step over the bounds' width
SHORTEST_REACH = 1e-6  # and the reach at which a search ends
LEAST_GAIN = 1e-6  # gain of a program, over what there is, under which it ends too
PROGRAMS = 25  # most programs from one start
KEPT = 1e-6  # violation that is rounding


@dataclass(frozen=True, eq=False)
@documented
class LinearDesign(TunedGains):
    """Gains of the linear design."""

    loops: int = label(means="how many loops they hold for")
    excess: float = label(
        unit="N*m*s/rad", means="least slope margin less slope of the rock over the loops"
    )
    slope_margin: float = label(unit="N*m*s/rad", means="D* of the design itself with these gains")
    deciding_frequency_hz: float = label(unit="Hz", means="of the poles that decide it")
    starts: list[dict[str, Any]] = label(means="what each start led to")
    programs: int = label(means="nonlinear programs solved")

    def summary(self) -> dict[str, Any]:
        """Strict JSON values, SI."""
        figures = picked(
            self, "gains", "excess", "slope_margin", "deciding_frequency_hz", "loops", "feasible",
            "violations", "message", "programs", "seconds",
        )  # fmt: skip
        return dict(strict(figures))


@own_errstate()
def linear_design(
    design: Design,
    strings: int = 0,
    seed: int | None = None,
    asked: TuneConstraintsTable | None = None,
    verbose: bool = False,
) -> LinearDesign:
    """Find the gains of the largest slope margin.

    Parameters
    ----------
    design : Design
        Its `[tune]` table names what is tuned, its bounds and what is required.
    strings : int
        Draws of what `[uncertain]` names that the gains must hold for besides the design itself.
    seed : int, optional
        Of the draws; by default that of `[tune]`.
    asked : TuneConstraintsTable, optional
        Requirements instead of those of `[tune]`.
    verbose : bool
        Let IPOPT print.

    Returns
    -------
    LinearDesign
        Requirements that cannot be met are stated in its message, with the closest point.

    Raises
    ------
    InputError
        A parameter that the linear loop does not know, or bounds within which no loop is stable.
    """
    begin, processor = time.perf_counter(), time.process_time()
    tuned = tuned_parameters(design)
    refuse_not_linear(design, tuned)
    asked = design.tables.tune.constraints if asked is None else asked
    designs = [design]
    if strings:
        seed = design.tables.tune.seed if seed is None else seed
        designs += designs_at(design, draw(design, strings, seed))
    loops = loops_of(designs, tuned)
    problem = Loops(tuned, loops, asked)
    program = LinearProgram(problem, verbose)
    followed = [_followed(problem, program, start) for start in _starts(problem)]
    if not followed:
        raise InputError(
            "no loop between the bounds of the tuned parameters is stable without falling friction",
            "tune.parameters",
        )
    best = min(followed, key=_merit)
    variant = put(design, tuned, best.values)
    margin, omega = tolerated_slope(variant, variant.speed)
    missed = {key: value for key, value in best.violations.items() if value > KEPT}
    starts = [
        {"gains": by_path(tuned, s.values), "excess": s.excess, "violation": s.violation}
        for s in followed
    ]
    return LinearDesign(
        design=variant,
        tuned=tuned,
        values=best.values,
        loops=len(loops),
        excess=best.excess,
        slope_margin=margin,
        deciding_frequency_hz=omega / (2.0 * math.pi),
        violations=missed,
        message=_message(best, missed),
        starts=starts,
        programs=program.solves,
        seconds=time.perf_counter() - begin,
        processor_seconds=time.process_time() - processor,
    )


def linear_or_why(design: Design, verbose: bool = False) -> LinearDesign | InputError:
    """The linear design, or why there is none; once for a search and what stands beside it."""
    try:
        return linear_design(design, verbose=verbose)
    except InputError as error:
        return error


def _message(best: LoopsState, missed: dict[str, float]) -> str:
    at = spelled(best.problem.tuned, best.values)
    if missed:
        return unmet(at, missed)
    if best.excess < 0.0:
        return (
            f"no gains between these bounds are stable: at the best gains, {at}, the slope of the "
            f"rock exceeds the slope margin by {-best.excess:.4g} N*m*s/rad"
        )
    return f"largest slope margin at {at}: {best.excess:.4g} N*m*s/rad above the slope of the rock"


def _starts(problem: Loops) -> list[LoopsState]:
    """The best of many gains, apart from each other, that are stable without slope."""
    tuned, loops = problem.tuned, problem.loops
    looked = loops[:: max(1, len(loops) // LOOPS_LOOKED_AT)][:LOOPS_LOOKED_AT]
    points = spread(tuned, LOOKED_AT * len(tuned))
    excess = [min(least_seen(x, by_path(tuned, p)) - x.slope for x in looked) for p in points]
    width = np.array([t.high - t.low for t in tuned])
    chosen: list[LoopsState] = []
    for k in np.argsort(-np.array(excess), kind="stable"):
        if len(chosen) == STARTS:
            break
        if all(np.max(np.abs(points[k] - s.values) / width) > APART for s in chosen):
            state = problem.at(points[k])
            chosen += [state] if math.isfinite(state.excess) else []
    return chosen


def _merit(state: LoopsState) -> float:
    """What a search lowers: the margin, less what requirements are missed by."""
    return -state.excess / state.problem.scale + PRICE * state.violation


def _followed(problem: Loops, program: LinearProgram, state: LoopsState) -> LoopsState:
    """The end of a search from one start."""
    reach = FIRST_REACH
    for _ in range(PROGRAMS):
        trial = problem.at(program.step(state, reach))
        gain = _merit(state) - _merit(trial)
        if not gain > 0.0:
            reach *= 0.25
            if reach < SHORTEST_REACH:
                break
            continue
        state = trial
        if gain < LEAST_GAIN * (1.0 + abs(_merit(state))):
            break
        reach = min(2.0 * reach, 1.0)
    return state
