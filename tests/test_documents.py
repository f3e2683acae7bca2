"""README, docs and examples say what the code does."""

import importlib.util
import itertools
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from drillctl.rig.table import Table

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", text, flags=re.DOTALL)


def test_the_python_example_runs(tmp_path, monkeypatch, capsys):
    """On a few cells."""
    import drillctl

    (code,) = blocks(README, "python")
    assert len(code.strip().splitlines()) <= 14
    load, gains = drillctl.load, (("controller.kp", 0, 1000), ("controller.ki", 0, 500))
    axes = [{"path": path, "min": low, "max": high, "points": 5} for path, low, high in gains]
    coarse = {"map.axes": axes}
    monkeypatch.setattr(drillctl, "load", lambda *a, **v: load(*a, **v, **coarse), raising=False)
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "README.md", "exec"), {"__name__": "__main__"})
    assert len(capsys.readouterr().out.splitlines()) == code.count("print(") == 4
    assert (tmp_path / "map.png").stat().st_size > 10_000


@pytest.mark.slow
def test_the_python_example_runs_as_it_is(tmp_path):
    (code,) = blocks(README, "python")
    script = tmp_path / "example.py"
    script.write_text(code, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, str(script)], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "map.png").stat().st_size > 10_000


def test_the_rig_of_the_readme_is_a_valid_design(tmp_path):
    import drillctl

    (text,) = blocks(README, "toml")
    path = tmp_path / "rig.toml"
    path.write_text(text, encoding="utf-8")
    assert drillctl.load(path).tables.title == tomllib.loads(text)["title"]


def test_the_starter_file_is_a_valid_design(tmp_path, monkeypatch):
    import drillctl
    from drillctl.design.reading import write_starter

    monkeypatch.chdir(tmp_path)
    design = drillctl.load(write_starter("my-rig"))
    assert design.string.yield_torque == pytest.approx(100.5e3, rel=2e-3)


def test_every_command_of_the_readme_exists():
    from drillctl.cli import app

    known = {c.name or c.callback.__name__ for c in app.registered_commands}
    named = set(re.findall(r"`drillctl ([\w-]+)", README))
    assert named <= known
    assert known <= named


PAGES = [
    *ROOT.glob("*.md"),
    *(
        page
        for folder in ("docs", "reports", "benchmarks", "examples", "designs", "models")
        for page in (ROOT / folder).rglob("*.md")
    ),
]


def prose(page):
    """A page without its code."""
    return re.sub(
        r"^```.*?^```$|`[^`\n]*`", "", page.read_text("utf-8"), flags=re.DOTALL | re.MULTILINE
    )


def anchors(page):
    """Of the headings of a page, as forges make them."""
    text = re.sub(r"^```.*?^```$", "", page.read_text("utf-8"), flags=re.DOTALL | re.MULTILINE)
    found = set()
    for heading in re.findall(r"^#+ (.+)$", text, flags=re.MULTILINE):
        words = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).lower()
        plain = re.sub(r"[^\w\- ]", "", words).strip().replace(" ", "-")
        names = (plain if n == 0 else f"{plain}-{n}" for n in itertools.count())
        found.add(next(name for name in names if name not in found))
    return found


def astray(page):
    """Links and pictures of a page that lead nowhere, anchors included."""
    for link in re.findall(r"\]\(([^)\s]+)\)", prose(page)):
        if re.match(r"[a-z]+:", link):
            continue
        name, _, anchor = link.partition("#")
        target = page.parent / name if name else page
        if not target.exists() or (anchor and anchor not in anchors(target)):
            yield link


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_lead_somewhere(page):
    assert not list(astray(page))
    for named in re.findall(r"`(tests/[\w/.]+?\.py)", page.read_text(encoding="utf-8")):
        assert (ROOT / named).exists(), named


def test_links_that_lead_nowhere_are_found(tmp_path):
    page = tmp_path / "a.md"
    page.write_text(
        "# One `two`, three\n\n[a](a.md#one-two-three) [b](a.md#four) [c](c.md) [d](#one-two)\n"
        "```\n# no heading\n[e](e.md)\n```\n[f](#no-heading) [g](https://example.org/x)\n"
    )
    assert list(astray(page)) == ["a.md#four", "c.md", "#one-two", "#no-heading"]


@pytest.mark.parametrize(
    ("script", "made"), [("make_design_file", "design-file.md"), ("make_laws", "laws.md")]
)
def test_pages_made_from_the_code_are_up_to_date(script, made):
    path = ROOT / "docs" / f"{script}.py"
    spec = importlib.util.spec_from_file_location(script, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.page() == (ROOT / "docs" / made).read_text(encoding="utf-8")


def test_the_page_of_keys_leaves_no_table_out():
    path = ROOT / "docs" / "make_design_file.py"
    spec = importlib.util.spec_from_file_location("make_design_file", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    listed = set(module.tables())
    assert all(f"## `{name}`" in module.page() for name in module.tables().values())
    every, left = set(), [Table]
    while left:
        below = [c for c in left.pop().__subclasses__() if c.__module__.startswith("drillctl.")]
        every |= set(below)
        left += below
    # What two laws or two studies have in common is no table of its own.
    assert {table.__name__ for table in every - listed} == {
        "OwnTables", "DesignTables", "FrictionCoefficients", "FollowingTable", "ProgramTable",
        "RockTable", "CurvedDriveTable",
    }  # fmt: skip


@pytest.mark.parametrize(
    "name",
    [
        "modes_and_bode",
        "gains_from_margins",
        "three_drives",
        "own_rig",
        pytest.param("four_gain_pairs", marks=pytest.mark.slow),
    ],
)
def test_examples_run(name, tmp_path):
    done = subprocess.run(
        [sys.executable, str(ROOT / "examples" / f"{name}.py"), str(tmp_path)],
        capture_output=True, text=True, check=False, env=os.environ,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert list(tmp_path.glob("*.png"))


def test_nothing_speaks_of_where_it_was_made():
    words = ("/wo" + "rk/", "sha" + "red/", r"\bsess" + r"ions?\b")
    for folder in ("drillctl", "models", "designs", "docs", "examples", "benchmarks"):
        for path in (ROOT / folder).rglob("*"):
            if path.suffix in (".py", ".toml", ".md"):
                text = path.read_text(encoding="utf-8")
                for word in words:
                    assert not re.search(word, text), f"{path}: {word}"
