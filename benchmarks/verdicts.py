"""What `recommend` says of shipped designs, and what other draws say of it.

    python -m benchmarks.verdicts [DESIGN ...] [--set PATH=VALUE ...]

A line a design: the recommended setting, its verdict, the verdict and the probability at 2,000
draws of another seed, and what grids over the gains found where nothing passes. Minutes each; the
designs of a cutting bit and those of no drive that can be set are left out by default.
"""

from __future__ import annotations

import argparse
import time

import drillctl
from drillctl import catalog, units
from drillctl.errors import InputError
from drillctl.studies.recommend.assess import assessed
from drillctl.studies.recommend.candidates import Candidate

OTHER = {"tune.certificate.seed": 77, "tune.certificate.realizations": 2000}
"""Draws that no search and no assessment before has seen."""


def verdict(name: str, values: dict[str, str]) -> str:
    """A line on a design."""
    design = drillctl.load(name, **values)
    found = drillctl.recommend(design)
    best = found.recommended
    again = assessed(Candidate(best.name, best.design, best.law), best.design.replace(OTHER))
    return " | ".join(
        (
            name,
            found.verdict,
            f"again: {again.verdict}, P = {again.probability:.4g}",
            units.told(found.sentence, "si"),
            *(one.sentence for one in found.confirmed),
        )
    )


def main() -> None:
    """Print a line for each design."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("designs", nargs="*")
    parser.add_argument("--set", action="append", default=[], metavar="PATH=VALUE")
    given = parser.parse_args()
    values = dict(one.split("=", 1) for one in given.set)
    for name in given.designs or catalog.names("designs"):
        begin = time.process_time()
        try:
            line = verdict(name, values)
        except InputError as error:
            line = f"{name} | {error}"
        print(f"{line} | {time.process_time() - begin:.0f} s of processor time", flush=True)


if __name__ == "__main__":
    main()
