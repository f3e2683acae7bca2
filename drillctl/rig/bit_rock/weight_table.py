"""Friction coefficients that depend on the weight on bit, from a table."""

from __future__ import annotations

from dataclasses import dataclass

from drillctl.rig.bit_rock.navarro_lopez_suarez import NavarroLopezSuarez


@dataclass(frozen=True)
class WeightTable:
    """Coefficients of `NavarroLopezSuarez` at several weights on bit.

    Between rows the torques `a1 W` and `a2 W`, and `beta`, are piecewise linear in W. Below
    the first row its coefficients hold (torque goes to zero with the weight); above the last
    row the last segment is continued.

    Attributes
    ----------
    weight : tuple of float, shape (rows,)
        Weights on bit (N), increasing.
    a1, a2 : tuple of float, shape (rows,)
        Torque over weight (m).
    beta : tuple of float, shape (rows,)
        Decay (s/rad).
    """

    weight: tuple[float, ...]
    a1: tuple[float, ...]
    a2: tuple[float, ...]
    beta: tuple[float, ...]

    def covers(self, weight: float) -> bool:
        """Whether `weight` (N) lies within the rows."""
        return self.weight[0] <= weight <= self.weight[-1]

    def at(self, weight: float) -> NavarroLopezSuarez:
        """Coefficients at `weight` (N)."""
        if weight <= self.weight[0]:
            return NavarroLopezSuarez(self.a1[0], self.a2[0], self.beta[0])
        last = len(self.weight) - 2
        row = min(sum(w < weight for w in self.weight[1:]), last)
        low, high = self.weight[row], self.weight[row + 1]
        share = (weight - low) / (high - low)

        if share == 1.0:  # at a row, its printed coefficients to the last bit
            return NavarroLopezSuarez(self.a1[row + 1], self.a2[row + 1], self.beta[row + 1])

        def between(left: float, right: float) -> float:
            return left + share * (right - left)

        return NavarroLopezSuarez(
            between(self.a1[row] * low, self.a1[row + 1] * high) / weight,
            between(self.a2[row] * low, self.a2[row + 1] * high) / weight,
            between(self.beta[row], self.beta[row + 1]),
        )
