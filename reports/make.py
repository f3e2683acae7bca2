"""Make everything under reports/ again: run as `make reports`.

Each entry is a report of a shipped design as `drillctl report` writes it; the HTML of all stays
under runs/reports. The page about the source paper is made from their results.
"""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import drillctl
from drillctl.store.json_files import write_json, write_text

HERE = Path(__file__).resolve().parent
RUNS = HERE.parent / "runs" / "reports"
CLOCK = ("seconds", "total_seconds", "processor_seconds", "speed")
"""What differs from run to run."""


@dataclass(frozen=True)
class Entry:
    """A report to be made.

    Attributes
    ----------
    design : str
        Shipped name, which is that of its folder.
    about : str
        Its line in the index.
    profile : str
        How much is computed.
    sections : tuple of str or None
        All if None.
    """

    design: str
    about: str
    profile: str = "standard"
    sections: tuple[str, ...] | None = None


COMPARISON = ("rig", "comparison", "advantage", "glossary")
ENTRIES = (
    Entry("monteiro-trindade-140kn", "the source paper's case, on the reconstructed string"),
    Entry(
        "monteiro-trindade-fig6",
        "the same with uncertain friction, 10 draws as the paper had",
        sections=("rig", "map", "uncertainty", "audit", "glossary"),
    ),
    Entry(
        "six-drives-100kn",
        "six drives on the same string, at the same draws",
        "full",
        COMPARISON,
    ),
    Entry(
        "pi-vs-dynamic-wob-140kn",
        "constant against dynamic weight on bit",
        "full",
        COMPARISON,
    ),
)


def make(entry: Entry) -> None:
    """Make one report and keep its Markdown, pictures and summary."""
    design = drillctl.load(entry.design)
    made = drillctl.report(
        design, RUNS / entry.design, entry.profile, entry.sections, formats=("html", "md"),
        system="si",
    )  # fmt: skip
    if made.problems:
        raise SystemExit("\n".join(made.problems))
    folder = HERE / entry.design
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "figures").mkdir(parents=True)
    shutil.copy(made.files["md"], folder / "README.md")
    drawn = made.files["md"].read_text(encoding="utf-8")
    for picture in sorted((made.folder / "figures").glob("*.png")):
        if f"figures/{picture.name}" in drawn:
            shutil.copy(picture, folder / "figures" / picture.name)
    write_json(folder / "summary.json", lasting(made.summary()))


def lasting(content: Any) -> Any:
    """A summary without what the clock says.

    Parameters
    ----------
    content : dict, list or value
        As JSON holds it.
    """
    if isinstance(content, dict):
        return {key: lasting(value) for key, value in content.items() if key not in CLOCK}
    return [lasting(value) for value in content] if isinstance(content, list) else content


def index() -> str:
    """The page that leads to all of them."""
    lines = [
        "# Reports", "",
        "Reports of shipped designs, written by `make reports`: Markdown, figures and",
        "`summary.json` here, the HTML of each under `runs/reports/`.", "",
        "- [The paper beside drillctl](paper.md): each statement and figure of Monteiro & Trindade",
        "  (2012), the result of drillctl, and what had to be reconstructed.",
    ]  # fmt: skip
    for entry in ENTRIES:
        lines.append(f"- [{entry.design}]({entry.design}/README.md): {entry.about}.")
    lines += [
        "",
        "`tests/test_reports.py` recomputes the numbers of these pages and compares them with the",
        "committed ones.",
        "",
    ]
    return "\n".join(lines)


def main() -> None:
    """Make all."""
    import paper

    shutil.rmtree(RUNS, ignore_errors=True)
    for entry in ENTRIES:
        make(entry)
    paper.make(RUNS, HERE)
    write_text(HERE / "README.md", index())


if __name__ == "__main__":
    main()
