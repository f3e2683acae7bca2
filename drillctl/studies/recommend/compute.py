"""What to set: every candidate at the same draws, judged by all criteria, and one recommended."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from drillctl.design import Design
from drillctl.ensemble.cases import mean_estimate
from drillctl.errors import InputError
from drillctl.progress import SILENT, Progress
from drillctl.store.codec import label
from drillctl.store.json_files import picked
from drillctl.store.result import Timed, timed
from drillctl.store.tables import Estimate
from drillctl.studies.delay.compute import following_law
from drillctl.studies.recommend import candidates as c
from drillctl.studies.recommend.assess import FAILS, Assessed, assessed, best_of
from drillctl.studies.recommend.help import until_depth, what_helps
from drillctl.studies.recommend.words import in_drive_units, limits_of, sentence
from drillctl.studies.tune.search import Tuning
from drillctl.studies.tune.tuned import tuned_parameters


@dataclass(frozen=True, eq=False)
class Recommendation(Timed, kind="recommend"):
    """What to set, what limits it, and what else was considered."""

    design: Design = label(means="as it was given")
    candidates: tuple[Assessed, ...] = label(
        over="candidate", flat=True, means="those that apply, what is in the drive now first"
    )
    left_out: dict[str, str] = label(means="those that do not, with the reason")
    confirmed: tuple[c.Confirmed, ...] = label(means="what grids over the gains say, if asked")
    helps: tuple[str, ...] = label(means="what would help next, in words")
    until: tuple[float, float | None] | None = label(
        means="depth (m) down to which the recommended setting keeps passing, and where not"
    )
    seed: int = label(means="of the draws")
    trajectories: int = label(means="runs of the search")

    @cached_property
    def recommended(self) -> Assessed:
        """The best that passes, else the best that passes but is fragile, else the least bad."""
        return best_of(self.candidates)

    @property
    def present(self) -> Assessed:
        """What is in the drive now."""
        return self.candidates[0]

    @property
    def verdict(self) -> str:
        """`passes`, `fragile` or `none`."""
        word = self.recommended.verdict
        return "none" if word == FAILS else word

    @property
    def limits(self) -> tuple[str, ...]:
        """What limits the recommended setting, in words."""
        return limits_of(self.recommended)

    @property
    def sentence(self) -> str:
        """What to set, what limits it, what would help next; quantities in full."""
        return sentence(self)

    def less(self, one: Assessed) -> Estimate:
        """Mean J1 less that of what is in the drive now, draw by draw."""
        apart = one.j1 - self.present.j1
        return mean_estimate(np.where(np.isfinite(apart), apart, np.nan), self.seed)

    def summary(self) -> dict[str, Any]:
        """Strict JSON values, SI."""
        best = self.recommended
        return {
            "recommended": {
                "name": best.name,
                "law": best.law,
                "gains": best.gains,
                "drive_units": in_drive_units(best),
                "verdict": self.verdict,
                "limits": list(self.limits),
                "sentence": self.sentence,
            },
            "present": self.present.name,
            "candidates": {
                one.name: {**one.summary(), "less_than_present": self.less(one).summary()}
                for one in self.candidates
            },
            "left_out": self.left_out,
            "confirmed": [one.sentence for one in self.confirmed],
            "helps": list(self.helps),
            "passes_to_depth": self.until and self.until[0],
            "fails_at_depth": self.until and self.until[1],
            "realizations": len(best.j1),
            **picked(self, "seed", "trajectories", "total_seconds"),
        }


@timed
def recommend(design: Design, progress: Progress = SILENT) -> Recommendation:
    """Find what to set in the drive, judge it, and say what limits it.

    Parameters
    ----------
    design : Design
        Its `[recommend]` table says what is considered and what must be kept; level, probability,
        search and draws are those of `[tune]`.
    progress : Progress
        Receives each candidate that is assessed.

    Returns
    -------
    Recommendation
        That nothing passes is an answer, with the least bad and by how much it misses.

    Raises
    ------
    InputError
        Impossible settings, or no candidate that a rig can have.
    """
    listed, found = _listed(design, progress)
    progress.begin("assessing settings", len(listed))
    results: list[Assessed] = []
    left_out: dict[str, str] = {}
    for one in listed:
        _assess(one, results, left_out)
        progress.advance(1)
    if not results:
        raise InputError(f"no drive law applies: {next(iter(left_out.values()))}", "recommend.laws")
    confirmed: list[c.Confirmed] = []
    robust = next((one for one in results if one.name == c.ROBUST), None)
    if robust is not None and robust.missed:
        _search_kept(robust.design, c.KEPT, results, left_out, confirmed)
    if all(one.missed for one in results) and "z-torque" in design.tables.recommend.laws:
        matched = next((one for one in results if one.law == "z-torque"), None)
        if matched is not None:
            _search_kept(matched.design, c.MATCHED, results, left_out, confirmed)
    best = best_of(results)
    return Recommendation(
        design=design,
        candidates=tuple(results),
        left_out=left_out,
        confirmed=tuple(confirmed),
        helps=what_helps(best),
        until=until_depth(best),
        seed=design.tables.tune.fresh_seed,
        trajectories=0 if found is None else found.trajectories,
    )


def _listed(design: Design, progress: Progress) -> tuple[list[c.Candidate], Tuning | None]:
    """Candidates, each with a weight that follows the bit speed beside it where that is asked."""
    some, found = (
        c.searched(design, progress) if "pi" in design.tables.recommend.laws else ([], None)
    )
    listed = [c.Candidate(c.PRESENT, c.present(design)), *some, *c.by_rules(design)]
    if given := design.tables.recommend.dynamic_weight:
        values = {f"weight_on_bit.{key}": value for key, value in given.items()}
        values = following_law(design, values)
        listed += [
            c.Candidate(f"{one.name}, dynamic weight", one.design.replace(values), one.law)
            for one in listed
            if one.design is not None
        ]
    return listed, found


def _search_kept(
    design: Design, name: str, results: list[Assessed], left_out: dict[str, str],
    confirmed: list[c.Confirmed],
) -> None:  # fmt: skip
    """Search a grid for the best setting that keeps everything, and assess it."""
    tuned = c.MATCHED_BY if name == c.MATCHED else tuned_parameters(design)
    if len(tuned) != 2:
        return
    made, count = c.all_kept(design, tuned, name.split(",")[0])
    confirmed.append(count)
    if made is not None:
        _assess(c.Candidate(name, made), results, left_out)


def _assess(one: c.Candidate, results: list[Assessed], left_out: dict[str, str]) -> None:
    if one.design is None:
        left_out[one.name] = one.reason
        return
    try:
        results.append(assessed(one, one.design))
    except InputError as error:
        left_out[one.name] = error.problem
