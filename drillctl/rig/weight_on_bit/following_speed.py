"""Weight on bit that follows the bit speed (Navarro-Lopez & Suarez 2004)."""

from __future__ import annotations

from typing import Any, NamedTuple


class FollowingSpeed(NamedTuple):
    r"""More weight on a fast bit, less on a slow one.

    .. math:: W = W_n + K_w (|\omega_b| - \Omega), \qquad W_{min} \le W \le W_{max}

    After Navarro-Lopez & Suarez, Proc. IEEE CCA (2004) 1454-1460, who write
    :math:`W = K_w |\omega_b| + W_0`; here W_n is the weight at the set speed, so that laws are
    compared at equal nominal weight. The ideal law: the bit speed is known at once and the hoist
    follows at once.

    Attributes
    ----------
    nominal : float
        Weight at the set speed W_n (N).
    gain : float
        K_w (N s/rad), not negative.
    set_speed : float
        Omega (rad/s).
    least, most : float
        Limits (N).
    """

    nominal: Any
    gain: Any
    set_speed: Any
    least: Any
    most: Any

    @property
    def moves(self) -> bool:
        """Whether the weight changes with the bit speed."""
        return True

    def weight(self, speed: Any) -> Any:
        """Weight on bit (N) at bit speed `speed` >= 0 (rad/s)."""
        free = self.nominal + self.gain * (speed - self.set_speed)
        kept = free + (free < self.least) * (self.least - free)
        return kept + (kept > self.most) * (self.most - kept)

    def slope(self, speed: Any) -> Any:
        """Weight per bit speed (N s/rad): the gain, none beyond the limits."""
        free = self.nominal + self.gain * (speed - self.set_speed)
        return self.gain * (free > self.least) * (free < self.most)
