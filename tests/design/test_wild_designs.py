"""Any design is refused in words, or read, written and shown without a warning; and it runs.

`python -m tests.design.test_wild_designs FIRST COUNT` does the same from seeds, and prints each
kind of fault once.
"""

from __future__ import annotations

import collections
import random as seeded
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import tomli_w
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import drillctl
from drillctl.design import Design, to_toml
from drillctl.design.tables import DesignTables
from drillctl.design.validation import validated
from drillctl.errors import DrillctlError
from drillctl.progress import SILENT
from drillctl.simulation.measures import STATUSES
from drillctl.text import LONGEST_ERROR, clean, one_line
from tests.design.wild import misfits, rigs, spoilt

RIGS = rigs()
RIGS["monteiro-trindade-2012"]["bit_rock"]["outside_table"] = "extrapolate"
RIG = "monteiro-trindade-2012"
COMPILED = ("operating_point", "drillstring", "top_drive", "bha", "well", "simulation", "title")
"""Tables of the design that leave the laws as they are, whose kernel other tests compile."""
PICTURE = SimpleNamespace(svg="<svg/>", width=1, height=1, box=(0.0, 0.0, 1.0, 1.0))


def refused(error: DrillctlError) -> None:
    """Check that anybody can read why."""
    lines = str(error).split("\n")
    assert 1 <= len(lines) <= 11
    assert all(0 < len(line) <= LONGEST_ERROR and one_line(line) == line for line in lines)
    assert not any(word in str(error) for word in ("Value error", "datetime.", "<class"))


def attempted(function: Callable[[], Any]) -> Any:
    """What a function returns, or None if it refuses."""
    try:
        return function()
    except DrillctlError as error:
        refused(error)
        return None


def written(design: Design, path: Path) -> Design:
    """The same design, written and read back; what it shows is computed."""
    text = to_toml(design)
    path.write_text(text, encoding="utf-8")
    again = drillctl.load(path)
    assert to_toml(again) == text
    assert again == design
    assert clean(text) == text
    assert sum(one.elements for one in again.mesh) > 0
    assert all(str(one) for one in again.warnings)
    return again


def run(design: Design, folder: Path) -> None:
    """A short run of a design, its loop and its page of a report."""
    from drillctl.reporting.blocks import Words
    from drillctl.reporting.gather import QUICK, gather
    from drillctl.reporting.making import compose
    from drillctl.reporting.pages import html_page

    short = {"simulation.duration": "0.5 s", "simulation.j1_from": "0 s"}
    done = attempted(lambda: drillctl.simulate(design.replace(short), engine="batch"))
    assert done is None or done.status in STATUSES
    loop = attempted(design.loop)
    assert loop is None or np.isfinite(np.linalg.eigvals(loop.A)).all()
    gathered = gather(design, QUICK, folder, (), Words("field"), SILENT)
    document = compose(gathered, ("rig",), None)
    page = html_page(document, SimpleNamespace(picture=lambda figure: PICTURE))
    assert clean(page) == page


def examined(tree: object, folder: Path, deep: bool) -> bool:
    """Take a tree through all of it; whether it is a design."""
    path = folder / "wild.toml"
    path.write_text(tomli_w.dumps(tree), encoding="utf-8")
    with warnings.catch_warnings(), np.errstate(all="raise", under="ignore"):
        warnings.simplefilter("error")
        design = attempted(lambda: drillctl.load(path))
        if design is None:
            return False
        again = written(design, folder / "again.toml")
        if deep:
            run(again, folder)
    return True


@pytest.fixture(scope="module")
def scratch(tmp_path_factory):
    return tmp_path_factory.mktemp("wild")


def often(count, same=True):
    """So many designs, the same ones each time unless they are many."""
    checks = [HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much]
    return settings(
        max_examples=count, deadline=None, suppress_health_check=checks, database=None,
        derandomize=same,
    )  # fmt: skip


RANDOM = st.randoms(use_true_random=False)


@often(1_900)
@given(random=RANDOM)
def test_any_design_is_refused_in_words_or_comes_back_as_it_is(random, scratch):
    examined(spoilt(random, RIGS[random.choice(sorted(RIGS))]), scratch, deep=False)


def test_every_key_refuses_what_does_not_fit():
    for path, tree in misfits(DesignTables, RIGS[RIG]):
        try:
            attempted(lambda tree=tree: validated(tree, ""))
        except Exception as error:
            raise AssertionError(path) from error


@often(100)
@given(random=RANDOM)
def test_any_rig_runs_and_has_a_report(random, scratch):
    examined(spoilt(random, RIGS[RIG], COMPILED, absurd=0.2), scratch, deep=True)


@pytest.mark.slow
@often(30_000, same=False)
@given(random=RANDOM)
def test_any_design_goes_through_everything(random, scratch):
    examined(spoilt(random, RIGS[random.choice(sorted(RIGS))]), scratch, deep=True)


def main(first: int, count: int, keys: tuple[str, ...] | None) -> None:
    """Designs by seed, each kind of fault printed once with its file."""
    found: collections.Counter[str] = collections.Counter()
    folder = Path(tempfile.mkdtemp(prefix="wild-"))
    for seed in range(first, first + count):
        random = seeded.Random(seed)
        rig = RIGS[RIG if keys else random.choice(sorted(RIGS))]
        try:
            kind = (
                "valid"
                if examined(spoilt(random, rig, keys, 0.2 if keys else 1.0), folder, True)
                else "refused"
            )
        except Exception as error:
            at = traceback.extract_tb(error.__traceback__)[-1]
            kind = f"{type(error).__name__} {Path(at.filename).name}:{at.lineno} {str(error)[:150]}"
            if kind not in found:
                kept = folder / f"{seed}.toml"
                kept.write_bytes((folder / "wild.toml").read_bytes())
                print(kept, kind, flush=True)  # noqa: T201
        found[kind] += 1
    for kind, number in found.most_common():
        print(number, kind)  # noqa: T201


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), COMPILED if len(sys.argv) > 3 else None)
