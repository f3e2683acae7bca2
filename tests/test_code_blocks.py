"""Every code block of README and docs runs, or says why it does not."""

import tomllib
from pathlib import Path

import pytest

import drillctl
from tests.code_blocks import alike, blocks, compare, parse, run

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
RUN = ("python", "bash", "console")


def follow(page, slow, folder, capsys, monkeypatch):
    """Run a page from top to bottom in a folder, its Python in one namespace."""
    monkeypatch.chdir(folder)
    monkeypatch.syspath_prepend(folder)
    names = {"__name__": "__main__"}
    for block in blocks(page):
        where = f"{page.name}:{block.line}"
        if block.mark.startswith("file "):
            Path(block.mark.removeprefix("file ")).write_text(block.text, encoding="utf-8")
        elif block.mark.startswith("not run") or (block.mark == "slow" and not slow):
            continue
        elif block.language == "python":
            exec(compile("\n" * (block.line - 1) + block.text, where, "exec"), names)
        elif block.language in RUN:
            for command, expected in block.commands:
                run(command, expected, capsys)


def has(page, *marks):
    return any(b.language in RUN and b.mark in marks for b in blocks(page))


@pytest.mark.parametrize("page", [p for p in PAGES if has(p, "")], ids=lambda page: page.stem)
def test_the_blocks_of_a_page_run(page, tmp_path, capsys, monkeypatch):
    follow(page, False, tmp_path, capsys, monkeypatch)


@pytest.mark.slow
@pytest.mark.parametrize("page", [p for p in PAGES if has(p, "slow")], ids=lambda page: page.stem)
def test_the_long_blocks_of_a_page_run(page, tmp_path, capsys, monkeypatch):
    follow(page, True, tmp_path, capsys, monkeypatch)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_blocks_that_are_not_run_are_spelt_right(page):
    for block in blocks(page):
        if block.mark.startswith("not run"):
            assert ": " in block.mark, f"{page.name}:{block.line}: no reason"
        if block.mark.startswith("not run yet"):
            continue
        if block.language == "python":
            compile(block.text, f"{page.name}:{block.line}", "exec")
        for command, _ in block.commands:
            if command.startswith("drillctl "):
                parse(command)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_block_says_what_it_is(page):
    for block in blocks(page):
        where = f"{page.name}:{block.line}"
        known = block.language in (*RUN, "toml", "matlab", "text") or block.language.startswith("{")
        assert known, f"{where}: of what language is it?"
        marked = block.mark and not block.mark.startswith(("file ", "line "))
        assert not marked or block.language in RUN, f"{where}: a mark on what never runs"


TOML = [(page, b) for page in PAGES for b in blocks(page) if b.language == "toml"]


@pytest.mark.parametrize(("page", "block"), TOML, ids=lambda one: getattr(one, "stem", None))
def test_tables_on_the_pages_are_valid(page, block, tmp_path):
    """As a design, or over the first shipped model, in a run that lasts long enough."""
    told = tomllib.loads(block.text)
    text = "" if "schema" in told else 'schema = 1\nmodel = "monteiro-trindade-2012"\n'
    text += block.text
    text += "" if "simulation" in told else '\n[simulation]\nduration = "400 s"\n'
    path = tmp_path / "design.toml"
    path.write_text(text, encoding="utf-8")
    drillctl.load(path)


def test_the_checks_find_what_is_wrong(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(
        "<!-- code: not run: long -->\n```bash\ndrillctl map rig.toml --axes a\n```\n\n"
        "```console\n$ drillctl models\none\n$ drillctl \\\n  designs\n```\n"
    )
    first, second = blocks(page)
    assert (first.mark, first.line) == ("not run: long", 3)
    assert [command.split() for command, _ in second.commands] == [
        ["drillctl", "models"],
        ["drillctl", "designs"],
    ]
    with pytest.raises(Exception, match="--axes"):
        parse(first.commands[0][0])
    with pytest.raises(AssertionError, match="no such verb"):
        parse("drillctl mapp rig.toml")
    assert alike("J1  12.00 s", "J1 12.01 s")
    assert not alike("J1 12.0 s", "J1 12.5 s")
    compare(["a 1", "...", "c"], ["a 1", "b", "c"])
    for expected in (["a 1", "c"], ["a 1", "...", "d"], ["a 1"]):
        with pytest.raises((AssertionError, pytest.fail.Exception)):
            compare(expected, ["a 1", "b", "c"])
