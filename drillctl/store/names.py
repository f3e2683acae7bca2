"""Names on disk."""

from __future__ import annotations


def stored_name(name: str) -> str:
    """Name of a variable on disk: zarr takes a slash, as a section's name may hold, for a group."""
    return name.replace("/", "%2F")
