"""Which code, packages and machine a result came from."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from functools import cache
from importlib.metadata import version
from pathlib import Path

import drillctl

PACKAGES = ("numpy", "scipy", "numba", "llvmlite")
"""Packages whose version may change the last bits of a result."""


@cache
def provenance() -> dict[str, str]:
    """Versions and processor, as stored with every result."""
    results = {"drillctl": drillctl.__version__, "python": platform.python_version()}
    results |= {name: version(name) for name in PACKAGES}
    return results | {"processor": processor()}


def merged(one: Mapping[str, str], other: Mapping[str, str]) -> dict[str, str]:
    """What two origins have in common; where they differ, both."""
    results = dict(one)
    for key, value in other.items():
        held = results.get(key, value).split(" + ")
        results[key] = " + ".join(dict.fromkeys([*held, *value.split(" + ")]))
    return results


def processor() -> str:
    """Model of the processor, as the system names it."""
    info = Path("/proc/cpuinfo")
    if info.is_file():
        for line in info.read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
