"""What the rock does to the bit in a step.

With string and drive eliminated (`drive_step`), the bit speed at the end of the step
is free - gain T_bit, and what is left is one scalar inclusion:

- A stuck bit stays while the torque that holds it, free / gain, is within the static one.
- A turning bit feels the mean of the torque before and after, so that its speed u >= 0 in its
  own direction solves u + (gain/2) T(u) = right. With (gain/2) (-T') < 1/4 the left side rises
  and Newton's method converges to the only root.
- It sticks only if there is no root of its own sign and the static torque can hold it; else it
  turns the other way.

Every lane takes its own decisions, and its Newton iteration freezes when that lane has converged:
no lane's bits depend on its neighbours. What takes divisions and happens rarely is done when some
lane needs it; it leaves the other lanes as they are.

A smooth law is solved by a safeguarded Newton method.

A law over the weight on bit costs more than a string of modes where each of Newton's steps walks
through the rows of its table. Where the weight has a memory it is a number within a step, and so
are the torques and the decay that follow from it: they are looked up once a step.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from drillctl.rig.bit_rock import OverWeight, contact
from drillctl.rig.bit_rock.law import Exp
from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.arithmetic import any_of, everywhere, exp, law_at, least, most
from drillctl.simulation.kernels.vectors import Variable, at, each, loop, pick, put, when
from drillctl.simulation.kernels.weight_step import acting, has_memory

NEWTON_STEP = 1e-3
"""A lane has converged when Newton moves it less than this (rad/s, relative over 1 rad/s). What
is left is the square of that move times gain/4 times the law's curvature: 1e-9 rad/s for the
rock of the paper's map at steps of 50 ms, where the scheme itself is off by 1e-4 of the speed."""
NEWTON_LIMIT = 30
BISECTIONS = 60  # most iterations of the safeguarded Newton method
CLOSE = 1e-13  # it has converged when it moves less than this (rad/s, relative over 1 rad/s)


class Outcome(NamedTuple):
    """What a step ends with."""

    speed: Any  # bit speed at its end (rad/s)
    direction: Any  # +1 or -1 turning, 0 stuck
    # friction torque at that speed, signed (N m), and the law's slope there (N m s/rad)
    kinetic: Any
    slope: Any
    torque: Any  # mean torque on the bit over the step (N m)
    holding: Any  # mean torque that held a bit which was stuck throughout (N m); -1 of any other
    stuck: Any  # share of the step spent stuck


def stick_or_slip(friction: Any, weight: Any, reduced: Any, work: Any) -> Any:
    """The `Outcome` of a step under a set-valued law."""
    law, load, at_rest = rock(friction, weight, work), acting(weight, work), at(work, r.REST_LOAD)
    static, kinetic = law.static_torque(at_rest), law.kinetic_torque_at_rest(at_rest)
    free, half = reduced.free, 0.5 * reduced.gain
    direction, before = at(work, r.DIRECTION), at(work, r.KINETIC)
    was_stuck = direction == 0.0
    own = direction * (free - half * before) > half * kinetic
    # A stuck bit, and one that is turned round, starts from the torque at rest.
    sign = pick(own, direction, pick(free > 0.0, 1.0, -1.0))
    previous = pick(own, sign * before, kinetic)
    right = sign * free - half * previous
    holding = abs(free) * reduced.per_gain
    loose = was_stuck & (holding > static)
    released, push = Variable(each(0.0)), Variable(right)
    with when(any_of(loose)):
        share, early = time_release(static, kinetic, holding, reduced.gain, at(work, r.HOLDING))
        released.set(share)
        push.set(pick(loose, right + early, right))
    right = push.get()
    # The law as a straight line from its last torque and slope: Newton's first guess, off
    # by its curvature over one step. A bit set in motion has no last slope.
    fall = pick(own, -half * at(work, r.SLOPE), 0.0)
    last = abs(at(work, r.BIT_SPEED))
    flat = right - half * previous
    guess = most(flat + fall * (flat + fall * (flat - last) - last), 0.0)
    u, slope = solve_inclusion(law, load, half, right, guess, at(work, r.SLOPE))

    sticks = (holding <= static) & ~own
    speed = pick(sticks, 0.0, sign * u)
    # The slip torque at the new speed follows from the equation that u solves.
    slip = 2.0 * (right - u) * reduced.per_gain
    # A bit that breaks loose keeps the share that `time_release` found.
    stuck = Variable(pick(loose, released.get(), pick(sticks, 1.0, 0.0)))
    stops = sticks & ~was_stuck
    with when(any_of(stops)):
        past_zero = direction * (free - half * before) - half * kinetic
        # The bit is followed in a straight line from its speed before through zero.
        stuck.set(pick(stops, past_zero / (past_zero - last), stuck.get()))
        put(work, r.STICKS, at(work, r.STICKS) + stops)
    return Outcome(
        speed,
        pick(sticks, 0.0, sign),
        pick(sticks, 0.0, sign * slip),
        slope,
        (free - speed) * reduced.per_gain,
        pick(was_stuck & sticks, holding, -1.0),
        stuck.get(),
    )


