"""The page about notebooks, as a notebook: in a kernel of its own, with what it shows."""

from __future__ import annotations

import os
from pathlib import Path

import nbclient
import nbformat.v4
import pytest

from tests.code_blocks import blocks

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "howto-notebooks.md"


@pytest.fixture(scope="module")
def cells(tmp_path_factory):
    """Every cell by its first line, as it was run."""
    texts = [block.text.rstrip() for block in blocks(PAGE) if block.language == "python"]
    notebook = nbformat.v4.new_notebook(cells=list(map(nbformat.v4.new_code_cell, texts)))
    folder = str(tmp_path_factory.mktemp("notebook"))
    paths = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", os.pathsep.join(paths))
        client = nbclient.NotebookClient(
            notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": folder}}
        )
        client.execute()
    return {cell.source.splitlines()[0]: cell.outputs for cell in notebook.cells}


def shown(outputs):
    """What the last expression of a cell gave, by its kind."""
    return next(one.data for one in outputs if one.output_type == "execute_result")


def test_a_result_shows_its_table_and_a_small_picture(cells):
    for head, table in (("import drillctl", "lowest bit speed"), ("import control", "set speed")):
        data = shown(cells[head])
        assert table in data["text/html"]
        assert '<img src="data:image/png;base64,' in data["text/html"]
        lines = data["text/plain"].splitlines()
        assert len(lines) <= 10
        assert max(map(len, lines)) <= 110


def test_a_figure_is_shown(cells):
    assert "image/png" in shown(cells['run.plot(system="field")'])


def test_data_are_handed_out(cells):
    outputs = cells["import numpy as np"]
    assert "('controller.kp', 'controller.ki')" in outputs[0].text
    assert "600.0" in shown(outputs)["text/plain"]
