"""Every symbol and word of a report, with its unit."""

from __future__ import annotations

from drillctl.reporting.blocks import Block, Table
from drillctl.reporting.gather import Gathered
from drillctl.reporting.words import Words


def entries(words: Words) -> tuple[tuple[str, str, str], ...]:
    """Symbol or word, meaning and unit."""
    speed, torque, force = (words.unit(unit) for unit in ("rad/s", "N*m", "N"))
    slope, length = words.unit("N*m*s/rad"), words.unit("m")
    return (
        ("J1", "integral of |bit speed − set speed| / set speed over the run; small is good", "s"),
        ("level", "value of J1 that regions and probabilities are told for", "s"),
        ("region", "cells of the map with J1 at or under a level", "cells, %"),
        ("Kp", "proportional gain of the top drive: torque per speed error", "N m s"),
        ("Ki", "integral gain: torque per integral of the speed error", "N m"),
        ("ω", "speed; set speed: what the drive is asked to hold", speed),
        ("WOB", "weight on bit", force),
        ("bit torque", "of the rock on the bit, positive when it brakes", torque),
        ("top torque", "of the drive", torque),
        ("pipe torque", "in the uppermost element, positive when the top leads", torque),
        ("twist", "top angle less bit angle", "rad"),
        ("D = −dT/dω", "falling slope of the bit torque at the operating speed", slope),
        ("D*", "slope margin: the falling slope at which steady drilling becomes unstable", slope),
        ("S", "sensitivity at the top torque; its peak tells how near to instability", "1"),
        ("disk margin", "change of gain and phase at the top torque that the loop bears at once",
         "dB, °"),
        ("ζ", "impedance of the pipe, J √(G ρ): torque per speed of a travelling wave", slope),
        ("reflection", "share of a wave's amplitude that the drive sends back down", "1"),
        ("a1, a2, β", "friction: torque = [a1 + (a2 − a1) exp(−β |ω|)] x weight on bit",
         "m, m, s/rad"),
        ("set-valued", "a bit at rest bears any torque up to the static one", ""),
        ("stick-slip index", "(max − min) / (2 mean) of the bit speed over the last 20 s", "1"),
        ("settling time", "after which the bit stays within 2 % of the set speed", "s"),
        ("ROP proxy", "mean of weight x |bit speed|, over nominal weight x set speed", "1"),
        ("work per turn", "work on the rock over the turns of the bit", "J"),
        ("cell", "one point of a map", ""),
        ("draw, realization", "one set of values of what is uncertain", ""),
        ("P(J1 ≤ level)", "share of the draws that keep to the level", "%"),
        ("95 % interval", "of a number that was estimated: Clopper-Pearson for shares, bootstrap "
         "for areas and means", ""),
        ("q95, cvar95", "95 % quantile of J1; mean of the worst 5 %", "s"),
        ("Sobol index", "share of the variance of J1 that a parameter explains alone (first) or in "
         "company (total)", "1"),
        ("status", "how a run ends: ok (settled), sticking, stalled, not settled, censored "
         "(stopped early), failed", ""),
        ("reconstructed", "not printed in the source; found to reproduce its statements", ""),
        ("reference solver", "locates every stick and slip; slow and exact", ""),
        ("batch engine", "fixed step, thousands of runs at once; audited by the reference solver",
         ""),
        ("depth", "measured along the string", length),
    )  # fmt: skip


def build(gathered: Gathered) -> tuple[Block, ...]:
    """One table."""
    heads = ("symbol or word", "meaning", "unit")
    return (Table("glossary", "Symbols and words", heads, entries(gathered.words)),)
