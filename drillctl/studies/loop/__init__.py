"""What a control engineer wants to know of a loop before any simulation."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drillctl import units
from drillctl.store.tables import Column, Quantity, Table, Unit
from drillctl.studies.base import Option, Picture, Recipe, Run, Section, Study

if TYPE_CHECKING:
    from drillctl.design import Design
    from drillctl.linear.loop_analysis import LoopAnalysis
    from drillctl.linear.regenerative import CuttingLoop

SHOWN = 10  # oscillating poles in the table
SLOPE = "N*m*s/rad"


def computed(design: Design, run: Run) -> LoopAnalysis:
    """The loop, with the map over the axes of the design unless it is left out."""
    from drillctl.linear.loop_analysis import loop
    from drillctl.studies.loop.compute import mapped_loop

    run.progress.begin("analysing the loop", 1)
    return loop(design) if run.options["no_map"] else mapped_loop(design, run.progress)


def tables(result: LoopAnalysis) -> Iterator[Table]:
    """Steady drilling, margins, oscillating poles; the map, if there is one."""
    from drillctl.studies.loop_mapping import tables as of_map

    pair = (Column("quantity"), Column("value"), Column("unit", hidden=True))
    own = not result.mesh_limited  # no figure is the mesh's
    more = (*pair, Column("mesh", hidden=own), Column("exact_string", "exact string", hidden=own))
    yield Table("operating-point", "steady drilling", pair, _operating_point(result))
    yield Table("margins", "margins of the loop about steady drilling", more, _margins(result))
    columns = (
        Column("pair"), Column("frequency", unit="Hz", digits=6),
        Column("damping_ratio", "damping", percent=True),
    )  # fmt: skip
    poles = [[k, *one] for k, one in enumerate(result.oscillations[:SHOWN], start=1)]
    yield Table("closed-loop-modes", "oscillations of the loop, lowest first", columns, poles)
    if result.cutting is not None:
        yield from _cutting(result.cutting)
    if getattr(result, "map", None) is not None:
        yield from of_map(result.map)  # type: ignore[attr-defined]


def _cutting(cutting: CuttingLoop) -> Iterator[Table]:
    """Roots of a bit that cuts its own wake."""
    columns = (
        Column("pair"), Column("growth", unit="1/s", digits=6),
        Column("frequency", unit="Hz", digits=6),
    )  # fmt: skip
    rows = [
        [k, float(root.real), float(root.imag) / (2.0 * math.pi)]
        for k, root in enumerate(cutting.roots[:SHOWN], start=1)
    ]
    title = f"roots of the cutting bit up to {cutting.limit_hz:.3g} Hz, rightmost first"
    yield Table("cutting-roots", title, columns, rows)


def _operating_point(result: LoopAnalysis) -> list[list[Any]]:
    requested, steady = result.design.tables.operating_point, result.operating_point
    rows: tuple[tuple[str, float | None, str], ...] = (
        ("set speed", requested.speed, "rad/s"),
        ("weight on bit", requested.weight_on_bit, "N"),
        ("speed of steady drilling", steady.speed, "rad/s"),
        ("bit torque at that speed", steady.bit_torque, "N*m"),
        ("falling slope of the rock, −dT/dω", steady.slope, SLOPE),
        ("falling slope that the loop tolerates, D*", result.slope_margin, SLOPE),
    )
    if result.bit_side.path is None:  # a weight that is late is another one at each speed
        rows += (
            ("critical speed (stability changes)", result.critical_speed, "rad/s"),
            ("nearest weight at which stability changes", result.critical_weight_on_bit, "N"),
        )
    cut = result.cutting
    if cut is not None:
        rows += (
            ("depth of cut in a turn", cut.depth_of_cut, "m"),
            ("rate of penetration", cut.rate_of_penetration, "m/s"),
            ("speed above which axial motion alone is stable", cut.boundary_speed, "rad/s"),
            ("roots in the right half-plane", float(cut.unstable_roots), "1"),
        )
    return [[name, _or_none(value, unit), Unit(unit)] for name, value, unit in rows]


def _margins(result: LoopAnalysis) -> list[list[Any]]:
    rows: list[tuple[str, float | None, str, str]] = [
        ("largest real part of the poles", result.spectral_abscissa, "1/s", ""),
        ("falling slope of the rock, −dT/dω", result.operating_point.slope, SLOPE, ""),
        ("slope margin D*", result.slope_margin, SLOPE, "slope_margin"),
        ("deciding frequency", result.deciding_frequency_hz, "Hz", ""),
    ]
    settles = result.mesh_limited.get("slope_margin", 0.0) is not None  # over modes of the string
    if result.continuum_slope_margin is not None and settles:
        rows.append(("slope margin of the continuous string", result.continuum_slope_margin, SLOPE,
                     ""))  # fmt: skip
    margins = result.margins
    if margins is not None:
        rows += [
            ("disk margin: gain", margins.gain_db, "dB", "disk_gain_db"),
            ("disk margin: phase", margins.phase_deg, "deg", "disk_phase_deg"),
            ("largest sensitivity", margins.peak_sensitivity, "1", "peak_sensitivity"),
            ("frequency of the largest sensitivity", margins.peak_sensitivity_hz, "Hz", ""),
            ("delay at the top torque that is tolerated", margins.delay, "s", "delay_margin"),
            ("its deciding frequency", margins.delay_hz, "Hz", ""),
        ]
    if result.weight_delay_margin is not None:
        rows.append(("further delay of the moving weight that is tolerated",
                     result.weight_delay_margin, "s", "weight_delay_margin"))  # fmt: skip
    stable: list[Any] = ["stable", "yes" if result.stable else "no", "", "", ""]
    return [stable, *map(partial(_margin_row, result.mesh_limited), rows)]


def _margin_row(
    limited: dict[str, float | None], row: tuple[str, float | None, str, str]
) -> list[Any]:
    """A figure, and beside one that the mesh decides that of the exact string."""
    head, value, unit, name = row
    own = [head, _or_none(value, unit), Unit(unit)]
    if name not in limited:
        return [*own, "", ""]
    exact = limited[name]
    return [*own, "mesh-limited", _or_none(exact, unit)]


def _or_none(value: float | None, unit: str) -> str | Quantity:
    """A figure, or that there is none."""
    return "none" if value is None or math.isnan(value) else Quantity(value, unit)


def pictures(result: LoopAnalysis) -> Iterator[Picture]:
    """Frequency responses, gains and impedance; the slope margin over the map."""
    from drillctl.studies.loop.compute import loop_pictures
    from drillctl.studies.loop_mapping import pictures as of_map

    yield from loop_pictures(result)
    if getattr(result, "map", None) is not None:
        yield from of_map(result.map)  # type: ignore[attr-defined]


def remarks(result: LoopAnalysis, system: units.System) -> Iterator[str]:
    """Why there may be no margins; what a limit of the rate brings into the loop."""
    if result.cutting is not None:
        yield (
            "Stability is that of the roots of the cutting bit; slope margin and poles are of its "
            "steady torque alone, which does not fall."
        )
    if result.margins is None:
        yield "The loop is not stable: it has no margins at the top torque."
    if result.mesh_limited:
        yield (
            "Figures marked mesh-limited are decided by the last modes of the mesh: with other "
            "elements they change. Use the value of the exact string beside them, where it has "
            "one, or give the string its damping (drillstring.sections.NAME.stiffness_damping, "
            "usually 1e-3 s)."
        )
    drive = result.design.tables.controller.drive
    if drive.motor_lag > drive.lag:
        yield (
            f"The limit of the torque's rate comes with a lag of {drive.motor_lag * 1e3:g} ms, "
            "here as in a run; set controller.drive.lag for a longer one."
        )


def notes(result: LoopAnalysis) -> Iterator[str]:
    """Why there is no map, or not all of it."""
    from drillctl.studies.loop.compute import MOST_NODES, MOST_ROOTS, MappedLoop, large

    if not isinstance(result, MappedLoop):
        return
    if result.no_map:
        yield f"no map: {result.no_map}"
    elif result.map is not None and result.design.axial is not None:
        yield (
            f"map of the roots over {MOST_ROOTS} points of an axis at most; in Python "
            "drillctl.studies.loop_map takes any"
        )
    elif result.map is not None and large(result.design):
        yield (
            f"map of the slope margin alone, no root locus: {result.design.string.nodes} nodes; up "
            f"to {MOST_NODES} the poles are computed for every cell"
        )


def files(result: LoopAnalysis, folder: Path, system: units.System) -> None:
    """The linear models for MATLAB and NumPy."""
    from drillctl.linear.export import write_matrices

    for name in ("model.mat", "model.npz"):
        write_matrices(result.design, folder / name)


STUDY = Study(
    module=__name__,
    name="loop",
    help="Analyse stability and margins, map the slope margin",
    group="Analyse the loop",
    options=(Option("no_map", bool, "Leave out the map over the axes of [map]", False),),
    axes=True,
    python="loop",
    call="drillctl.linear.loop_analysis:loop",
    recipes=(Recipe("loop", "the loop", options={"no_map": True}, order=10),),
    sections=(
        Section(
            "operating-point", "Operating point and friction", ("loop", "modes"), order=20,
            shows=("operating-point", "friction"),
            text="Friction is set-valued here: a bit at rest bears any torque up to the static "
            "one. A falling slope feeds torsional oscillation; the loop tolerates a slope up to "
            "its margin.",
        ),
        Section(
            "loop", "The linear loop", ("loop", "slope-margin"), order=40,
            shows=("margins", "remarks", "closed-loop-modes", "mobility", "closed-loop", "nyquist",
                   "nichols", "sensitivity", "boundary", "root-locus", "impedance",
                   "slope-margin", "cutting-roots"),
        ),
    ),
)  # fmt: skip
