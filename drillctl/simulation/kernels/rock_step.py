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

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from drillctl.rig.bit_rock import NavarroLopezSuarez, OverWeight, contact
from drillctl.rig.bit_rock.law import Exp
from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.arithmetic import (
    any_of,
    everywhere,
    exp,
    law_at,
    least,
    most,
    signed,
)
from drillctl.simulation.kernels.rows import CHUNK, WIDTH
from drillctl.simulation.kernels.variation_step import varies
from drillctl.simulation.kernels.vectors import Variable, at, each, loop, pick, put, when
from drillctl.simulation.kernels.weight_step import acting, has_memory, stays

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
    # friction torque at that speed against it (N m), and the law's slope there (N m s/rad)
    kinetic: Any
    slope: Any
    torque: Any  # mean torque on the bit over the step (N m)
    stuck: Any  # share of the step spent stuck


def stick_or_slip(
    law: Any, load: Any, reduced: Any, foreseen: Any, work: Any, slot: Any
) -> Outcome:
    """The `Outcome` of a step under a set-valued law.

    A mask that lives on beyond a branch has no register of its own; hence the infinite torques,
    by which one comparison tells who sticks.
    """
    at_rest = at(work, r.REST_LOAD)
    static, kinetic = law.static_torque(at_rest), law.kinetic_torque_at_rest(at_rest)
    free, half = reduced.free, 0.5 * reduced.gain
    direction, last = at(work, r.DIRECTION), abs(at(work, r.BIT_SPEED))
    before, start = half * at(work, r.KINETIC), half * kinetic
    ahead = direction * free - before
    own = ahead > start
    # A stuck bit, and one that is turned round, starts from the torque at rest.
    before = pick(own, before, start)
    push = Variable(pick(own, ahead, abs(free) - start))
    turns = pick(own, direction, free)
    holding = abs(free) * reduced.per_gain
    holds = pick(own, math.inf, holding)
    released = Variable(each(0.0))
    loose = pick(direction == 0.0, holding, 0.0) > static
    with when(any_of(loose)):
        # Known if a whole step at rest lies behind.
        known = at(work, r.STUCK + ((slot - 1) & (CHUNK - 1)) * WIDTH) == 1.0
        rest = abs(at(work, r.BIT_TORQUE))
        share, early = time_release(static, kinetic, holding, reduced.gain, rest)
        released.set(pick(loose, pick(known, share, 0.0), 0.0))
        push.set(push.get() + pick(loose, pick(known, early, 0.0), 0.0))
    right = push.get()

    if foreseen is None:
        # The law as a straight line from its last torque and slope: Newton's first guess, off by
        # its curvature over one step. A bit set in motion has no last slope.
        fall = pick(own, -half * at(work, r.SLOPE), 0.0)
        flat = right - before
        guess = most(flat + fall * (flat + fall * (flat - last) - last), 0.0)
        u, slope = solve_inclusion(law, load, half, right, guess)
    else:
        u, slope = solve_near(law, load, half, right, foreseen, holds <= static)

    sticks = holds <= static
    # A bit that breaks loose keeps the share that `time_release` found.
    stuck = Variable(pick(sticks, 1.0, released.get()))
    stops = pick(direction == 0.0, math.inf, holds) <= static
    with when(any_of(stops)):
        # The bit is followed in a straight line from its speed before through zero.
        past_zero = ahead - start
        stuck.set(pick(stops, past_zero / (past_zero - last), stuck.get()))
        put(work, r.STICKS, at(work, r.STICKS) + stops)
    speed = pick(sticks, 0.0, signed(u, turns))
    return Outcome(
        speed,
        pick(sticks, 0.0, signed(each(1.0), turns)),
        # The slip torque at the new speed follows from the equation that u solves.
        pick(sticks, 0.0, 2.0 * (right - u) * reduced.per_gain),
        slope,
        (free - speed) * reduced.per_gain,
        stuck.get(),
    )


def time_release(static: Any, kinetic: Any, holding: Any, gain: Any, last: Any) -> tuple[Any, Any]:
    """Date the moment a stuck bit breaks loose, and give it no friction torque before it.

    The torque that would hold it rises along the line through the holding torques of this step
    and the last, each in the middle of its step; it meets the static one after the share
    `held` of this step, or before its beginning if that is negative. Until then the bit bears
    the holding torque, which the slip equation has as the slip torque: the difference of the
    two impulses goes to the right-hand side. Returns the share and that difference.
    """
    rise = holding - last
    held = 0.5 + (static - holding) / rise
    return held, gain * (0.5 * rise * held * held - held * (static - kinetic))


def solve_inclusion(law: Any, load: Any, half: Any, right: Any, guess: Any) -> tuple[Any, Any]:
    """Newton's method on u + half T(u) = right, u >= 0; the root and the slope there.

    The first step is the last one but for bits that have just begun to turn, or long steps.
    """
    new, falls = _improved(law, load, half, right, guess)
    return _go_on(law, load, half, right, new, falls, lambda: _is_far(new, guess))


def _improved(law: Any, load: Any, half: Any, right: Any, u: Any) -> tuple[Any, Any]:
    torque, falls = contact(law, load, u, exp)
    left = right - u - half * torque
    return most(u + left * one_over_one_plus(half * falls), 0.0), falls


def _is_far(new: Any, u: Any) -> Any:
    return abs(new - u) > NEWTON_STEP * (1.0 + u)


