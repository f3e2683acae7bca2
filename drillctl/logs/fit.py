"""The rock and the string fitted to windows of a log: Gauss-Newton with robust weights.

Each window is a run of the inclusion driven by the wave that goes down. What is fitted are the
numbers of a law and, where asked for, factors on the string; the bit speed at the beginning of
each window is a number of its own, eliminated window by window. Errors follow from scatter: each
third of a window is left out once, to first order (a jackknife), since what limits a fit, sampling
at the edges of stick and slip, is neither white nor the same everywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline

from drillctl.arrays import Array
from drillctl.logs.inclusion import Exponentials, Rock, advance
from drillctl.logs.laws import Curve, Family
from drillctl.logs.waves import FINEST, PER_SWING, Below, Factors, Track, below, split, swing
from drillctl.rig.drillstring import Parts

FACTORS = ("travel_time", "impedance", "bit_inertia", "drive_inertia")
ROBUST = 2.4  # residual over its usual size at which a sample counts half (Cauchy)
PIECES = 3  # of a window that are left out one by one: a cycle or more each
ROUNDS = 25  # of Gauss-Newton at most
SMALL = 1e-6  # relative step of a difference
SETTLED = 1e-6  # decrease of the objective, relative, that ends a fit
AT_REST = 0.05  # speed of the bit at the beginning of a window, over the mean, that noise may be
FARTHEST = 0.5  # of its size that a number may go with a window left out, as all that tells it
QUIET = 2.0  # variance over that of noise of a log that says nothing but a mean
STICKING = 0.02  # share of a window at rest from which it has sticks


@dataclass(frozen=True, eq=False)
class Window:
    """Samples of a track in which the rock is fitted."""

    track: Track
    first: int  # sample of the track, and the one past the last
    last: int
    weight: float  # on the bit (N) over its mean of all windows; 1 where it is not known


@dataclass(frozen=True, eq=False)
class Problem:
    """Windows, the string that is known, and what of it is free."""

    parts: Parts
    windows: tuple[Window, ...]
    free: tuple[str, ...] = ()  # of `FACTORS`
    downhole: bool = False  # whether the residual is that of the downhole speed

    def factors(self, values: Array) -> Factors:
        """Factors on the string."""
        return Factors(**dict(zip(self.free, map(float, values), strict=True)))

    @property
    def alike(self) -> float:
        """Neighbouring samples whose residuals are alike: over a second, less of a quick string."""
        return max(1.0, min(1.0, 0.4 * swing(self.parts)) / self.windows[0].track.spacing)


@lru_cache(maxsize=64)
def _below(parts: Parts, factors: Factors) -> Below:
    return below(parts, factors)


@dataclass(frozen=True, eq=False)
class Driven:
    """What the inclusion of a window is driven by, at fine even times at the bit."""

    step: float  # (s)
    string: Below
    drive: Array  # wave that goes down, as it is at the bit (N m), shape (fine,)
    up: Array  # wave that comes up, measured, shape (samples,)
    down: Array  # what of it is known: the drive that returns from a bit at rest (N m)
    part: int  # fine steps of a sample
    mean: int  # fine steps over which the log's samples are means
    lead: int  # samples that are run before the first that counts
    begin: float  # bit speed to begin with (rad/s), from the waves alone
    slow: float  # one that noise may be
    speed: Array | None  # measured bit speed (rad/s), shape (samples,)


def driven(problem: Problem, window: Window, factors: Factors) -> Driven:
    """Prepare a window for a string."""
    string, track = _below(problem.parts, factors), window.track
    down, up = split(track, string)
    spacing = track.spacing
    part = max(1, int(np.ceil(spacing / min(FINEST, swing(problem.parts) / PER_SWING))))
    step = spacing / part
    lead = 0 if string.delay else min(window.first, int(np.ceil(string.memory / spacing)))
    first = window.first - lead
    fine = track.time[first] + step * np.arange((window.last - 1 - first) * part + 1)
    drive = CubicSpline(track.time, down)(fine - 2.0 * string.delay)
    z = 2.0 * string.impedance
    at = track.time[window.first]
    # Where there is a delay the waves at both ends of it give the speed of the bit.
    back = float(np.interp(at, track.time, up))
    there = float(drive[0])
    begin = (there - back) / z if string.delay else float(track.speed[first])
    speed = None
    if problem.downhole and track.bit is not None:
        times = track.time[window.first : window.last]
        speed = CubicSpline(track.time, track.bit)(times - string.delay)
    return Driven(
        step, string, np.ascontiguousarray(drive), up[window.first : window.last],
        drive[::part], part, part if track.mean > 1 else 1, lead, begin,
        AT_REST * abs(float(track.speed.mean())), speed,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Motion:
    """A run of a window."""

    bit: Array  # speed (rad/s), shape (samples,)
    torque: Array  # of the rock (N m)
    up: Array  # predicted wave that comes up (N m)
    time_at_rest: float  # share of the window


def run(made: Driven, curve: Curve, scale: float, begin: float | None = None) -> Motion:
    """Run the inclusion over a window, the torque of the rock times `scale`."""
    string = made.string
    start = made.begin if begin is None else begin
    start = start if start > made.slow else 0.0
    rock = Rock(curve.kind, scale * curve.static, _scaled(curve, scale), curve.knots)
    speed, other, torque = advance(
        Exponentials(string.rates, string.drive, string.torque, string.bit, string.top),
        rock, made.step, made.drive, start <= 0.0, _state(made, start, rock.static),
    )  # fmt: skip
    bit, top, held = (_means(one, made) for one in (speed, other, torque))
    z = 2.0 * string.impedance
    up = made.down[made.lead :] - z * (bit if string.delay else top)
    rest = float(np.mean(speed[made.lead * made.part :] == 0.0))
    return Motion(bit, held, up, rest)


def _scaled(curve: Curve, scale: float) -> Array:
    numbers = scale * curve.numbers
    if curve.kind == 0:
        numbers[2] = curve.numbers[2]
    return numbers


def _state(made: Driven, speed: float, torque: float) -> Array:
    """State of the string: steady, at the speed of the bit."""
    string = made.string
    if string.delay:
        return np.array([speed + 0j])
    steady = made.drive[0] - string.impedance * speed
    return np.asarray(-(string.drive * made.drive[0] - string.torque * steady) / string.rates)


def _means(values: Array, made: Driven) -> Array:
    """Values at samples, means over what a sample of the log is a mean of."""
    part = made.part
    if made.mean > 1:
        # Trapezoids over half a sample on either side.
        weights = np.ones(2 * (made.mean // 2) + 1)
        if made.mean % 2 == 0:
            weights[[0, -1]] = 0.5
        padded = np.pad(values, len(weights) // 2, mode="edge")
        values = np.convolve(padded, weights / weights.sum(), mode="valid")
    return np.asarray(values[::part][made.lead :])


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted law."""

    family: Family
    x: Array  # its numbers, then the free factors
    begins: Array  # bit speed at the beginning of each window (rad/s), shape (windows,)
    objective: float
    size: float  # usual residual (N m)
    explained: float  # share of the returning wave's variance, but for the noise of the log
    leave: Array  # numbers with each piece of a window left out, shape (pieces, numbers)
    sticks: tuple[bool, ...]  # whether the bit rests in each window
    fastest: float  # speed of the bit (rad/s)
    slowest: float
    # covariance of the numbers of the law that is left where a log says nothing of them
    unsaid: Array
    signal: float  # variance of the wave that comes up over that of the noise of the log
    normal: (
        Array  # what pulls the free factors to where they are (N2 m2), the law's numbers with it
    )
    problem: Problem = field(repr=False)

    @property
    def quiet(self) -> bool:
        """Whether the log holds hardly more than its noise."""
        return self.signal < QUIET

    @property
    def numbers(self) -> int:
        """Of the law."""
        return len(self.family.least)

    @property
    def curve(self) -> Curve:
        """Torque over speed."""
        return self.family.curve(self.x[: self.numbers])

    @property
    def factors(self) -> Factors:
        """On the string."""
        return self.problem.factors(self.x[self.numbers :])


