"""What may be set: laws with their numbers, by rules, by the linear loop, by search."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from drillctl import units
from drillctl.arrays import Array
from drillctl.design import Design, parameter, tuned_ranges
from drillctl.errors import InputError
from drillctl.linear.ends import ends_of
from drillctl.linear.operating_point import operating_point
from drillctl.linear.slope_margin import slope_margins
from drillctl.progress import Progress
from drillctl.rig.top_drive.law import drive_laws
from drillctl.studies.recommend.criteria import loop_criteria, loop_figures, slope_margin_of
from drillctl.studies.tune.linear_design import linear_or_why
from drillctl.studies.tune.problem import GainProblem
from drillctl.studies.tune.search import Tuning, search, search_problem
from drillctl.studies.tune.tuned import Tuned, put, string_numbers

PRESENT, LINEAR, ROBUST, KEPT = "in the drive now", "PI, linear", "PI, robust", "PI, margins kept"
MATCHED = "Z-torque, margins kept"
NAMES = {
    "stiff-speed": "stiff", "soft-torque": "soft torque", "z-torque": "Z-torque",
    "active-damping": "active damping", "constant-torque": "constant torque",
    "torsional-rectification": "torsional rectification", "pi": "PI",
}  # fmt: skip
"""Laws, as people call them."""
AS_PI = ("stiff-speed", "soft-torque")  # laws that are a PI with gains by a rule
MATCHED_BY = (
    Tuned("controller.absorption", "", 0.05, 1.0), Tuned("controller.stiffness", "", 5.0, 50.0),
)  # fmt: skip
"""Numbers of Z-torque that are searched where nothing passes."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A drive with its numbers, and why it is left out, if so."""

    name: str
    design: Design | None  # None where it does not apply
    law: str = ""  # that gave the numbers, if not that of the design
    reason: str = ""


def with_law(design: Design, values: dict[str, Any]) -> Design:
    """The design with another drive law, which has none of the old law's numbers."""
    law = values["controller.law"]
    if design.tables.controller.law == law != "pi":  # a change to itself would keep its numbers
        design = as_pi(design, 1.0, 1.0)
    return design.replace(values)


def as_pi(design: Design, kp: float, ki: float) -> Design:
    """The design with a PI."""
    gains = {"controller.kp": units.SI(float(kp)), "controller.ki": units.SI(float(ki))}
    return with_law(design, {"controller.law": "pi", **gains})


def gains_of(design: Design) -> dict[str, float]:
    """Numbers of the drive law by path (SI): of every PI its gains, of others the law's own."""
    table = design.tables.controller
    law = drive_laws()[table.law]
    drive = design.linear_drive
    if table.law in ("pi", *AS_PI):
        kp, ki = drive.gains()
        return {"controller.kp": float(kp), "controller.ki": float(ki)}
    results = {}
    for key in law.tuned:
        value = getattr(table, key)
        if value is None:  # by a rule of the law, as for `damper` and `spring`
            value = getattr(string_numbers(design.string), f"drive_{key}")
        results[f"controller.{key}"] = float(value)
    return results


def controller_numbers(design: Design) -> dict[str, float]:
    """Numbers as the drive has them (SI): both gains, and what it makes of the pipe torque."""
    drive: Any = design.top_drive
    kp, ki = drive.gains()
    results = {"kp": float(kp), "ki": float(ki)}
    if float(getattr(drive, "mobility", 0.0)) > 0.0:
        results |= {
            key: float(getattr(drive, key)) for key in ("mobility", "sensed_inertia", "corner")
        }
    return results


def present(design: Design) -> Design:
    """The design with what is in the drive now."""
    given = design.tables.recommend.present
    if not given:
        return design
    values = {f"controller.{key}": value for key, value in given.items()}
    with design.within("recommend.present"):
        return with_law(design, values) if "law" in given else design.replace(values)


def pi_problem(design: Design) -> Design:
    """The design whose PI is tuned: its own, or one within the ranges of this rig."""
    if design.tables.controller.law == "pi":
        return design
    string = design.string
    numbers = string_numbers(string)
    zeta = numbers.pipe_impedance
    if math.isnan(zeta):  # of a lumped spring, as the ranges of a PI have it
        zeta = string.static_stiffness / string.stick_slip_frequency
    return as_pi(design, 4.0 * zeta, numbers.drive_spring)


def by_rules(design: Design) -> list[Candidate]:
    """Laws whose numbers follow from the string."""
    results = []
    for law in design.tables.recommend.laws:
        if law == "pi":
            continue
        try:
            made = with_law(design, {"controller.law": law})
            if law in AS_PI:  # what stands in the drive are its two gains
                made = as_pi(made, *made.linear_drive.gains())
            _ = made.top_drive
            results.append(Candidate(NAMES[law], made, law))
        except InputError as error:
            why = error.problem.removeprefix(f"{law} is ")
            results.append(Candidate(NAMES[law], None, law, why))
    return results


