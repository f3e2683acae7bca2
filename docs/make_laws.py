"""Write docs/laws.md, the page of all laws, from their docstrings; and its picture.

python docs/make_laws.py
"""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import numpy as np

from drillctl.rig.bit_rock.law import friction_laws
from drillctl.rig.top_drive import RealDrive, SampledDrive
from drillctl.rig.top_drive.law import drive_laws
from drillctl.rig.weight_on_bit.law import weight_laws

HERE = Path(__file__).resolve().parent

FORMS = tuple(form for law in friction_laws().values() for form in law.forms)
BIT_ROCK = tuple((form.numbers, form.keys, form.use) for form in FORMS)
DRIVE_FORMS = tuple(form for law in drive_laws().values() for form in law.forms)
DRIVES = (
    *(form for form in DRIVE_FORMS if inspect.isclass(form[0])),
    (RealDrive, '`[controller.drive]` around any law (torque_limit, minimum_torque, power_limit, '
     'torque_rate_limit, lag, encoder_lag, torque_lag, anti_windup, tracking_time), and '
     '`law = "z-torque"`, `"torsional-rectification"`, `"active-damping"` with or without it',
     "For limits, for filters that reduce damping, and for drives with torque feedback."),
    (SampledDrive, '`[controller.drive]` with `sampling_period` (10 ms is usual) and '
     '`one_sample_delay`', "For the effect of a digital drive on fast modes."),
)  # fmt: skip
TUNED = tuple(form for form in DRIVE_FORMS if not inspect.isclass(form[0]))
WEIGHTS = tuple(form for law in weight_laws().values() for form in law.forms)


def section(thing: object, keys: str, use: str) -> str:
    """One law: its docstring, how it is written in a design, when it is of use."""
    title, _, rest = inspect.getdoc(thing).partition("\n")
    body, _, attributes = rest.partition("\nAttributes\n----------\n")
    body = body.partition("\nParameters\n----------\n")[0]
    parts = [f"### {thing.__name__}", title, _mathematics(body.strip())]
    parts += [f"In a design: {keys}. {use}"]
    rows = re.findall(r"^(\S.*?) : .*?\n((?:    .*\n?)+)", attributes + "\n", re.M)
    if rows:
        lines = ["| symbol | meaning |", "|---|---|"]
        lines += [f"| `{name}` | {' '.join(text.split())} |" for name, text in rows]
        parts.append("\n".join(lines))
    return "\n\n".join(part for part in parts if part)


def _mathematics(text: str) -> str:
    """Equations of a docstring as a block that Markdown readers set."""

    def block(found: re.Match[str]) -> str:
        return "$$" + " ".join(found.group(1).split()) + "$$\n"

    text = re.sub(r"\.\. math:: ((?:.*\n?)(?:[ ]{4,}.*\n?)*)", block, text)
    return re.sub(r":math:`(.+?)`", r"$\1$", text)


def page() -> str:
    """The page as it should stand."""
    groups = (
        ("Bit-rock laws", "Torque T (N m) on a bit that turns at speed w (rad/s) under the weight "
         "W (N). Positive torque brakes. *Set-valued* laws hold a bit at rest; under smooth ones "
         "it creeps.\n\n![Torque over speed](laws.png)", BIT_ROCK),
        ("Top-drive laws", "Torque (N m) of the drive from the speed of its own inertia. All "
         "are published laws, except the tuning rule of active damping.\n\n"
         "![Impedance and reflection of six drives](drives.png)", DRIVES),
        ("Top drives tuned to the string", "Numbers from pipe impedance, drive inertia and the "
         "lowest frequency of the string.", TUNED),
        ("Weight-on-bit laws", "Weight W (N) on a bit that turns at speed w (rad/s).\n\n"
         "![Weight against a bit speed that falls to zero](weights.png)", WEIGHTS),
    )  # fmt: skip
    parts = ["# Laws", "Every law of rock, drive and weight: equation, symbols, source and key "
             "in a design. Generated from the docstrings by `docs/make_laws.py`."]  # fmt: skip
    for title, text, laws in groups:
        parts += [f"## {title}", text, *(section(*law) for law in laws)]
    return "\n\n".join(parts) + "\n"


