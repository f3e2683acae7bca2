"""The command line: answers, exit codes, messages, folders, interruption and resumption."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numba
import numpy as np
import pytest

import drillctl
from drillctl import catalog
from drillctl.errors import SimulationError

HOLDS = {
    "resumed runs": "the same bits after an interruption and a kill",
}

DESIGN = "monteiro-trindade-140kn"
BISTABLE = "navarro-lopez-2dof-bistable"
SHORT = ["--set", "simulation.duration=10 s"]
LOW = ["--set", "map.levels=[3]"]  # below J1 of a bit that never turns in a short run
GAINS = ["--axis", "controller.kp=0:1000:5", "--axis", "controller.ki=0:500:4"]
SMALL = [*GAINS, "--audit", "0", *SHORT]


@pytest.fixture(autouse=True)
def _threads_given_back():
    yield
    numba.set_num_threads(numba.config.NUMBA_NUM_THREADS)


def refuse(constant):
    raise ValueError(f"{constant} is not JSON")


def parsed(text):
    """The one strict JSON object that the text is."""
    found = json.loads(text, parse_constant=refuse)
    assert isinstance(found, dict)
    return found


def command(*arguments, **options):
    return subprocess.run(
        [sys.executable, "-m", "drillctl", *map(str, arguments)],
        capture_output=True, text=True, check=False, timeout=120, **options,
    )  # fmt: skip


def same_bits(folder, expected):
    """Whether a saved map holds exactly the numbers of a sweep."""
    found = drillctl.open(folder)
    assert found.status.tobytes() == expected.status.tobytes()
    for name, values in expected.measures.items():
        assert found.measures[name].tobytes() == values.tobytes(), name


# --- answers ---------------------------------------------------------------------------------


@pytest.mark.parametrize("shelf", ["models", "designs"])
def test_shelves(call, shelf):
    code, out, err = call(shelf, "--json")
    assert (code, err) == (0, "")
    found = parsed(out)
    assert list(found) == [shelf]
    assert [entry["name"] for entry in found[shelf]] == catalog.names(shelf)
    for entry in found[shelf]:
        assert set(entry) == {"name", "title", "path"}
        assert entry["title"]
        assert Path(entry["path"]).is_file()
    code, out, err = call(shelf)
    assert code == 0
    assert all(name in out for name in catalog.names(shelf))


def test_show_prints_a_design_that_reads_back(call, tmp_path):
    code, out, _ = call("show", DESIGN, "--set", "controller.kp=300")
    assert code == 0
    (tmp_path / "shown.toml").write_text(out)
    assert drillctl.load("shown.toml") == drillctl.load(DESIGN, **{"controller.kp": 300})
    code, out, _ = call("show", DESIGN, "--json")
    assert parsed(out)["operating_point"]["weight_on_bit"] == "140 kN"
    # Defaults need not fit every rig: no pipe is added to a lumped spring.
    (tmp_path / "shown.toml").write_text(call("show", "richard-detournay-2dof")[1])
    assert call("validate", "shown.toml")[0] == 0


def test_validate(call):
    code, out, _ = call("validate", DESIGN)
    assert code == 0
    assert out.endswith("monteiro-trindade-140kn.toml: valid\n")
    code, out, _ = call("validate", DESIGN, "--json")
    assert parsed(out)["valid"] is True


def test_validate_checks_axes_that_were_written(call):
    assert call("validate", "navarro-lopez-2dof")[0] == 0  # the default axes do not fit its law
    code, out, err = call(
        "validate", BISTABLE, "--set", "map.axes=[{path='a',min=0,max=1,points=3}]"
    )
    assert (code, out) == (2, "")
    assert "map.axes a: no numeric parameter 'a'" in err


def test_modes_json(call):
    code, out, err = call("modes", DESIGN, "--json", "--count", "4")
    found = parsed(out)
    assert code == 0
    assert set(found) == {"free_free", "fixed_top", "mesh", "warnings"}
    assert [len(found[k]) for k in found] == [4, 4, 1, 0]
    rigid, first = found["free_free"][:2]
    assert rigid == {"frequency_hz": 0.0, "damping_ratio": None}
    assert first["frequency_hz"] == pytest.approx(0.1806, abs=1e-4)
    assert "results: runs" in err
    folder = Path(f"runs/{DESIGN}-modes-1")
    held = {path.name for path in folder.iterdir()}
    assert held >= {"design.toml", "run.json", "summary.json", "data.zarr", "modes.png"}
    assert drillctl.open(folder).summary() | {"warnings": found["warnings"]} == found


def test_loop_json(call):
    code, out, _ = call("loop", DESIGN, "--json", "--set", "controller.kp=200", *GAINS)
    found = parsed(out)
    assert code == 0
    keys = {"stable", "spectral_abscissa", "slope", "slope_margin", "deciding_frequency_hz",
            "disk_margin", "peak_sensitivity"}  # fmt: skip
    assert set(found) >= keys
    assert found["stable"] is False
    assert found["disk_margin"] is None
    folder = Path(f"runs/{DESIGN}-loop-1")
    held = {path.name for path in folder.iterdir()}
    assert held >= {"model.mat", "model.npz", "loop-map.csv", "summary.json", "data.zarr"}
    assert drillctl.open(folder).map.summary() == found["map"]


def test_loop_with_margins(call):
    found = parsed(call("loop", DESIGN, "--json")[1])
    assert found["stable"] is True
    assert found["disk_margin"]["gain_db"] == pytest.approx(0.898, abs=1e-3)
    assert found["disk_margin"]["phase_deg"] == pytest.approx(5.911, abs=1e-3)
    assert found["map"]["stable_cells"] == 111


def test_loop_of_a_drive_that_cannot_turn_the_bit(call):
    code, out, err = call("loop", BISTABLE, "--set", "controller.torque=1 kN*m")
    assert (code, out) == (2, "")
    assert "controller: no speed at which the torque of the drive equals" in err


def test_cycle_json(call):
    code, out, _ = call("cycle", BISTABLE, "--json")
    found = parsed(out)
    assert code == 0
    assert found["status"] == "periodic"
    assert found["period"] == pytest.approx(5.092533, abs=1e-6)
    back = drillctl.open(f"runs/{BISTABLE}-cycle-1")
    assert back.summary() | {"warnings": []} == found
    assert abs(back.orbit.multipliers[0]) == pytest.approx(0.6014, abs=1e-4)


def test_regions_over_one_parameter_are_refused_at_once(call):
    axis = ["--axis", "controller.torque=9 kN*m:11 kN*m:3"]
    code, out, err = call("regions", BISTABLE, *axis, "--out", "one")
    assert (code, out) == (2, "")
    assert "map.axes: regions are shown over 2 parameters, got 1" in err
    assert not Path("one").exists()


def test_loop_without_a_map_says_so(call):
    axis = ["--axis", "controller.torque=9 kN*m:11 kN*m:3"]
    code, out, err = call("loop", BISTABLE, *axis, "--json")
    assert code == 0
    assert "map" not in parsed(out)
    assert "no map: it runs over 2 parameters" in err


def test_overdamped_poles_are_told(call):
    found = parsed(call("modes", "navarro-lopez-4dof", "--json")[1])
    assert [e["damping_ratio"] for e in found["free_free"] if e.get("overdamped")] == [None]


MEASURES = {
    "j1", "stuck_time", "sticks", "stick_slip_index", "mean_bit_speed", "min_bit_speed",
    "peak_bit_speed", "peak_pipe_torque", "peak_top_torque", "settling_time",
    "mean_weight_on_bit", "rop_proxy", "work_per_turn", "time_outside_table",
}  # fmt: skip


@pytest.mark.parametrize("engine", ["reference", "batch"])
def test_simulate_json(call, engine):
    code, out, _ = call("simulate", DESIGN, *SHORT, "--json", "--engine", engine)
    found = parsed(out)
    assert code == 0
    assert set(found) >= {"measures", "status", "engine", "step", "modes"}
    assert set(found["measures"]) >= MEASURES
    assert found["engine"] == engine
    assert (found["step"] is None) == (engine == "reference")
    assert found["status"] == "sticking"
    assert found["measures"]["settling_time"] is None


def test_reference_is_the_default_engine(call):
    assert parsed(call("simulate", BISTABLE, *SHORT, "--json")[1])["engine"] == "reference"
    chosen = ["--set", "simulation.engine=batch"]
    assert parsed(call("simulate", BISTABLE, *SHORT, *chosen, "--json")[1])["engine"] == "batch"


def test_map_json(call):
    code, out, err = call("map", DESIGN, *SMALL, "--json", "--out", "m")
    found = parsed(out)
    assert code == 0
    assert set(found) >= {"axes", "minimum", "regions", "audit", "seconds", "total_seconds"}
    assert found["axes"] == {
        "controller.kp": {"min": 0.0, "max": 1000.0, "points": 5},
        "controller.ki": {"min": 0.0, "max": 500.0, "points": 4},
    }
    assert set(found["minimum"]) == {"j1", "at"}
    assert set(found["minimum"]["at"]) == set(found["axes"])
    assert list(found["regions"]) == ["20", "30", "40", "50"]
    for region in found["regions"].values():
        assert set(region) == {"cells", "area_fraction", "bounds"}
    assert found["audit"]["cells"] == 0
    assert found["audit"]["worst_relative_difference"] is None
    assert 0.0 < found["seconds"] < found["total_seconds"]
    assert "results: m" in err
    held = {path.name for path in Path("m").iterdir()}
    assert held == {
        "design.toml", "run.json", "summary.json", "data.zarr", "result.json", "map.csv",
        "journal.jsonl",
        "regions.csv", "statuses.csv", "map.png", "responses.png",
    }  # fmt: skip
    assert parsed(Path("m/summary.json").read_text()) == found


def test_map_audits_as_many_cells_as_asked_for(call):
    arguments = ["map", BISTABLE, "--axis", "start.speed=10 rad/s:14 rad/s:3", *SHORT, "--audit"]
    found = parsed(call(*arguments, "2", "--json")[1])
    assert found["audit"]["cells"] == 2
    assert found["audit"]["verdict"] == "ok"
    assert found["audit"]["worst_relative_difference"] < 1e-2


def test_maps_over_one_and_three_parameters(call):
    one = ["map", DESIGN, GAINS[0], GAINS[1], "--audit", "0", *SHORT]
    code, out, _ = call(*one, "--out", "one")
    assert code == 0
    assert Path("one/map.png").is_file()
    three = [*SMALL, "--axis", "bit_rock.a1_factor=0.9:1.1:2"]
    code, out, _ = call("map", DESIGN, *three, "--out", "three")
    assert code == 0
    assert not Path("three/map.png").exists()
    assert "40 cells" in out
    lines = Path("three/map.csv").read_text().splitlines()
    assert len(lines) == 41
    assert lines[0].startswith(
        "controller.kp (N*m*s/rad),controller.ki (N*m/rad),bit_rock.a1_factor,j1 (s),"
    )
    assert drillctl.open("three").j1.shape == (5, 4, 2)


def verbs_on(name):
    """The verbs that compute, with options that keep them short."""
    axes = []
    for axis in drillctl.load(name).tables.map.axes:
        axes += ["--axis", f"{axis.path}={axis.min}:{axis.max}:3"]
    # A program of the start-up must have ended before the run does.
    duration = "160 s" if name == "start-up-140kn" else "5 s"
    short = ["--set", f"simulation.duration={duration}", *LOW]
    verbs = {"modes": [], "loop": axes, "simulate": short}
    verbs |= {"compare": [*short, "--realizations", "3"]}
    few = ["--realizations", "8"]
    if drillctl.load(name).tables.uncertainty.sensitivity is not None:
        few += ["--sensitivity", "2"]
    verbs |= {"uncertainty": [*axes, *short, *few, "--audit", "0"]}
    verbs |= {"regions": axes, "map": [*axes, *short, "--audit", "0"]}
    # A long run of thirty elements takes ten seconds: `cycle` has tests of its own. A bit that cuts
    # its own wake has none.
    return verbs | ({"cycle": []} if name == "navarro-lopez-2dof-bistable" else {})


# The same rig at other weights on bit or draws tells nothing new in a quick run; some of these
# take several kernels of their own.
SLOW = (
    "monteiro-trindade-80kn", "monteiro-trindade-100kn", "monteiro-trindade-160kn",
    "pi-vs-delayed-wob-140kn", "start-up-140kn", "slip-laws-140kn", "six-drives-100kn",
    "torque-limited-140kn", "pi-vs-dynamic-wob-140kn", "monteiro-trindade-fig6-10000",
    "five-weights-uncertain", "monteiro-trindade-120kn", "monteiro-trindade-fig6",
    "robust-gains-140kn", "pi-vs-pi-dynamic-wob",
    "monteiro-trindade-140kn", "wob-rpm-chart", "dynamic-wob-delay-140kn",  # in test_studies.py
    "well-a-off-bottom",  # 258 nodes
)  # fmt: skip


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.slow if name in SLOW else ())
        for name in catalog.names("designs")
    ],
)
def test_every_verb_on_every_design(call, name):
    assert call("validate", name)[0] == 0
    assert call("show", name)[0] == 0
    for verb, options in verbs_on(name).items():
        code, out, err = call(verb, name, *options, "--json")
        alone = verb == "compare" and not drillctl.load(name).tables.compare.cases
        note = "one case only: name others in compare.cases to compare it with\n" if alone else ""
        nodes = drillctl.load(name).string.nodes
        if verb == "loop" and nodes > 120:
            note += f"map of the slope margin alone, no root locus: {nodes} nodes; up to 120 the "
            note += "poles are computed for every cell\n"
        if verb == "loop" and drillctl.load(name).axial is not None:
            note += "map of the roots over 9 points of an axis at most; in Python "
            note += "drillctl.studies.loop_map takes any\n"
        if verb == "compare" and name == "six-drives-100kn":
            # From 70 rpm their torque is at its peak at once, and falls to half of it in a step.
            for case in ("Z-torque, a = 0.5", "torsional rectification"):
                note += f"{case}: audit: check: the step is too long for peak top torque, "
                note += "peak drive power\n"
        note += "".join(f"warning: {one}\n" for one in drillctl.load(name).warnings)
        assert (code, err) == (0, f"{note}results: runs/{name}-{verb}-1\n")
        assert parsed(out)


def test_a_run_that_breaks_down_is_a_status(call):
    """A torque fed back through one sample, nineteen times itself: no finite answer."""
    controller = ["controller.law=active-damping", "controller.drive.sampling_period=20 ms"]
    sets = [word for text in controller for word in ("--set", text)]
    code, out, _ = call("simulate", DESIGN, *sets, "--engine", "batch", "--json")
    assert code == 0
    found = parsed(out)
    assert found["status"] == "failed"
    assert found["measures"]["j1"] is None


def test_a_level_that_a_short_run_keeps_in_any_case_is_named(call):
    map_of = ["map", DESIGN, *GAINS[:2], "--audit", "0", *SHORT, "--set"]
    assert call(*map_of, "map.levels=[9.9]", "--out", "one")[2] == ""
    err = call(*map_of, "map.levels=[9, 10, 30]", "--out", "two")[2]
    assert "never turns has a J1 of 10 s in these runs, so that J1 under 10, 30 s says" in err


def test_units_of_tables(call):
    axes = ["--axis", "operating_point.weight_on_bit=100 kN:120 kN:2", "--audit", "0", *SHORT]
    assert re.search(r"\b100 [│|]\s+120\b", call("map", DESIGN, *axes)[1])
    code, out, _ = call("map", DESIGN, *axes, "--units", "field")
    assert code == 0
    assert "operating_point.weight_on_bit from (klbf)" in out
    assert re.search(r"\b22\.48\d* [│|]\s+26\.9[78]\d*", out)
    code, out, _ = call("simulate", DESIGN, *SHORT, "--units", "field")
    assert "klbf ft" in out
    assert call("map", DESIGN, "--units", "furlongs")[0] == 2


def test_units_of_a_design_hold_unless_others_are_asked_for(call):
    Path("mine.toml").write_text(f'schema = 1\nmodel = "{DESIGN}"\nunits = "field"\n')
    code, out, err = call("modes", "mine.toml", "--out", "run")
    assert (code, "of (ft)" in out) == (0, True), err
    assert Path("run/mesh.csv").read_text().startswith("section,elements,element_length (ft),")
    code, out, err = call("modes", "mine.toml", "--out", "run", "--units", "si")
    assert (code, "of (m)" in out) == (0, True)  # no other run
    assert "already done" in err
    code, _, err = call("modes", "mine.toml", "--set", "units=imperial")
    assert (code, "units: got 'imperial'; allowed: field, si" in err) == (2, True), err


def test_threads_change_nothing(call):
    one = call("map", DESIGN, *SMALL, "--threads", "1", "--out", "one")
    assert one[0] == 0
    assert numba.get_num_threads() == 1
    numba.set_num_threads(numba.config.NUMBA_NUM_THREADS)
    same_bits("one", drillctl.open(made(call)))


def made(call):
    """Folder of a small map."""
    assert call("map", DESIGN, *SMALL, "--out", "made")[0] == 0
    return "made"


def test_setting_a_law_drops_the_old_numbers(call):
    torque = ["--set", "controller.torque=9 kN*m", "--set", "controller.law=constant-torque"]
    code, out, _ = call("show", DESIGN, *torque, "--json")
    assert code == 0
    controller = parsed(out)["controller"]
    controller.pop("drive")
    assert controller == {"law": "constant-torque", "torque": "9 kN*m"}


def test_new_writes_a_valid_design_once(call):
    assert call("new", "my-rig")[:2] == (0, "written: my-rig.toml\n")
    assert call("validate", "my-rig.toml")[0] == 0
    text = Path("my-rig.toml").read_text()
    code, out, err = call("new", "my-rig")
    assert (code, out) == (2, "")
    assert "my-rig.toml: exists already" in err
    assert Path("my-rig.toml").read_text() == text
    assert call("new", "no/such/folder/rig")[0] == 2


@pytest.mark.parametrize("stem", ["a b", "rig [b] [x]", "ünïcøde;", "50%", "-x", ":smile:"])
def test_names_and_titles_of_any_characters(call, stem):
    text = f'schema = 1\nmodel = "{DESIGN}"\ntitle = "{stem} [/bold]"\n'
    Path(f"{stem}.toml").write_text(text, encoding="utf-8")
    code, out, err = call("map", f"./{stem}.toml", *GAINS[:2], "--audit", "0", *SHORT, *LOW)
    assert code == 0
    assert err == ""
    assert f"{stem} [/bold]" in out
    assert f"results: runs/{stem}-map-1" in out
    assert drillctl.open(f"runs/{stem}-map-1").design.name == stem


def test_sections_of_any_name(call):
    section = 'name = "a/b [c]"\npipe = "5 in 19.5 lb/ft"\nlength = "900 m"\n'
    Path("rig.toml").write_text(
        f'schema = 1\nmodel = "{BISTABLE}"\n[[drillstring.sections]]\n{section}'
    )
    axis = "drillstring.sections.a/b [c].length=500 m:900 m:2"
    code, _, err = call(
        "map", "rig.toml", "--axis", axis, "--audit", "0", *SHORT, *LOW, "--out", "m"
    )
    assert (code, err) == (0, "")
    np.testing.assert_array_equal(drillctl.open("m").axes[0].values, [500.0, 900.0])


def test_help_and_version(call):
    code, out, err = call()
    assert (code, err) == (0, "")
    assert "Usage: drillctl" in out
    assert call("--help")[1] == out
    assert call("--version")[:2] == (0, f"drillctl {drillctl.__version__}\n")
    assert "--axis" in call("map", "--help")[1]


# --- wrong input -----------------------------------------------------------------------------

WRONG = {
    "unknown verb": (["mpa", DESIGN], ["mpa", "map"]),
    "unknown option": (["map", DESIGN, "--axs", "1"], ["--axs", "--axis"]),
    "no design": (["map"], ["DESIGN"]),
    "unknown name": (["map", "monteiro-trindade-14kn"], ["did you mean 'monteiro-trindade-140kn'"]),
    "missing file": (["map", "nowhere.toml"], ["nowhere.toml: no such file"]),
    "unknown key": (
        ["map", DESIGN, "--set", "controller.kpp=3"],
        ["--set controller.kpp", "kp"],
    ),
    "unknown section": (
        ["show", DESIGN, "--set", "drillstring.sections.pip.length=3 m"], ["'pip'", "pipe"],
    ),
    "set without =": (["show", DESIGN, "--set", "controller.kp"], ["--set", "path=VALUE"]),
    "bare speed": (["show", DESIGN, "--set", "operating_point.speed=100"], ['"100 rpm"?']),
    "wrong unit": (["show", DESIGN, "--set", "operating_point.speed=3 kN"], ["rpm", "kN"]),
    "law without number": (
        ["show", DESIGN, "--set", "controller.law=constant-torque"], ["controller.torque"],
    ),
    "unknown law": (["show", DESIGN, "--set", "controller.law=pid"], ["pid", "did you mean 'pi'"]),
    "axis without =": (["map", DESIGN, "--axis", "controller.kp"], ["--axis", "path=min:max"]),
    "axis without points": (["map", DESIGN, "--axis", "controller.kp=0:1"], ["min:max:points"]),
    "axis of 2.5 points": (["map", DESIGN, "--axis", "controller.kp=0:1:2.5"], ["2.5", "points"]),
    "axis of one point": (["map", DESIGN, "--axis", "controller.kp=0:1:1"], ["2 points or more"]),
    "axis reversed": (
        ["map", DESIGN, "--axis", "controller.kp=5:1:3"],
        ["map.axes controller.kp", "min 5", "less than max 1"],
    ),
    "axis unknown": (
        ["map", DESIGN, "--axis", "controller.kpp=0:1:3"],
        ["map.axes controller.kpp", "did you mean 'controller.kp'"],
    ),
    "axis with a wrong unit": (
        ["map", DESIGN, "--axis", "operating_point.speed=1 kN:2 kN:3"],
        ["map.axes operating_point.speed", "1 kN", "rpm"],
    ),
    "axis without unit": (
        ["map", DESIGN, "--axis", "operating_point.speed=60:90:3"], ['"60 rpm"'],
    ),
    "axis twice": (["map", DESIGN, *GAINS[:2], *GAINS[:2]], ["two axes", "controller.kp"]),
    "axes of another law": (
        ["map", DESIGN, "--set", "controller.law=constant-torque",
         "--set", "controller.torque=9 kN*m", "--axis", "controller.kp=0:1:2"],
        ["map.axes controller.kp", "controller.torque"],
    ),
    "impossible cell": (
        ["map", "navarro-lopez-4dof", "--axis", "start.speed=1 rad/s:2 rad/s:2",
         "--axis", "controller.kp=0:1:2", "--set", "start.kind=rest"],
        ["start.speed = 1"],
    ),
    "half an element": (
        ["map", DESIGN, "--axis", "drillstring.sections.pipe.elements=1:4:3"],
        ["whole number", "elements"],
    ),
    "too large": (
        ["map", DESIGN, "--axis", "controller.kp=0:1:100000", "--axis", "controller.ki=0:1:100000",
         "--axis", "bha.inertia=1 kg*m^2:2 kg*m^2:100000"],
        ["1,000,000,000,000,000 cells", "GiB", "fewer points"],
    ),
    "too many draws": (
        ["tune", "robust-gains-140kn", "--certificate", "1000000000"],
        ["1,000,000,000 draws", "GiB"],
    ),
    "one enormous axis": (["map", DESIGN, "--axis", "controller.kp=0:1:1000000000"], ["GiB"]),
    "no threads": (["map", DESIGN, "--threads", "0"], ["--threads"]),
    "too many threads": (["map", DESIGN, "--threads", "99999"], ["--threads", "99999"]),
    "negative audit": (["map", DESIGN, "--audit", "-1"], ["map.audit_cells", "-1"]),
    "too many lanes": (["doctor", DESIGN, "--audit", "9" * 20], ["--audit", "1000000000"]),
    "a log of too long a name": (["log", "x" * 5000], ["xxx"]),
    "no modes": (["modes", DESIGN, "--count", "0"], ["count", "0"]),
    "long step": (["map", DESIGN, *SMALL, "--set", "simulation.step=5 s"], ["simulation.step"]),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_wrong_input(call, case):
    arguments, words = WRONG[case]
    code, out, err = call(*arguments)
    assert (code, out) == (2, "")
    assert err.startswith("drillctl: ")
    assert "Traceback" not in err
    for word in words:
        assert word in err
    # One message, and no folder of a run that never was.
    assert err.count("\n") == 1
    assert not Path("runs").exists()


def test_json_is_empty_on_an_error(call):
    code, out, err = call("map", DESIGN, "--axis", "controller.kp=5:1:3", "--json")
    assert (code, out) == (2, "")
    assert err


def test_broken_toml_is_told_with_its_line(call):
    Path("broken.toml").write_text("schema = 1\n[bha]\ninertia = = 3\n")
    code, out, err = call("validate", "broken.toml")
    assert (code, out) == (2, "")
    assert "broken.toml" in err
    assert "line 3" in err


def test_messages_name_file_key_value_and_what_is_allowed(call):
    Path("rig.toml").write_text(f'schema = 1\nmodel = "{DESIGN}"\n[start]\nkind = "tunring"\n')
    _, _, err = call("validate", "rig.toml")
    for word in ("rig.toml", "start.kind", "'tunring'", "'turning'", "wound_up"):
        assert word in err


def test_traceback_only_with_debug(call):
    wrong = ["show", DESIGN, "--set", "controller.kpp=3"]
    assert "Traceback" not in call(*wrong)[2]
    code, out, err = call(*wrong, "--debug")
    assert (code, out) == (2, "")
    assert "Traceback" in err
    assert err.splitlines()[-1].startswith("drillctl: ")


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (SimulationError("step size fell to zero"), "drillctl: step size fell to zero"),
        (
            ZeroDivisionError("by zero"),
            "drillctl: ZeroDivisionError: by zero (--debug prints the traceback)",
        ),
    ],
)
def test_other_failures_are_exit_1(call, monkeypatch, error, words):
    def fail(*arguments, **options):
        raise error

    monkeypatch.setattr("drillctl.simulation.reference.solve", fail)
    code, out, err = call("simulate", DESIGN, *SHORT, "--json")
    assert (code, out, err) == (1, "", f"{words}\n")
    code, out, err = call("simulate", DESIGN, *SHORT, "--json", "--debug")
    assert (code, out) == (1, "")
    assert "Traceback" in err


# --- folders ---------------------------------------------------------------------------------


def test_default_folders_are_numbered(call):
    for number in (1, 2):
        code, out, _ = call("simulate", BISTABLE, *SHORT)
        assert code == 0
        assert out.endswith(f"results: runs/{BISTABLE}-simulate-{number}\n")


def test_out_new_and_empty(call):
    assert call("map", DESIGN, *SMALL, "--out", "new/deep")[0] == 0
    Path("empty").mkdir()
    assert call("map", DESIGN, *SMALL, "--out", "empty")[0] == 0
    assert Path("empty/summary.json").is_file()


def test_out_that_holds_something_else_is_left_alone(call):
    Path("mine").mkdir()
    Path("mine/thesis.txt").write_text("years of work")
    code, out, err = call("map", DESIGN, *SMALL, "--out", "mine")
    assert (code, out) == (2, "")
    assert "--out mine" in err
    assert [p.name for p in Path("mine").iterdir()] == ["thesis.txt"]
    Path("file").write_text("")
    assert "--out file: is a file" in call("map", DESIGN, *SMALL, "--out", "file")[2]


def test_out_that_holds_another_run(call):
    made(call)
    before = Path("made/run.json").read_text()
    other_design = ["map", DESIGN, *SMALL, "--set", "controller.kp=1", "--out", "made"]
    for arguments, word in (
        (other_design, "another design"),
        (["simulate", DESIGN, "--out", "made"], "'map'"),
        (["map", DESIGN, *SMALL, "--audit", "1", "--out", "made"], "other settings"),
    ):
        code, out, err = call(*arguments)
        assert (code, out) == (2, "")
        assert word in err
    assert Path("made/run.json").read_text() == before


def test_out_of_another_version(call, monkeypatch):
    made(call)
    monkeypatch.setattr(drillctl, "__version__", "99.0")
    code, _, err = call("map", DESIGN, *SMALL, "--out", "made")
    assert code == 2
    assert "99.0" in err


@pytest.mark.parametrize("content", ["", "[]", "{}", '"x"', '{"provenance": 3}'])
def test_out_with_a_foreign_run_json(call, content):
    Path("odd").mkdir()
    Path("odd/run.json").write_text(content)
    code, out, err = call("map", DESIGN, *SMALL, "--out", "odd")
    assert (code, out) == (2, "")
    assert "odd" in err
    assert Path("odd/run.json").read_text() == content


def test_out_that_cannot_be_written(call):
    Path("file").write_text("")
    for out, told in (
        ("file/inside", "cannot be written"), ("x" * 300, "too long"), ("a/" * 2000, "too long"),
        ("a::b", "something else than a folder"), ("memory::z", "something else"),
        ("memory://z", "something else"), ("~nobody-at-all/x", "cannot be a folder"),
        ("--json", "is an option: name a folder before it"),
    ):  # fmt: skip
        code, said, err = call("map", DESIGN, *SMALL, "--out", out)
        assert (code, said) == (2, "")
        assert told in err
    assert [*Path().iterdir()] == [Path("file")]


def test_out_without_permission(call, permissions_count):
    Path("locked").mkdir(mode=0o500)
    assert "cannot be written" in call("map", DESIGN, *SMALL, "--out", "locked")[2]
    Path("locked").chmod(0o700)
    assert call("map", DESIGN, *SMALL, "--out", "locked")[0] == 0


def test_impossible_run_leaves_the_folder_for_the_next(call):
    Path("kept").mkdir()
    wrong = [*SMALL, "--set", "simulation.step=5 s"]
    for out in ("kept", "gone"):
        assert call("map", DESIGN, *wrong, "--out", out)[0] == 2
    assert list(Path().iterdir()) == [Path("kept")]
    assert not list(Path("kept").iterdir())
    assert call("map", DESIGN, *SMALL, "--out", "kept")[0] == 0


def test_a_map_of_chosen_measures(call):
    code, out, err = call("map", DESIGN, *SMALL, "--measure", "sticks", "--out", "some", "--json")
    assert code == 0, err
    assert parsed(out)["regions"]
    head = Path("some/map.csv").read_text().splitlines()[0].split(",")
    assert head[2:] == ["j1 (s)", "sticks", "status"]
    assert list(drillctl.open("some").measures) == ["j1", "sticks"]
    # The same again is shown; another choice is another run.
    assert call("map", DESIGN, *SMALL, "--measure", "sticks", "--out", "some")[0] == 0
    assert call("map", DESIGN, *SMALL, "--out", "some")[0] == 2
    code, _, err = call("map", DESIGN, *SMALL, "--measure", "stick", "--out", "none")
    assert code == 2
    assert "--measure" in err
    assert "did you mean 'sticks'" in err
    assert not Path("none").exists()


# --- interruption ----------------------------------------------------------------------------


class Counted:
    """`run_batch` that counts its calls and is interrupted at one of them."""

    def __init__(self, monkeypatch, stop_at=None):
        from drillctl.ensemble import running, sweeps

        self.calls, self.stop_at = 0, stop_at
        self.real = running.run_batch
        monkeypatch.setattr(sweeps, "CHUNK", 7)
        monkeypatch.setattr(running, "run_batch", self)

    def __call__(self, lanes, prepared, give_up):
        self.calls += 1
        if self.calls == self.stop_at:
            raise KeyboardInterrupt
        return self.real(lanes, prepared, give_up)


def test_interrupted_map_goes_on_and_ends_in_the_same_bits(call, monkeypatch):
    undisturbed = drillctl.open(made(call))
    with monkeypatch.context() as patch:
        counted = Counted(patch, stop_at=2)
        code, out, err = call("map", DESIGN, *SMALL, "--out", "cut", "--json")
        assert (code, out) == (130, "")
        assert "Traceback" not in err
        assert "--out cut" in err
        assert err.rstrip().endswith("drillctl: interrupted")
        assert counted.calls == 2
    assert Path("cut/blocks/map/000000.npz").is_file()
    assert not Path("cut/blocks/map/000007.npz").exists()
    assert not Path("cut/summary.json").exists()
    with pytest.raises(drillctl.errors.InputError, match="unfinished run"):
        drillctl.open("cut")
    with monkeypatch.context() as patch:
        counted = Counted(patch)
        assert call("map", DESIGN, *SMALL, "--out", "cut")[0] == 0
        assert counted.calls == 2  # of three blocks, the first was there
    same_bits("cut", undisturbed)
    assert not Path("cut/blocks").exists()


def test_interrupted_in_a_default_folder_says_how_to_go_on(call, monkeypatch):
    Counted(monkeypatch, stop_at=1)
    code, _, err = call("map", DESIGN, *SMALL)
    assert code == 130
    assert f"--out runs/{DESIGN}-map-1" in err


def test_a_string_that_varies_resumes_by_group(call, monkeypatch):
    axes = ["--axis", "bha.inertia=300 kg*m^2:400 kg*m^2:3", *GAINS[:2], "--audit", "0", *SHORT]
    assert call("map", DESIGN, *axes, "--out", "whole")[0] == 0
    with monkeypatch.context() as patch:
        Counted(patch, stop_at=3)
        assert call("map", DESIGN, *axes, "--out", "cut")[0] == 130
    with monkeypatch.context() as patch:
        counted = Counted(patch)
        assert call("map", DESIGN, *axes, "--out", "cut")[0] == 0
        assert counted.calls == 1
    same_bits("cut", drillctl.open("whole"))


def test_unfinished_run_of_other_packages_is_refused(call, rewritten, monkeypatch):
    with monkeypatch.context() as patch:
        Counted(patch, stop_at=2)
        call("map", DESIGN, *SMALL, "--out", "cut")
    rewritten("cut", numpy="0.1")
    code, _, err = call("map", DESIGN, *SMALL, "--out", "cut")
    assert code == 2
    assert "other packages" in err


def kill_after_a_block(arguments, folder, prelude=""):
    """Start a map in another process and kill it once a block is finished."""
    script = f"import sys\n{prelude}\nfrom drillctl.cli import run\nsys.exit(run(sys.argv[1:]))"
    process = subprocess.Popen(
        [sys.executable, "-c", script, *arguments, "--out", folder],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    try:
        deadline = time.monotonic() + 100.0
        while not Path(folder, "blocks", "map", "000000.npz").exists():
            assert process.poll() is None, process.stderr.read()
            assert time.monotonic() < deadline
            time.sleep(0.01)
    finally:
        process.kill()
        process.communicate()
    assert process.returncode == -signal.SIGKILL


def test_killed_map_goes_on_and_ends_in_the_same_bits(call, monkeypatch):
    slow = """
