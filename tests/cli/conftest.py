"""What tests of the command line share."""

import pytest

from drillctl.cli import run


@pytest.fixture(autouse=True)
def _own_folder(tmp_path, monkeypatch):
    """Runs go to a folder of their own; pictures are not rendered."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("drillctl.cli.running.draw", lambda figure, path: path.touch())


@pytest.fixture
def call(capsys):
    """Run a command line in this process: exit code, stdout, stderr."""

    def _call(*arguments):
        capsys.readouterr()
        code = run([str(a) for a in arguments])
        said = capsys.readouterr()
        return code, said.out, said.err

    return _call
