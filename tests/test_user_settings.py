"""The user's settings of numpy, python-control and matplotlib neither matter nor change."""

from __future__ import annotations

import os
import subprocess
import sys

import control
import matplotlib
import numpy as np
import pytest
from matplotlib.colors import same_color

import drillctl
from drillctl.linear import open_loop
from drillctl.linear.export import nonlinear_system
from drillctl.plots import time_response
from drillctl.reporting.blocks import Figure
from drillctl.reporting.pictures import FigureFiles

DESIGN = "monteiro-trindade-140kn"
SHORT = {"simulation.duration": "20 s", "map.audit_cells": 0}
GRID = [
    {"path": "controller.kp", "min": 100, "max": 900, "points": 2},
    {"path": "operating_point.speed", "min": "60 rpm", "max": "120 rpm", "points": 2},
]


@pytest.fixture(scope="module")
def design():
    return drillctl.load(DESIGN, **SHORT, **{"map.axes": GRID})


def test_models_are_continuous(design, monkeypatch):
    monkeypatch.setitem(control.config.defaults, "control.default_dt", 0.1)
    monkeypatch.setitem(control.config.defaults, "statesp.remove_useless_states", True)
    made = (design.plant(), design.loop(), open_loop(design), nonlinear_system(design))
    assert [system.dt for system in made] == [0, 0, 0, 0]


def test_exceptions_of_numpy_are_our_own(design):
    """Without gains the bit runs far from rest, where the exponential of the rock vanishes."""
    gains = [{"path": f"controller.{k}", "min": 0, "max": 1000, "points": 2} for k in ("kp", "ki")]
    with np.errstate(all="raise"):
        before = np.geterr()
        drillctl.three_regions(design.replace({"map.axes": gains}))
        assert np.geterr() == before


@pytest.fixture
def dark():
    with matplotlib.style.context("dark_background"):
        yield dict(matplotlib.rcParams)


def colours_of(figure):
    return [line.get_color() for ax in figure.axes for line in ax.lines]


def test_lines_are_seen_on_a_dark_style(design, dark):
    run = drillctl.simulate(design)
    shown = colours_of(time_response(run))
    with matplotlib.style.context("default"):
        usual = colours_of(time_response(run))
    assert any(same_color(one, "black") for one in usual)
    assert not any(same_color(one, "black") for one in shown)
    assert [one for one in shown if not same_color(one, "white")] == [
        one for one in usual if not same_color(one, "black")
    ]
    assert dict(matplotlib.rcParams) == dark


class Gathered:
    def key(self, of):
        return "one"


def test_pictures_of_a_report_are_light(design, dark, tmp_path):
    made = FigureFiles(tmp_path / "dark", Gathered()).picture(picture_of(design))
    with matplotlib.style.context("default"):
        usual = FigureFiles(tmp_path / "light", Gathered()).picture(picture_of(design))
    assert made.svg == usual.svg
    assert dict(matplotlib.rcParams) == dark


def picture_of(design):
    return Figure(
        "one", "A caption.", "Words.", lambda: time_response(drillctl.simulate(design)), ()
    )


@pytest.mark.parametrize("settings", [{"MPLBACKEND": "none-such"}, {"MATPLOTLIBRC": "usetex"}])
def test_a_command_draws_whatever_the_user_draws_with(settings, tmp_path):
    (tmp_path / "usetex").write_text("text.usetex: True\n")
    words = ["modes", DESIGN, "--out", "run"]
    done = subprocess.run(
        [sys.executable, "-m", "drillctl", *words], cwd=tmp_path, env={**os.environ, **settings},
        capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert len(list((tmp_path / "run").glob("*.png"))) > 0
