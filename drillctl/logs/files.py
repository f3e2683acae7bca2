"""Files that hold logs, read in pieces: CSV, Parquet, MAT and LAS.

CSV, Parquet and MAT 7.3 are never in memory as a whole; LAS and MAT 5 are, as their readers do.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from drillctl import catalog
from drillctl.errors import InputError
from drillctl.logs.quantities import QUANTITIES, Head, spelt
from drillctl.progress import SILENT, Progress

PIECE = 262_144  # rows at a time
ABSENT = (-999.25, -9999.0, -999.0, -9999.25)
"""Numbers that stand for a missing value in well logs."""
_WORDS = ["NULL", "null", "NaN", "nan", "NA", "N/A", "--", "-", "", "None"]
EXTRAS = {"pyarrow": "parquet", "h5py": "mat", "lasio": "las"}

Pieces = Callable[[Sequence[int], Progress], Iterator[list[Any]]]


@dataclass(frozen=True)
class Source:
    """A file that is open to be read."""

    path: Path
    heads: tuple[Head, ...]  # its columns
    dated: frozenset[int]  # columns that hold text or dates, by number
    pieces: Pieces  # of some columns by number: arrays of the same length, some rows at a time


def open_source(path: Path) -> Source:
    """Open a file by its ending (`InputError` if it cannot be read)."""
    path = catalog.regular_file(str(path))
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        known = ", ".join(_READERS)
        raise InputError(
            f"{path.suffix or 'no ending'} is not a log; allowed are {known}", str(path)
        )
    with _named(path):
        source = reader(path)
    if len(source.heads) < 2:
        raise InputError("holds fewer than two columns", str(path))
    return replace(source, pieces=partial(_named_pieces, source))


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Refuse a file in one way, whatever the library that reads it raises."""
    try:
        yield
    except InputError as error:
        raise error.within(str(path)) from None
    except Exception as error:
        reason = f"{error}".splitlines()[0] if f"{error}" else type(error).__name__
        raise InputError(f"cannot be read: {reason}", str(path)) from error


def _named_pieces(
    source: Source, columns: Sequence[int], progress: Progress
) -> Iterator[list[Any]]:
    with _named(source.path):
        yield from source.pieces(columns, progress)


def _needed(module: str) -> Any:
    from importlib import import_module

    try:
        return import_module(module)
    except ImportError:
        package = module.partition(".")[0]
        raise InputError(
            f"needs the package {package}: pip install 'drillctl[{EXTRAS[package]}]'"
        ) from None


# Text with separators.


@dataclass(frozen=True)
class _Text:
    """How a text file is laid out."""

    encoding: str
    separator: str
    decimal: str
    heads: tuple[Head, ...]
    skipped: int  # lines before the first row of numbers


def _csv(path: Path) -> Source:
    layout = _layout(path)
    first = next(_csv_pieces(path, layout, range(len(layout.heads)), SILENT, rows=50), [])
    dated = frozenset(k for k, values in enumerate(first) if _is_text(values))

    def pieces(columns: Sequence[int], progress: Progress) -> Iterator[list[Any]]:
        return _csv_pieces(path, layout, columns, progress)

    return Source(path, layout.heads, dated, pieces)


def _is_text(values: Any) -> bool:
    values = np.asarray(values)
    return values.dtype.kind in "OUM" and len(values) > 0


def _layout(path: Path) -> _Text:
    with path.open("rb") as stream:
        raw = stream.read(65_536)
    if b"\x00" in raw and not raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise InputError("is not text")
    encoding = "utf-16" if raw.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8-sig"
    try:
        text = codecs.getincrementaldecoder(encoding)().decode(raw)  # whose end may be cut
    except UnicodeDecodeError:
        encoding = "latin-1"
        text = raw.decode(encoding)
    lines = text.splitlines()[:200]
    rows = [n for n, line in enumerate(lines) if line.strip() and not line.startswith("#")]
    if len(rows) < 2:
        raise InputError("holds no rows")
    last = lines[rows[-1]]
    # A comma may be that of decimals, where another one parts the columns.
    separator = next((one for one in "\t;|," if one in last), " ")
    decimal = "," if separator in ";\t" and re.search(r"\d,\d", last) else "."

    def cells(line: str) -> list[str]:
        parts = line.split() if separator == " " else line.split(separator)
        return [part.strip().strip('"').strip() for part in parts]

    width = len(cells(last))
    wide = (n for n in rows if len(cells(lines[n])) >= width)
    head = next((n for n in wide if not _numeric(cells(lines[n]), decimal)), None)
    if head is None:
        raise InputError("has no line of column names above its numbers")
    names = cells(lines[head])[:width]
    below = next((n for n in rows if n > head), head)
    unit = [""] * width
    row = cells(lines[below])
    if _of_units(row):
        unit = [cell.strip("()[]") for cell in row]
        below = next((n for n in rows if n > below), below + 1)
    heads = tuple(Head(*pair) for pair in zip(names, unit, strict=False))
    return _Text(encoding, separator, decimal, heads, below)


def _numeric(cells: list[str], decimal: str) -> bool:
    """Whether a line is one of numbers."""
    return any(re.fullmatch(r"[-+]?\d+([.,]\d+)?([eE][-+]?\d+)?", cell) for cell in cells)


def _of_units(cells: list[str]) -> bool:
    """Whether a line names units: no cell is a number, and most are units of a quantity."""
    if _numeric(cells, "."):
        return False
    known = {unit for one in QUANTITIES.values() for unit in one.units}
    filled = [cell for cell in cells if cell.strip("()[]- ")]
    return bool(filled) and sum(spelt(cell) in known for cell in filled) * 2 >= min(len(filled), 4)


