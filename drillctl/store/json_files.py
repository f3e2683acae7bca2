"""Strict JSON, and files that are written whole or not at all."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from drillctl.errors import InputError


def strict(content: Any) -> Any:
    """The same with None for every number that is not finite, and plain Python types."""
    if isinstance(content, dict):
        return {str(key): strict(value) for key, value in content.items()}
    if isinstance(content, (list, tuple)):
        return [strict(value) for value in content]
    if hasattr(content, "tolist"):  # of NumPy, which lists of names need not wait for
        return strict(content.tolist())
    if isinstance(content, float) and not math.isfinite(content):
        return None
    return content


def write_json(path: Path, content: Any) -> None:
    """Write strict JSON (null, never NaN), atomically."""
    write_text(path, json.dumps(strict(content), indent=2, allow_nan=False) + "\n")


def write_text(path: Path, text: str) -> None:
    """Write beside the target and move: a reader sees a whole file or none."""
    part = path.with_suffix(".part")
    part.write_text(text, encoding="utf-8")
    part.replace(path)


def read_json(path: Path) -> Any:
    """What a file holds; refused (`InputError`) if it cannot be read."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {error}", str(path)) from None
