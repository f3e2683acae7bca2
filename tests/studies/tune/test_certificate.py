"""The certificate: its draws are fresh, its figures those of other rooms, its intervals cover."""

import dataclasses
import json

import numpy as np
import pytest

import drillctl
from drillctl import units
from drillctl.ensemble.audit import by_reference
from drillctl.ensemble.cases import share_interval
from drillctl.ensemble.draws import drawn_lanes, run_draws
from drillctl.ensemble.parameters import draw
from drillctl.errors import InputError
from drillctl.reporting.blocks import Checks, Figure, Table, Text, Words
from drillctl.reporting.gather import Gathered, NotThereError, Study
from drillctl.reporting.sections import SECTIONS
from drillctl.store.json_files import strict
from drillctl.studies.tune import notes
from drillctl.studies.tune.certificate import (
    HALVINGS,
    LOOKED_AT,
    FreshDraws,
    FreshRuns,
    certified,
)
from drillctl.studies.tune.compute import tune
from drillctl.studies.tune.linear_design import linear_design
from drillctl.studies.tune.search import search
from drillctl.studies.tune.tuned import put, tuned_parameters
from tests.alike import same

HOLDS = {
    "certificate of gains": "runs of `compare` at the same draws, to the last bit; tolerances by "
    "their ends; 40 tunes against 20,000 further draws each (slow)",
}

PAPER = "monteiro-trindade-140kn"
WINDOW = {"controller.kp": {"min": 400, "max": 800}, "controller.ki": {"min": 0, "max": 200}}


def tuning(parameters=WINDOW, values=(), certificate=(), **table):
    table = {
        "parameters": parameters, "realizations": 40, "starts": 1, "seed": 3,
        "certificate": {"realizations": 120, "audit": 2, **dict(certificate)}, **table,
    }  # fmt: skip
    return drillctl.load(PAPER, **dict(values), tune=table)


@pytest.fixture(scope="module")
def found():
    return tune(tuning())


def j1_of(design, count, seed):
    """J1 of a design at draws, by the rooms that `compare` is made of."""
    return run_draws(drawn_lanes(design, draw(design, count, seed)), count).measures["j1"]


def test_runs_are_those_of_the_tuned_design_at_draws_of_another_seed(found):
    certificate, design = found.certificate, found.tuned_design
    assert certificate.seed == 3 + 1_000_003
    expected = j1_of(design, 120, certificate.seed)
    np.testing.assert_array_equal(certificate.runs.j1, expected)
    assert certificate.runs.hits == (expected <= 33.0).sum()
    assert certificate.runs.interval == share_interval(certificate.runs.hits, 120)
    assert certificate.runs.value == pytest.approx(np.quantile(expected, 0.95), rel=1e-12)
    assert certificate.runs.quantiles["q50"] == pytest.approx(np.median(expected), rel=1e-12)
    searched = draw(design, 120, 3).values
    for path, drawn in certificate.drawn.items():
        assert not np.isin(drawn, searched[path]).any()
    assert certificate.worst == np.argmax(expected)


def test_accuracy_is_that_of_the_design_not_of_the_search():
    coarse = tuning(values={"simulation.accuracy": "fast"})
    fine = tuning(values={"simulation.accuracy": "standard"})
    values = np.array([630.0, 145.0])
    runs = [FreshDraws(d, tuned_parameters(d)).of_gains(values)[1] for d in (coarse, fine)]
    np.testing.assert_array_equal(runs[0].j1, j1_of(put(coarse, tuned_parameters(coarse), values),
                                                    120, 1_000_006))  # fmt: skip
    assert (runs[0].j1 != runs[1].j1).any()


def test_margins_and_audit_are_those_of_their_rooms(found):
    certificate, design = found.certificate, found.tuned_design
    expected = drillctl.loop(design).summary()
    assert certificate.margins["slope_margin"] == expected["slope_margin"] > 300.0
    assert certificate.margins["disk_margin"] == expected["disk_margin"]
    audit = certificate.audit
    assert len(audit.cells) == 2
    number = int(audit.cells[0])
    rock = {path: column[number] for path, column in certificate.drawn.items()}
    known = by_reference(design.replace(rock))
    assert {name: values[0] for name, values in audit.reference.items()} == pytest.approx(
        known, rel=0.0, abs=0.0, nan_ok=True
    )
    j1 = audit.batch["j1"]
    assert j1[0] == certificate.runs.j1[number]
    assert (audit.verdict, certificate.other_side) == ("ok", 0)
    beyond = dataclasses.replace(audit, reference=audit.reference | {"j1": j1 + 100.0})
    other = dataclasses.replace(certificate, audit=beyond)
    assert (other.other_side, beyond.verdict) == ((j1 <= 33.0).sum(), "check")
    assert other.summary()["audit"]["other_side_of_level"] == other.other_side


