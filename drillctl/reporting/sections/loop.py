"""The linear loop: poles, margins, Bode, Nyquist, impedance."""

from __future__ import annotations

from drillctl import plots
from drillctl.plots.loop_pictures import loop_drawings
from drillctl.reporting.blocks import Block, Figure, Table, Text
from drillctl.reporting.gather import Gathered
from drillctl.reporting.words import NOTHING, number, percent

TOLD = {
    "mobility": (
        "Mobility at bit and top: speed per torque, of the string alone and in the loop.",
        "Bode plot of the mobility at bit and top; sharp peaks of the string alone are flattened "
        "in the loop near its first mode.",
    ),
    "closed-loop": (
        "Bode plot from the set speed to the speeds of top and bit.",
        "Magnitude and phase from the set speed to top speed and bit speed.",
    ),
    "nyquist": (
        "Nyquist plot of the loop broken at the top torque, the slope of the rock included.",
        "Nyquist curve with the disk that it stays out of around the critical point.",
    ),
    "sensitivity": (
        "Sensitivities at the top torque.",
        "Magnitude of sensitivity and complementary sensitivity over frequency.",
    ),
    "boundary": (
        "Gains at which steady drilling is stable.",
        "Boundary of the stable gains in the plane of Kp and Ki, with the current gains.",
    ),
    "impedance": (
        "Impedance of the drive and what it reflects; vertical line: the stick-slip frequency.",
        "Drive impedance and reflection coefficient over frequency, the stick-slip frequency "
        "marked.",
    ),
}
"""Caption and text of each picture that is shown."""
ON_PAPER = ("boundary",)
"""Pictures with dark colours of their own."""


def build(gathered: Gathered) -> tuple[Block, ...]:
    """Margins, poles and pictures; the slope margin over the map."""
    study = gathered.need("loop")
    found, words = study.summary, gathered.words
    blocks: list[Block] = [_margins(gathered), _poles(gathered)]
    if found["margins"] is None:
        blocks.append(Text("The loop is not stable: it has no margins at the top.", "warning"))
    for name, draw in loop_drawings(study.result).items():
        if name in TOLD:
            caption, alt = TOLD[name]
            blocks.append(Figure(name, caption, alt, draw, ("loop",), name in ON_PAPER))
    plane = gathered.have("slope-margin")
    if plane is not None:
        best = plane.summary["largest_slope_margin"]
        told = "" if best is None else (
            f" The largest is {words.quantity(best['slope_margin'], 'N*m*s/rad')} at "
            f"{words.place(gathered.design, best['at'])}."
        )  # fmt: skip
        blocks.append(
            Figure(
                "slope-margin", "Slope margin over the map: the falling slope that the loop bears.",
                f"Map of the slope margin; {plane.summary['stable_cells']} of "
                f"{plane.summary['cells']} cells are locally stable.{told}",
                lambda: plots.loop_map(plane.result, system=words.system), ("slope-margin",), True,
            )
        )  # fmt: skip
    return tuple(blocks)


def _margins(gathered: Gathered) -> Table:
    found, words = gathered.need("loop").summary, gathered.words
    disk, margins = found["disk_margin"], found["margins"]
    slope = "N*m*s/rad"
    rows = [
        ("stable", "yes" if found["stable"] else "no"),
        ("falling slope of the rock D", words.quantity(found["slope"], slope)),
        ("slope margin D*", NOTHING if found["slope_margin"] is None
         else words.quantity(found["slope_margin"], slope)),
        ("frequency that decides it", f"{number(found['deciding_frequency_hz'])} Hz"),
        ("the same of the exact continuum", words.quantity(found["continuum_slope_margin"], slope)),
        ("largest real part of the poles", f"{number(found['spectral_abscissa'])} 1/s"),
    ]  # fmt: skip
    if margins is not None and disk is not None:
        rows += [
            ("disk margin: gain", f"{number(disk['gain_db'])} dB"),
            ("disk margin: phase", f"{number(disk['phase_deg'])}°"),
            ("largest sensitivity", number(found["peak_sensitivity"])),
            ("delay at the top torque that is borne", f"{number(found['delay_margin'])} s"),
        ]
    if found["weight_delay_margin"] is not None:
        told = f"{number(found['weight_delay_margin'])} s"
        rows.append(("further delay of the moving weight that is borne", told))
    return Table("margins", "Margins of the loop about steady drilling", ("quantity", "value"),
                 tuple(rows))  # fmt: skip


def _poles(gathered: Gathered) -> Table:
    rows = tuple(
        (str(k), number(mode["frequency_hz"]), percent(mode["damping_ratio"]))
        for k, mode in enumerate(gathered.need("loop").summary["modes"], start=1)
    )
    return Table("closed-loop-modes", "Oscillations of the loop, lowest first",
                 ("pair", "frequency (Hz)", "damping"), rows)  # fmt: skip
