"""Strict JSON, and files written atomically."""

from __future__ import annotations

import json
import math
import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from drillctl.errors import InputError

PART = ".part"  # ending of a file that is not whole yet


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


def as_json(content: Any) -> bytes:
    """Strict JSON (null, never NaN)."""
    return (json.dumps(strict(content), indent=2, allow_nan=False) + "\n").encode()


def write_json(path: Path, content: Any) -> None:
    """Write strict JSON, atomically."""
    write_bytes(path, as_json(content))


def write_text(path: Path, text: str) -> None:
    """Write text, atomically."""
    write_bytes(path, text.encode())


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file, atomically and to the disk itself."""
    with replaced(path) as part, part.open("xb") as stream:
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())


@contextmanager
def replaced(path: Path) -> Iterator[Path]:
    """A new name beside a file or folder, moved there at the end: readers see all of it or none."""
    part = path.with_name(f".{os.getpid()}-{secrets.token_hex(4)}{PART}")
    try:
        yield part
        part.replace(path)
    except BaseException:
        if part.is_dir():
            shutil.rmtree(part, ignore_errors=True)
        else:
            part.unlink(missing_ok=True)
        raise


def read_json(path: Path) -> Any:
    """Read a JSON file; `InputError` if it cannot be read."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {error}", str(path)) from None