@pytest.mark.parametrize(
    ("hits", "verdict"),
    [(1000, "passed"), (965, "passed"), (960, "not shown"), (940, "not shown"), (930, "failed")],
)
def test_a_certificate_is_passed_when_its_interval_shows_it(found, hits, verdict):
    j1 = np.where(np.arange(1000) < hits, 10.0, 90.0)
    one = dataclasses.replace(found.certificate, runs=FreshRuns(j1, 10.0, 33.0))
    low, high = share_interval(hits, 1000)
    assert one.verdict == verdict
    assert one.passed == (low >= 0.95)
    assert (one.verdict == "failed") == (high < 0.95)
    assert ("more realizations would decide" in one.message) == (verdict == "not shown")


@pytest.mark.slow
def test_tolerance_ends_where_the_probability_falls(found):
    design = found.design
    fresh = FreshDraws(design, tuned_parameters(design))
    required = 0.85
    certificate = certified(
        found.tuned_design.replace({"tune.probability": required}),
        FreshDraws(design.replace({"tune.probability": required}), tuned_parameters(design)),
        found.tuning.values,
    )
    widths = {"controller.kp": 400.0, "controller.ki": 200.0}
    for k, one in enumerate(certificate.tolerances):
        assert one.low < one.value < one.high
        step = widths[one.path] / LOOKED_AT / 2**HALVINGS
        for end, out in ((one.low, -2.0 * step), (one.high, 2.0 * step)):
            points = np.tile(found.tuning.values, (2, 1))
            points[:, k] = end, end + out
            inside, outside = fresh.shares(points)
            assert inside >= required > outside
        assert (np.diff(one.values) > 0).all()
        between = (one.values >= one.low) & (one.values <= one.high)
        assert (one.probability[between] >= required).all()


def test_a_gain_that_never_leaves_the_level_meets_the_bounds():
    bounds = {"controller.kp": {"min": 600, "max": 640}}
    design = tuning(bounds, {"operating_point.weight_on_bit": "100 kN"}, {"audit": 0})
    (one,) = tune(design).certificate.tolerances
    assert (one.low, one.high) == (600.0, 640.0)
    assert one.low_at_bound
    assert one.high_at_bound


def test_neighbourhood_is_the_share_of_the_first_draws(found):
    about = found.certificate.neighbourhood
    assert about.probability.shape == (21, 21)
    assert about.realizations == 120
    point = np.array([about.axes[0].values[4], about.axes[1].values[17]])
    j1 = j1_of(put(found.design, found.tuning.tuned, point), 120, found.certificate.seed)
    assert about.probability[4, 17] == (j1 <= 33.0).mean()


def test_draws_that_no_rig_has_count_against_the_gains():
    uncertain = {"bit_rock.a2_factor": {"distribution": "uniform", "min": 0.2, "max": 1.2}}
    design = tuning(values={"uncertain": uncertain}, certificate={"audit": 0})
    fresh = FreshDraws(design, tuned_parameters(design))
    _, runs = fresh.of_gains(np.array([630.0, 145.0]))
    lost = sum(failure.count for failure in fresh.problem.runs.failures)
    assert lost == np.isnan(runs.j1).sum() > 5
    assert runs.hits <= 120 - lost
    assert np.isfinite(runs.quantiles["q50"])
    assert fresh.shares(np.array([[630.0, 145.0]]))[0] == runs.probability


def test_certificates_of_a_quasi_random_search_are_of_independent_draws():
    design = tuning(values={"uncertainty.sampling": "sobol", "uncertainty.realizations": 64})
    fresh = FreshDraws(design, tuned_parameters(design))
    plain = draw(tuning(), 120, 1_000_006).values
    for path, drawn in fresh.drawn.items():
        np.testing.assert_array_equal(drawn, plain[path])


def test_the_seed_of_the_search_certifies_nothing():
    with pytest.raises(InputError, match=r"certificate\.seed 3 is that of the search"):
        tuning(certificate={"seed": 3})


def test_what_is_drawn_cannot_be_tuned():
    uncertain = {"controller.kp": {"distribution": "uniform", "min": 500, "max": 700}}
    with pytest.raises(InputError, match="cannot be tuned as well"):
        tuned_parameters(tuning(values={"uncertain": uncertain}))
    with pytest.raises(InputError, match="cannot be tuned as well"):
        tuned_parameters(drillctl.load(PAPER, uncertain=uncertain))


