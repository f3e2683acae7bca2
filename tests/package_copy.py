"""A copy of the package in which a recipe is followed, and Python in it."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

from tests.code_blocks import blocks

ROOT = Path(__file__).resolve().parents[1]


def copied(folder):
    """What is compiled comes with it: Python and numba recognise a source by time and size."""
    for name in ("drillctl", "models", "designs"):
        shutil.copytree(ROOT / name, folder / name)
    return folder


def marked(page, kind):
    """The code blocks of a page of the documents that a recipe names, by `kind NAME`."""
    return {b.mark.removeprefix(f"{kind} "): b.text for b in blocks(ROOT / "docs" / page)}


def inserted(path, mark, before="", after=""):
    """Add text before or after the first place of a mark in a file."""
    head, found, tail = path.read_text().partition(mark)
    assert found, f"{path.name} has no {mark!r}"
    path.write_text(f"{head}{before}{found}{after}{tail}")


def changed(folder):
    """Files of the copy that are new or other ones."""
    sources = [path.relative_to(folder) for path in (folder / "drillctl").rglob("*.py")]
    return [
        str(path) for path in sources
        if not (ROOT / path).exists() or (ROOT / path).read_bytes() != (folder / path).read_bytes()
    ]  # fmt: skip


def python(folder, *arguments):
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=folder, env=os.environ | {"PYTHONPATH": str(folder)},
        capture_output=True, text=True, check=False,
    )  # fmt: skip


def script(folder, text):
    """What a script prints that ends well."""
    done = python(folder, "-c", text)
    assert done.returncode == 0, done.stderr
    return done.stdout


def answer(folder, *arguments):
    """The object that a command answers."""
    done = python(folder, "-m", "drillctl", *arguments, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)
