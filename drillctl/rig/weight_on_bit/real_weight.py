"""Weight-on-bit laws as they reach the bit: seen late, given by a hoist that lags.

The three laws here share their way. A signal that stands for the bit speed comes up: measured at
the bit behind a filter, or estimated at the surface. It arrives late, perhaps sampled. A command
follows from it, and the hoist follows the command with a lag and at a limited rate:

    tau_s s' = |w_b| - s,   seen(t) = s(t - delay)  or  s(k period) from k period + delay on,
    W' = (command - W) / tau_h,  |W'| <= rate.
"""

from __future__ import annotations

from typing import Any, NamedTuple


class RealWeight(NamedTuple):
    r"""Weight that follows a bit speed measured downhole, as a rig can do it.

    .. math:: W_c = W_n + K_w (s(t - \tau_d) - \Omega), \quad W_{min} \le W_c \le W_{max}, \qquad
              \tau_h \dot W = W_c - W, \quad |\dot W| \le R

    The law of Navarro-Lopez & Suarez (2004) with s the bit speed behind a filter of time constant
    tau_s: measured downhole, sent up with a delay, sampled if `period` is not zero, followed by a
    hoist. A bit speed is not known at the surface at once; mud pulses take seconds, wired pipe a
    fraction of one.

    Attributes
    ----------
    nominal : float
        Weight at the set speed W_n (N).
    gain : float
        K_w (N s/rad), not negative.
    set_speed : float
        Omega (rad/s).
    least, most : float
        Limits of the command (N).
    delay : float
        tau_d, from the bit to the driller (s).
    period : float
        Between two readings (s); 0 for a continuous signal.
    sensor : float
        tau_s (s).
    hoist : float
        tau_h (s); 0 for a hoist that follows at once.
    rate : float
        R (N/s); infinite for none, else with a lag of the hoist.
    """

    nominal: Any
    gain: Any
    set_speed: Any
    least: Any
    most: Any
    delay: Any
    period: Any
    sensor: Any
    hoist: Any
    rate: Any

    @property
    def moves(self) -> bool:
        """Whether the weight changes at once with the bit speed: it does not."""
        return False

    def command(self, seen: Any, nominal: Any) -> Any:
        """Weight asked for (N) at a speed seen (rad/s) and the nominal weight of the hour (N)."""
        free = nominal + self.gain * (seen - self.set_speed)
        kept = free + (free < self.least) * (self.least - free)
        return kept + (kept > self.most) * (self.most - kept)


class ObservedWeight(NamedTuple):
    r"""The law of `RealWeight` with a bit speed estimated at the surface.

    An observer of the string sees top speed and top torque and tells the bit speed (see
    `drillctl.linear.observer`); no signal comes up from the bit. What the bit does reaches the
    top, and the estimate, one travel time of the pipe later.

    Attributes
    ----------
    nominal, gain, set_speed, least, most, delay, period, hoist, rate : float
        As in `RealWeight`; the delay is that of the computation.
    sensor : float
        Not used: the observer filters by itself.
    """

    nominal: Any
    gain: Any
    set_speed: Any
    least: Any
    most: Any
    delay: Any
    period: Any
    sensor: Any
    hoist: Any
    rate: Any

    @property
    def moves(self) -> bool:
        """Whether the weight changes at once with the bit speed: it does not."""
        return False

    def command(self, seen: Any, nominal: Any) -> Any:
        """Weight asked for (N) at a speed seen (rad/s) and the nominal weight of the hour (N)."""
        return RealWeight.command(self, seen, nominal)  # type: ignore[arg-type]


class AlarmWeight(NamedTuple):
    r"""Weight taken off on a stick-slip alarm and put on again when it is calm.

    At the end of each window the stick-slip index SSI = (max - min) / (2 mean) of the bit speed
    within it is sent up. Over the alarm level the weight is lowered by a share, under the calm
    level it is raised by as much, never above the nominal weight and never below the least:

    .. math:: W_c \leftarrow \max(W_{min}, (1 - r) W_c) \;\text{if SSI} > s_a, \qquad
              W_c \leftarrow \min(W_n, W_c / (1 - r)) \;\text{if SSI} < s_c

    What a driller does with an alarm, as a state machine.

    Attributes
    ----------
    nominal : float
        Weight W_n without alarm (N).
    floor : float
        W_min over the nominal weight, above zero.
    delay : float
        From the end of a window to the driller (s), at most the window.
    sensor, hoist, rate : float
        As in `RealWeight`.
    window : float
        Length of a window (s).
    alarm, calm : float
        SSI s_a above which weight is taken off, s_c below which it is put on.
    reduction : float
        Share r taken off at a time.
    """

    nominal: Any
    floor: Any
    delay: Any
    sensor: Any
    hoist: Any
    rate: Any
    window: Any
    alarm: Any
    calm: Any
    reduction: Any

    @property
    def moves(self) -> bool:
        """Whether the weight changes at once with the bit speed: it does not."""
        return False

    def next_level(self, level: Any, low: Any, high: Any, mean: Any) -> Any:
        """Weight over its nominal value after a window.

        Parameters
        ----------
        level : float
            Before.
        low, high, mean : float
            Of the bit speed in the window (rad/s).
        """
        spread = 0.5 * (high - low)
        lower = level * (1.0 - self.reduction)
        lower = lower + (lower < self.floor) * (self.floor - lower)
        upper = level / (1.0 - self.reduction)
        upper = upper + (upper > 1.0) * (1.0 - upper)
        # Not as a quotient: a bit that stands still has no mean, and is cause for alarm.
        alarmed = (spread > self.alarm * mean) + (mean <= 0.0) > 0
        quiet = (spread < self.calm * mean) * (mean > 0.0) > 0
        return alarmed * lower + quiet * upper + (1 - alarmed) * (1 - quiet) * level


PATHS = (RealWeight, ObservedWeight, AlarmWeight)
"""Laws with a memory: the weight does not follow from the bit speed of the moment."""
