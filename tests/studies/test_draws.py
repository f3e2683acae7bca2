"""Uncertain parameters: the distributions asked for, and draws that anyone can make again."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

import drillctl
from drillctl.design import to_toml
from drillctl.ensemble.draws import drawn_lanes
from drillctl.ensemble.parameters import DEFAULT_COV, draw, probabilities, uncertain_parameters
from drillctl.errors import InputError
from drillctl.rig.bit_rock.law import friction_laws

DEFAULT_PATHS = {
    "navarro-lopez-suarez": ("bit_rock.a1_factor", "bit_rock.a2_factor"),
    "printed-three-branch": ("bit_rock.a1_factor", "bit_rock.a2_factor"),
    "bit-radius-friction": ("bit_rock.sliding_coefficient", "bit_rock.static_coefficient"),
    "stribeck": ("bit_rock.sliding_coefficient", "bit_rock.static_coefficient"),
    "jansen-van-den-steen": ("bit_rock.a1", "bit_rock.a2"),
    "coulomb": ("bit_rock.a",),
    "tucker-wang": ("bit_rock.a",),
    "tabulated": (),
    "richard-detournay": ("bit_rock.intrinsic_energy", "bit_rock.contact_stress"),
    "bit-aggressiveness": ("bit_rock.aggressiveness", "bit_rock.high_speed_ratio"),
}


HOLDS = {
    "draws of uncertain parameters": "moments and quantiles in closed form and by SciPy; the same "
    "draw for any number of them",
}

PAPER = "monteiro-trindade-140kn"
A1 = "bit_rock.a1_factor"
A2 = "bit_rock.a2_factor"
WEIGHT = "operating_point.weight_on_bit"
MANY = 40_000


def uncertain(**tables):
    """The paper's design with these distributions; a1 for bit_rock.a1_factor, w for the weight."""
    paths = {"a1": A1, "a2": A2, "w": WEIGHT}
    return drillctl.load(PAPER, uncertain={paths[key]: table for key, table in tables.items()})


# --- distributions -----------------------------------------------------------------------------

SIGMA = np.sqrt(np.log(1.0 + 0.2**2))
FAMILIES = [
    (
        {"distribution": "lognormal", "mean": "140 kN", "cov": 0.2},
        stats.lognorm(SIGMA, scale=140e3 / np.sqrt(1.04)),
        (140e3, 28e3),
    ),
    ({"distribution": "normal", "mean": "140 kN", "cov": 0.05}, stats.norm(140e3, 7e3), None),
    ({"distribution": "uniform", "min": "100 kN", "max": "0.15 MN"}, stats.uniform(1e5, 5e4), None),
    (
        {"distribution": "triangular", "min": "100 kN", "max": "160 kN", "mode": "110 kN"},
        stats.triang(1 / 6, 1e5, 6e4),
        ((100e3 + 110e3 + 160e3) / 3, None),
    ),
    (
        {"distribution": "triangular", "min": "100 kN", "max": "160 kN"},
        stats.triang(0.5, 1e5, 6e4),
        (130e3, 60e3 / np.sqrt(24)),
    ),
]


@pytest.mark.parametrize(("table", "law", "moments"), FAMILIES)
def test_draws_have_the_moments_and_quantiles_of_their_law(table, law, moments):
    values = draw(uncertain(w=table), MANY, seed=1).values[WEIGHT]
    mean, deviation = law.mean(), law.std()
    # Five standard errors: with this seed a fixed fact, for most seeds too.
    assert abs(values.mean() - mean) < 5 * deviation / np.sqrt(MANY)
    assert values.std() == pytest.approx(deviation, rel=0.02)
    levels = np.array([0.01, 0.1, 0.5, 0.9, 0.99])
    assert np.quantile(values, levels) == pytest.approx(law.ppf(levels), rel=5e-3)
    assert stats.kstest(values, law.cdf).pvalue > 1e-3
    if moments:  # by their closed forms, not SciPy's
        assert mean == pytest.approx(moments[0])
        assert moments[1] is None or deviation == pytest.approx(moments[1])


def test_a_mean_left_out_is_the_designs_own_value():
    table = {"distribution": "lognormal", "cov": 0.01}
    (found,) = uncertain_parameters(uncertain(w=table).replace({WEIGHT: "120 kN"}))
    assert (found.mean, found.own_mean) == (120e3, True)
    (found,) = uncertain_parameters(uncertain(w=table | {"mean": "130 kN"}))
    assert (found.mean, found.own_mean) == (130e3, False)