def picture(path: Path) -> None:
    """Torque over speed of each bit-rock law, at one weight."""
    from drillctl.plots import style
    from drillctl.units import RPM

    weight = 140e3
    curves = [curve for form in FORMS for curve in form.curves]
    speed = np.concatenate([np.linspace(0.0, 1.0, 200), np.linspace(1.0, 21.0, 400)])
    figure, ax = style.axes_or_new(None, 8.0, 4.8)
    for number, (name, law) in enumerate(curves):
        torque, _ = law.torque_and_slope(weight, speed, np.exp)
        look = {"color": style.COLOURS[number], "linestyle": style.DASHES[number % 4]}
        ax.plot(speed / RPM, torque / 1e3, linewidth=style.LINE, label=name, **look)
        if law.set_valued:
            ax.plot([0.0, 0.0], [0.0, law.static_torque(weight) / 1e3], linewidth=3.0,
                    color=look["color"], alpha=0.4)  # fmt: skip
    style.dress(ax, "bit speed (rpm)", "bit torque (kN m)", "Bit-rock laws at 140 kN")
    ax.legend(fontsize=style.SMALL, frameon=False)
    figure.savefig(path, dpi=110)


SIX = {
    "PI, Kp 625, Ki 125": {"law": "pi", "kp": 625.0, "ki": 125.0},
    "stiff speed control": {"law": "stiff-speed"},
    "soft torque": {"law": "soft-torque"},
    "Z-torque, a = 0.5": {"law": "z-torque", "absorption": 0.5},
    "torsional rectification": {"law": "torsional-rectification"},
    "active damping": {"law": "active-damping"},
}


def drives(path: Path) -> None:
    """Impedance and reflection of six drives on the paper's string."""
    import drillctl
    from drillctl.linear import drive_impedance
    from drillctl.linear.tuning import stick_slip_frequency

    designs = {
        name: drillctl.load("monteiro-trindade-100kn", controller=law) for name, law in SIX.items()
    }
    found = [drive_impedance(design, label=name) for name, design in designs.items()]
    mark = stick_slip_frequency(designs["soft torque"].string) / (2.0 * np.pi)
    drillctl.plots.drive_impedance(found, marks=(mark,)).savefig(path, dpi=110)


def weights(path: Path) -> None:
    """Weight of each law in one run of stick-slip, beside the bit speed."""
    import drillctl
    from drillctl.plots import style
    from drillctl.units import RPM

    limits = {"minimum": "42 kN", "maximum": "182 kN"}
    following = {"law": "navarro-lopez-suarez", "gain": "2 kN*s/rad"} | limits
    late = {"delay": "1 s", "hoist_lag": "0.5 s"}
    laws = {
        "ideal": following,
        "1 s late, hoist 0.5 s": following | {"path": late},
        "observed, hoist 0.5 s": following
        | {"law": "surface-observer", "path": {"hoist_lag": "0.5 s"}},
        "alarm": {"law": "stick-slip-alarm", "path": {"hoist_lag": "0.5 s"}},
    }
    gains = {"controller.kp": 200.0, "controller.ki": 100.0, "simulation.duration": "60 s"}
    figure, grid = style.grid_or_new(None, len(laws), 1, 8.0, 9.0, share_x=True)
    panels = np.ravel(grid)
    for number, (name, law) in enumerate(laws.items()):
        design = drillctl.load("monteiro-trindade-140kn", weight_on_bit=law, **gains)
        run = drillctl.simulate(design, engine="batch", interval=0.05)
        ax = panels[number]
        ax.plot(run.time, run.signals["weight_on_bit"] / 1e3, linewidth=style.LINE,
                color=style.COLOURS[0])  # fmt: skip
        beside = ax.twinx()
        beside.plot(run.time, run.signals["bit_speed"] / RPM, linewidth=1.0, color=style.COLOURS[1],
                    linestyle=style.DASHES[1])  # fmt: skip
        beside.set_ylabel("bit (rpm)", fontsize=style.SMALL, color=style.COLOURS[1])
        style.dress(ax, "time (s)" if number == len(laws) - 1 else "", "WOB (kN)", name)
        ax.set_ylim(0.0, 200.0)
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    (HERE / "laws.md").write_text(page(), encoding="utf-8")
    picture(HERE / "laws.png")
    drives(HERE / "drives.png")
    weights(HERE / "weights.png")