def _go_on(
    law: Any, load: Any, half: Any, right: Any, first: Any, falls: Any, far: Callable[[], Any]
) -> tuple[Any, Any]:
    """Newton's method for those lanes that are still far from their root."""
    root, slope = Variable(first), Variable(falls)
    with when(any_of(far())):
        is_open = Variable(far())
        with loop(NEWTON_LIMIT) as iterations:
            u = root.get()
            new, falls = _improved(law, load, half, right, u)
            root.set(pick(is_open.get(), new, u))
            slope.set(pick(is_open.get(), falls, slope.get()))
            is_open.set(is_open.get() & _is_far(new, u))
            with when(~any_of(is_open.get())):
                iterations.leave()
    return root.get(), slope.get()


def foresee(friction: Any, weight: Any, program: Any, variation: Any, work: Any) -> Any:
    """Bit speed to which the last three lead, and what the torque decays to there; or None.

    A law that is an exponential, with numbers that stay, is worked out there while the modes are
    still being added up; with its curvature known as well, that is near enough.
    """
    if varies(variation) or not (_is_held(friction, weight, program) and stays(weight, program)):
        return None
    law, last = rock(friction, weight, program, work), at(work, r.BIT_SPEED)
    speed = 3.0 * (last - at(work, r.SPEED_BEFORE)) + at(work, r.SPEED_BEFORE_THAT)
    u = most(at(work, r.DIRECTION) * speed, 0.0)
    return u, law.spread * exp(law.grows * u)


def solve_near(
    law: Any, load: Any, half: Any, right: Any, foreseen: Any, sticks: Any
) -> tuple[Any, Any]:
    """The root of u + half T(u) = right from the law at a speed nearby; lanes that stick aside.

    Newton's step, less what the law's curvature makes of it. What is left is of third order, that
    step's cube times half/6 times a third derivative that is `grows` times the second: no more than
    Newton's method leaves by its own rule if step^3 grows <= NEWTON_STEP^2.
    """
    u, falling = foreseen
    falls = law.grows * falling
    inverse = one_over_one_plus(half * falls)
    step = (right - u - half * (law.level + falling)) * inverse
    curved = 0.5 * half * law.grows * falls * inverse
    new = most(u + (step - curved * step * step), 0.0)
    close = NEWTON_STEP * (1.0 + u)

    def far() -> Any:
        return pick(sticks, 0.0, abs(step * step * step * law.grows)) > close * close

    return _go_on(law, load, half, right, new, falls, far)


def one_over_one_plus(d: Any) -> Any:
    """1 / (1 + d) for |d| <= 1/4, to 2e-5 and far better for small d; a division takes longer.

    (1 - d) (1 + d^2) (1 + d^4) = (1 - d^8) / (1 + d). Newton's method corrects itself: its step is
    off by that share at most.
    """
    square = d * d
    product = 1.0 - d
    product = product + product * square
    return product + product * (square * square)


def meet_rock(law: Any, weight: Any, reduced: Any, foreseen: Any, work: Any, slot: Any) -> Outcome:
    """The `Outcome` of a step under a law from what string and drive leave free."""
    load = acting(weight, work)
    if law.set_valued:
        return stick_or_slip(law, load, reduced, foreseen, work, slot)
    return _creep(law, load, reduced, work)


def _creep(law: Any, load: Any, reduced: Any, work: Any) -> Outcome:
    """The step of a smooth law: w + theta gain T(w) = free - (1 - theta) gain T(before).

    The mean torque is the trapezoid's, theta = 1/2, while the bit's own time constant under the
    rock is longer than half a step. A law that is steep at rest makes it shorter; theta then
    grows to 1 - 1/z, z = gain x slope, so that a creeping bit relaxes and does not ring.
    """
    free, gain = reduced.free, reduced.gain
    steep = gain * at(work, r.SLOPE)
    theta = pick(steep > 2.0, 1.0 - 1.0 / steep, 0.5)
    before = at(work, r.DIRECTION) * at(work, r.KINETIC)
    right = free - (1.0 - theta) * gain * before
    sign = pick(right >= 0.0, 1.0, -1.0)
    u = _safeguarded_newton(law, load, theta * gain, sign * right, sign * at(work, r.BIT_SPEED))
    torque, slope = contact(law, load, u, exp)
    mean = (free - sign * u) * reduced.per_gain
    return Outcome(sign * u, sign, torque, slope, mean, each(0.0))


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
    """A law that decays exponentially with speed, at the weights of one step."""

    rest: Any  # static torque under the mean weight of the step (N m)
    # torque at high speed, and what the static torque is above it, at the end of the step (N m)
    level: Any
    spread: Any
    grows: Any  # minus the decay with speed (s/rad)

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
        falling = self.spread * exp(self.grows * speed)
        return self.level + falling, self.grows * falling


def _is_held(friction: Any, weight: Any, program: Any) -> bool:
    """Whether a law is looked up before each step, or once if its weight stays."""
    known = has_memory(weight) or stays(weight, program)
    return known and isinstance(friction, (NavarroLopezSuarez, OverWeight))


def rock(friction: Any, weight: Any, program: Any, work: Any) -> Any:
    """The bit-rock law that the lanes meet in this step."""
    if _is_held(friction, weight, program):
        return law_at(HeldRock(*HeldRock._fields), work, r.HELD)
    return law_at(friction, work, r.FRICTION)


def hold_rock(friction: Any, weight: Any, program: Any, work: Any, begins: bool = False) -> None:
    """Look the law up at the weights of this step, where they are numbers."""
    if _is_held(friction, weight, program) and (begins or not stays(weight, program)):
        law = law_at(friction, work, r.FRICTION)
        end = acting(weight, work).weight(0.0)
        _, rest, _ = law.held(at(work, r.REST_LOAD))
        level, static, decay = law.held(end)
        held = HeldRock(rest, level, static - level, -decay)
        for k, number in enumerate(held):
            put(work, r.HELD + k * WIDTH, number)