@pytest.mark.parametrize(
    ("values", "parameters", "told"),
    [
        ({"controller.law": "soft-torque"}, {"controller.share": {"min": 0.2, "max": 1.5}},
         r"controller.share.max: no design has it: must be at most 1"),
        ({}, {"operating_point.weight_on_bit": {"min": "10 kN", "max": "150 kN"}},
         r"weight_on_bit.min: no design has it: 10 kN lies outside the friction table"),
        ({}, {"controller.kp": {"min": 5, "max": 5}}, "bounds are equal"),
    ],
)  # fmt: skip
def test_bounds_outside_the_range_of_a_law_are_refused(values, parameters, told):
    with pytest.raises(InputError, match=told):
        tuned_parameters(tuning(parameters, values))


def test_baselines_are_the_designs_that_they_name(found):
    by_name = {one.name: one for one in found.baselines}
    seed = found.certificate.seed
    others = {
        "as designed": {},
        "paper's gains": {"controller.kp": 200.0, "controller.ki": 100.0},
        "soft torque": {"controller.law": "soft-torque"},
        "Z-torque": {"controller.law": "z-torque"},
        "stiff speed": {"controller.law": "stiff-speed"},
        "least nominal J1": by_name["least nominal J1"].gains,
        "largest slope margin": by_name["largest slope margin"].gains,
    }
    assert set(others) == set(by_name)
    for name, values in others.items():
        expected = j1_of(found.design.replace(values), 120, seed)
        np.testing.assert_array_equal(by_name[name].runs.j1, expected, err_msg=name)
    linear = linear_design(found.design)
    assert by_name["largest slope margin"].gains == linear.gains
    nominal = by_name["least nominal J1"]
    axes = [
        {"path": "controller.kp", "min": 400, "max": 800, "points": 41},
        {"path": "controller.ki", "min": 0, "max": 200, "points": 41},
    ]
    j1, at = drillctl.stability_map(found.design.replace({"map.axes": axes}), audit_cells=0).minimum
    assert (nominal.search["value"], nominal.gains) == (j1, at)


def test_baselines_of_another_law_have_its_default_tuning():
    values = {"controller.law": "soft-torque", "controller.share": 0.6}
    design = tuning({"controller.share": {"min": 0.2, "max": 0.9}}, values, {"audit": 0})
    result = tune(design)
    by_name = {one.name: one for one in result.baselines}
    default = drillctl.load(PAPER, **{"controller.law": "soft-torque"})
    expected = j1_of(default, 120, result.certificate.seed)
    np.testing.assert_array_equal(by_name["soft torque"].runs.j1, expected)
    assert by_name["as designed"].gains == {"controller.share": 0.6}
    assert by_name["paper's gains"].runs is None
    assert "the law is soft-torque" in by_name["paper's gains"].reason
    assert len(result.certificate.neighbourhood.axes) == 1


def test_the_exhaustive_grid_is_the_least_of_the_searchs_own_realizations():
    narrow = {"controller.kp": {"min": 610, "max": 650}, "controller.ki": {"min": 130, "max": 160}}
    design = tuning(narrow, realizations=12, certificate={"audit": 0, "realizations": 20})
    result = tune(design, exhaustive=True)
    grid = {one.name: one for one in result.baselines}["exhaustive grid"]
    assert grid.search["trajectories"] == 41 * 41 * 12
    fast = design.replace({"simulation.accuracy": "fast"})
    at = fast.replace(grid.gains)
    assert grid.search["value"] == pytest.approx(np.quantile(j1_of(at, 12, 3), 0.95), rel=1e-12)
    worse = fast.replace({"controller.kp": 631.0, "controller.ki": 148.0})
    assert grid.search["value"] <= np.quantile(j1_of(worse, 12, 3), 0.95)


def test_a_tune_is_read_back_as_it_was(found, tmp_path):
    found.save(tmp_path / "run")
    again = drillctl.open(tmp_path / "run")
    assert strict(again.summary()) == strict(found.summary())
    assert again.data.equals(found.data)
    same(again, found)
    json.dumps(strict(found.summary()), allow_nan=False)
    assert drillctl.tune is tune
    assert found.save(tmp_path / "run") == tmp_path / "run"  # the very same run


