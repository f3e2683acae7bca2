"""Shipped models and designs by name."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

import drillctl
from drillctl import catalog
from drillctl.errors import InputError

SHELVES = ("models", "designs")
CHECKOUT = Path(catalog.__file__).resolve().parent.parent


@pytest.mark.parametrize("shelf", SHELVES)
def test_names_are_those_of_the_files(shelf):
    files = [path.stem for path in (CHECKOUT / shelf).glob("*.toml")]
    assert catalog.names(shelf) == sorted(files)
    assert files


def test_the_papers_rig_and_its_cases_are_shipped():
    assert "monteiro-trindade-2012" in catalog.names("models")
    assert {f"monteiro-trindade-{w}kn" for w in (80, 100, 120, 140, 160)} <= set(
        catalog.names("designs")
    )


@pytest.mark.parametrize("shelf", SHELVES)
def test_every_entry_has_its_own_title_and_can_be_found(shelf):
    entries = catalog.entries(shelf)
    assert [entry.name for entry in entries] == catalog.names(shelf)
    assert len({entry.title for entry in entries}) == len(entries)
    for entry in entries:
        assert entry.title
        assert entry.path.is_file()
        assert catalog.find(entry.name) == entry.path


@pytest.mark.parametrize("name", catalog.names("models"))
def test_every_model_names_its_source_and_status(name):
    tree = tomllib.loads(catalog.find(name, ("models",)).read_text(encoding="utf-8"))
    assert tree["schema"] == 1
    assert len(tree["source"]) > 20
    assert tree["status"]


@pytest.mark.parametrize("name", catalog.names("designs"))
def test_every_design_inherits_a_source(name):
    assert drillctl.load(name).tables.source


def test_reconstructed_string_says_so():
    tables = drillctl.load("monteiro-trindade-140kn").tables
    assert tables.status == "reconstructed"
    assert "reconstructed" in drillctl.load("monteiro-trindade-2012").tables.title


def test_names_are_unique_across_shelves():
    # A bare name is looked for among the designs first: a model of that name would be hidden.
    assert not set(catalog.names("models")) & set(catalog.names("designs"))


@pytest.mark.parametrize(
    ("wrong", "suggestion"),
    [
        ("monteiro-trindade-120", "monteiro-trindade-120kn"),
        ("navarro-lopez-2-dof", "navarro-lopez-2dof"),
        ("wob_rpm_chart", "wob-rpm-chart"),
        ("aarsnes-shor", "aarsnes-shor-well-a"),
    ],
)
def test_unknown_names_are_told_with_the_nearest(wrong, suggestion):
    with pytest.raises(InputError) as caught:
        catalog.find(wrong)
    assert str(caught.value).startswith(f"{wrong}: not a shipped name ")
    assert f"did you mean '{suggestion}'?" in str(caught.value)


def test_only_the_shelf_asked_for_is_searched():
    assert catalog.find("monteiro-trindade-2012", ("models",)).parent.name == "models"
    with pytest.raises(InputError, match="not a shipped name"):
        catalog.find("monteiro-trindade-2012", ("designs",))


def test_paths_are_taken_as_they_are(tmp_path, monkeypatch):
    (tmp_path / "rig.toml").write_text("")
    (tmp_path / "noext").write_text("")
    monkeypatch.chdir(tmp_path)
    assert catalog.find(str(tmp_path / "rig.toml")) == tmp_path / "rig.toml"
    assert catalog.find("rig.toml").resolve() == tmp_path / "rig.toml"
    assert catalog.find("./noext").resolve() == tmp_path / "noext"


def test_home_is_expanded(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    (tmp_path / "rig.toml").write_text("")
    assert catalog.find("~/rig.toml") == tmp_path / "rig.toml"


def test_shipped_files_inside_the_package_come_first(tmp_path, monkeypatch):
    # As in a wheel, where models and designs lie inside the package.
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "only.toml").write_text('title = "the only one"')
    monkeypatch.setattr(catalog, "_PACKAGE", tmp_path)
    assert catalog.names("models") == ["only"]
    assert catalog.entries("models")[0].title == "the only one"