import time
from drillctl.ensemble import running, sweeps
real = running.run_batch
sweeps.CHUNK = 7
def slowly(lanes, prepared, give_up):
    time.sleep(0.3)
    return real(lanes, prepared, give_up)
running.run_batch = slowly
"""
    kill_after_a_block(["map", DESIGN, *SMALL], "killed", slow)
    counted = Counted(monkeypatch)
    assert call("map", DESIGN, *SMALL, "--out", "killed")[0] == 0
    assert counted.calls < 3
    same_bits("killed", drillctl.open(made(call)))


@pytest.mark.slow
def test_killed_large_map_goes_on(call):
    axes = ["--axis", "controller.kp=0:1000:130", "--axis", "controller.ki=0:500:130"]
    arguments = ["map", DESIGN, *axes, "--audit", "0"]
    kill_after_a_block(arguments, "killed")
    again = command(*arguments, "--out", "killed", "--json")
    assert again.returncode == 0, again.stderr
    assert call(*arguments, "--out", "whole")[0] == 0
    same_bits("killed", drillctl.open("whole"))


@pytest.mark.parametrize("left", ["run.part", "nothing", "no design"])
def test_killed_at_birth(call, left):
    """Between making the folder and having written both files."""
    Path("young").mkdir()
    if left == "run.part":
        Path("young/run.part").write_text('{"verb": "m')
    elif left == "no design":
        from drillctl.store import claim

        argued = drillctl.load(DESIGN).replace({"controller.kp": 5.0})
        claim("simulate", argued.replace({"simulation.duration": "10 s"}), "young")
        Path("young/design.toml").unlink()
    settings = ["--set", "controller.kp=5"]
    assert call("simulate", DESIGN, *SHORT, *settings, "--out", "young")[0] == 0
    assert drillctl.open("young").design.tables.controller.kp == 5.0


# --- as a process ----------------------------------------------------------------------------


def test_as_a_process():
    done = command("simulate", BISTABLE, *SHORT, "--json")
    assert done.returncode == 0, done.stderr
    assert parsed(done.stdout)["status"] in ("ok", "not_settled")
    assert done.stderr == f"results: runs/{BISTABLE}-simulate-1\n"
    wrong = command("simulate", BISTABLE, "--set", "bha.inertai=1 kg*m^2", "--json")
    assert (wrong.returncode, wrong.stdout) == (2, "")
    assert "inertia" in wrong.stderr
    assert "Traceback" not in wrong.stderr


def test_interrupted_by_a_signal():
    # The file says that the run has begun: an import that is interrupted may swallow the signal.
    # A shell that starts the tests in the background makes them, and so this process, ignore it.
    slow = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
    slow += "import time, pathlib, drillctl.simulation.run as run\n"
    slow += "wait = lambda *a, **k: (pathlib.Path('begun').touch(), time.sleep(60))\n"
    slow += "run.simulate = wait\n"
    script = f"{slow}from drillctl.cli import run\nimport sys\nsys.exit(run(sys.argv[1:]))"
    process = subprocess.Popen(
        [sys.executable, "-c", script, "simulate", BISTABLE, "--out", "cut", "--json"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    while not Path("begun").exists():
        assert process.poll() is None
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=30)
    assert (process.returncode, out) == (130, "")
    assert "Traceback" not in err


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interruption_within_a_finaliser_is_not_lost(number, code, call, monkeypatch):
    class Last:
        def __del__(self):
            signal.raise_signal(number)

    def endless(*given, **named):
        Last()
        began = time.monotonic()
        while time.monotonic() < began + 20.0:
            time.sleep(0.001)

    monkeypatch.setattr("drillctl.simulation.run.simulate", endless)
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        assert call("simulate", BISTABLE, "--out", "cut")[:2] == (code, "")
    finally:
        signal.signal(signal.SIGINT, handler)
    assert not Path("cut").exists()


# --- what surrounds a command -----------------------------------------------------------------


def shell(text, **options):
    """A command line through the shell, with `drillctl` as a word of it."""
    text = text.replace("drillctl", f"{sys.executable} -m drillctl")
    return subprocess.run(
        ["bash", "-c", text], capture_output=True, text=True, check=False, timeout=120, **options
    )


@pytest.mark.parametrize(
    ("ending", "said"), [(">&-", "closed: nothing can be printed"), (">/dev/full", "No space left")]
)
def test_output_that_cannot_be_written_is_no_success(ending, said):
    done = shell(f"drillctl validate {DESIGN} --json {ending}")
    assert done.returncode == 1
    assert said in done.stderr


def test_without_stderr_the_answer_is_the_same():
    done = shell(f"drillctl validate {DESIGN} --json 2>&-")
    assert done.returncode == 0
    assert parsed(done.stdout)["valid"]


def test_a_reader_that_leaves_and_a_poor_terminal():
    assert shell(f"drillctl show {DESIGN} | head -1").stdout == "schema = 1\n"
    done = shell(f"PYTHONIOENCODING=ascii drillctl validate {DESIGN} --set 'title=\"\u2300 8 in\"'")
    assert done.returncode == 0, done.stderr


def test_a_request_to_terminate_says_how_to_resume(tmp_path):
    axes = [f"--axis=controller.{gain}:300" for gain in ("kp=0:1000", "ki=0:500")]
    words = ["map", DESIGN, *axes]
    with subprocess.Popen(
        [sys.executable, "-m", "drillctl", *words, "--audit", "0", "--out", str(tmp_path / "run")],
        stderr=subprocess.PIPE, text=True,
    ) as running:  # fmt: skip
        while not any((tmp_path / "run").glob("blocks/map/0*.npz")):
            assert running.poll() is None
            time.sleep(0.02)
        running.send_signal(signal.SIGTERM)
        _, said = running.communicate(timeout=60)
    assert running.returncode == 143
    assert "to resume, repeat with --out" in said
    assert "drillctl: terminated" in said


def test_a_choice_that_there_is_not_is_refused_in_plain_words(call):
    code, out, err = call("show", DESIGN, "--units", "imperial")
    assert (code, out) == (2, "")
    assert "Invalid value for '--units': 'imperial' is not one of 'si', 'field'" in err
