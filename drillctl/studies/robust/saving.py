"""Tuned designs on disk: a design file ready to run, and what was found."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from drillctl.design import Design, to_toml
from drillctl.json_files import write_json


def save_design(design: Design, summary: dict[str, Any], folder: str | Path) -> Path:
    """Write `design.toml` and `summary.json` into a folder, which is made; returns it."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "design.toml").write_text(to_toml(design), encoding="utf-8")
    write_json(folder / "summary.json", summary)
    return folder
