"""Logs of every format read the same; faults are named; windows ranked."""

import json

import numpy as np
import pytest

from drillctl.cli import run
from drillctl.errors import InputError
from drillctl.logs.record import read_log
from drillctl.logs.windows import band_of, events_of, windows_of
from drillctl.units import RPM

RATE = 10.0


def made(seconds=900.0):
    """Time (s), torque (kN m), speed (rpm): a tone of 7 s from 300 to 600 s, a ramp before it."""
    random = np.random.default_rng(3)
    time = np.arange(round(seconds * RATE)) / RATE
    tone = np.where((time > 300) & (time < 600), 2.0 * np.sin(2 * np.pi * time / 7.0), 0.0)
    torque = 8.0 + tone + 0.3 * random.standard_normal(len(time)) + 4.0 * (time < 150)
    return time, torque, 100.0 + 0.5 * random.standard_normal(len(time))


TIME, TORQUE, SPEED = made()


def csv(
    path, head="time_s,topdrive_torque_kNm,TDRPM (rpm)", columns=(TIME, TORQUE, SPEED), sep=","
):
    lines = [sep.join(f"{x:.6g}" for x in row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join([head, *lines]) + "\n")
    return path


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    return read_log(csv(tmp_path_factory.mktemp("log") / "a.csv"))


def test_si_units(log):
    assert log.signals["top_torque"] == pytest.approx(1e3 * TORQUE, rel=1e-5)
    assert log.signals["top_speed"] == pytest.approx(RPM * SPEED, rel=1e-5)
    assert log.spacing == pytest.approx(0.1)
    assert not log.faults


@pytest.mark.parametrize(
    "kind", ["semicolon", "units row", "blank", "parquet", "mat5", "mat73", "las", "dates"]
)
def test_every_format_reads_the_same(kind, tmp_path, log):
    columns = {"time_s": TIME, "torque_kNm": TORQUE, "speed_rpm": SPEED}
    path = tmp_path / "b.csv"
    if kind == "semicolon":
        csv(path, "Zeit;x", (TIME, TORQUE, SPEED), ";")
        text = path.read_text().replace("Zeit;x", "time (s);Torque (kN.m);RPM").replace(".", ",")
        path.write_text(text.replace("kN,m", "kN.m"))
    elif kind == "units row":
        csv(path, "# made\nTime,Top Drive Torque,Top Drive RPM\ns,kN.m,rpm")
    elif kind == "blank":
        csv(path, "time_s torque_kNm speed_rpm", sep="  ")
    elif kind == "dates":
        stamps = np.datetime64("2024-05-01T12:00:00") + np.round(1e3 * TIME).astype(
            "timedelta64[ms]"
        )
        rows = zip(stamps.astype(str), TORQUE, SPEED, strict=True)
        lines = [f"{a},{b:.6g},{c:.6g}" for a, b, c in rows]
        path.write_text("\n".join(["timestamp,torque_kNm,speed_rpm", *lines]))
    elif kind == "parquet":
        arrow = pytest.importorskip("pyarrow")
        path = tmp_path / "b.parquet"
        __import__("pyarrow.parquet").parquet.write_table(arrow.table(columns), path)
    elif kind == "mat5":
        path = tmp_path / "b.mat"
        __import__("scipy.io").io.savemat(path, columns)
    elif kind == "mat73":
        path = tmp_path / "b.mat"
        with pytest.importorskip("h5py").File(path, "w") as file:
            for name, values in columns.items():
                file[name] = values.reshape(1, -1)
    else:
        path = tmp_path / "b.las"
        las = pytest.importorskip("lasio").LASFile()
        las.append_curve("TIME", TIME, unit="s")
        las.append_curve("TQA", TORQUE, unit="kN.m")
        las.append_curve("RPM", SPEED, unit="rpm")
        las.write(str(path), version=2.0)
    read = read_log(path)
    assert read.time == pytest.approx(log.time, abs=2e-6)
    for name in ("top_torque", "top_speed"):
        assert read.signals[name] == pytest.approx(log.signals[name], rel=2e-5)


def test_what_is_wrong_is_named(tmp_path):
    time, torque, speed = made()
    time[4000:] += 60.0
    time[100] = time[99]
    torque[2000] = 90.0
    torque[6000:6400] = 8.25
    torque = np.minimum(torque, 9.5 + (TIME < 201) * 90.0)
    log = read_log(csv(tmp_path / "a.csv", columns=(time, torque, speed)))
    said = " / ".join(fault.said for fault in log.faults)
    assert "1 rows repeat a time stamp" in said
    assert "1 gaps, 60 s in all: 399.9-460 s" in said
    assert "stands still under rotation for 39.9 s" in said
    assert log.gaps == [(pytest.approx(399.9), pytest.approx(460.0))]
    assert not log.usable[6100 - 1]
    (outlier,) = [fault for fault in log.faults if "outliers" in fault.what]
    assert outlier.intervals == ((pytest.approx(200.0), pytest.approx(200.0)),)
    for part in log.stretches:
        assert np.diff(log.time[part]).max() < 0.25


def test_dates_with_dots_are_of_the_day_first_and_any_column_may_hold_them(tmp_path):
    rows = [f"{day:02}.03.2024 {clock};{k},5;100,0" for k, (day, clock) in enumerate(
        (1 + n // 20, f"23:59:{40 + n}" if n < 20 else f"00:00:{n - 20:02}") for n in range(40)
    )]  # fmt: skip
    path = tmp_path / "a.csv"
    path.write_text("Zeit;Torque (kN m);RPM (1/min)\n" + "\n".join(rows), encoding="cp1252")
    log = read_log(path, {"time": ("Zeit", "")})
    assert log.time == pytest.approx(np.arange(40.0))
    assert log.signals["top_torque"][3] == pytest.approx(3500.0)


def test_a_clock_begins_again_at_midnight(tmp_path):
    seconds = [int(86380 + k) % 86400 for k in range(40)]
    rows = [f"2024/03/01,{k // 3600:02}:{k // 60 % 60:02}:{k % 60:02},{k % 7},100" for k in seconds]
    path = tmp_path / "a.csv"
    path.write_text("YYYY/MM/DD,HH:MM:SS,Torque (kN m),RPM\n" + "\n".join(rows))
    log = read_log(path)
    assert log.time == pytest.approx(np.arange(40.0))
    assert not log.faults


def rows(torque="8000", speed="100", time=lambda k: k / 10, end=""):
    lines = [f"{time(k)!r},{torque},{speed}{end}" for k in range(1600)]
    return "\n".join(["time_s,torque_Nm,speed_rpm" + (",wob_kN,dhrpm_rpm" if end else ""), *lines])


@pytest.mark.parametrize(("content", "words"), [
    (rows("nan"), "holds no values of top torque"),
    (rows("1e400", "1e30"), "holds no values of top speed"),
    (rows(time=lambda k: k * 1e300), "holds 1 rows"),
    (rows().replace("8000", "x"), "holds no values of top torque"),
])  # fmt: skip
def test_a_log_of_nothing_is_refused(content, words, tmp_path):
    (tmp_path / "a.csv").write_text(content)
    with pytest.raises(InputError, match=words):
        read_log(tmp_path / "a.csv")


@pytest.mark.parametrize("content", [
    rows("0", "0"), rows("1e-308", "1e-320"), rows("-8000", "-100"),
    rows(time=lambda k: k * 1e-12), rows(end=",nan,"), rows("9e14", "9e14", end=",1e40,0"),
    rows(end=",140,90").replace(",140,90", ",,", 900),
])  # fmt: skip
def test_any_numbers_are_ranked_without_a_warning(content, tmp_path):
    lines = content.split("\n")
    lines = [line.replace(",8000,", f",{8000 + k % 13},") for k, line in enumerate(lines)]
    (tmp_path / "a.csv").write_text("\n".join(lines))
    with np.errstate(all="raise", under="ignore"):
        assert run(["log", str(tmp_path / "a.csv"), "--out", str(tmp_path / "run"), "--json"]) == 0


def test_a_file_that_breaks_is_named(tmp_path, log):
    for name, content in (("a.mat", b""), ("a.las", b"x"), ("a.parquet", b"x")):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputError, match=f"{name}: (cannot be read|needs the package)"):
            read_log(tmp_path / name)
    text = csv(tmp_path / "a.csv").read_text()
    (tmp_path / "a.csv").write_bytes(text.encode("utf-16"))
    assert len(text) > 2**17
    assert read_log(tmp_path / "a.csv").time.tobytes() == log.time.tobytes()
    (tmp_path / "a.csv").write_bytes(text[:100_000].encode() + b"\xe9" + text[100_000:].encode())
    assert sum(fault.count for fault in read_log(tmp_path / "a.csv").faults) < 5
    (tmp_path / "a.csv").write_text(text[:100_000] + '\n"' + text[100_000:])
    with pytest.raises(InputError, match=r"a\.csv: cannot be read: Error tokenizing"):
        read_log(tmp_path / "a.csv")


@pytest.mark.parametrize(
    ("head", "words"),
    [
        ("time_s,torque,speed_rpm", "names no unit of top torque"),
        ("time_s,torque (furlong),speed_rpm", "names no unit of top torque"),
        ("time_s,depth_m,speed_rpm", "no column looks like top torque"),
        ("time_s,torque_kNm,torque_Nm", "'torque_kNm', 'torque_Nm' all look like top torque"),
    ],
)
def test_wrong_columns_are_refused(head, words, tmp_path):
    with pytest.raises(InputError, match=words):
        read_log(csv(tmp_path / "a.csv", head))


def test_the_tone_is_ranked_first_and_windows_keep_to_stretches(log):
    windows = windows_of((log,), band_of(None), 100.0)
    first = events_of(windows)[0]
    assert windows.period[first.best] == pytest.approx(7.0, abs=0.05)
    assert windows.share[first.best] > 0.8
    assert first.begin >= 249.0
    assert first.end <= 650.0
    assert windows.swing.argmax() != first.best  # the step is larger


@pytest.mark.parametrize(("rows", "twice"), [
    (slice(None), True), (slice(3000, 4000), True), (slice(8000, None), True), (None, False),
])  # fmt: skip
def test_rows_are_not_counted_twice(rows, twice, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    whole = np.array([TIME, TORQUE, SPEED])
    more = np.concatenate([whole[:, rows], whole[:, :100] + 0.3], axis=1) if twice else whole + 0.3
    csv(tmp_path / "a.csv")
    csv(tmp_path / "b.csv", columns=[np.arange(more.shape[1]) / RATE, *more[1:]])
    for order in (["a.csv", "b.csv"], ["b.csv", "a.csv"]):
        assert run(["log", *order]) == 2 * twice
        told = f"drillctl: {order[1]}: holds rows of {order[0]}: give each row once\n"
        assert (told == capsys.readouterr().err) == twice


def test_the_command(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    csv(tmp_path / "a.csv", "t,TQ,RPM")
    assert run(["log", "a.csv", "--json"]) == 2
    assert "names no unit of time" in capsys.readouterr().err
    sets = ["--set", "log.time.unit=s", "--set", "log.top_torque.unit=kN*m"]
    assert run(["log", "a.csv", *sets, "--set", "log.window=0.5 s"]) == 2  # a period of nan
    told = "log.window: 0.5 s is less than two of the shortest period looked for, 3 s"
    assert told in capsys.readouterr().err
    assert run(["log", "a.csv", "--json", "--out", "o", *sets, "--set", "log.window=100 s"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["rows"] == len(TIME)
    assert found["windows"][0]["period"] == pytest.approx(7.0, abs=0.05)
    assert (tmp_path / "o" / "log-overview.png").stat().st_size > 5000
    assert (tmp_path / "o" / "oscillations.csv").is_file()
