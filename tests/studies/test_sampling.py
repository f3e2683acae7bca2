"""Points behind draws: functions of seed and number, replicates, copula, samples of files."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

import drillctl
from drillctl.design import to_toml
from drillctl.ensemble.parameters import Sampling, correlation_root, draw, uncertain_parameters
from drillctl.errors import InputError
from drillctl.studies import weight_delay
from drillctl.studies.compare.compute import compare

HOLDS = {
    "samplings and correlations": "pieces of one sequence, strata of every replicate, correlation "
    "of 40,000 draws, truncated and beta laws by SciPy",
}

PAPER = "monteiro-trindade-140kn"
A1, A2, WEIGHT = "bit_rock.a1_factor", "bit_rock.a2_factor", "operating_point.weight_on_bit"
LAW = {"distribution": "lognormal", "cov": 0.05}
PATHS = (A1, A2, WEIGHT)
KINDS = ["monte-carlo", "sobol", "latin-hypercube"]


def sampling(kind, total=256, seed=3):
    return Sampling(kind, seed, 1 if kind == "monte-carlo" else 8, total)


def table(points):
    return np.column_stack([points[path] for path in PATHS])


# --- points ------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("first", "count"), [(0, 1), (2, 9), (5, 11), (8, 8), (63, 2)])
def test_pieces_are_of_one_sequence(kind, first, count):
    whole = table(sampling(kind).points(PATHS, 256))
    piece = table(sampling(kind).points(PATHS, count, first))
    assert piece.tobytes() == whole[first : first + count].tobytes()


@pytest.mark.parametrize("kind", ["monte-carlo", "sobol"])
def test_more_realizations_begin_with_the_same_ones(kind):
    few, many = sampling(kind, 64).points(PATHS, 64), sampling(kind, 512).points(PATHS, 512)
    assert table(few).tobytes() == table(many)[:64].tobytes()


@pytest.mark.parametrize("kind", KINDS)
def test_points_follow_from_the_seed(kind):
    one, same, other = (table(sampling(kind, seed=s).points(PATHS, 64)) for s in (1, 1, 2))
    assert (one == same).all()
    assert not (one == other).any()
    assert one.min() > 0.0
    assert one.max() < 1.0


@pytest.mark.parametrize("kind", ["sobol", "latin-hypercube"])
def test_every_replicate_is_stratified_by_itself(kind):
    points = table(sampling(kind).points(PATHS, 256))
    for replicate in range(8):
        own = points[replicate::8]
        for column in own.T:
            assert sorted(np.floor(column * 32).astype(int)) == list(range(32))
    # And they are different scrambles, not one.
    assert not np.intersect1d(points[0::8], points[1::8]).size


def test_sobol_points_integrate_better_than_independent_ones():
    def error(kind):
        found = [np.prod(table(sampling(kind, seed=s).points(PATHS, 256)), 1).mean() - 0.125
                 for s in range(20)]  # fmt: skip
        return np.sqrt(np.mean(np.square(found)))

    assert error("sobol") < 0.2 * error("monte-carlo")


def test_the_order_of_parameters_changes_no_draw():
    one = sampling("sobol").points(PATHS, 16)
    other = sampling("sobol").points(PATHS[::-1], 16)
    assert all((one[path] == other[path]).all() for path in PATHS)


def test_a_latin_hypercube_has_no_more_points_than_it_has():
    with pytest.raises(InputError, match="its number is fixed; use sobol or monte-carlo"):
        sampling("latin-hypercube", 64).points(PATHS, 8, 60)


def test_the_numbers_themselves_are_kept():
    found = sampling("sobol").points((A1,), 2)[A1]
    assert found.tolist() == SOBOL
    found = sampling("latin-hypercube").points((A1,), 2)[A1]
    assert found.tolist() == HYPERCUBE


SOBOL = [0.44154599169269204, 0.7971393181942403]
HYPERCUBE = [0.31751808672522897, 0.46615947222787046]


# --- correlation -------------------------------------------------------------------------------


def correlated(*entries, **more):
    values = {"uncertain": dict.fromkeys((A1, A2, WEIGHT), LAW)}
    tables = [{"between": list(pair), "value": value} for pair, value in entries]
    return drillctl.load(PAPER, **values, **{"uncertainty.correlations": tables}, **more)


def test_normal_scores_have_the_correlation_asked_for():
    design = correlated(((A1, A2), 0.7), ((A2, WEIGHT), -0.4))
    values = draw(design, 40_000, seed=1).values
    scores = np.log(np.column_stack([values[path] for path in (A1, A2, WEIGHT)]))
    found = np.corrcoef(scores.T)
    assert found[0, 1] == pytest.approx(0.7, abs=0.01)
    assert found[1, 2] == pytest.approx(-0.4, abs=0.015)
    assert found[0, 2] == pytest.approx(0.0, abs=0.02)


def test_correlation_leaves_every_distribution_as_it_is():
    design = correlated(((A1, A2), 0.9))
    for parameter in uncertain_parameters(design):
        values = draw(design, 20_000, seed=2).values[parameter.path]
        assert stats.kstest(values, parameter.law().cdf).pvalue > 1e-3


def test_correlated_draws_are_pieces_of_one_sequence():
    design = correlated(((A1, A2), 0.5))
    whole, piece = draw(design, 50, seed=2), draw(design, 20, seed=2, first=30)
    for path, values in piece.values.items():
        assert values.tobytes() == whole.values[path][30:].tobytes()


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        (
            [((A1, A2), 0.9), ((A2, WEIGHT), 0.9), ((A1, WEIGHT), -0.9)],
            "not positive definite, its smallest eigenvalue is -0.8",
        ),
        ([((A1, "bit_rock.beta_factor"), 0.1)], "'bit_rock.beta_factor' is not uncertain"),
        ([((A1, A2), 0.1), ((A2, A1), 0.2)], "named twice"),
    ],
)
def test_impossible_correlations_are_refused(entries, message):
    with pytest.raises(InputError, match=r"uncertainty\.correlations") as caught:
        draw(correlated(*entries), 2, seed=0)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("pair", "value", "message"),
    [((A1, A1), 0.1, "between two parameters"), ((A1, A2), 1.0, "must lie between -1 and 1")],
)
def test_impossible_entries_are_refused(pair, value, message):
    with pytest.raises(InputError, match=message):
        correlated((pair, value))


def test_the_root_is_of_the_matrix():
    design = correlated(((A1, A2), 0.5))
    root = correlation_root(design.tables.uncertainty, (A1, A2, WEIGHT))
    assert root @ root.T == pytest.approx(np.array([[1, 0.5, 0], [0.5, 1, 0], [0, 0, 1]]))


# --- distributions -----------------------------------------------------------------------------


def one(path=WEIGHT, **law):
    (found,) = uncertain_parameters(drillctl.load(PAPER, uncertain={path: law}))
    return found


@pytest.mark.parametrize("distribution", ["uniform", "triangular"])
def test_limits_may_follow_from_mean_and_deviation(distribution):
    law = one(distribution=distribution, mean="140 kN", cov=0.05).law()
    assert (law.mean(), law.std()) == (pytest.approx(140e3), pytest.approx(7e3))


def test_beta_has_its_mean_deviation_and_limits():
    found = one(distribution="beta", mean="130 kN", cov=0.05, min="100 kN", max="170 kN")
    law = found.law()
    assert (law.mean(), law.std()) == (pytest.approx(130e3), pytest.approx(6.5e3))
    assert law.support() == (100e3, 170e3)


def test_a_normal_weight_is_truncated_at_zero():
    found = one(distribution="normal", mean="20 kN", cov=0.8)
    values = found.values(np.array([1e-12, 0.5]))
    assert 0.0 <= values[0] < 1.0
    assert values[1] > 20e3  # the part below zero is gone
    assert (found.low, found.high) == (0.0, None)
    # Where nothing is cut off, draws are those of the normal law to the bit.
    plain = one(distribution="normal", mean="140 kN", cov=0.05)
    at = np.array([0.001, 0.3, 0.999])
    assert (plain.values(at) == stats.norm(140e3, 7e3).ppf(at)).all()


def test_limits_of_a_normal_law_may_be_given():
    found = one(distribution="normal", cov=0.05, min="135 kN", max="140 kN")
    law = stats.truncnorm(-5 / 7, 0.0, 140e3, 7e3)
    at = np.array([0.01, 0.5, 0.99])
    assert found.values(at) == pytest.approx(law.ppf(at))


@pytest.mark.parametrize(
    ("law", "message"),
    [
        ({"distribution": "uniform", "min": "-1 kN", "max": "2 kN"}, "min: -1 kN reaches impos"),
        ({"distribution": "uniform", "mean": "20 kN", "cov": 0.8}, "min: a spread down to -7"),
        ({"distribution": "triangular", "mean": "20 kN", "cov": 0.5}, "reaches impossible"),
        (
            {"distribution": "beta", "cov": 0.1, "min": "130 kN", "max": "142 kN"},
            "cov: 0.1 is impossible: between these limits, about this mean, it is less than 0.0319",
        ),
        (
            {"distribution": "beta", "cov": 0.1, "min": "150 kN", "max": "160 kN"},
            "mean: 140000 must lie between",
        ),
        ({"distribution": "samples", "samples": ["-2 kN"]}, "samples: -2 kN: "),
        ({"distribution": "normal", "cov": 0.1, "max": "100 kN"}, "must lie between min and max"),
    ],
)
def test_impossible_distributions_are_refused_with_their_key(law, message):
    with pytest.raises(InputError, match=r"uncertain\.operating_point\.weight_on_bit") as caught:
        one(**law)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("law", "message"),
    [
        (
            {"distribution": "uniform", "min": 1, "max": 2, "cov": 0.1},
            "min is not allowed with cov",
        ),
        (
            {"distribution": "uniform", "min": 1, "max": 2, "mean": 1},
            "mean is not allowed with min",
        ),
        ({"distribution": "beta", "cov": 0.1, "min": 1}, "max is missing"),
        ({"distribution": "samples"}, "samples is missing"),
        ({"distribution": "samples", "samples": []}, "samples: holds nothing"),  # on reading
    ],
)
def test_keys_that_do_not_go_together_are_refused(law, message):
    with pytest.raises(InputError, match=message):
        one(A1, **law)


# --- samples of a file -------------------------------------------------------------------------


def with_file(tmp_path, text, **keys):
    (tmp_path / "measured.csv").write_text(text, encoding="utf-8")
    lines = [f'{key} = "{value}"' for key, value in {"file": "measured.csv", **keys}.items()]
    head = f'schema = 1\nmodel = "{PAPER}"\n[uncertain."{WEIGHT}"]\ndistribution = "samples"\n'
    path = tmp_path / "rig.toml"
    path.write_text(head + "\n".join(lines) + "\n", encoding="utf-8")
    return drillctl.load(path)


def test_samples_of_a_file_are_taken_into_the_design(tmp_path):
    text = "depth,wob\n1,120\n2,131.5\n3,120\n4,150\n"
    design = with_file(tmp_path, text, column="wob", unit="kN")
    (tmp_path / "measured.csv").unlink()
    (found,) = uncertain_parameters(design)
    assert found.samples == (120e3, 120e3, 131.5e3, 150e3)
    assert found.values(np.array([0.01, 0.49, 0.51, 0.75, 0.76])).tolist() == [
        120e3, 120e3, 131.5e3, 131.5e3, 150e3
    ]  # fmt: skip
    shares = np.unique(draw(design, 20_000, seed=1).values[WEIGHT], return_counts=True)[1] / 20_000
    assert shares == pytest.approx([0.5, 0.25, 0.25], abs=0.015)
    again = tmp_path / "again.toml"
    again.write_text(to_toml(design), encoding="utf-8")
    assert drillctl.load(again) == design


def test_a_file_may_be_a_column_of_numbers_alone(tmp_path):
    design = with_file(tmp_path, "# measured\n140e3\n141e3\n", unit="N")
    assert uncertain_parameters(design)[0].samples == (140e3, 141e3)


@pytest.mark.parametrize(
    ("text", "keys", "message"),
    [
        ("a,b\n1,2\n", {"unit": "kN"}, "has 2 columns; column must be one of a, b"),
        ("a,wob\n1,2\n", {"column": "wbo", "unit": "kN"}, "did you mean 'wob'"),
        ("1\n2\n", {"column": "wob", "unit": "kN"}, "no line of column names"),
        ("wob\n1\ntwo\n", {"unit": "kN"}, "'two' in row 2 is not a number"),
        ("wob\n1\n", {}, 'did you mean "1 kN"'),
        ("wob\n1\n", {"unit": "m"}, "samples"),
        ("wob\n1\n", {"file": "other.csv"}, "cannot be read: No such file"),
    ],
)
def test_bad_files_are_told(tmp_path, text, keys, message):
    with pytest.raises(InputError, match=r"uncertain\.operating_point") as caught:
        uncertain_parameters(with_file(tmp_path, text, **keys))
    assert message in str(caught.value)
    assert "rig.toml" in str(caught.value)


# --- tables ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"uncertainty.replicates": 7}, "at least 8"),
        (
            {"uncertainty.sampling": "sobol", "uncertainty.realizations": 100},
            "100 must be a multiple of the 8 replicates of sobol, for instance 104",
        ),
        ({"uncertainty.sampling": "halton"}, "allowed: latin-hypercube, monte-carlo, sobol"),
        (
            {"uncertainty.sampling": "latin-hypercube", "uncertainty.until.half_width": 0.1},
            "until is not allowed with latin-hypercube",
        ),
        (
            {"uncertainty.sampling": "sobol", "uncertainty.until.first_look": 100},
            "first_look 100 must be a multiple",
        ),
        ({"uncertainty.sensitivity.samples": 100}, "100 is not a power of two"),
        ({"uncertainty.realizations": 0}, "0 is not allowed"),
    ],
)
def test_impossible_tables_are_refused(values, message):
    with pytest.raises(InputError, match="uncertainty") as caught:
        drillctl.load(PAPER, **values)
    assert message in str(caught.value)


@pytest.mark.parametrize("study", [compare, weight_delay])
def test_studies_of_independent_draws_take_no_others(study):
    with pytest.raises(InputError, match="intervals here are of independent draws"):
        study(drillctl.load(PAPER, **{"uncertainty.sampling": "sobol"}))
