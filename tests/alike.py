"""Results that are the same to the bit, a progress that remembers, tables as they were written."""

from __future__ import annotations

import csv
import dataclasses
from pathlib import Path

import numpy as np

from drillctl.design import Design

TIMES = ("seconds", "total_seconds")  # what a run takes, which is another one each time


def same(one, other, but=(), at="result"):
    """Assert that everything in two results is equal to the bit, except for fields called so."""
    if isinstance(one, np.ndarray):
        assert (one.dtype, one.shape) == (other.dtype, other.shape), at
        content = "tolist" if one.dtype == object else "tobytes"
        assert getattr(one, content)() == getattr(other, content)(), at
    elif dataclasses.is_dataclass(one) and not isinstance(one, Design):
        assert type(one) is type(other), at
        for name in (x.name for x in dataclasses.fields(one) if x.name not in but):
            same(getattr(one, name), getattr(other, name), but, f"{at}.{name}")
    elif isinstance(one, dict):
        assert list(one) == list(other), at
        for key, value in one.items():
            same(value, other[key], but, f"{at}.{key}")
    elif isinstance(one, (tuple, list)):
        assert (type(one), len(one)) == (type(other), len(other)), at
        for place, pair in enumerate(zip(one, other, strict=True)):
            same(*pair, but, f"{at}.{place}")
    else:
        assert one == other or (one != one and other != other), at


class Told:
    """Progress: tasks as they were begun, each with how much of it was done."""

    def __init__(self):
        self.tasks = []

    def begin(self, task, total):
        self.tasks.append([task, total, 0])

    def advance(self, done):
        self.tasks[-1][2] += done


def rows_of(path):
    """Rows of a CSV file, by its heads."""
    with Path(path).open(encoding="utf-8") as stream:
        return list(csv.DictReader(stream))
