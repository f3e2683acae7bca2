"""From a log with hidden friction to certified gains: how they do at the true friction.

    python benchmarks/identify_to_tune.py [CASES]

The rock of each case is drawn about that of the tuned design, a log of 300 s is made by
characteristics with gains that let it stick, `identify` fits it and the search of `tune` finds
gains for `identified.toml`. They are certified as `tune` does it, by the interval of P(J1 <= level)
at fresh draws; what else it computes (tolerances, neighbourhood, baselines, audit) is left out. Of
the cases whose certificate passed: is J1 at the true friction under the level? To save time the
search has 48 realizations from one start, and the certificate 600.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

import drillctl
from drillctl import units
from drillctl.studies.identify.compute import identify
from drillctl.studies.identify.written import write as write_design
from drillctl.studies.tune.certificate import FreshDraws
from drillctl.studies.tune.search import search
from drillctl.studies.tune.tuned import tuned_parameters
from tests.logs.synthetic import WEIGHT, Rig, sampled, write

TUNE = {
    "tune.realizations": 48, "tune.starts": 1, "tune.certificate.realizations": 600,
    "simulation.accuracy": "fast",
}  # fmt: skip


def case(number: int, folder: Path) -> tuple[bool, float, float]:
    """Whether the certificate passed, its level, and J1 at the true friction."""
    random = np.random.default_rng([2020, number])
    a1, a2, beta = (
        value * np.exp(random.normal(0.0, 0.08)) for value in (0.026, 0.085, 0.098)
    )  # fmt: skip
    rig = Rig(a1=a1 * WEIGHT, a2=a2 * WEIGHT, beta=beta, parts=400)
    rate = (10.0, 100.0)[number % 2]
    samples = sampled(rig.run(320.0), rate, 20.0, 320.0, (200.0, 0.02), number)
    path = write(folder / "log.csv", samples, weight=WEIGHT)
    design = drillctl.load("robust-gains-140kn")
    write_design(identify(design, [path]), folder)
    rock = drillctl.load(folder / "identified.toml", **TUNE)
    fresh = FreshDraws(rock, tuned_parameters(rock))
    found = search(rock)
    runs = fresh.of_gains(found.values)[1]
    gains = {
        one.path: units.SI(value) for one, value in zip(found.tuned, found.values, strict=True)
    }
    truth = {
        "bit_rock.law": "navarro-lopez-suarez",
        "bit_rock.a1": a1,
        "bit_rock.a2": a2,
        "bit_rock.beta": beta,
    }
    made = drillctl.load(folder / "identified.toml").replace({**truth, **gains})
    j1 = drillctl.simulate(made, "batch").measures.j1
    return runs.interval[0] >= rock.tables.tune.probability, runs.level, float(j1)


def main(count: int) -> None:
    """Print each case, and the share of those that passed and hold."""
    folder = Path(tempfile.mkdtemp())
    rows = []
    for number in range(count):
        rows.append(case(number, folder))
        passed, level, j1 = rows[-1]
        print(f"{number} passed {passed}, level {level:g}, J1 at the truth {j1:.3f}", flush=True)
    held = [j1 <= level for passed, level, j1 in rows if passed]
    print(f"{len(held)} of {count} certificates passed; of these {sum(held)} hold")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 40)