def time_release(static: Any, kinetic: Any, holding: Any, gain: Any, last: Any) -> Any:
    """Date the moment a stuck bit breaks loose, and give it no friction torque before it.

    The torque that would hold it rises along the line through the holding torques of this step
    and the last, each in the middle of its step; it meets the static one after the share
    `held` of this step, or before its beginning if that is negative. Until then the bit bears
    the holding torque, which the slip equation has as the slip torque: the difference of the
    two impulses goes to the right-hand side. Returns the share and that difference.
    """
    rise = holding - last
    held = 0.5 + (static - holding) / rise
    early = gain * (0.5 * rise * held * held - held * (static - kinetic))
    # Without a step wholly at rest behind it, nothing is known of the rise.
    known = last >= 0.0
    return pick(known, held, 0.0), pick(known, early, 0.0)


def solve_inclusion(
    law: Any, load: Any, half: Any, right: Any, guess: Any, slope_before: Any
) -> Any:
    """Newton's method on u + half T(u) = right, u >= 0; the root and the slope there."""
    root, slope, is_open = Variable(guess), Variable(slope_before), Variable(everywhere())
    with loop(NEWTON_LIMIT) as iterations:
        u = root.get()
        torque, falls = contact(law, load, u, exp)
        new = most(u + (right - u - half * torque) * one_over_one_plus(half * falls), 0.0)
        far = abs(new - u) > NEWTON_STEP * (1.0 + u)
        root.set(pick(is_open.get(), new, u))
        slope.set(pick(is_open.get(), falls, slope.get()))
        is_open.set(is_open.get() & far)
        with when(~any_of(is_open.get())):
            iterations.leave()
    return root.get(), slope.get()


def one_over_one_plus(d: Any) -> Any:
    """1 / (1 + d) for |d| <= 1/4, to 2e-5 and far better for small d; a division takes longer.

    (1 - d) (1 + d^2) (1 + d^4) = (1 - d^8) / (1 + d). Newton's method corrects itself: its step is
    off by that share at most.
    """
    square = d * d
    product = 1.0 - d
    product = product + product * square
    return product + product * (square * square)


def meet_rock(friction: Any, weight: Any, reduced: Any, work: Any) -> Any:
    """The `Outcome` of a step from what string and drive leave free."""
    if friction.set_valued:
        return stick_or_slip(friction, weight, reduced, work)
    return _creep(friction, weight, reduced, work)


