"""Code blocks of Markdown pages: found, and run or checked.

A comment before the fence says what is not to be done with a block as with others:

    <!-- code: slow -->                   run in the slow set
    <!-- code: not run: reason -->        commands are parsed, Python is compiled
    <!-- code: not run yet: reason -->    neither
    <!-- code: file NAME -->              written to the folder that the page runs in
    <!-- code: line NAME -->              a line for a file of the package, which a test inserts
"""

from __future__ import annotations

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

import pytest

FENCE = re.compile(
    r"(?:^<!-- code: (?P<mark>.+?) -->\n\n?)?^```(?P<language>[^`\n]*)\n(?P<text>.*?)^```$",
    flags=re.MULTILINE | re.DOTALL,
)
COMMANDS = ("bash", "console")
NUMBER = re.compile(r"[-+]?\d[\d,]*\.?\d*(?:e[-+]?\d+)?")


@dataclass(frozen=True)
class Block:
    """A fenced block: where it begins, its language, its text, and what is said of it."""

    line: int
    language: str
    text: str
    mark: str

    @property
    def commands(self) -> list[tuple[str, list[str]]]:
        """Commands with the lines of output that follow them."""
        if self.language not in COMMANDS:
            return []
        text = self.text.replace("\\\n", " ")
        if self.language == "console":
            parts = re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]
            return [(p.splitlines()[0], p.rstrip().splitlines()[1:]) for p in parts]
        lines = [line for line in text.splitlines() if line.strip()]
        return [(line, []) for line in lines]


def blocks(page: Path) -> list[Block]:
    """All fenced blocks of a page."""
    text = page.read_text(encoding="utf-8")
    return [
        Block(
            text.count("\n", 0, found.start("text")) + 1,
            found["language"],
            found["text"],
            found["mark"] or "",
        )
        for found in FENCE.finditer(text)
    ]


def arguments(command: str) -> list[str]:
    """What follows `drillctl`."""
    words = shlex.split(command, comments=True)
    assert words[0] == "drillctl", f"only drillctl runs here: {command}"
    return words[1:]


def parse(command: str) -> None:
    """Verb and options are those of the program; nothing is run."""
    import typer

    from drillctl.cli import app

    verb, *rest = arguments(command)
    program = typer.main.get_command(app)
    if verb.startswith("-"):
        return
    assert verb in program.commands, f"no such verb: {command}"
    program.commands[verb].make_context(verb, rest)


def run(command: str, expected: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    """Run a command here, and hold its output to the lines of the page, if there are any."""
    from drillctl.cli import run as drillctl

    capsys.readouterr()
    code = drillctl(arguments(command))
    said = capsys.readouterr()
    assert code == 0, f"{command}: {said.err}"
    if expected:
        compare(expected, said.out.splitlines() + said.err.splitlines())


def compare(expected: list[str], printed: list[str]) -> None:
    """Each line of the page stands in the output, in order; `...` leaves lines out."""
    rest = iter(printed)
    skipping = False
    for line in expected:
        if line.strip() == "...":
            skipping = True
            continue
        for came in rest:
            if alike(line, came):
                break
            assert skipping, f"the page says\n{line}\nand the program\n{came}"
        else:
            pytest.fail(f"the program does not say: {line}")
        skipping = False
    assert skipping or not [line for line in rest if line.strip()], "the page leaves lines out"


def alike(expected: str, came: str) -> bool:
    """Whether two lines have the same words, and numbers that agree to 1 %."""
    words = [" ".join(NUMBER.sub("#", line).split()) for line in (expected, came)]
    if words[0] != words[1]:
        return False
    numbers = [
        [float(number.replace(",", "")) for number in NUMBER.findall(line)]
        for line in (expected, came)
    ]
    return all(abs(a - b) <= 0.01 * abs(a) + 1e-9 for a, b in zip(*numbers, strict=True))
