"""Kinds of result: what each was asked for, and how it is read back."""

from drillctl.store.kinds import (
    advantage,
    comparisons,
    doctor,
    linear,
    maps,
    runs,
    tuning,
    uncertainty,
)

KINDS = (
    *linear.KINDS,
    *runs.KINDS,
    *maps.KINDS,
    *comparisons.KINDS,
    *advantage.KINDS,
    *uncertainty.KINDS,
    *tuning.KINDS,
    *doctor.KINDS,
)
"""Every kind that is written and read back."""
