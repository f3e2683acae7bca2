"""Peaks of this machine, in words.

    python -m benchmarks.machine

What is measured, and how: `benchmarks/peaks.py`.
"""

from __future__ import annotations

from pathlib import Path

from benchmarks.peaks import Machine, measure


def nominal_clock() -> float | None:
    """Clock that the system names (Hz), where it does."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.is_file() else []
    found = [float(line.split(":")[1]) for line in lines if line.startswith("cpu MHz")]
    return 1e6 * max(found) if found else None


def describe(machine: Machine) -> list[str]:
    """What was found, and whether it is plausible."""
    m, nominal = machine, nominal_clock()
    named = "" if nominal is None else f" (the system names {nominal / 1e9:.2f} GHz)"
    return [
        f"{m.cores} cores, clock {m.clock / 1e9:.2f} GHz{named}",
        f"multiply-adds: {m.flops / 1e9:.1f} Gflop/s a core, {m.flops_all / 1e9:.1f} on all; "
        f"{m.flops_per_cycle:.1f} a cycle, {m.units:.2f} units of {m.vector_bits} bits",
        f"first cache: {m.loads / 1e9:.0f} GB/s loaded a core, {m.loads / m.clock:.0f} B a cycle; "
        f"{m.updates / 1e9:.0f} GB/s in place (loads and stores)",
    ]


if __name__ == "__main__":
    print("\n".join(describe(measure())))
