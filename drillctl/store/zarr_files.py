"""Arrays in the files of a zarr store (version 3), as zarr itself writes and reads them.

Of a hundred small arrays zarr spends a millisecond or two on each, and a third of a second on its
own import: more than many a command computes for.
"""

from __future__ import annotations

import itertools
import json
import math
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

ABOUT = "zarr.json"
CHUNK = 2**20  # bytes of a chunk, about
CHECKED = struct.Struct("<I")  # the checksum behind each chunk
COMPRESSION = {"name": "zstd", "configuration": {"level": 0, "checksum": False}}


def write_group(folder: Path, arrays: dict[str, dict[str, Any]], origin: dict[str, Any]) -> None:
    """Write what a group of written arrays is, with all that is said of each."""
    held = {"kind": "inline", "must_understand": False, "metadata": arrays}
    _say(folder, {
        "attributes": origin, "zarr_format": 3, "consolidated_metadata": held,
        "node_type": "group",
    })  # fmt: skip


def write_array(
    folder: Path, values: NDArray[Any], dims: list[str], attributes: dict[str, Any]
) -> dict[str, Any]:
    """Write an array, in chunks of whole rows, and return what is said of it."""
    text = values.dtype.kind in "OU"
    shape, size = values.shape, values.dtype.itemsize * math.prod(values.shape[1:])
    rows = shape[:1] if text else tuple(min(n, CHUNK // max(1, size)) for n in shape[:1])
    chunk = tuple(max(1, n) for n in (*rows, *shape[1:]))
    order = {} if values.dtype.itemsize == 1 else {"configuration": {"endian": "little"}}
    about: dict[str, Any] = {
        "shape": list(shape),
        "data_type": "string" if text else values.dtype.name,
        "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": list(chunk)}},
        "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
        "fill_value": "" if text else {"f": "NaN", "b": False}.get(values.dtype.kind, 0),
        "codecs": [
            {"name": "vlen-utf8", "configuration": {}} if text else {"name": "bytes", **order},
            COMPRESSION,
            {"name": "crc32c"},
        ],
        "attributes": attributes,
        **({"dimension_names": dims} if dims else {}),
        "zarr_format": 3,
        "node_type": "array",
        "storage_transformers": [],
    }
    folder.mkdir(parents=True)
    for key, place in _chunks(shape, chunk):
        part = values[place]
        if part.shape != chunk:  # the last one, filled up
            whole = np.full(chunk, np.nan if values.dtype.kind == "f" else 0, values.dtype)
            whole[tuple(map(slice, part.shape))] = part
            part = whole
        (folder / key).parent.mkdir(parents=True, exist_ok=True)
        (folder / key).write_bytes(_packed(_written(part) if text else _little(part).tobytes()))
    _say(folder, about)
    return about


def read_array(folder: Path) -> tuple[NDArray[Any], list[str]]:
    """An array and its dimensions."""
    about = json.loads((folder / ABOUT).read_bytes())
    shape = tuple(about["shape"])
    chunk = tuple(about["chunk_grid"]["configuration"]["chunk_shape"])
    text = about["data_type"] == "string"
    dtype = np.dtype(object if text else about["data_type"])
    values = np.empty(shape, dtype)
    for key, place in _chunks(shape, chunk):
        content = _unpacked((folder / key).read_bytes())
        held = _read(content) if text else np.frombuffer(content, dtype.newbyteorder("<"))
        part = held.reshape(chunk)
        values[place] = part[tuple(map(slice, values[place].shape))]
    return values, about.get("dimension_names", [])


def _chunks(
    shape: tuple[int, ...], chunk: tuple[int, ...]
) -> Iterator[tuple[str, tuple[slice, ...]]]:
    """The file of each chunk, and its place."""
    for at in itertools.product(*(range(-(-n // c)) for n, c in zip(shape, chunk, strict=True))):
        place = tuple(slice(k * c, (k + 1) * c) for k, c in zip(at, chunk, strict=True))
        yield "/".join(("c", *map(str, at))), place


def _little(values: NDArray[Any]) -> NDArray[Any]:
    return values.astype(values.dtype.newbyteorder("<"), copy=False)


def _packed(content: bytes) -> bytes:
    import google_crc32c
    from numcodecs.zstd import Zstd

    packed = bytes(Zstd(level=0).encode(content))
    return packed + CHECKED.pack(google_crc32c.value(packed))


def _unpacked(content: bytes) -> bytes:
    import google_crc32c
    from numcodecs.zstd import Zstd

    packed, check = content[: -CHECKED.size], content[-CHECKED.size :]
    if CHECKED.pack(google_crc32c.value(packed)) != check:
        raise ValueError("its checksum is not that of its content")
    return bytes(Zstd(level=0).decode(packed))


def _written(texts: NDArray[Any]) -> bytes:
    from numcodecs.vlen import VLenUTF8

    return bytes(VLenUTF8().encode(texts.astype(object)))


def _read(content: bytes) -> NDArray[Any]:
    from numcodecs.vlen import VLenUTF8

    return np.asarray(VLenUTF8().decode(content))


def _say(folder: Path, about: dict[str, Any]) -> None:
    (folder / ABOUT).write_text(json.dumps(about, indent=2), encoding="utf-8")
