"""Friction from a log: a curve with a band, what the log does not say, and joint draws."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from drillctl import plots, units
from drillctl.store.tables import Column, Quantity, Table, Told, Unit
from drillctl.studies.base import Check, Option, Picture, Recipe, Requested, Run, Section, Study

if TYPE_CHECKING:
    from drillctl.design import Design
    from drillctl.studies.identify.compute import Identification

ENOUGH = 0.95  # share of the returning wave that a good fit explains


def computed(design: Design, run: Run) -> Identification:
    """Fit the logs."""
    from drillctl.studies.identify.compute import identify
    from drillctl.studies.log.compute import named_files

    return identify(design, run.options.get("log") or named_files(design), run.progress)


def tables(result: Identification) -> Iterator[Table]:
    """Coefficients and their intervals; laws; numbers of the rig; the curve; windows; draws."""
    one = result.fitted
    rows = [
        [name, float(value), float(half), said]
        for name, value, half, said in zip(
            one.names, one.values, one.half,
            (result.identifiable.get(name, True) for name in one.names), strict=True,
        )
    ]  # fmt: skip
    columns = (
        Column("coefficient"), Column("value", digits=5), Column("half_width", "within", digits=2),
        Column("identified"),
    )  # fmt: skip
    yield Table("coefficients", f"{one.name}, over the mean weight", columns, rows)
    heads = (
        Column("law"), Column("hold_out", "error of the next window", percent=True, digits=3),
        Column("explained", percent=True, digits=4), Column("residual", "usual residual", "N*m", 3),
        Column("static", "static torque", "N*m"),
    )  # fmt: skip
    laws = [[f.name, f.hold_out, f.explained, f.size, f.static] for f in result.fits]
    yield Table("laws", "laws compared", heads, laws)
    parts = (
        Column("number"), Column("design"), Column("log"), Column("half_width", "within", digits=2),
        Column("unit", hidden=True), Column("fitted"), Column("off", "apart"),
    )  # fmt: skip
    checked = [
        [n.label, *(Quantity(x, n.unit) for x in (n.design, n.log, n.half)), Unit(n.unit),
         n.fitted, n.off]
        for n in result.numbers
    ]  # fmt: skip
    yield Table("rig", "numbers of the rig against the log", parts, checked)
    points = (
        Column("speed", "bit speed", "rad/s"), Column("torque", unit="N*m"),
        Column("low", unit="N*m"), Column("high", unit="N*m"),
    )  # fmt: skip
    lines = (x.tolist() for x in (one.speed, one.torque, one.low, one.high))
    curve = list(map(list, zip(*lines, strict=True)))
    band = f"{100 * result.design.tables.identify.confidence:g} % band"
    yield Table("curve", f"torque at the bit with its {band}", points, curve, shown=False)
    spans = (
        Column("begin", unit="s", digits=6),
        Column("end", unit="s", digits=6),
        Column("sticks"),
    )
    windows = [
        [float(a), float(b), bool(s)]
        for a, b, s in zip(result.begin, result.end, result.sticks, strict=True)
    ]
    yield Table("windows", "windows that were fitted", spans, windows, shown=False)
    trace = result.trace
    names = (
        Column("time", unit="s", digits=8), Column("measured", unit="N*m"),
        Column("predicted", unit="N*m"), Column("bit_speed", unit="rad/s"),
        Column("bit_torque", unit="N*m"),
    )  # fmt: skip
    series = (trace.time, trace.measured, trace.predicted, trace.bit_speed, trace.bit_torque)
    yield Table(
        "trace", "a window of the log beside the fit", names,
        list(zip(*(x.tolist() for x in series), strict=True)), shown=False,
    )  # fmt: skip


def remarks(result: Identification, system: units.System) -> Iterator[str]:
    """What the log says and what it does not."""
    whose = "of the log" if result.weight_known else "of the design"
    yield units.told(Told(f"Mean weight {units.full(result.weight, 'N', 4)}, {whose}."), system)
    for text in result.findings:
        yield units.told(Told(f"{text[0].upper()}{text[1:]}."), system)
    yield (
        f"{len(result.begin)} windows, {int(result.sticks.sum())} with sticks, fitted at "
        f"{result.used_rate:.3g} Hz of {result.rate:.3g} Hz."
    )


def notes(result: Identification) -> Iterator[str]:
    """Where to go on."""
    yield "identified.toml and draws.csv in the folder are for uncertainty and tune"


def checks(result: Identification) -> Iterator[Check]:
    """Whether string and rock explain the log, and the rig's numbers are those of the log."""
    one = result.fitted
    yield Check(
        "Does the fit explain what returns to the top?", bool(one.explained > ENOUGH),
        f"{one.explained:.1%} of it",
    )  # fmt: skip
    off = [n.label for n in result.numbers if n.off]
    yield Check(
        "Are the numbers of the rig those of the log?", not off, ", ".join(off) or "within a tenth"
    )


def pictures(result: Identification) -> Iterator[Picture]:
    """The curve with its band, a window beside the fit, profiles."""
    one = result.fitted
    yield Picture(
        "identified-curve", "Torque at the bit over its speed: the law fitted with its band, the "
        "other laws, and the bit's motion computed from the waves alone.",
        f"Curve of {one.name} from {units.full(one.torque[0], 'N*m', 4)} to "
        f"{units.full(one.torque[-1], 'N*m', 4)}.",
        lambda system: plots.identified_curve(result, system=system),
    )  # fmt: skip
    yield Picture(
        "identified-window", "A window of the log beside the fit: the wave that comes up, what is "
        "left of it, and the speed of the bit.",
        f"Measured and fitted wave; {one.explained:.1%} explained.",
        lambda system: plots.identified_window(result, system=system),
    )  # fmt: skip
    if result.profile:
        yield Picture(
            "identified-profile", "Misfit over each coefficient, the others fitted anew.",
            "Profiles of the objective over the coefficients of the law.",
            lambda system: plots.identified_profile(result, system=system),
        )  # fmt: skip


def files(result: Identification, folder: Path, system: units.System) -> None:
    """The design with the rock of the log, and joint draws."""
    from drillctl.studies.identify.written import write

    write(result, folder)


def without_log(request: Requested) -> str:
    """Why there is nothing to fit to."""
    return "" if request.design.tables.log.files else "the design names no log in [log] files"


STUDY = Study(
    module=__name__,
    name="identify",
    help="Fit friction to a log: curve with band, draws, checks",
    group="Decide",
    options=(
        Option(
            "log", list[str], "Read this log of the rig; repeatable", files=True, metavar="FILE"
        ),
        Option("weight", str, "Set the weight on bit", sets="operating_point.weight_on_bit"),
    ),
    python="identify",
    recipes=(Recipe("identify", "the fit to the log", without_log, order=5),),
    sections=(
        Section(
            "log", "Friction from the log", ("identify",), order=25,
            absent=lambda design: "the design names no log in [log] files",
        ),
    ),
)  # fmt: skip
