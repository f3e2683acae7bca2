"""What is in a log: signals, faults, and windows ranked by their oscillations."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from drillctl import plots, units
from drillctl.store.tables import Column, Quantity, Table, Told, Unit
from drillctl.studies.base import Option, Picture, Study

if TYPE_CHECKING:
    from drillctl.studies.log.compute import LogOverview

MOST_SHOWN = 10  # oscillations of a table on the terminal

FORMULAS = {
    True: "(largest - least) / (2 mean) of the downhole speed",
    False: "(99th - 1st percentile) / (2 mean) of the surface torque, as no downhole speed is "
    "logged; surface speed would miss nearly all of it under a stiff drive",
}
"""Of the stick-slip index, by whether the downhole speed is known."""
STICKING = {
    "downhole speed": "Times at which the bit stands still are those of the downhole speed",
    "waves": "Times at which the bit stands still follow from the waves at the top, with the "
    "string and the drive of the design",
    "": "When the bit stands still is not known: name a design, or log the downhole speed",
}
"""What tells when the bit stood still."""


def tables(result: LogOverview) -> Iterator[Table]:
    """Oscillations by rank, columns, faults, every window."""
    w = result.windows
    heads = (
        Column("rank"), Column("log", hidden=len(result.files) == 1),
        Column("begin", "from", "s", 6),
        Column("end", "to", "s", 6), Column("tonal_share", "tonal share", percent=True, digits=3),
        Column("period", unit="s", digits=3), Column("stick_slip_index", "index", digits=3),
        Column("mean_torque", "mean torque", "N*m", 3), Column("torque_swing", "swing", "N*m", 3),
        Column("mean_speed", "mean top speed", "rad/s", 3),
        Column("mean_weight", "mean weight", "N", 3),
        Column("stuck", "stuck", percent=True, digits=3),
    )  # fmt: skip

    def cells(k: int, begin: float, end: float) -> list[object]:
        return [
            int(w.log[k]) + 1, begin, end,
            *(float(one[k]) for one in (w.share, w.period, w.index, w.torque, w.swing, w.speed,
                                        w.weight, w.stuck)),
        ]  # fmt: skip

    ranked = [[n, *cells(e.best, e.begin, e.end)] for n, e in enumerate(result.events, start=1)]
    title = f"oscillations of {', '.join(result.files)}, the strongest tonal share first"
    yield Table("oscillations", title, heads, ranked[:MOST_SHOWN])
    parts = [[one.quantity.replace("_", " "), one.column, one.unit] for one in result.columns]
    yield Table(
        "columns",
        "columns",
        (Column("quantity"), Column("column"), Column("unit", "read in")),
        parts,
    )
    yield Table(
        "faults", "what is wrong with the log", (Column("fault"), Column("count")),
        [[one.said, one.count] for one in result.faults], shown=bool(result.faults),
    )  # fmt: skip
    every = [[k + 1, *cells(k, float(w.begin[k]), float(w.end[k]))] for k in range(len(w))]
    yield Table("windows", "every window", (Column("window"), *heads[1:]), every, shown=False)
    facts: list[list[object]] = [
        ["rows", str(result.rows), ""], ["samples a second", f"{result.rate:.4g}", ""],
        ["time", Quantity(result.duration, "s"), Unit("s")], ["gaps", str(len(result.gaps)), ""],
    ]  # fmt: skip
    columns = (Column("number"), Column("value"), Column("unit", hidden=True))
    yield Table("log", "the log", columns, facts)


def remarks(result: LogOverview, system: units.System) -> Iterator[str]:
    """What the ranking and the index mean; the worst and a typical window."""
    low, high = result.band
    whose = "0.5 to 1.5 of the string's first frequency" if result.known else "no string was given"
    yield f"Oscillations were looked for at periods of {1 / high:.3g} to {1 / low:.3g} s ({whose})."
    yield f"Index: {FORMULAS[result.windows.from_bit]}."
    yield f"{STICKING[result.sticking_from]}."
    w, worst, typical = result.windows, result.worst, result.typical
    if worst is None or typical is None:
        yield "No window rotates and drills: nothing to rank."
        return
    for name, k in (("Strongest", worst), ("Typical", typical)):
        yield units.told(
            Told(f"{name}: {w.begin[k]:.6g} to {w.end[k]:.6g} s, period {w.period[k]:.3g} s, "
                 f"{w.share[k]:.0%} of the torque's variance, index {w.index[k]:.2g}."), system,
        )  # fmt: skip


def pictures(result: LogOverview) -> Iterator[Picture]:
    """Signals over time with oscillations marked; spectra."""
    yield Picture(
        "log-overview", "Torque, speed and weight over time; the strongest oscillations shaded, "
        "times at which the bit stands still in black below.",
        f"Signals of {len(result.files)} logs over {result.duration:.0f} s; "
        f"{len(result.events)} oscillations, {len(result.sticking)} times at which the bit stands "
        "still.",
        lambda system: plots.log_overview(result, system=system),
    )  # fmt: skip
    if result.spectra:
        yield Picture(
            "log-spectrum", "Spectrum of the torque in the strongest and in a typical window.",
            "Share of the torque's variance over frequency, with the band that was searched and "
            "the frequencies of the string.",
            lambda system: plots.log_spectrum(result),
        )  # fmt: skip


STUDY = Study(
    module=__name__,
    name="log",
    help="Read logs: faults, oscillations, windows ranked",
    group="Describe a rig",
    options=(
        Option("files", list[str], "Read these logs", files=True),
        Option("known", bool, "Take the string from the design", True),
    ),
    command=False,
    python="log_overview",
)  # fmt: skip
