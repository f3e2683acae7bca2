"""Lines of design files: where a key stands, for messages.

`tomllib` keeps no positions. When something in a file is wrong, and then only, tree-sitter reads it
again: its grammar is kept by those who keep the parser, and to import it takes a fortieth of a
second.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from drillctl import catalog, units
from drillctl.text import one_line, shortened

Words = tuple[str | int, ...]  # keys, and numbers of entries in lists
MISSING = object()  # what stands at a key that is not there
SECTIONS = "drillstring.sections"  # the one list that is merged
LONGEST_KEY = 60  # characters of a key in a message


def place(origin: str, key: str, tree: Any) -> str:
    """File, line and key for a message; of a key that is missing, the line of its table.

    What was set after the file was read has no line.
    """
    value, at = _at(tree, key), key
    files = list(_files(origin)) if key else []
    while value is MISSING and at and not any(at in lines for _, _, lines in files):
        at = at.rpartition(".")[0]
    for path, held, lines in files:
        if at in lines:
            own = _at(held, at)
            merged = at == SECTIONS or (isinstance(own, dict) and isinstance(value, dict))
            same = value is MISSING or merged or own == value
            return f"{path}:{lines[at]}: {key}" if same else f"{origin}: {key}"
    return f"{origin}: {key}" if key else origin


def without_place(where: str, origin: str) -> str:
    """The key of a place."""
    for path in (origin, *(path for path, _, _ in _files(origin))):
        where = re.sub(rf"^{re.escape(path)}(:\d+)?(: |$)", "", where)
    return where


ALTERNATIVES = ("literal[", "function-before[")  # how pydantic calls those of a value


def dotted(words: Words, tree: Any) -> str:
    """A path as a user writes it: entries of lists by name if they have one, no union tags."""
    texts: list[str] = []
    here = tree
    for step in words:
        if isinstance(step, int):
            here = here[step] if isinstance(here, list) and step < len(here) else None
            texts.append(_entry(step, here))
        elif _is_tag(step, here):
            continue
        else:
            here = here.get(step) if isinstance(here, dict) else None
            texts.append(_printed(step))
    return ".".join(texts)


def _is_tag(step: str, here: Any) -> bool:
    """Whether a word of a path is the name of an alternative, and no key."""
    if isinstance(here, dict):
        return here.get("law") == step and step not in here
    return step.startswith(ALTERNATIVES)


@lru_cache(maxsize=1024)
def _printed(key: str) -> str:
    return shortened(one_line(key), LONGEST_KEY)


def _entry(number: int, value: Any) -> str:
    name = value.get("name") if isinstance(value, Mapping) else None
    return _printed(name) if name and isinstance(name, str) else str(number + 1)


def _at(here: Any, key: str) -> Any:
    """What stands at a dotted path."""
    if not key:
        return here
    entries: Iterator[tuple[str, Any]] = iter(())
    if isinstance(here, dict):
        entries = ((_printed(k), v) for k, v in here.items())
    elif isinstance(here, list):
        entries = ((_entry(n, v), v) for n, v in enumerate(here))
    for text, inside in entries:
        if f"{key}.".startswith(f"{text}."):
            value = _at(inside, key[len(text) + 1 :])
            if value is not MISSING:
                return value
    return MISSING


def _files(origin: str) -> Iterator[tuple[str, Any, dict[str, int]]]:
    """A file, its model, the model of that: path, content and lines by key."""
    path, seen = origin, set[str]()
    while path not in seen:
        seen.add(path)
        try:
            state = Path(path).stat()
            held, lines = _read(path, state.st_mtime_ns, state.st_size)
            yield path, held, lines
            path = str(catalog.find_model(held["model"], Path(path)))
        except (OSError, ValueError, KeyError, TypeError):  # gone, or changed since it was read
            return


@lru_cache(maxsize=8)
def _read(path: str, changed: int, size: int) -> tuple[dict[str, Any], dict[str, int]]:
    import tree_sitter
    import tree_sitter_toml

    text = catalog.read(Path(path), path)
    held = units.plain(tomllib.loads(text))
    language = tree_sitter.Language(tree_sitter_toml.language())
    root = tree_sitter.Parser(language).parse(text.encode()).root_node
    lines: dict[str, int] = {}
    for words, row in _of_document(root):
        lines.setdefault(dotted(units.plain(words), held), row + 1)
    lines.pop("model", None)  # gone from a design that was read: it can only be set
    return held, lines


def _of_document(root: Any) -> Iterator[tuple[Words, int]]:
    """Path and row of every key of a parsed file."""
    numbers: dict[Words, int] = {}  # entries of each list of tables so far, less one
    for node in root.named_children:
        if node.type == "pair":
            yield from _of_pair(node, ())
        elif node.type in ("table", "table_array_element"):
            keys = _keys(node.named_children[0])
            path: Words = ()
            for depth, key in enumerate(keys, start=1):
                path = (*path, key)
                if depth == len(keys) and node.type == "table_array_element":
                    numbers[path] = numbers.get(path, -1) + 1
                yield path, node.start_point[0]
                if path in numbers:
                    path = (*path, numbers[path])
                    yield path, node.start_point[0]
            for pair in node.named_children[1:]:
                yield from _of_pair(pair, path)


def _of_pair(node: Any, path: Words) -> Iterator[tuple[Words, int]]:
    if node.type != "pair":  # a comment
        return
    key, value = (one for one in node.named_children if one.type != "comment")
    for one in _keys(key):
        path = (*path, one)
        yield path, node.start_point[0]
    yield from _of_value(value, path)


def _of_value(node: Any, path: Words) -> Iterator[tuple[Words, int]]:
    inside = [one for one in node.named_children if one.type != "comment"]
    if node.type == "inline_table":
        for pair in inside:
            yield from _of_pair(pair, path)
    elif node.type == "array":
        for number, one in enumerate(inside):
            yield (*path, number), one.start_point[0]
            yield from _of_value(one, (*path, number))


def _keys(node: Any) -> list[str]:
    """Words of a key as TOML has them."""
    if node.type == "dotted_key":
        return [key for one in node.named_children for key in _keys(one)]
    text = node.text.decode()
    return [text] if node.type == "bare_key" else list(tomllib.loads(f"{text} = 0"))
