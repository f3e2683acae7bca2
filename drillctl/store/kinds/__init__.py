"""Kinds of result: what each was asked for, and how it is read back."""

from drillctl.store.kinds import (
    tuning,
)

KINDS = (*tuning.KINDS,)
"""Every kind that is written and read back."""
