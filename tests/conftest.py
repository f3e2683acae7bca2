"""How tests share workers; figures that they measure, noted for docs/make_verification.py."""

import json
from pathlib import Path

import pytest

NOTED = pytest.StashKey[list]()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """A file to one worker, and all of the reports to one: fixtures are made once."""
    from xdist.scheduler import LoadFileScheduling

    class ByFixture(LoadFileScheduling):
        def _split_scope(self, nodeid):
            file = super()._split_scope(nodeid)
            return "tests/reporting" if file.startswith("tests/reporting/") else file

    return ByFixture(config, log)


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