def residual(problem: Problem, window: Window, made: Driven, curve: Curve, begin: float) -> Array:
    """What a run of a window misses of the log (N m)."""
    motion = run(made, curve, window.weight, begin)
    if made.speed is not None:
        return 2.0 * made.string.impedance * (made.speed - motion.bit)
    return made.up - motion.up


def fit(
    problem: Problem, family: Family, start: Array, begins: Array | None = None,
    rounds: int = ROUNDS, hold: int | None = None,
) -> Fit:  # fmt: skip
    """Fit a law and the free factors.

    `start`: numbers of the law, then the free factors. `hold`: number that keeps its value.
    """
    x = np.array(start, float)
    centre, weight = _prior(problem, family, x)
    windows = problem.windows
    lows = np.concatenate((family.least, np.full(len(problem.free), 0.3)))
    highs = np.concatenate((family.most, np.full(len(problem.free), 3.0)))
    if hold is not None:
        lows[hold] = highs[hold] = x[hold]
    made = _prepared(problem, family, x)
    y = np.array([one.begin for one in made]) if begins is None else np.array(begins, float)
    y = np.maximum(y, 0.0)
    damping = 1e-3
    parts = _residuals(problem, family, made, x, y)
    size = _size(parts)
    value = _objective(parts, size) + size**2 * _off(x, centre, weight)
    for _ in range(rounds):
        scale = _scale(problem, family, x)
        blocks = _blocks(problem, family, made, x, y, parts, size, highs)
        normal = sum(b.normal for b in blocks) + np.diag(size**2 * weight * scale**2)
        gradient = sum(b.gradient for b in blocks) + size**2 * weight * scale * (x - centre)
        improved = False
        for _ in range(8):
            step = _step(normal, gradient, damping, x, scale, lows, highs)
            trial = np.clip(x + step, lows, highs)
            moved = trial - x
            new_y = np.maximum(y + np.array([b.begin(moved / scale) for b in blocks]), 0.0)
            new_made = _prepared(problem, family, trial) if problem.free else made
            new = _residuals(problem, family, new_made, trial, new_y)
            new_value = _objective(new, size) + size**2 * _off(trial, centre, weight)
            if new_value < value:
                improved = True
                break
            damping *= 6.0
        if not improved:
            break
        gain = (value - new_value) / value
        x, y, made, parts = trial, new_y, new_made, new
        damping = max(damping / 6.0, 1e-9)
        fresh = _size(parts)
        size = fresh if fresh < size else size
        value = _objective(parts, size) + size**2 * _off(x, centre, weight)
        if gain < SETTLED:
            break
    scale = _scale(problem, family, x)
    blocks = _blocks(problem, family, made, x, y, parts, size, highs)
    held = np.diag(size**2 * weight * scale**2)
    leave = _jackknife(blocks, x, scale, lows, highs, held)
    unsaid = _unsaid(blocks, held, scale, size, problem.alike)
    motions = [
        run(m, family.curve(x[: len(family.least)]), w.weight, b)
        for m, w, b in zip(made, windows, y, strict=True)
    ]
    told = [m.up if m.speed is None else 2.0 * m.string.impedance * m.speed for m in made]
    variance = sum(float(((one - one.mean()) ** 2).sum()) for one in told)
    count = sum(len(r) for r in parts)
    noise = count * float(np.mean([_noise(w, m) for w, m in zip(windows, made, strict=True)]))
    missed = max(sum(float((r**2).sum()) for r in parts) - noise, 0.0)
    explained = 1.0 - missed / max(variance - noise, noise, 1e-30)
    return Fit(
        family, x, y, value, size, explained, leave,
        tuple(m.time_at_rest > STICKING for m in motions),
        float(max(m.bit.max() for m in motions)), float(min(m.bit.min() for m in motions)),
        unsaid, variance / max(noise, 1e-30), _free(blocks, held, problem), problem,
    )  # fmt: skip


