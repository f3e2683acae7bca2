"""Tuned designs on disk: a design file ready to run, and what was found."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from drillctl.design import Design, to_toml
from drillctl.store.json_files import write_json, write_text

if TYPE_CHECKING:
    from drillctl.studies.robust.tune_study import Tune


def save_design(design: Design, summary: dict[str, Any], folder: str | Path) -> Path:
    """Write `design.toml` and `summary.json` into a folder, which is made; returns it."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "design.toml").write_text(to_toml(design), encoding="utf-8")
    write_json(folder / "summary.json", summary)
    return folder


def tuned_file(result: Tune, path: Path) -> None:
    """Write the design with its found gains, ready to run, what came of it on top as comments."""
    told = (f"Gains tuned from {result.design.name!r} by drillctl.", result.message + ".")
    head = "".join(f"# {line}\n" for line in told)
    write_text(path, head + to_toml(result.tuned_design))