def _csv_pieces(
    path: Path, layout: _Text, columns: Sequence[int], progress: Progress, rows: int = PIECE
) -> Iterator[list[Any]]:
    import pandas as pd

    with path.open("rb") as stream:
        progress.begin(f"reading {path.name}", max(path.stat().st_size, 1))
        reader = pd.read_csv(
            stream, sep=r"\s+" if layout.separator == " " else layout.separator, header=None,
            skiprows=layout.skipped, usecols=sorted(columns), names=range(len(layout.heads)),
            index_col=False, encoding=layout.encoding, encoding_errors="replace",
            decimal=layout.decimal, chunksize=rows, na_values=_WORDS, skip_blank_lines=True,
            on_bad_lines="skip", low_memory=False,
        )  # fmt: skip
        done = 0
        for piece in reader:
            yield [piece[k].to_numpy() for k in columns]
            at = stream.tell()
            progress.advance(at - done)
            done = at


# Columns of Parquet, MAT and LAS.


def _parquet(path: Path) -> Source:
    file = _needed("pyarrow.parquet").ParquetFile(path)
    heads = tuple(
        Head(field.name, (field.metadata or {}).get(b"unit", b"").decode())
        for field in file.schema_arrow
    )
    dated = frozenset(
        k for k, field in enumerate(file.schema_arrow)
        if str(field.type).startswith(("timestamp", "string", "large_string", "date"))
    )  # fmt: skip

    def pieces(columns: Sequence[int], progress: Progress) -> Iterator[list[Any]]:
        names = [heads[k].name for k in columns]
        progress.begin(f"reading {path.name}", max(file.metadata.num_rows, 1))
        for batch in file.iter_batches(PIECE, columns=names):
            yield [batch[name].to_numpy(zero_copy_only=False) for name in names]
            progress.advance(batch.num_rows)

    return Source(path, heads, dated, pieces)


def _mat(path: Path) -> Source:
    with path.open("rb") as stream:
        newer = b"MATLAB 7.3" in stream.read(128) or not _is_mat5(path)
    return _mat73(path) if newer else _mat5(path)


def _is_mat5(path: Path) -> bool:
    with path.open("rb") as stream:
        return stream.read(8) != b"\x89HDF\r\n\x1a\n"


def _mat73(path: Path) -> Source:
    h5py = _needed("h5py")
    found: list[tuple[str, str, int]] = []
    with h5py.File(path, "r") as file:

        def visit(name: str, one: Any) -> None:
            vector = isinstance(one, h5py.Dataset) and one.size > 1 and max(one.shape) == one.size
            if vector and one.dtype.kind in "fiu" and not name.startswith("#"):
                unit = one.attrs.get("unit", one.attrs.get("units", ""))
                text = unit.decode() if isinstance(unit, bytes) else str(unit)
                found.append((name, text, one.size))

        file.visititems(visit)
    found, rows = _longest(found)
    heads = tuple(Head(name.rpartition("/")[2], unit) for name, unit, _ in found)

    def pieces(columns: Sequence[int], progress: Progress) -> Iterator[list[Any]]:
        progress.begin(f"reading {path.name}", max(rows, 1))
        with h5py.File(path, "r") as file:
            held = [file[found[k][0]] for k in columns]
            for first in range(0, rows, PIECE):
                part = slice(first, min(first + PIECE, rows))
                yield [
                    np.ravel(one[part] if one.shape[0] == one.size else one[..., part])
                    for one in held
                ]
                progress.advance(part.stop - first)

    return Source(path, heads, frozenset(), pieces)


def _longest(found: list[Any]) -> tuple[list[Any], int]:
    """The vectors that are as long as the longest: columns of one table."""
    rows = max((one[-1] for one in found), default=0)
    return [one for one in found if one[-1] == rows], rows


def _mat5(path: Path) -> Source:
    import scipy.io

    found: list[tuple[str, Any, int]] = []

    def visit(name: str, value: Any) -> None:
        value = np.asarray(value)
        if value.dtype.names:
            for field in value.dtype.names:
                visit(field, value[field].flat[0] if value.dtype == object else value[field].item())
        elif value.dtype.kind in "fiu" and value.size > 1 and max(value.shape) == value.size:
            found.append((name, value.ravel(), value.size))

    for name, value in scipy.io.loadmat(path).items():
        if not name.startswith("__"):
            visit(name, value)
    found, _ = _longest(found)
    heads = tuple(Head(name) for name, _, _ in found)
    return Source(path, heads, frozenset(), _of_arrays(path, [values for _, values, _ in found]))


def _las(path: Path) -> Source:
    lasio = _needed("lasio")
    file = lasio.read(str(path))
    heads = tuple(Head(one.mnemonic, one.unit) for one in file.curves)
    data = [np.asarray(one.data) for one in file.curves]
    dated = frozenset(k for k, values in enumerate(data) if _is_text(values))
    return Source(path, heads, dated, _of_arrays(path, data))


def _of_arrays(path: Path, data: Sequence[Any]) -> Pieces:
    def pieces(columns: Sequence[int], progress: Progress) -> Iterator[list[Any]]:
        progress.begin(f"reading {path.name}", 1)
        yield [data[k] for k in columns]
        progress.advance(1)

    return pieces


_READERS: dict[str, Callable[[Path], Source]] = {
    ".csv": _csv, ".txt": _csv, ".tsv": _csv, ".dat": _csv, ".asc": _csv,
    ".parquet": _parquet, ".pq": _parquet, ".mat": _mat, ".las": _las,
}  # fmt: skip
