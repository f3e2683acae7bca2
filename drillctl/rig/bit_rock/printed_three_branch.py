"""The friction of Monteiro & Trindade (2012) as they print it, in three branches."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

from drillctl.errors import InputError
from drillctl.rig import table as q
from drillctl.rig.bit_rock.law import Exp, Form, FrictionLaw
from drillctl.rig.bit_rock.navarro_lopez_suarez import FrictionCoefficients, NavarroLopezSuarez


class PrintedThreeBranch(NamedTuple):
    r"""Friction with a tolerance about zero speed, as printed; reference solver only.

    .. math:: T(\omega) = K (\theta_{n-1} - \theta_n)
              \quad |\omega| \le \delta, \; |K (\theta_{n-1} - \theta_n)| \le a_2 W

    .. math:: T(\omega) = a_2 W \, \mathrm{sign}(\theta_{n-1} - \theta_n)
              \quad |\omega| \le \delta, \; |K (\theta_{n-1} - \theta_n)| > a_2 W

    .. math:: T(\omega) = [a_1 + (a_2 - a_1) e^{-\beta |\omega|}] \, W \, \mathrm{sign}\,\omega
              \quad |\omega| > \delta

    Equations 3, 4 and 5 of Monteiro & Trindade (2012), with W the weight on bit, K the stiffness
    (N m/rad) of the element next to the bit and theta_{n-1}, theta_n the angles of its ends
    (rad). A stand-in for the set of `NavarroLopezSuarez`: within the tolerance the bit bears the
    torque of the pipe, whatever its own speed, so that nothing brings it to rest: it creeps at up
    to delta. `stuck_time` counts the time within the tolerance, and `sticks` the times it was
    entered. Status: as printed, to show what that does; not for design.

    Attributes
    ----------
    a1 : float
        Torque at high speed over weight on bit (m).
    a2 : float
        Static torque over weight on bit (m); not less than `a1`.
    beta : float
        Decay of the torque with speed (s/rad).
    tolerance : float
        Speed delta within which a bit counts as stuck (rad/s), more than zero.
    """

    a1: Any
    a2: Any
    beta: Any
    tolerance: Any

    @property
    def turning(self) -> NavarroLopezSuarez:
        """The law of a bit outside the tolerance, Equation 5."""
        return NavarroLopezSuarez(self.a1, self.a2, self.beta)

    @property
    def set_valued(self) -> bool:
        """A bit creeps under this law where it should stand still."""
        return False

    def static_torque(self, weight: Any) -> Any:
        """Largest torque within the tolerance (N m), `a2 W`."""
        return self.turning.static_torque(weight)

    def kinetic_torque_at_rest(self, weight: Any) -> Any:
        """Torque of Equation 5 continued to rest (N m): the static torque."""
        return self.turning.kinetic_torque_at_rest(weight)

    def steepest_fall(self, weight: Any) -> Any:
        """Largest falling slope of Equation 5 (N m s/rad)."""
        return self.turning.steepest_fall(weight)

    def torque_and_slope(self, weight: Any, speed: Any, exp: Exp) -> tuple[Any, Any]:
        """Torque (N m) and slope (N m s/rad) of Equation 5 at `speed` >= 0 (rad/s).

        Within the tolerance the torque depends on the string, which only a simulation computes.
        """
        return self.turning.torque_and_slope(weight, speed, exp)


class PrintedThreeBranchTable(FrictionCoefficients):
    """The same in three branches as Monteiro & Trindade print it; reference solver only."""

    law: Literal["printed-three-branch"]
    tolerance: q.PositiveSpeed = 1e-4


def _law(table: PrintedThreeBranchTable, weight: float, moves: bool) -> PrintedThreeBranch:
    if table.table is not None and moves:
        raise InputError(
            f"is not allowed with a weight on bit that moves under {table.law!r}; "
            "give a1, a2 and beta",
            "bit_rock.table",
        )
    return PrintedThreeBranch(*table.at(weight), table.tolerance)


LAWS = (
    FrictionLaw(
        PrintedThreeBranchTable,
        _law,
        draws=("a1_factor", "a2_factor"),
        forms=(
            Form(
                PrintedThreeBranch,
                static=("a2",),
                sliding=("a1",),
                decay=("beta",),
                keys='`law = "printed-three-branch"` (a1, a2, beta, or a table over the weight on '
                'bit; tolerance, by default `"1e-4 rad/s"`)',
                use="To see what the paper's own numerical stand-in does beside the set, one run "
                "at a time: the reference solver locates where its torque jumps; the batch engine "
                "refuses it by name.",
            ),
        ),
    ),
)