def _creep(friction: Any, weight: Any, reduced: Any, work: Any) -> Any:
    """The step of a smooth law: w + theta gain T(w) = free - (1 - theta) gain T(before).

    The mean torque is the trapezoid's, theta = 1/2, while the bit's own time constant under the
    rock is longer than half a step. A law that is steep at rest makes it shorter; theta then
    grows to 1 - 1/z, z = gain x slope, so that a creeping bit relaxes and does not ring.
    """
    law, load = rock(friction, weight, work), acting(weight, work)
    free, gain = reduced.free, reduced.gain
    steep = gain * at(work, r.SLOPE)
    theta = pick(steep > 2.0, 1.0 - 1.0 / steep, 0.5)
    right = free - (1.0 - theta) * gain * at(work, r.KINETIC)
    sign = pick(right >= 0.0, 1.0, -1.0)
    u = _safeguarded_newton(law, load, theta * gain, sign * right, sign * at(work, r.BIT_SPEED))
    torque, slope = contact(law, load, u, exp)
    return Outcome(
        sign * u,
        sign,
        sign * torque,
        slope,
        (free - sign * u) * reduced.per_gain,
        each(-1.0),
        each(0.0),
    )


def _safeguarded_newton(law: Any, load: Any, share: Any, right: Any, last: Any) -> Any:
    """The root of u + share T(u) = right, by Newton's method or bisection.

    It lies between zero and the right-hand side, as the torque only brakes; a step that would
    leave the bracket halves it instead.
    """
    below, above, is_open = Variable(each(0.0)), Variable(right), Variable(everywhere())
    root = Variable(least(most(last, 0.0), right))
    with loop(BISECTIONS) as iterations:
        u = root.get()
        torque, slope = contact(law, load, u, exp)
        excess = u + share * torque - right
        low, high = pick(excess < 0.0, u, below.get()), pick(excess >= 0.0, u, above.get())
        below.set(low)
        above.set(high)
        new = u - excess / (1.0 + share * slope)
        new = pick((new > low) & (new < high), new, 0.5 * (low + high))
        root.set(pick(is_open.get(), new, u))
        is_open.set(is_open.get() & (abs(new - u) > CLOSE * (1.0 + u)))
        with when(~any_of(is_open.get())):
            iterations.leave()
    return root.get()


class HeldRock(NamedTuple):
    """`OverWeight` at the weights of one step."""

    rest: Any  # static torque under the mean weight of the step (N m)
    # torque at high speed, and what the static torque is above it, at the end of the step (N m)
    level: Any
    spread: Any
    decay: Any  # decay with speed (s/rad)

    @property
    def set_valued(self) -> bool:
        """A bit can stand still under this law."""
        return True

    def static_torque(self, weight: Any) -> Any:
        """Largest torque of a bit at rest (N m)."""
        return self.rest

    def kinetic_torque_at_rest(self, weight: Any) -> Any:
        """Torque of a bit that just turns (N m)."""
        return self.rest

    def torque_and_slope(self, weight: Any, speed: Any, exp: Exp) -> tuple[Any, Any]:
        """Torque (N m) and slope (N m s/rad) at `speed` >= 0 (rad/s)."""
        falling = self.spread * exp(-self.decay * speed)
        return self.level + falling, -self.decay * falling


def _is_held(friction: Any, weight: Any) -> bool:
    return isinstance(friction, OverWeight) and has_memory(weight)


def rock(friction: Any, weight: Any, work: Any) -> Any:
    """The bit-rock law that the lanes meet in this step."""
    if _is_held(friction, weight):
        return HeldRock(
            at(work, r.HELD_REST),
            at(work, r.HELD_LEVEL),
            at(work, r.HELD_SPREAD),
            at(work, r.HELD_DECAY),
        )
    return law_at(friction, work, r.FRICTION)


def hold_rock(friction: Any, weight: Any, work: Any) -> None:
    """Look the table up at the weights of this step, where they are numbers."""
    if _is_held(friction, weight):
        return _look_up(friction, work)
    return None


def _look_up(friction: Any, work: Any) -> None:
    law = law_at(friction, work, r.FRICTION)
    _, rest, _ = law.held(at(work, r.REST_LOAD))
    level, static, decay = law.held(at(work, r.HOISTED))
    put(work, r.HELD_REST, rest)
    put(work, r.HELD_LEVEL, level)
    put(work, r.HELD_SPREAD, static - level)
    put(work, r.HELD_DECAY, decay)
