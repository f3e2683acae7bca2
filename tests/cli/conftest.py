"""What tests of the command line share."""

from importlib import import_module
from pathlib import Path

import pytest

from drillctl.cli import run


@pytest.fixture(autouse=True)
def _own_folder(tmp_path, monkeypatch):
    """Runs go to a folder of their own; pictures are not rendered."""
    monkeypatch.chdir(tmp_path)
    module = import_module("drillctl.cli.verb")
    monkeypatch.setattr(module, "draw", lambda figure, path: path.touch())


@pytest.fixture
def rewritten():
    """Give an unfinished run another origin, as if it had been begun there."""

    def _rewritten(folder, **origin):
        from drillctl.store.journal import Journal
        from drillctl.store.json_files import as_json, read_json

        about = read_json(Path(folder, "run.json"))
        about["provenance"] |= origin
        Journal(Path(folder)).announce("run.json", as_json(about | {"finished": False}))

    return _rewritten


@pytest.fixture
def call(capsys):
    """Run a command line in this process: exit code, stdout, stderr."""

    def _call(*arguments):
        capsys.readouterr()
        code = run([str(a) for a in arguments])
        said = capsys.readouterr()
        return code, said.out, said.err

    return _call
