"""How tests share workers and kernels; figures they measure, for docs/make_verification.py."""

import ctypes
import hashlib
import importlib.util
import json
import os
import sys
from pathlib import Path

import pytest
from threadpoolctl import threadpool_limits

# Tests start some sixty processes: what these import is compiled once, whatever the environment.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False
if "PYTEST_XDIST_WORKER" in os.environ:  # a core each: more threads would only wait in turns
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    threadpool_limits(1, "blas")  # of a NumPy that plugins of pytest have loaded before

NOTED = pytest.StashKey[list]()


# Files that take longest, and rooms whose fixtures are made once: begun first, so that the workers
# end together.
LONG = (
    "tests/reporting", "tests/cli/test_studies.py", "tests/cli/test_cli.py",
    "tests/simulation/test_reference.py", "tests/simulation/test_wall.py",
    "tests/studies/test_advantage.py",
)  # fmt: skip


def part(nodeid):
    """What goes to one worker as a whole: a file, or all of the reports."""
    file = nodeid.split("::", 1)[0]
    return "tests/reporting" if file.startswith("tests/reporting/") else file


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    from xdist.scheduler import LoadFileScheduling

    class ByPart(LoadFileScheduling):
        _split_scope = staticmethod(part)

    config.option.loadscopereorder = False  # by number of tests
    return ByPart(config, log)


def pytest_collection_modifyitems(items):
    rank = {name: place for place, name in enumerate(LONG)}
    items.sort(key=lambda item: rank.get(part(item.nodeid), len(LONG)))


@pytest.fixture(scope="session", autouse=True)
def _kernels_are_compiled_once(tmp_path_factory, worker_id):
    """The second of two workers that need a kernel waits for the first, and reads it from disk."""
    if worker_id == "master":
        return
    from fcntl import LOCK_EX, flock

    from drillctl.simulation.kernels.advance import run

    shared, compiled = tmp_path_factory.getbasetemp().parent, run.compile

    def compile_alone(signature):
        laws = hashlib.sha256(str(signature).encode()).hexdigest()
        with (shared / f"kernel-{laws[:16]}").open("w") as lock:
            flock(lock, LOCK_EX)
            return compiled(signature)

    run.compile = compile_alone
    _share_the_reference_solver(shared / "reference")


def _share_the_reference_solver(lock):
    """The same for the reference solver, before its first run."""
    from fcntl import LOCK_EX, flock

    import drillctl
    from drillctl.progress import SILENT
    from drillctl.simulation import reference

    numbers_of = reference.numbers_of

    def compiled_first(design, *kept):
        reference.numbers_of = numbers_of
        short = {"simulation.duration": "0.1 s", "simulation.j1_from": "0 s"}
        paper = drillctl.load("monteiro-trindade-140kn", **short)
        with lock.open("w") as file:
            flock(file, LOCK_EX)
            reference._run(paper, numbers_of(paper), 1e-4, SILENT, None)
        return numbers_of(design, *kept)

    reference.numbers_of = compiled_first


def pytest_addoption(parser):
    parser.addoption("--figures", type=Path, help="File for the figures that tests measure.")


def pytest_configure(config):
    config.stash[NOTED] = []


@pytest.fixture
def figure(request):
    """Call with a name and a number: what a test has measured."""

    def note(name, value):
        where = str(request.path.relative_to(request.config.rootpath))
        request.config.stash[NOTED].append({"figure": name, "value": float(value), "test": where})

    return note


def pytest_sessionfinish(session):
    target = session.config.getoption("--figures")
    if target is not None:
        target.write_text(json.dumps(session.config.stash[NOTED], indent=2), encoding="utf-8")


# linux/capability.h: third version; what lets root pass over the permissions of files
CAPABILITIES, OVER_PERMISSIONS = 0x20080522, 1 << 1 | 1 << 2


@pytest.fixture
def permissions_count():
    """Root, too, is bound by the permissions of files, as any other user is."""
    if os.geteuid() != 0:
        yield
        return
    if sys.platform != "linux":
        pytest.skip("root may write anywhere")
    libc = ctypes.CDLL(None, use_errno=True)
    head = (ctypes.c_uint32 * 2)(CAPABILITIES, 0)
    held = (ctypes.c_uint32 * 6)()  # twice: effective, permitted, inheritable
    assert libc.capget(head, held) == 0
    all_of_them = held[0]
    held[0] &= ~OVER_PERMISSIONS
    assert libc.capset(head, held) == 0
    yield
    held[0] = all_of_them
    assert libc.capset(head, held) == 0


@pytest.fixture(scope="module")
def browser():
    """Chromium, where there is one."""
    playwright = pytest.importorskip("playwright.sync_api")
    from drillctl.reporting.pages import browser as installed

    with playwright.sync_playwright() as started:
        found = started.chromium.launch(
            executable_path=installed(), args=["--no-sandbox", "--disable-gpu", "--disable-quic"]
        )
        yield found
        found.close()


AXE = """axe.run({ resultTypes: ['violations'] }).then(found => [
  found.passes.length,
  found.violations.filter(one => ['serious', 'critical'].includes(one.impact))
    .map(one => [one.id, one.nodes.slice(0, 3).map(node => node.html.slice(0, 120))]),
])"""


@pytest.fixture
def serious():
    """Give what Deque's own rules find of a page: how many hold, and what is serious."""
    axe = importlib.util.find_spec("axe_playwright_python")
    if axe is None:
        pytest.skip("no axe")
    rules = Path(axe.origin).with_name("axe.min.js").read_text(encoding="utf-8")

    def _serious(page):
        page.evaluate(rules)
        return page.evaluate(AXE)

    return _serious