def searched(design: Design, progress: Progress) -> tuple[list[Candidate], Tuning | None]:
    """PI of the largest slope margin, and the one of the search that `drillctl tune` makes."""
    pi = pi_problem(design)
    linear = linear_or_why(pi)
    if isinstance(linear, InputError):
        results = [Candidate(LINEAR, None, "pi", linear.problem)]
    else:
        results = [Candidate(LINEAR, linear.design)]
    try:
        found = search(pi, progress, linear=linear)
        return [*results, Candidate(ROBUST, found.design)], found
    except InputError as error:
        return [*results, Candidate(ROBUST, None, "pi", error.problem)], None


POINTS = 33  # along each axis of the grid over the gains of an ideal PI
FEWER = 13  # of any other drive, whose loops are computed one by one
DRAWS = 200  # of the search, at which cells of the grid are run
TRIED = 48  # cells, the best by the draws first, whose margins are computed
ROUNDS = 8  # of the polish
FIRST, LAST = 0.5, 0.1  # steps of the polish, over the distance of two cells


@dataclass(frozen=True, eq=False)
class Confirmed:
    """What a grid over two numbers of a drive says of the criteria."""

    law: str  # as people call it
    cells: int  # of the grid
    stable: int  # with the slope margin that is asked for
    probable: int  # of those, with the probability at the draws
    passing: int  # of those, that keep the other margins too; of the first that were tried

    @property
    def sentence(self) -> str:
        """For people."""
        counts = (
            (self.stable, "the slope margin"), (self.probable, "the probability"),
            (self.passing, "all else"),
        )  # fmt: skip
        told: list[str] = []
        for count, what in counts:
            verb = ("keeps" if count < 2 else "keep") if not told else "of these"
            told.append(f"{count or 'none'} {verb} {what}")
            if not count:
                break
        return f"{self.law}, grid of {self.cells} settings: {', '.join(told)}"


def all_kept(design: Design, tuned: tuple[Tuned, ...], law: str) -> tuple[Design | None, Confirmed]:
    """The setting of the least objective among those that keep every criterion of the loop."""
    problem = search_problem(design, tuned)
    size = POINTS if design.simple_loop else FEWER
    lines = [np.linspace(t.low, t.high, size) for t in tuned]
    grid = np.stack([one.ravel() for one in np.meshgrid(*lines, indexing="ij")], axis=1)
    stable = grid[_slopes_kept(design, tuned, grid)]
    if not len(stable):
        return None, Confirmed(law, len(grid), 0, 0, 0)
    points = problem.points(stable, min(DRAWS, len(problem)))
    probable = [p for p in points if p.share >= problem.table.probability]
    ordered = sorted(probable or points, key=lambda p: p.merit)[:TRIED]
    kept = []
    for point in ordered:
        if _loop_kept(put(design, tuned, point.values)):
            kept.append(point)
            if probable:
                break
    count = Confirmed(law, len(grid), len(stable), len(probable), len(kept) if probable else 0)
    if not kept:
        return None, count
    best = _polished(design, tuned, problem, problem.at_all(kept[0]), size)
    return put(design, tuned, best.values), count


def _slopes_kept(design: Design, tuned: tuple[Tuned, ...], grid: Array) -> Any:
    asked = design.tables.recommend.slope_reserve
    slope = operating_point(design).slope
    if slope <= 0.0:
        return np.ones(len(grid), bool)
    if design.simple_loop and [t.path for t in tuned] == ["controller.kp", "controller.ki"]:
        margin = slope_margins(ends_of(design.sliding_string), grid[:, 0], grid[:, 1]).slope
    else:
        made = (put(design, tuned, one) for one in grid)
        margin = np.array([slope_margin_of(one, one.speed)[0] for one in made])
    return np.nan_to_num(margin) >= asked * slope


def _loop_kept(design: Design) -> bool:
    asked = design.tables.recommend
    return all(
        one.kept for one in loop_criteria(design, loop_figures(design, asked.slope_share), asked)
    )


def _polished(
    design: Design, tuned: tuple[Tuned, ...], problem: GainProblem, best: Any, size: int
) -> Any:
    """Pattern search at all draws among gains that keep the loop."""
    width = np.array([t.high - t.low for t in tuned]) / (size - 1)
    low, high = (np.array([getattr(t, end) for t in tuned]) for end in ("low", "high"))
    step = FIRST
    moves = np.array([(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1) if (a, b) != (0, 0)])
    for _ in range(ROUNDS):
        trials = np.clip(best.values + step * moves * width, low, high)
        better = sorted(
            (p for p in problem.points(trials, len(problem)) if p.merit < best.merit),
            key=lambda p: p.merit,
        )
        found = next((p for p in better if _loop_kept(put(design, tuned, p.values))), None)
        if found is None:
            step *= 0.5
            if step < LAST:
                break
            continue
        best = found
    return best


def kept_ranges(design: Design) -> tuple[Tuned, ...]:
    """Gains of a drive and how far each is followed: a quarter to four times its value."""
    results = []
    most = tuned_ranges(design)
    for path, value in gains_of(design).items():
        if value <= 0.0:
            continue
        high = min(4.0 * value, max(most[path][1], value)) if path in most else 4.0 * value
        results.append(Tuned(path, parameter(design, path).si_unit, 0.25 * value, high))
    return tuple(results)
