"""Names on disk."""

from __future__ import annotations


def stored_name(name: str) -> str:
    """Name of a variable on disk: zarr reads a slash, which a section name may hold, as a group."""
    return name.replace("/", "%2F")