def _noise(window: Window, made: Driven) -> float:
    """Variance that the noise of the log gives the difference of two waves (N2 m2)."""
    one = window.track
    torque, speed = (n**2 / one.mean for n in one.noise)
    inertia, zeta = made.string.top_inertia, made.string.impedance
    return 2.0 * (torque + zeta**2 * speed + (inertia * one.rise_noise) ** 2)


def _prepared(problem: Problem, family: Family, x: Array) -> list[Driven]:
    factors = problem.factors(x[len(family.least) :])
    return [driven(problem, window, factors) for window in problem.windows]


def _residuals(
    problem: Problem, family: Family, made: list[Driven], x: Array, y: Array
) -> list[Array]:
    curve = family.curve(x[: len(family.least)])
    return [
        residual(problem, w, m, curve, float(b))
        for w, m, b in zip(problem.windows, made, y, strict=True)
    ]


def _size(parts: Sequence[Array]) -> float:
    """Usual size of residuals."""
    return max(float(np.median(np.abs(np.concatenate(parts)))) / 0.6745, 1e-9)


def _objective(parts: Sequence[Array], size: float) -> float:
    """Cauchy's, over all samples: a stick that noise ended early does not bend the law."""
    u = np.concatenate(parts) / (ROBUST * size)
    return 0.5 * ROBUST**2 * float(np.log1p(u**2).sum()) * size**2


