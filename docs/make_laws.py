"""Write docs/laws.md, the page of all laws, from their docstrings; and its picture.

python docs/make_laws.py
"""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import numpy as np

from drillctl.bit_rock import (
    JansenVanDenSteen,
    NavarroLopezSuarez,
    OverWeight,
    PrintedThreeBranch,
    Stribeck,
    Tabulated,
    TuckerWang,
    tabulated,
)
from drillctl.linear import tuning
from drillctl.top_drive import PI, ConstantTorque
from drillctl.weight_on_bit import ConstantWeight, FollowingSpeed

HERE = Path(__file__).resolve().parent

BIT_ROCK = (
    (NavarroLopezSuarez, '`law = "navarro-lopez-suarez"` (a1, a2, beta, or a table over the weight '
     'on bit); `law = "bit-radius-friction"` (the same with bit radius and friction coefficients)',
     "The paper's law and the default of the shipped designs."),
    (OverWeight, '`law = "navarro-lopez-suarez"` with a `table` and a weight on bit that moves',
     "Taken by itself wherever the weight changes while the bit drills."),
    (PrintedThreeBranch, '`law = "printed-three-branch"` (a1, a2, beta, or a table over the weight '
     'on bit; tolerance, by default `"1e-4 rad/s"`)',
     "To see what the paper's own numerical stand-in does beside the set, one run at a time: the "
     "reference solver locates where its torque jumps; the batch engine refuses it by name."),
    (JansenVanDenSteen, '`law = "jansen-van-den-steen"` (a1, a2), `law = "coulomb"` (a)',
     "To tell what the static peak does from what the falling slope does."),
    (Tabulated, '`law = "tabulated"` (points, static)', "For measured torque over speed."),
    (TuckerWang, '`law = "tucker-wang"` (a, b1, b2, b3)', "To compare with the literature."),
    (Stribeck, '`law = "stribeck"`, or `regularised_over` with either form of the first law',
     "To compare with simulators that regularise; `drillctl regularisation` says what that "
     "costs."),
)  # fmt: skip
DRIVES = (
    (PI, '`law = "pi"` (kp, ki)', "Speed control as in the paper."),
    (ConstantTorque, '`law = "constant-torque"` (torque)', "A drive at its torque limit."),
)
TUNED = (
    (tuning.stiff_speed, '`law = "stiff-speed"` (stiffness, rate)', "A PI; reflects all waves."),
    (tuning.soft_torque, '`law = "soft-torque"` (share)', "A PI; takes waves at the stick-slip "
     "frequency."),
)  # fmt: skip
WEIGHTS = (
    (ConstantWeight, '`law = "constant"`', "The default."),
    (FollowingSpeed, '`law = "navarro-lopez-suarez"` (gain, minimum, maximum)',
     "What dynamic weight on bit could do at best: no delay, no hoist."),
)  # fmt: skip


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
         "W (N). Positive torque brakes. *Set-valued* laws hold a bit at rest; smooth ones let it "
         "creep.\n\n![Torque over speed](laws.png)", BIT_ROCK),
        ("Top-drive laws", "Torque (N m) of the drive from the speed of its own inertia.", DRIVES),
        ("Top drives tuned to the string", "A PI whose gains follow from pipe impedance, drive "
         "inertia and the lowest frequency of the string.", TUNED),
        ("Weight-on-bit laws", "Weight W (N) on a bit that turns at speed w (rad/s).", WEIGHTS),
    )  # fmt: skip
    parts = ["# Laws", "Every law of rock, drive and weight: its equation, symbols, source and "
             "how a design names it. Made from the docstrings by `docs/make_laws.py`."]  # fmt: skip
    for title, text, laws in groups:
        parts += [f"## {title}", text, *(section(*law) for law in laws)]
    return "\n\n".join(parts) + "\n"


def picture(path: Path) -> None:
    """Torque over speed of each bit-rock law, at one weight."""
    from drillctl.plots import style
    from drillctl.units import RPM

    weight = 140e3
    laws = {
        "Navarro-Lopez & Suarez, 140 kN": NavarroLopezSuarez(0.026, 0.085, 0.098),
        "the same, regularised over 0.5 rad/s": Stribeck(0.085, 0.026, 0.098, 2.0),
        "Jansen & van den Steen": JansenVanDenSteen(0.047, 0.085),
        "tabulated": tabulated(0.09, (0.0, 3.0, 8.0, 20.0), (0.085, 0.06, 0.05, 0.035)),
        "Tucker & Wang": TuckerWang(0.0239, 1.91, 8.5, 5.47),
        "Stribeck, R 0.1 m": Stribeck(0.08, 0.05, 1.0, 20.0),
    }
    speed = np.concatenate([np.linspace(0.0, 1.0, 200), np.linspace(1.0, 21.0, 400)])
    figure, ax = style.axes_or_new(None, 8.0, 4.8)
    for number, (name, law) in enumerate(laws.items()):
        torque, _ = law.torque_and_slope(weight, speed, np.exp)
        look = {"color": style.COLOURS[number], "linestyle": style.DASHES[number % 4]}
        ax.plot(speed / RPM, torque / 1e3, linewidth=style.LINE, label=name, **look)
        if law.set_valued:
            ax.plot([0.0, 0.0], [0.0, law.static_torque(weight) / 1e3], linewidth=3.0,
                    color=look["color"], alpha=0.4)  # fmt: skip
    style.dress(ax, "bit speed (rpm)", "bit torque (kN m)", "Bit-rock laws at 140 kN")
    ax.legend(fontsize=style.SMALL, frameon=False)
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    (HERE / "laws.md").write_text(page(), encoding="utf-8")
    picture(HERE / "laws.png")
