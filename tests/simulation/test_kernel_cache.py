"""A second process compiles nothing, and an edited law is not run stale."""

import os
import subprocess
import sys

import pytest

from drillctl.simulation import kernel_cache

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
    assert {"ideal.py", "navarro_lopez_suarez.py", "following_speed.py", "rock_step.py"} <= names
    assert advance.fingerprint(sources) != advance.fingerprint(sources[:-1])


OUTSIDE = """
import drillctl
from outside_law import Law

class Under(drillctl.Design):
    bit_rock = property(lambda self: Law(0.02, 0.06, 0.15))
    bit_rock_before = bit_rock

base = drillctl.load("monteiro-trindade-100kn", **{"simulation.duration": "10 s"})
design = Under(base.name, base.tables, base.tree, base.origin)
print(drillctl.simulate(design, "batch").measures.j1)
"""
LAW = """
from typing import Any, NamedTuple

class Law(NamedTuple):
    a1: Any
    a2: Any
    delta: Any
    set_valued = property(lambda self: True)
    def static_torque(self, weight):
        return self.a2 * weight
    def kinetic_torque_at_rest(self, weight):
        return self.a2 * weight
    def steepest_fall(self, weight):
        return FACTOR * self.delta * (self.a2 - self.a1) * weight
    def torque_and_slope(self, weight, speed, exp):
        part = 1.0 / (1.0 + FACTOR * self.delta * speed)
        falling = (self.a2 - self.a1) * weight * part
        return self.a1 * weight + falling, -FACTOR * self.delta * falling * part
"""


@pytest.mark.slow
def test_a_law_from_outside_is_never_stale_and_leaves_nothing_behind(tmp_path):
    def j1(code, law):
        (tmp_path / "outside_law.py").write_text(law)
        path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
        env = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "kept"), "PYTHONPATH": path}
        env["PYTHONDONTWRITEBYTECODE"] = "1"  # the edit is within the second of a file's date
        done = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=env
        )
        return float(done.stdout)

    steep = j1(OUTSIDE, LAW.replace("FACTOR", "3.0"))
    assert abs(j1(OUTSIDE, LAW.replace("FACTOR", "1.0")) / steep - 1.0) > 0.01
    (tmp_path / "outside_law.py").unlink()
    assert not list((tmp_path / "kept").rglob("*.nb?"))


def twice(x):
    return 2.0 * x


def kept_in(folder, monkeypatch):
    """What the cache does for a function of its own: misses and hits of two processes."""
    monkeypatch.setattr("numba.config.CACHE_DIR", str(folder))
    made = kernel_cache.njit(twice)
    assert made(2.0) == 4.0
    return sum(made.stats.cache_misses.values()), sum(made.stats.cache_hits.values())


@pytest.mark.parametrize("kind", ["nbi", "nbc"])
@pytest.mark.parametrize("left", [0, 40])
def test_a_damaged_entry_is_compiled_again(tmp_path, monkeypatch, caplog, kind, left):
    assert kept_in(tmp_path, monkeypatch) == (1, 0)
    assert kept_in(tmp_path, monkeypatch) == (0, 1)
    (file,) = tmp_path.rglob(f"*.{kind}")
    file.write_bytes(file.read_bytes()[:left])
    with caplog.at_level("INFO", logger="drillctl"):
        assert kept_in(tmp_path, monkeypatch) == (1, 0)
    assert "damaged" in caplog.text
    assert kept_in(tmp_path, monkeypatch) == (0, 1)


def test_what_is_kept_for_other_types_is_compiled_again(tmp_path, monkeypatch):
    """As two processes leave it that keep their first functions at the same moment."""
    monkeypatch.setattr("numba.config.CACHE_DIR", str(tmp_path))
    kept = kernel_cache.njit(twice)
    assert (kept(2), kept(2.5)) == (4.0, 5.0)
    whole, broken = sorted(tmp_path.rglob("*.nbc"))
    for over, other in ((broken, whole), (whole, broken)):
        over.write_bytes(other.read_bytes())
        again = kernel_cache.njit(twice)
        assert (again(2), again(2.5)) == (4.0, 5.0)
        assert sum(again.stats.cache_misses.values()) == 1


def test_without_a_writable_folder_functions_are_kept_among_temporary_files(tmp_path, monkeypatch):
    nowhere = kernel_cache._Entries._locator_classes[-1:]
    monkeypatch.setattr(kernel_cache._Entries, "_locator_classes", nowhere)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    assert kept_in("", monkeypatch) == (1, 0)
    assert kept_in("", monkeypatch) == (0, 1)
    (own,) = tmp_path.iterdir()
    assert own.stat().st_mode & 0o777 == 0o700
    own.chmod(0o777)  # others could plant code
    assert kernel_cache.njit(twice)._cache.cache_path is None
    assert kernel_cache.cfunc("f8(f8)", twice).ctypes(3.0) == 6.0


def test_no_folder_of_the_user_is_needed(tmp_path):
    environment = {**os.environ, "HOME": "/dev/null", "XDG_CACHE_HOME": "/dev/null"}
    code = "import drillctl.units as u; print(u.parse('1 yard', u.LENGTH))"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=False
    )
    assert (done.stdout.strip(), done.stderr) == ("0.9144", "")