def _scale(problem: Problem, family: Family, x: Array) -> Array:
    """Size of each number."""
    return np.concatenate((family.scale(x[: len(family.least)]), np.ones(len(problem.free))))


def _blocks(
    problem: Problem, family: Family, made: list[Driven], x: Array, y: Array,
    parts: list[Array], size: float, highs: Array,
) -> list[_Block]:  # fmt: skip
    """Normal equations of every window."""
    scale = _scale(problem, family, x)
    slopes = (
        _slopes(problem, family, made, x, y, parts, k, scale, highs) for k in range(len(parts))
    )
    return [_block(r, *s, size, scale) for r, s in zip(parts, slopes, strict=True)]


def _slopes(
    problem: Problem, family: Family, made: list[Driven], x: Array, y: Array,
    parts: list[Array], k: int, scale: Array, highs: Array,
) -> tuple[Array, Array]:  # fmt: skip
    """Residual of a window by each number, and by its own beginning."""
    n = len(family.least)
    window, base = problem.windows[k], parts[k]
    columns = []
    for j in range(len(x)):
        step = SMALL * scale[j] * (100.0 if j >= n else 10.0)
        if x[j] + step > highs[j]:
            step = -step
        moved = x.copy()
        moved[j] += step
        other = made[k] if j < n else driven(problem, window, problem.factors(moved[n:]))
        value = residual(problem, window, other, family.curve(moved[:n]), float(y[k]))
        columns.append((value - base) / step)
    step = 1e-4
    own = (
        residual(problem, window, made[k], family.curve(x[:n]), float(y[k]) + step) - base
    ) / step
    return np.array(columns).T, own


@dataclass(frozen=True, eq=False)
class _Block:
    """Normal equations of a window, its own beginning eliminated."""

    normal: Array
    gradient: Array
    own: float  # curvature by the beginning
    cross: Array
    pull: float
    pieces: list[tuple[Array, Array]]  # of normal and gradient

    def begin(self, step: Array) -> float:
        """Change of the beginning that goes with a scaled step."""
        return -(self.pull + float(self.cross @ step)) / self.own


