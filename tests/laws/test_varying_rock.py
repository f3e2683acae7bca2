"""A rock that varies along the way: its paths, and what both engines make of them."""

from __future__ import annotations

import math

import numpy as np
import pytest

import drillctl
from drillctl.design.reading import to_toml
from drillctl.errors import InputError
from drillctl.rig.bit_rock.variation import NoVariation, Variation, path

DRAWS = 2000
LOG = math.sqrt(math.log1p(0.1**2))


def of(draw: int, length: float = 1.0, seed: int = 2026) -> Variation:
    """A rock with nodes a tenth of its correlation length apart."""
    return Variation(LOG, length, 0.1 * length, 1.0, 0.0, float(seed), float(draw))


@pytest.fixture(scope="module")
def drawn():
    """X of many draws over five correlation lengths, shape (draws, nodes)."""
    return np.array([path(of(draw), 51) for draw in range(DRAWS)])


@pytest.fixture(scope="module")
def base():
    """The best gains at 140 kN, for a short while."""
    gains = {"controller.kp": 625.0, "controller.ki": 125.0, "simulation.duration": "50 s"}
    return drillctl.load("monteiro-trindade-140kn", **gains)


def test_a_path_is_that_of_its_key_and_of_nothing_else(drawn):
    assert pytest.approx(0.0997513, abs=5e-8) == LOG
    assert path(of(0), 3) == pytest.approx([0.3865012947, 0.7995608083, 1.5169394846], abs=5e-11)
    assert np.array_equal(path(of(7), 20), drawn[7, :20])
    assert not np.array_equal(path(of(7, seed=2027), 20), drawn[7, :20])


def _within_four_errors(samples, expected):
    error = samples.std(ddof=1) / math.sqrt(len(samples))
    assert abs(samples.mean() - expected) < 4.0 * error


def test_paths_have_the_statistics_of_the_process(drawn):
    factor = np.exp(LOG * drawn - 0.5 * LOG**2)
    _within_four_errors(factor[:, 30], 1.0)
    _within_four_errors((factor[:, 30] - 1.0) ** 2, 0.1**2)
    # Correlation one correlation length apart, of Y; of X halfway between nodes; of its mean.
    _within_four_errors((factor[:, 40] - 1.0) * (factor[:, 30] - 1.0) / 0.1**2, 0.36672)
    _within_four_errors((0.5 * (drawn[:, 30] + drawn[:, 31])) ** 2, 0.95242)
    mean = np.trapezoid(drawn, dx=0.1, axis=1) / 5.0
    _within_four_errors(mean**2, 0.32074)


ROCKS = (
    {"length": "5 cm"},
    {"over": "time", "length": "2 s"},
    {"over": "angle", "length": "2 rev"},
)


@pytest.mark.parametrize("rock", ROCKS, ids=lambda rock: rock.get("over", "depth"))
def test_both_engines_meet_the_same_path(base, rock):
    design = base.replace({"bit_rock.variation": {"cv": 0.1, "realization": 3, **rock}})
    exact, batch = drillctl.simulate(design), drillctl.simulate(design, engine="batch")
    assert exact.energy.relative_residual < 1e-8
    assert batch.measures.j1 == pytest.approx(exact.measures.j1, rel=1e-3)
    other = design.replace({"bit_rock.variation.realization": 4})
    apart = drillctl.simulate(other, engine="batch").measures.j1 / batch.measures.j1 - 1.0
    assert abs(apart) > 0.01


@pytest.mark.parametrize("engine", ["batch", "reference"])
def test_a_rock_of_one_level_is_a_rock_with_both_torques_scaled(base, engine):
    slow = {"cv": 0.2, "length": "10 km", "realization": 1}
    design = base.replace({"bit_rock.variation": slow})
    number = path(design.variation, 1)[0]
    factor = math.exp(design.variation.spread * (number - 0.5 * design.variation.spread))
    scaled = base.replace({"bit_rock.a1_factor": factor, "bit_rock.a2_factor": factor})
    found, expected = (drillctl.simulate(one, engine=engine).measures.j1
                       for one in (design, scaled))  # fmt: skip
    assert abs(factor - 1.0) > 0.05
    assert found == pytest.approx(expected, rel=2e-4)  # within 28 cm it is not quite level
    assert any("one random level" in one.text for one in design.warnings)


def test_a_rock_that_does_not_vary_is_the_plain_law(base):
    same = base.replace({"bit_rock.variation": {"cv": 0.0, "length": "5 cm"}})
    assert isinstance(same.variation, NoVariation)
    one, other = (drillctl.simulate(design, engine="batch") for design in (base, same))
    assert one.measures == other.measures


def test_each_draw_has_its_own_path_whoever_computes_it(base):
    axes = [{"path": "controller.kp", "min": 600, "max": 650, "points": 2}]
    values = {"bit_rock.variation": {"cv": 0.1, "length": "5 cm"}, "map.axes": axes}
    design = base.replace({**values, "map.audit_cells": 0, "uncertainty.realizations": 12,
                           "uncertainty.full": True})  # fmt: skip
    result = drillctl.uncertainty(design)
    drawn = result.drawn
    assert list(drawn["bit_rock.variation.realization"]) == list(range(12))
    values = {path: drillctl.units.SI(column[9]) for path, column in drawn.items()}
    alone = drillctl.simulate(design.replace({**values, "controller.kp": 650.0}), engine="batch")
    assert result.j1[9, 1] == alone.measures.j1
    band = result.envelope.signals["bit_speed"]
    assert np.all(band[0] <= band[1])
    assert np.all(band[1] <= band[2])
    assert np.ptp(band[:, -1]) > 0.0
    assert drillctl.plots.response_envelope(result).axes[0].get_ylabel() == "bit speed (rpm)"


def test_a_variation_is_read_and_written_in_the_unit_of_its_way(base, tmp_path):
    design = base.replace({"bit_rock.variation": {"cv": 0.1, "over": "angle", "length": "2 rev"}})
    file = tmp_path / "turned.toml"
    file.write_text(to_toml(design), encoding="utf-8")
    assert drillctl.load(str(file)).tables == design.tables
    with pytest.raises(InputError, match="length"):
        base.replace({"bit_rock.variation": {"cv": 0.1, "over": "angle", "length": "2 m"}})
    with pytest.raises(InputError, match="a tenth"):
        base.replace({"bit_rock.variation": {"cv": 0.1, "length": "1 m", "spacing": "20 cm"}})
    with pytest.raises(InputError, match="length is missing"):
        base.replace({"bit_rock.variation": {"cv": 0.1}})


def test_results_state_the_rate_that_a_rock_passes_by_at(base):
    varying = {"cv": 0.1, "length": "5 cm"}
    text = "no rate of penetration is given: the rock passes by at 20 m/h"
    assert text in [one.text for one in base.replace({"bit_rock.variation": varying}).warnings]
    given = {"bit_rock.variation": varying, "operating_point.rate_of_penetration": "20 m/h"}
    assert text not in [one.text for one in base.replace(given).warnings]
    # A bit that drills by itself has its own.
    own = drillctl.load("richard-detournay-2dof").replace({"bit_rock.variation": varying})
    assert text not in [one.text for one in own.warnings]
    slow = own.replace({"bit_rock.variation.length": "1 m"})
    assert any("26.2 m/h a run of 21.1 s drills 0.15 m" in one.text for one in slow.warnings)
