"""What tests of the command line share."""

import ctypes
import os
import sys
from importlib import import_module

import pytest

from drillctl.cli import run


@pytest.fixture(autouse=True)
def _own_folder(tmp_path, monkeypatch):
    """Runs go to a folder of their own; pictures are not rendered."""
    monkeypatch.chdir(tmp_path)
    module = import_module("drillctl.cli.verb")
    monkeypatch.setattr(module, "draw", lambda figure, path: path.touch())


@pytest.fixture
def call(capsys):
    """Run a command line in this process: exit code, stdout, stderr."""

    def _call(*arguments):
        capsys.readouterr()
        code = run([str(a) for a in arguments])
        said = capsys.readouterr()
        return code, said.out, said.err

    return _call


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