def _block(values: Array, slopes: Array, own: Array, size: float, scale: Array) -> _Block:
    weights = 1.0 / (1.0 + (values / (ROBUST * size)) ** 2)
    matrix = slopes * scale
    curve = max(float(weights @ own**2), 1e-6 * float(values @ values) + 1e-30)
    cross = matrix.T @ (weights * own)
    pull = float((weights * own) @ values)
    # Samples, what the beginning takes of them eliminated.
    left, missed = matrix - np.outer(own, cross / curve), values - own * (pull / curve)
    pieces = [
        (left[k].T @ (weights[k, None] * left[k]), left[k].T @ (weights[k] * missed[k]))
        for k in np.array_split(np.arange(len(values)), PIECES)
    ]
    normal, gradient = (sum(of) for of in zip(*pieces, strict=True))
    return _Block(normal, gradient, curve, cross, pull, pieces)


def _step(
    normal: Array,
    gradient: Array,
    damping: float,
    x: Array,
    scale: Array,
    lows: Array,
    highs: Array,
) -> Array:
    """A damped step, numbers at a bound held there if they would leave it."""
    free = np.ones(len(x), bool)
    for _ in range(len(x)):
        step = np.zeros(len(x))
        a = normal[np.ix_(free, free)]
        diagonal = np.diag(a).copy() + 1e-12 * max(float(np.trace(normal)), 1e-30)
        step[free] = -np.linalg.solve(a + damping * np.diag(diagonal), gradient[free])
        step *= scale
        out = free & (((x <= lows) & (step < 0.0)) | ((x >= highs) & (step > 0.0)))
        if not out.any():
            break
        free &= ~out
    return step


def _prior(problem: Problem, family: Family, x: Array) -> tuple[Array, Array]:
    """Usual numbers, and one over the variance they have; zero where there is no such thing."""
    usual, spread = family.usual(x[: len(family.least)])
    none = np.zeros(len(problem.free))
    return np.concatenate((usual, none)), np.concatenate((1.0 / spread**2, none))


def _off(x: Array, centre: Array, weight: Array) -> float:
    return 0.5 * float(weight @ (x - centre) ** 2)


def _unsaid(blocks: list[_Block], held: Array, scale: Array, size: float, alike: float) -> Array:
    """Covariance that usual numbers leave, where a log says nothing: small elsewhere."""
    said = sum(b.normal for b in blocks) / alike + held
    ridge = 1e-12 * max(float(np.trace(said)), 1e-30) * np.eye(len(said))
    inverse = np.linalg.inv(said + ridge)
    return np.asarray(size**2 * inverse @ held @ inverse * np.outer(scale, scale))


def _free(blocks: list[_Block], held: Array, problem: Problem) -> Array:
    """Curvature of the objective over the free factors, the law's numbers going along."""
    whole = sum(b.normal for b in blocks) + held
    inside = slice(len(whole) - len(problem.free), None)
    ridge = 1e-12 * max(float(np.trace(whole)), 1e-30) * np.eye(len(whole))
    return np.asarray(np.linalg.inv(np.linalg.inv(whole + ridge)[inside, inside]))


def _jackknife(
    blocks: list[_Block], x: Array, scale: Array, lows: Array, highs: Array, held: Array
) -> Array:
    """Numbers with each piece of a window left out, to first order."""
    normal = sum(b.normal for b in blocks) + held
    # What is at its bound stays there.
    free = (x > lows + 1e-9 * scale) & (x < highs - 1e-9 * scale)
    rows = []
    for out, gradient in (piece for one in blocks for piece in one.pieces):
        step = np.zeros(len(x))
        if free.any():
            left = (normal - out)[np.ix_(free, free)]
            ridge = 1e-9 * max(float(np.trace(normal)), 1e-30) * np.eye(len(left))
            step[free] = np.linalg.solve(left + ridge, gradient[free])
            step *= min(1.0, FARTHEST / max(float(np.abs(step).max()), 1e-30))
        rows.append(np.clip(x + step * scale, lows, highs))
    return np.array(rows)