def test_nothing_named_means_the_rock_by_five_percent():
    found = uncertain_parameters(drillctl.load(PAPER))
    assert [(p.path, p.distribution, p.mean, p.cov) for p in found] == [
        (A1, "lognormal", 1.0, DEFAULT_COV),
        (A2, "lognormal", 1.0, DEFAULT_COV),
    ]
    assert DEFAULT_COV == 0.05


@pytest.mark.parametrize("name", drillctl.catalog.names("designs"))
def test_every_shipped_design_has_something_uncertain(name):
    design = drillctl.load(name)
    found = uncertain_parameters(design)
    assert found
    if not design.tables.uncertain:
        assert tuple(p.path for p in found) == DEFAULT_PATHS[design.tables.bit_rock.law]


def test_every_friction_law_says_what_is_uncertain_by_default_or_refuses():
    assert {
        name: tuple(f"bit_rock.{key}" for key in law.draws) for name, law in friction_laws().items()
    } == DEFAULT_PATHS


# --- a draw is a function of seed, parameter and number alone ----------------------------------


def test_what_else_is_uncertain_changes_no_draw():
    law = {"distribution": "lognormal", "cov": 0.1}
    alone = draw(uncertain(a1=law), 20, seed=5).values[A1]
    assert (alone == draw(uncertain(a2=law, a1=law), 20, seed=5).values[A1]).all()


def test_seeds_and_parameters_have_streams_of_their_own():
    streams = [probabilities(seed, path, 4000) for seed in (0, 1) for path in (A1, A2)]
    correlations = np.corrcoef(streams)[np.triu_indices(4, 1)]
    assert np.abs(correlations).max() < 5 / np.sqrt(4000)


def test_the_numbers_themselves_are_kept():
    # Philox 4x64-10 of this seed: other numbers would move every result with a seed.
    expected = [0.1515360139791052, 0.18912313413092174, 0.34095504863519677]
    assert probabilities(2012, A1, 3).tolist() == expected


def test_probabilities_are_never_zero_or_one():
    found = probabilities(0, A1, 100_000)
    assert 0.0 < found.min() < 1e-4
    assert 1.0 - 1e-4 < found.max() < 1.0


# --- files -------------------------------------------------------------------------------------


def test_paths_may_be_quoted_or_not(tmp_path):
    text = to_toml(drillctl.load(PAPER))
    designs = []
    for name, head in (
        ("a", '[uncertain."bit_rock.a1_factor"]'),
        ("b", "[uncertain.bit_rock.a1_factor]"),
    ):
        path = tmp_path / f"{name}.toml"
        path.write_text(f'{text}\n{head}\ndistribution = "normal"\ncov = 0.1\n')
        designs.append(drillctl.load(path))
    assert designs[0] == designs[1]
    assert list(designs[0].tables.uncertain) == [A1]
    (tmp_path / "c.toml").write_text(to_toml(designs[0]))
    assert drillctl.load(tmp_path / "c.toml") == designs[0]


def test_single_values_are_set_by_path():
    design = uncertain(a1={"distribution": "normal", "cov": 0.1})
    assert design.replace({f"uncertain.{A1}.cov": 0.2}).tables.uncertain[A1].cov == 0.2
    quoted = design.replace({f'uncertain."{A1}".cov': 0.2})
    assert quoted.tables.uncertain[A1].cov == 0.2
    # Another distribution drops the numbers of the old one, as another law does.
    limits = {f"uncertain.{A1}.min": 0.9, f"uncertain.{A1}.max": 1.1}
    changed = design.replace({**limits, f"uncertain.{A1}.distribution": "uniform"})
    assert changed.tables.uncertain[A1].cov is None


NORMAL = {"distribution": "normal", "cov": 0.1}


