"""A weight on bit that follows the bit speed, against the delay of its path."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from drillctl import plots, units
from drillctl.simulation.measures import MEASURES
from drillctl.store.tables import Column, Table, chance, quantity
from drillctl.studies.base import DRAWS, SEED, Picture, Study

if TYPE_CHECKING:
    from drillctl.design import Design
    from drillctl.studies.delay.compute import WeightDelay


def tables(result: WeightDelay) -> Iterator[Table]:
    """J1 and the end of stick-slip by gain and delay, and how much delay each gain bears."""
    columns = (
        Column("gain", "K_w", "N*s/rad"), Column("delay", "delay", "s"),
        Column("j1", "mean J1", "s", interval=True),
        Column("difference", "less constant weight", "s", 3, signed=True, interval=True),
        Column("pairs", hidden=True), Column("ended", hidden=True),
        Column("ended_share", "stick-slip ended", percent=True, digits=3, interval=True),
        Column("peak_bit_speed", "mean peak bit speed", "rad/s", hidden=True),
        Column("peak_pipe_torque", "mean peak pipe torque", "N*m", hidden=True),
        Column("mean_weight", "mean WOB", "N"),
        *(Column(name, f"mean {MEASURES[name].label}", MEASURES[name].unit,
                 hidden=name != "rate_of_penetration")
          for name in result.baseline.axial),
    )  # fmt: skip
    rows = [
        [float(gain), one.delay, one.j1, one.difference, one.difference.draws, one.ended.hits,
         one.ended.estimate, one.peak_bit_speed, one.peak_pipe_torque, one.mean_weight,
         *one.axial.values()]
        for gain, row in zip(result.gains, result.benefits, strict=True)
        for one in row
    ]  # fmt: skip
    title = f"J1 and end of stick-slip over {result.realizations} draws (95 % intervals)"
    yield Table("weight-delay", title, columns, rows)
    limits = (
        Column("gain", "K_w", "N*s/rad"),
        Column("ends_up_to", "stick-slip ends up to a delay of", "s"),
        Column("share", "share of draws there", percent=True, digits=3, interval=True),
        Column("next_share", "at the next delay", percent=True, digits=3, interval=True),
        Column("harmful_from", "harmful from a delay of", "s", digits=3, interval=True),
    )
    bounds: list[list[Any]] = []
    for one in result.limits:
        at, after = one.ends_at, one.ends_before
        bounds.append([
            one.gain, at and at.delay, at and at.ended.estimate, after and after.ended.estimate,
            one.harmful_from.estimate,
        ])  # fmt: skip
    yield Table("delay-limits", "delay that each gain bears (95 % intervals)", limits, bounds)


def pictures(result: WeightDelay) -> Iterator[Picture]:
    """J1 and the end of stick-slip against the delay."""
    yield Picture(
        "weight-delay", "Weight on bit that follows the bit speed, against its delay.",
        "Mean J1 and share of draws in which stick-slip ends against the delay, a line a gain.",
        lambda system: plots.weight_delay(result, system=system),
    )  # fmt: skip


def remarks(result: WeightDelay, system: units.System) -> Iterator[str]:
    """The constant weight, failures and draws."""
    constant, longest = result.baseline, result.delays[-1]
    ended = constant.ended
    yield (
        f"Constant weight: mean J1 {quantity(constant.j1.value, 's', system)}, stick-slip ended in "
        f"{chance(ended.value, ended.interval)} of the draws."
    )
    yield (
        f"Stick-slip ends where the bit does not stick in the last 20 s in {result.enough:.0%} of "
        "the draws, at this delay and all shorter ones. Harmful: mean J1 not less than with a "
        f"constant weight. –: not up to {longest:g} s."
    )
    for failure in result.failures:
        yield failure.sentence(result.realizations)
    yield f"{result.realizations} draws of {', '.join(result.drawn)}; seed {result.seed}."


def check(design: Design) -> None:
    """Refuse a law that does not follow the bit speed, before anything is run."""
    if "weight_delay" in design.tree:
        from drillctl.studies.delay.compute import following_design

        following_design(design)


STUDY = Study(
    module=__name__,
    name="delay",
    help="Show what delay does to a weight that follows bit speed",
    group="Decide",
    options=(DRAWS, SEED),
    python="weight_delay",
)
