"""Results on disk: arrays as variables of a zarr store, everything else as JSON.

A result is a frozen dataclass. Its arrays are labelled where they are declared:

    axes: tuple[Axis, ...]
    j1: Array = label("axes", unit="s", means="J1; NaN where the run failed")

One codec for every result: a tree of frozen dataclasses, named tuples, tuples, lists, sets,
dictionaries, numbers, text, designs and arrays. `result.json` names the class of each object and,
in place of an array, the variable that holds it. Classes are looked up in this package only, and
only dataclasses and named tuples are made: reading a folder runs no code of its own.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import re
import shutil
import tomllib
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design, to_toml
from drillctl.design.validation import validated
from drillctl.provenance import provenance
from drillctl.store.journal import reading, writing
from drillctl.store.json_files import replaced, write_json

if TYPE_CHECKING:
    import xarray

Dataclass = TypeVar("Dataclass", bound=type)


@dataclass(frozen=True)
class Label:
    """Dimensions, unit and meaning of an array or of a dictionary of arrays."""

    # "axes" means the paths of the axes of the object; {name} an attribute of the object
    dims: tuple[str, ...] = ()
    unit: str | Callable[[str], str] = "1"  # SI; for a dictionary a function of the key
    means: str | Callable[[str], str] = ""
    name: str = ""  # of the variable; default: that of the field
    flat: bool = False  # whether names inside omit the name of this field
    over: str = ""  # dimension along which arrays of a tuple of objects are stacked
    flags: tuple[str, ...] = ()  # meanings of the integers 0, 1, ...


def label(
    *dims: str,
    unit: str | Callable[[str], str] = "1",
    means: str | Callable[[str], str] = "",
    name: str = "",
    flat: bool = False,
    over: str = "",
    flags: tuple[str, ...] = (),
    **options: Any,
) -> Any:
    """Declare a field of a result with its label; other options are those of a dataclass field."""
    return field(metadata={"label": Label(dims, unit, means, name, flat, over, flags)}, **options)


def documented(cls: Dataclass) -> Dataclass:
    """Document the fields of a class from their labels, for `help` and the reference."""
    if cls.__doc__ and "Attributes\n" not in cls.__doc__:
        cls.__doc__ = f"{cls.__doc__.rstrip()}\n\n{_section(cls)}"
    return cls


def _section(cls: type) -> str:
    """The numpydoc section of a class whose fields are labelled."""
    lines = ["    Attributes", "    ----------"]
    for name, kind in cls.__annotations__.items():
        if kind.startswith("ClassVar"):
            continue
        one = getattr(vars(cls).get(name), "metadata", {}).get("label")
        lines.append(f"    {name} : {kind}")
        if one is not None:
            lines.append(f"        {_described(one)}")
    return "\n".join(lines) + "\n    "


def _described(one: Label) -> str:
    parts = [one.means if isinstance(one.means, str) else ""]
    parts += [f"shape ({', '.join(one.dims)})"] if one.dims else []
    parts += [f"in {one.unit}"] if isinstance(one.unit, str) and one.unit != "1" else []
    return "; ".join(part for part in parts if part) or "See the class."


LONGEST = 200  # bytes of the name of a file


def stored_name(name: str) -> str:
    """Name of a variable on disk, where a slash, a dot alone or 300 letters are no name."""
    safe = re.sub(r"[/\\%\x00-\x1f]|^\.+$|^_(?=_)|^$", _escaped, name)
    content = safe.encode()
    if len(content) <= LONGEST:
        return safe
    start = content[: LONGEST - 17].decode(errors="ignore")
    return f"{start}~{hashlib.sha256(content).hexdigest()[:16]}"


def _escaped(match: re.Match[str]) -> str:
    return "".join(f"%{ord(one):02X}" for one in match[0]) or "%"


TREE = "result.json"
DATA = "data.zarr"
MARK = "$"  # key of a JSON object that encodes a type missing in JSON
_PLAIN = Label()


@dataclass(frozen=True)
class _Variable:
    dims: tuple[str, ...]
    values: NDArray[Any]
    attributes: dict[str, Any]


@dataclass
class _Encoder:
    """Encodes a result and collects its arrays."""

    variables: dict[str, _Variable] = field(default_factory=dict)

    def tree(self, value: Any, name: str, label: Label = _PLAIN, owner: Any = None) -> Any:
        """A value as JSON; its arrays become variables named after `name`."""
        if value is None or isinstance(value, (bool, str, int)):
            return value
        if isinstance(value, (float, np.floating)):
            number = float(value)
            return number if math.isfinite(number) else {MARK: "float", "is": repr(number)}
        if isinstance(value, (np.integer, np.bool_)):
            return value.item()
        if isinstance(value, np.ndarray):
            return {MARK: "array", "is": self._array(value, name, label, owner)}
        if isinstance(value, Design):
            about = {"name": value.name, "origin": value.origin}
            return {MARK: "design", "is": to_toml(value), **about}
        if isinstance(value, dict):
            pairs = [
                [key, self.tree(v, _joined(name, key), _of_key(label, key), owner)]
                for key, v in value.items()
            ]
            return {MARK: "dict", "is": pairs}
        if dataclasses.is_dataclass(value) or hasattr(value, "_fields"):
            return self._object(value, name, owner)
        if isinstance(value, (tuple, list)):
            parts = self._parts(value, name, label, owner)
            return parts if isinstance(value, list) else {MARK: "tuple", "is": parts}
        if isinstance(value, frozenset):
            return {MARK: "set", "is": self._parts(sorted(value), name, label, owner)}
        raise TypeError(f"{type(value).__name__} ({name}) cannot be stored in a result")

    def _object(self, value: Any, prefix: str, owner: Any) -> Any:
        cls = type(value)
        inside = {}
        for one, label in labels(cls).items():
            own = label.name.format_map(_Attributes(value)) or one
            # A field that an attribute names, as its path names an axis, takes no prefix.
            name = (
                own
                if label.name.startswith("{")
                else prefix
                if label.flat
                else _joined(prefix, own)
            )
            inner = getattr(value, one)
            inside[one] = self.tree(inner, name, label, _Owner(value, owner))
        return {MARK: "object", "of": f"{cls.__module__}:{cls.__qualname__}", "is": inside}

    def _parts(self, value: Any, name: str, label: Label, owner: Any) -> list[Any]:
        if not label.over:
            return [self.tree(v, _joined(name, k), label, owner) for k, v in enumerate(value)]
        results = []
        for one in value:
            apart = _Encoder()
            results.append((apart, apart.tree(one, name, label, owner)))
        return self._stacked(results, label.over, [getattr(one, "name", None) for one in value])

    def _stacked(
        self, result: list[tuple[_Encoder, Any]], over: str, names: list[Any]
    ) -> list[Any]:
        """Stack equal shapes in one variable along a new dimension; keep others separate."""
        for key in dict.fromkeys(key for apart, _ in result for key in apart.variables):
            held = [apart.variables.get(key) for apart, _ in result]
            first = next(one for one in held if one is not None)
            if key in first.dims:  # a coordinate, shared or one per object
                continue
            alike = all(
                one is not None
                and one.dims == first.dims
                and one.values.shape == first.values.shape
                for one in held
            )
            if alike:
                values = np.stack([one.values for one in held if one is not None])
                self.variables[key] = _Variable((over, *first.dims), values, first.attributes)
                continue
            for k, one in enumerate(held):
                if one is not None:
                    dims = tuple(f"{d}.{k}" for d in one.dims)
                    self.variables[f"{key}.{k}"] = _Variable(dims, one.values, one.attributes)
        if names and all(isinstance(name, str) for name in names):
            self.variables[over] = _Variable((over,), np.array(names, dtype=object), {})
        return [self._placed(tree, apart, k) for k, (apart, tree) in enumerate(result)]

    def _placed(self, tree: Any, apart: _Encoder, k: int) -> Any:
        """The tree of one stacked object, with the new places of its arrays."""
        if isinstance(tree, list):
            return [self._placed(one, apart, k) for one in tree]
        if not isinstance(tree, dict):
            return tree
        if tree.get(MARK) == "array":
            name = tree["is"]
            if name not in self.variables and f"{name}.{k}" not in self.variables:
                self.variables[name] = apart.variables[name]  # a coordinate
            if f"{name}.{k}" in self.variables:
                return tree | {"is": f"{name}.{k}"}
            shared = name in self.variables[name].dims
            return tree if shared else tree | {"at": k}
        return {key: self._placed(one, apart, k) for key, one in tree.items()}

    def _array(self, value: NDArray[Any], name: str, label: Label, owner: Any) -> str:
        dims = _dimensions(label, owner) if label.dims else ()
        if len(dims) != value.ndim:
            dims = tuple(f"{name}_{k}" for k in range(value.ndim))
        if np.iscomplexobj(value):
            value, dims = np.stack([value.real, value.imag], axis=-1), (*dims, "complex")
        attributes = _attributes(label, owner)
        held = self.variables.get(name)
        if held is not None and not _same(held.values, value):
            name = next(n for k in range(2, 10_000) if (n := f"{name}.{k}") not in self.variables)
            dims = tuple(f"{d}.{name.rpartition('.')[2]}" if d in dims else d for d in dims)
        self.variables[name] = _Variable(dims, value, attributes)
        return name


def _same(one: NDArray[Any], other: NDArray[Any]) -> bool:
    return bool(np.array_equal(one, other, equal_nan=one.dtype.kind == "f"))


def _joined(prefix: str, key: Any) -> str:
    return f"{prefix}.{key}" if prefix else str(key)


@dataclass(frozen=True)
class _Owner:
    """The objects that hold an array, the nearest first."""

    value: Any
    above: Any

    def get(self, name: str) -> Any:
        result = getattr(self.value, name, None)
        return result if result is not None or self.above is None else self.above.get(name)


class _Attributes(dict[str, Any]):
    """Attributes of an object for the names of its variables."""

    def __init__(self, value: Any) -> None:
        super().__init__()
        self._value = value

    def __missing__(self, key: str) -> Any:
        return getattr(self._value, key)


def labels(cls: type) -> dict[str, Label]:
    """Fields of a dataclass or named tuple with their labels."""
    if dataclasses.is_dataclass(cls):
        return {f.name: f.metadata.get("label", _PLAIN) for f in dataclasses.fields(cls)}
    names: tuple[str, ...] = cls._fields  # type: ignore[attr-defined]
    return dict.fromkeys(names, _PLAIN)


def _dimensions(label: Label, owner: Any) -> tuple[str, ...]:
    dims: list[str] = []
    for one in label.dims:
        if one == "axes":
            dims += [axis.path for axis in owner.get("axes")]
        else:
            dims.append(one.format_map(_Attributes(owner.value)))
    return tuple(dims)


def _of_key(label: Label, key: Any) -> Label:
    """The label of one entry of a dictionary."""
    unit = label.unit(key) if callable(label.unit) else label.unit
    means = label.means(key) if callable(label.means) else label.means
    return dataclasses.replace(label, unit=unit, means=means)


def _attributes(label: Label, owner: Any) -> dict[str, Any]:
    unit = str(label.unit)
    if owner is not None:
        unit = unit.format_map(_Attributes(owner.value))
    flags = {"flag_values": list(range(len(label.flags))), "flag_meanings": " ".join(label.flags)}
    about = flags if label.flags else {"units": unit}
    return about | ({"long_name": label.means} if label.means else {})


def encoded(result: Any) -> tuple[Any, dict[str, _Variable]]:
    """A result as a JSON tree and variables."""
    encoder = _Encoder()
    return encoder.tree(result, ""), encoder.variables


def dataset(result: Any) -> xarray.Dataset:
    """Every array of a result, labelled, and the derived variables."""
    import xarray

    _, variables = encoded(result)
    made: dict[str, Any] = {n: (v.dims, v.values, v.attributes) for n, v in variables.items()}
    attributes = dict(getattr(result, "provenance", None) or {})
    return xarray.Dataset(made | result.derived(), attrs=attributes)


def write(result: Any, folder: Path) -> None:
    """Write a result into the folder of its run, each file atomically.

    The store is what xarray would write. Without it, and without the packages that it brings, a
    command is done a second sooner.
    """
    tree, variables = encoded(result)
    for name, (dims, values, *about) in result.derived().items():
        over = (dims,) if isinstance(dims, str) else tuple(dims)
        variables[name] = _Variable(over, np.asarray(values), *(about or ({},)))
    origin = provenance() | dict(getattr(result, "provenance", None) or {})
    target = folder / DATA
    with writing(target), replaced(target) as part:
        _put_all(part, variables, origin)
        shutil.rmtree(target, ignore_errors=True)
    write_json(folder / TREE, tree)


def _put_all(folder: Path, variables: dict[str, _Variable], origin: dict[str, Any]) -> None:
    import zarr

    group = zarr.create_group(folder, zarr_format=3, attributes=origin)
    for name, one in variables.items():
        _put(group, stored_name(name), one)
    with warnings.catch_warnings():  # zarr and xarray read it, and warn without it
        warnings.simplefilter("ignore")
        zarr.consolidate_metadata(group.store)


def _put(group: Any, name: str, one: _Variable) -> None:
    from zarr.codecs import Crc32cCodec, ZstdCodec

    kind, shape = one.values.dtype.kind, one.values.shape
    array = group.create_array(
        name,
        shape=shape,
        dtype=str if kind in "OU" else one.values.dtype,
        chunks="auto" if one.values.size else tuple(max(1, n) for n in shape),
        fill_value=np.nan if kind == "f" else None,
        compressors=(ZstdCodec(), Crc32cCodec()),
        attributes=one.attributes,
        dimension_names=[stored_name(dim) for dim in one.dims],
        config={"write_empty_chunks": True},  # a chunk that is not there is damage
    )
    if one.values.size:
        array[...] = one.values


def read(folder: Path) -> Any:
    """Read the result of a folder, whose files were compared with their journal."""
    import zarr

    with reading(folder / DATA):
        arrays = _Arrays(folder / DATA, zarr.open_group(folder / DATA, mode="r"))
    with reading(folder / TREE):
        return decoded(json.loads((folder / TREE).read_bytes()), arrays)


class _Arrays(dict[str, NDArray[Any]]):
    """Arrays of a store, each read once."""

    def __init__(self, path: Path, group: Any) -> None:
        super().__init__()
        self._path, self._group = path, group

    def __missing__(self, name: str) -> NDArray[Any]:
        with reading(self._path / name):
            self[name] = self._read(name)
        return self[name]

    def _read(self, name: str) -> NDArray[Any]:
        held = self._group[name]
        values = np.asarray(held[...])
        if values.dtype.kind not in "biufc":
            values = values.astype(object)
        if (held.metadata.dimension_names or ("",))[-1:] == ("complex",):
            values = np.asarray(values[..., 0] + 1j * values[..., 1])
        return values


def decoded(tree: Any, data: Mapping[str, NDArray[Any]]) -> Any:
    """A result from its JSON tree and dataset."""
    if isinstance(tree, list):
        return [decoded(one, data) for one in tree]
    if not isinstance(tree, dict):
        return tree
    kind, inside = tree[MARK], tree["is"]
    if kind == "float":
        return float(inside)
    if kind == "array":
        held, at = data[stored_name(inside)], tree.get("at")
        return held if at is None else held[at]
    if kind == "design":
        return _design(tree)
    if kind == "dict":
        return {key: decoded(one, data) for key, one in inside}
    if kind in ("tuple", "set"):
        return {"tuple": tuple, "set": frozenset}[kind](decoded(one, data) for one in inside)
    cls = _class(tree["of"])
    return cls(**{name: decoded(one, data) for name, one in inside.items()})


def _design(tree: dict[str, Any]) -> Design:
    held = tomllib.loads(tree["is"])
    return Design(tree["name"], validated(held, tree["origin"]), held, tree["origin"])


def _class(path: str) -> Any:
    module, _, name = path.partition(":")
    if not module.startswith("drillctl."):
        raise ValueError(f"{path} is not a class of drillctl")
    result = getattr(import_module(module), name)
    if not (dataclasses.is_dataclass(result) or issubclass(result, tuple)):
        raise ValueError(f"{path} is neither a dataclass nor a named tuple")
    return result
