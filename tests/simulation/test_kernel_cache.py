"""A second process compiles nothing, and an edited law is not run stale."""

import subprocess
import sys

CODE = """
import drillctl
from drillctl.simulation.kernels.advance import run
for name in ("monteiro-trindade-140kn", "navarro-lopez-2dof-bistable"):
    drillctl.simulate(drillctl.load(name), "batch", **{"simulation.duration": "1 s"})
print(sum(run.stats.cache_misses.values()), sum(run.stats.cache_hits.values()))
"""


def counts() -> tuple[int, int]:
    done = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=True)
    misses, hits = done.stdout.split()
    return int(misses), int(hits)


def test_the_second_process_compiles_nothing():
    counts()
    assert counts() == (0, 2)


def test_the_fingerprint_covers_every_source():
    from drillctl.simulation.kernels import advance

    sources = advance.sources()
    names = {path.name for path in sources}
    assert {"pi.py", "navarro_lopez_suarez.py", "constant.py", "lane_step.py"} <= names
    assert advance.fingerprint(sources) != advance.fingerprint(sources[:-1])
