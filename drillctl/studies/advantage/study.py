"""The study: tune, measure afresh, compare."""

from __future__ import annotations

import time

from drillctl.design import Design
from drillctl.ensemble.grid import refuse_too_large
from drillctl.errors import InputError
from drillctl.progress import SILENT, Progress
from drillctl.studies.advantage.cases import cases, own_optima
from drillctl.studies.advantage.chart import chart
from drillctl.studies.advantage.delays import delay_curve
from drillctl.studies.advantage.equalities import ALL_TERMS
from drillctl.studies.advantage.measured import Fresh
from drillctl.studies.advantage.policies import SPEED, WEIGHT, Policies, policies
from drillctl.studies.advantage.regions import regions
from drillctl.studies.advantage.result import Advantage


def advantage(design: Design, progress: Progress = SILENT) -> Advantage:
    """Compare PI with a constant weight on bit and PI with one that follows the bit speed.

    Each is tuned to the objective of `[tune]` at the same draws and measured at fresh ones: at
    equal nominal weight, equal mean weight and equal ROP proxy; with an ideal path and a real one;
    over the gains of the drive, over weights and speeds, over delays of the path.

    Parameters
    ----------
    design : Design
        With a PI controller. Its `[advantage]` table gives law and path of the weight, what is
        run over and how many draws.
    progress : Progress
        Told of gains found.

    Returns
    -------
    Advantage
        Positive advantage: the weight that follows is better.

    Raises
    ------
    InputError
        A controller or weight law that is not compared, a weight or speed outside what the rock or
        the limits of the law allow, impossible bounds, or something drawn that the study sets.

    Notes
    -----
    The law of the weight is that of Navarro-Lopez & Suarez, Proc. IEEE CCA (2004) 1454-1460.
    """
    begin = time.perf_counter()
    compared = policies(design)
    checked(compared)
    table = design.tables.advantage
    speeds = table.speeds if design.speed in table.speeds else (*table.speeds, design.speed)
    cells = len(speeds) * len(table.weights) * len(compared)
    progress.begin("comparing", 2 * len(compared) + 2 * len(ALL_TERMS) + cells + len(table.delays))
    fresh = Fresh(design)
    optima = own_optima(compared, progress)
    found = cases(compared, optima, fresh, progress)
    areas = regions(compared, optima, progress)
    curve = delay_curve(compared, optima, fresh, progress)
    over = chart(compared, table.weights, table.speeds, fresh, progress)
    front = over.at_speed(design.speed) or chart(
        compared, table.weights, (design.speed,), fresh, progress
    )
    return Advantage(
        design=design,
        cases=found,
        regions=areas,
        front=front,
        chart=over,
        delay=curve,
        total_seconds=time.perf_counter() - begin,
    )


def checked(compared: Policies) -> None:
    """Refuse (`InputError`) what would be refused in the midst of the work."""
    design = compared.constant.design
    table, where = design.tables.advantage, f"{design.origin}: " if design.origin else ""
    for key, path, values in (
        ("weights", WEIGHT, table.weights), ("speeds", SPEED, table.speeds),
    ):  # fmt: skip
        for value in values:
            try:
                for policy in compared.at(path, value):
                    policy.design.bit_rock  # noqa: B018  its friction, and the limits of the law
                    policy.design.weight_on_bit  # noqa: B018
            except InputError as error:
                raise InputError(error.problem, f"{where}advantage.{key}") from None
    points = [table.region_points, table.region_points, table.region_realizations]
    refuse_too_large(points, "advantage.region_points", 1)
    refuse_too_large([table.realizations], "advantage.realizations")