def test_its_section_of_a_report_holds_its_message_tables_and_pictures(found, tmp_path):
    folder = found.save(tmp_path / "run")
    for state in ("done", "left_out"):
        study = Study("tune", "the tuning", state, "it was not requested", folder)
        gathered = Gathered(found.design, found.design, None, Words("si"), {"tune": study})
        if state == "left_out":
            with pytest.raises(NotThereError, match="it was not requested"):
                SECTIONS["tuning"].build(gathered)
            continue
        blocks = SECTIONS["tuning"].build(gathered)
    message = units.told(found.message, "si")
    sentences = {block.text for block in blocks if isinstance(block, Text)}
    assert message[0].upper() + message[1:] in sentences
    tables = {block.name: block for block in blocks if isinstance(block, Table)}
    assert set(tables) - {"verge"} == {"tolerance", "baselines"}
    assert tables["tolerance"].rows[0][:2] == (
        "controller.kp",
        f"{found.tuning.values[0]:.6g} N m s",
    )
    assert [row[0] for row in tables["baselines"].rows] == [
        "tuned",
        *(one.name for one in found.baselines),
    ]
    drawn = [block.name for block in blocks if isinstance(block, Figure)]
    assert drawn == ["baselines", "neighbourhood"]
    ((check, audited),) = (block.checks for block in blocks if isinstance(block, Checks))
    assert check.answer == found.certificate.passed
    assert "at fresh draws" in check.question
    assert audited.answer == (found.certificate.audit.verdict == "ok")
    assert "reference solver agree with the certificate" in audited.question


def test_runs_without_an_answer_are_null_and_come_back(found, tmp_path):
    j1 = found.certificate.runs.j1.copy()
    j1[:60] = np.inf
    runs = FreshRuns(j1, float("inf"), 33.0)
    broken = dataclasses.replace(
        found, certificate=dataclasses.replace(found.certificate, runs=runs)
    )
    told = strict(broken.summary())["certificate"]
    assert told["value"] is None
    assert told["quantiles"]["q95"] is None
    assert told["worst"]["j1"] is None
    broken.save(tmp_path / "run")
    again = drillctl.open(tmp_path / "run").certificate.runs
    np.testing.assert_array_equal(again.j1, j1)
    assert again.value == float("inf")


def test_a_better_baseline_is_told_where_no_gains_reach_the_level(found):
    j1 = np.full(120, 90.0)
    certificate = dataclasses.replace(found.certificate, runs=FreshRuns(j1, 90.0, 33.0))
    message = dataclasses.replace(found, certificate=certificate).message
    best = max(found.baselines, key=lambda one: one.runs.hits)
    reaches = "meets it with" if best.runs.interval[0] >= certificate.required else "has"
    assert f"the baseline {best.name!r} {reaches} {best.runs.probability:.4f}" in message


def test_values_at_the_end_of_their_range_are_reported_with_a_wider_one(found):
    assert found.on_bounds == ()

    def at(*values):
        return dataclasses.replace(
            found, tuning=dataclasses.replace(found.tuning, values=np.array(values))
        )

    (kp,) = at(799.0, 100.0).on_bounds
    assert "controller.kp = 799 N*m*s/rad lies at the end of its range, 800 N*m*s/rad" in kp
    assert "as far as 1800 N*m*s/rad with" in kp  # what the rig suggests
    (low,) = at(401.0, 0.0).on_bounds  # less than 0 is no gain
    assert "controller.kp = 401" in low
    assert "as far as 0 N*m*s/rad with" in low
    assert list(notes(at(799.0, 199.0)))[:2] == list(at(799.0, 199.0).on_bounds)


@pytest.mark.slow
def test_the_interval_holds_the_probability_in_33_of_40_tunes():
    """A correct program fails this about once in 600: 95 % intervals, 40 of them.

    At 144 kN the best gains keep the level of 33 s at some nine of ten draws.
    """
    held = 0
    for seed in range(40):
        design = tuning(
            values={"operating_point.weight_on_bit": "144 kN", "simulation.accuracy": "fast"},
            seed=seed, certificate={"audit": 0, "realizations": 400},
        )  # fmt: skip
        found = search(design)
        fresh = FreshDraws(design, tuned_parameters(design))
        _, runs = fresh.of_gains(found.values)
        more = design.replace(
            {"tune.certificate.realizations": 20_000, "tune.certificate.seed": 7_000_000 + seed}
        )
        _, truth = FreshDraws(more, tuned_parameters(more)).of_gains(found.values)
        low, high = runs.interval
        assert 0.3 < truth.probability < 0.995
        held += low <= truth.probability <= high
    print(f"{held} of 40 intervals hold the probability")  # noqa: T201
    assert held >= 33


@pytest.mark.slow
def test_the_papers_case_against_the_exhaustive_grid_at_fresh_draws():
    """Found with a tenth of the trajectories, at most 1 % above; the time is told, not held."""
    result = tune(drillctl.load("robust-gains-140kn"), exhaustive=True)
    grid = {one.name: one for one in result.baselines}["exhaustive grid"]
    print(f"search {result.tuning.seconds:.1f} s, all {result.total_seconds:.1f} s")  # noqa: T201
    assert result.certificate.runs.value <= 1.01 * grid.runs.value
    assert result.tuning.value <= 1.01 * grid.search["value"]
    assert result.tuning.trajectories <= grid.search["trajectories"] / 10
    assert result.passed