@pytest.mark.parametrize(
    ("path", "table", "message"),
    [
        ("bit_rock.a1_factr", NORMAL, "did you mean 'bit_rock.a1_factor'"),
        (A1, {"distribution": "lognorml", "cov": 0.1}, "did you mean 'lognormal'"),
        (A1, {"cov": 0.1}, "distribution: is missing"),
        (A1, {**NORMAL, "cov": -0.05}, "cov: -0.05 is not allowed"),
        (A1, {**NORMAL, "cov": 0}, "cov: 0 is not allowed"),
        (A1, {**NORMAL, "cv": 1}, "cv: unknown key; did you mean 'cov'"),
        (A1, {"distribution": "normal"}, "cov is missing"),
        (A1, {**NORMAL, "mode": 1}, "mode is not allowed with normal"),
        (A1, {**NORMAL, "mean": -1}, "mean: -1: -1.0 is not allowed: it must be greater"),
        (A1, {**NORMAL, "max": 0.5}, "mean: 1: it must lie between min and max"),
        (A1, {"distribution": "uniform", "min": 1}, "max is missing"),
        (A1, {"distribution": "uniform", "min": 1, "max": 1}, "min: 1.0 must be less than max 1.0"),
        (
            A1,
            {"distribution": "triangular", "min": 1, "max": 2, "mode": 3},
            "mode: 3.0 must lie between",
        ),
        (A1, {"distribution": "lognormal", "mean": -1, "cov": 0.1}, "mean: -1 is impossible"),
        (A1, {"distribution": "normal", "mean": 0, "cov": 0.1}, "mean: 0 with a coefficient"),
        (A1, {**NORMAL, "mean": float("nan")}, "nan is not a finite number"),
        (WEIGHT, {**NORMAL, "mean": 140}, 'mean: 140 has no unit; did you mean "140 kN"?'),
        (WEIGHT, {**NORMAL, "mean": "140 m"}, "mean: "),
        ("simulation.duration", NORMAL, "not a parameter of the rig"),
        ("drillstring.sections.pipe.elements", NORMAL, "whole numbers only"),
        ("map.levels", NORMAL, "no numeric parameter 'map.levels'"),
        ("bit_rock.regularised_over", NORMAL, "no value of its own: give a mean"),
        ("bit_rock.law", NORMAL, "no numeric parameter"),
    ],
)
def test_bad_distributions_are_told_with_their_key(path, table, message):
    with pytest.raises(InputError) as caught:
        uncertain_parameters(drillctl.load(PAPER, uncertain={path: table}))
    assert message in str(caught.value)
    assert f"uncertain.{path}" in str(caught.value)


def test_a_law_without_default_asks_for_one():
    points = [{"speed": "0 rpm", "a": 0.08}, {"speed": "100 rpm", "a": 0.03}]
    values = {"bit_rock.law": "tabulated", "bit_rock.points": points}
    with pytest.raises(InputError, match="no default for the friction law 'tabulated'"):
        draw(drillctl.load(PAPER, **values), 5, seed=0)


# --- lanes -------------------------------------------------------------------------------------


def test_lanes_hold_what_was_drawn():
    design = drillctl.load(PAPER)
    draws = draw(design, 6, seed=1)
    (group,) = drawn_lanes(design, draws).groups
    base = design.bit_rock
    assert group.lanes.friction.a1 == pytest.approx(base.a1 * draws.values[A1], rel=1e-14)
    assert group.lanes.friction.a2 == pytest.approx(base.a2 * draws.values[A2], rel=1e-14)
    assert group.numbers.tolist() == list(range(6))


def test_impossible_draws_are_counted_with_their_reason():
    # Static friction 2.7 times the sliding one: a factor under 0.37 turns them round.
    design = uncertain(a2={"distribution": "uniform", "min": 0.1, "max": 1.0})
    draws = draw(design, 300, seed=1)
    ratio = design.bit_rock.a1 / design.bit_rock.a2
    impossible = draws.values[A2] < ratio
    found = drawn_lanes(design, draws)
    (failed,) = found.failures
    assert failed.count == impossible.sum() > 50
    assert "bit_rock.a2_factor" in failed.reason
    assert "less than a1" in failed.example
    assert found.groups[0].numbers.tolist() == np.flatnonzero(~impossible).tolist()


def test_a_distribution_without_possible_values_is_refused():
    design = uncertain(a2={"distribution": "uniform", "min": 0.1, "max": 0.2})
    with pytest.raises(InputError, match=r"every draw is impossible; the first: .*a2_factor"):
        drawn_lanes(design, draw(design, 5, seed=1))


def test_a_drawn_weight_may_leave_the_friction_table():
    design = uncertain(w={"distribution": "uniform", "min": "150 kN", "max": "180 kN"})
    found = drawn_lanes(design, draw(design, 20, seed=1))
    assert not found.failures
    assert found.groups[0].lanes.nominal_weight.max() > 160e3


def test_a_drawn_string_makes_a_group_of_its_own():
    path = "drillstring.sections.pipe.length"
    law = {"distribution": "normal", "cov": 0.05}
    design = drillctl.load(PAPER, uncertain={path: law})
    draws = draw(design, 3, seed=1)
    found = drawn_lanes(design, draws)
    lengths = [group.design.tables.drillstring.sections[0].length for group in found.groups]
    assert lengths == draws.values[path].tolist()
