"""Compiled functions kept on disk by numba, where that is possible and what is kept is sound.

A cache saves time and must never end a run: without a place to write it lies in the temporary
folder or nowhere, and an entry that cannot be read is compiled again.
"""

from __future__ import annotations

import getpass
import hashlib
import logging
import os
import tempfile
from pathlib import Path
from typing import Any

import numba
from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    NullCache,
    UserProvidedCacheLocator,
)
from numba.core.ccallback import CFunc
from numba.core.sigutils import normalize_signature

_notes = logging.getLogger(__name__)


def njit(function: Any, cache: bool = True, **options: Any) -> Any:
    """`numba.njit` of a function."""
    # Nothing compiled calls it by an address of its own: `cfunc` is for that.
    made: Any = numba.njit(**{"no_cfunc_wrapper": True} | options)(function)
    if cache:
        made._cache = _cache_of(function)
    return made


def on_disk(function: Any, *sources: str) -> Any:
    """A function compiled with all that it calls in these files, which are part of its name."""
    version = hashlib.sha256(b"".join(Path(one).read_bytes() for one in sources)).hexdigest()[:16]
    function.__name__ = function.__qualname__ = f"{function.__name__}_{version}"
    return njit(function, fastmath={"contract"}, nogil=True, error_model="numpy")


def cfunc(signature: Any, function: Any, cache: bool = True, **options: Any) -> Any:
    """`numba.cfunc` of a function."""
    made: Any = CFunc(function, normalize_signature(signature), locals={}, options=options)
    if cache:
        made._cache = _cache_of(function)
    made.compile()
    return made


def _cache_of(function: Any) -> Any:
    try:
        return _Cache(function)
    except RuntimeError:  # of numba: there is no place to write
        _notes.info("compiled functions are not kept: no folder for them can be written")
        return NullCache()


class _InTemporaryFolder(UserProvidedCacheLocator):
    """A folder of the user's own among the temporary ones, for want of any other."""

    def __init__(self, py_func: Any, py_file: str) -> None:
        super().__init__(py_func, py_file)
        self._cache_path = str(_own_folder() / self.get_suitable_cache_subpath(py_file))

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> Any:
        """None if the folder cannot be written, or is another user's."""
        try:
            made = cls(py_func, py_file)
            made.ensure_cache_path()
        except OSError:
            return None
        _notes.info("compiled functions are kept in %s", made.get_cache_path())
        return made


def _own_folder() -> Path:
    """Made if need be; refused (`OSError`) where others could plant code that would be run."""
    folder = Path(tempfile.gettempdir()) / f"drillctl-{getpass.getuser()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    about = folder.lstat()
    if hasattr(os, "getuid") and (about.st_uid != os.getuid() or about.st_mode & 0o022):
        raise PermissionError(f"{folder} can be written by others")
    return folder


class _Entries(CompileResultCacheImpl):
    _locator_classes = (*CompileResultCacheImpl._locator_classes, _InTemporaryFolder)


class _Cache(FunctionCache):
    """numba's cache of a function, whose faults cost time alone."""

    _impl_class = _Entries

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """What is kept for a signature; None if it is damaged, and it is dropped.

        Two processes that keep different signatures at the same moment may write the same file.
        """
        try:
            kept = super().load_overload(sig, target_context)
            if kept is None or kept.signature.args == normalize_signature(sig)[0]:
                return kept
            _notes.info("%s is kept for other types and is compiled again", self._name)
        except Exception as error:  # whatever unpickling damaged bytes may raise
            _notes.info("%s is damaged and is compiled again (%r)", self._name, error)
            self._dropped()
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled, if the disk takes it."""
        try:
            super().save_overload(sig, data)
        except OSError as error:
            _notes.info("%s is not kept: %s", self._name, error)

    def _dropped(self) -> None:
        try:
            self.flush()
        except OSError as error:  # of a folder that has become read-only
            _notes.info("%s stays damaged: %s", self._name, error)
