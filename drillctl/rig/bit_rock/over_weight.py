"""Friction whose coefficients follow the weight on bit, from the rows of a table."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

from drillctl.rig.bit_rock.protocol import Exp
from drillctl.rig.bit_rock.weight_table import WeightTable

KNOTS = 7
"""Most rows at which a piecewise linear function of the weight changes its slope."""


class OverWeight(NamedTuple):
    r"""The law of Navarro-Lopez & Suarez with torques and decay piecewise linear in the weight.

    .. math:: T(\omega, W) = p(W) + [q(W) - p(W)]\, e^{-\beta(W) |\omega|}

    with p = a1 W, q = a2 W and beta as in `WeightTable`: for a weight that moves while the bit
    drills. Made by `over_weight`. A function f of the weight is stored as its value or slope at
    zero and its changes of slope at the rows: f(W) = f0 W + sum f_i max(0, W - w_i) for the
    torques, with b0 in place of b0 W for beta.

    Attributes
    ----------
    w1, ..., w7 : float
        Weights of the rows but the last (N).
    p0, ..., p7, q0, ..., q7 : float
        Of the torque at high speed and of the static torque (m).
    b0, ..., b7 : float
        Of the decay: b0 in s/rad, the others in s/(rad N).
    """

    w1: Any
    w2: Any
    w3: Any
    w4: Any
    w5: Any
    w6: Any
    w7: Any
    p0: Any
    p1: Any
    p2: Any
    p3: Any
    p4: Any
    p5: Any
    p6: Any
    p7: Any
    q0: Any
    q1: Any
    q2: Any
    q3: Any
    q4: Any
    q5: Any
    q6: Any
    q7: Any
    b0: Any
    b1: Any
    b2: Any
    b3: Any
    b4: Any
    b5: Any
    b6: Any
    b7: Any

    @property
    def set_valued(self) -> bool:
        """A bit can stand still under this law."""
        return True

    # The sums stand in each method, as a method that is compiled cannot call another.

    def static_torque(self, weight: Any) -> Any:
        """Largest torque of a bit at rest (N m) under `weight` (N)."""
        static = self.q0 * weight
        for k in range(7):
            static = static + self[16 + k] * (weight > self[k]) * (weight - self[k])
        return static

    def kinetic_torque_at_rest(self, weight: Any) -> Any:
        """Torque of a bit that just turns (N m): the static torque."""
        static = self.q0 * weight
        for k in range(7):
            static = static + self[16 + k] * (weight > self[k]) * (weight - self[k])
        return static

    def steepest_fall(self, weight: Any) -> Any:
        """Largest falling slope (N m s/rad) under a constant `weight` (N), at zero speed."""
        spread, decay = (self.q0 - self.p0) * weight, self.b0 + 0.0 * weight
        for k in range(7):
            over = (weight > self[k]) * (weight - self[k])
            spread = spread + (self[16 + k] - self[8 + k]) * over
            decay = decay + self[24 + k] * over
        return decay * spread

    def torque_and_slope(self, weight: Any, speed: Any, exp: Exp) -> tuple[Any, Any]:
        """Torque (N m) and slope (N m s/rad) at `speed` >= 0 (rad/s) under `weight` (N)."""
        level, static, decay = self.p0 * weight, self.q0 * weight, self.b0
        for k in range(7):
            over = (weight > self[k]) * (weight - self[k])
            level = level + self[8 + k] * over
            static = static + self[16 + k] * over
            decay = decay + self[24 + k] * over
        falling = (static - level) * exp(-decay * speed)
        return level + falling, -decay * falling

    def held(self, weight: Any) -> tuple[Any, Any, Any]:
        """Torque at high speed, static torque (N m) and decay (s/rad) under `weight` (N)."""
        level, static, decay = self.p0 * weight, self.q0 * weight, self.b0
        for k in range(7):
            over = (weight > self[k]) * (weight - self[k])
            level = level + self[8 + k] * over
            static = static + self[16 + k] * over
            decay = decay + self[24 + k] * over
        return level, static, decay

    def torque_by_weight(self, weight: Any, speed: Any, exp: Exp) -> Any:
        """Torque per weight at constant speed, dT/dW (m); at a row the mean of both sides."""
        spread, decay = (self.q0 - self.p0) * weight, self.b0
        level_rate, static_rate, decay_rate = self.p0, self.q0, 0.0
        for k in range(7):
            half = 0.5 * (weight > self[k]) + 0.5 * (weight >= self[k])
            over = (weight > self[k]) * (weight - self[k])
            spread = spread + (self[16 + k] - self[8 + k]) * over
            decay = decay + self[24 + k] * over
            level_rate = level_rate + self[8 + k] * half
            static_rate = static_rate + self[16 + k] * half
            decay_rate = decay_rate + self[24 + k] * half
        fade = exp(-decay * speed)
        moved = static_rate - level_rate - decay_rate * speed * spread
        return level_rate + moved * fade


def over_weight(
    table: WeightTable, a1_factor: float = 1.0, a2_factor: float = 1.0, beta_factor: float = 1.0
) -> OverWeight:
    """The law through the rows of a table.

    Parameters
    ----------
    table : WeightTable
        At most `KNOTS` + 1 rows.
    a1_factor, a2_factor, beta_factor : float
        On all rows.

    Returns
    -------
    OverWeight
        Below the first row its coefficients hold, above the last the last piece is continued.
    """
    rows = table.weight
    knots = rows[:-1]
    unused = KNOTS - len(knots)
    torques = [
        _slopes(rows, tuple(factor * a * w for a, w in zip(arm, rows, strict=True)), None)
        for arm, factor in ((table.a1, a1_factor), (table.a2, a2_factor))
    ]
    decay = tuple(beta_factor * b for b in table.beta)
    padded = [[*changes, *([0.0] * unused)] for changes in torques]
    decays = [decay[0], *_slopes(rows, decay, 0.0)[1:], *([0.0] * unused)]
    return OverWeight(*knots, *([0.0] * unused), *padded[0], *padded[1], *decays)


def _slopes(rows: tuple[float, ...], values: tuple[float, ...], first: float | None) -> list[float]:
    """Slope below the first row, by default towards zero, and its changes at the rows."""
    slopes = [
        (v1 - v0) / (w1 - w0)
        for (w0, w1), (v0, v1) in zip(pairwise(rows), pairwise(values), strict=True)
    ]
    below = values[0] / rows[0] if first is None else first
    return [below, *(b - a for a, b in zip([below, *slopes], slopes, strict=False))]
