"""Strict JSON, and files written atomically."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from drillctl.errors import InputError


def strict(content: Any) -> Any:
    """Convert to plain Python types, with None for numbers that are not finite."""
    if isinstance(content, dict):
        return {str(key): strict(value) for key, value in content.items()}
    if isinstance(content, (list, tuple)):
        return [strict(value) for value in content]
    if hasattr(content, "tolist"):  # NumPy, recognised without importing it
        return strict(content.tolist())
    if isinstance(content, float) and not math.isfinite(content):
        return None
    return content


def picked(value: Any, *names: str) -> dict[str, Any]:
    """Attributes of an object by their names, for a summary."""
    return {name: getattr(value, name) for name in names}


def write_json(path: Path, content: Any) -> None:
    """Write strict JSON (null, never NaN), atomically."""
    write_text(path, json.dumps(strict(content), indent=2, allow_nan=False) + "\n")


def write_text(path: Path, text: str) -> None:
    """Write to a temporary file and rename it: a reader sees the whole file or none."""
    part = path.with_suffix(".part")
    part.write_text(text, encoding="utf-8")
    part.replace(path)


def read_json(path: Path) -> Any:
    """Read a JSON file; `InputError` if it cannot be read."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {error}", str(path)) from None
