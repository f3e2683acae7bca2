"""A folder belongs to one process at a time."""

from __future__ import annotations

import os
import socket
from contextlib import suppress
from pathlib import Path

from drillctl.errors import InputError

ENDING = ".lock"


class FolderLock:
    """The lock of a folder, from now until it is released or the process ends.

    The system holds it, so that a process that was killed holds none. It lies beside the folder,
    or in it where nothing can be written beside it, and says who holds it.
    """

    def __init__(self, folder: Path, where: str) -> None:
        try:
            self._acquire(folder.with_name(folder.name + ENDING), where)
        except PermissionError:
            if not folder.is_dir():
                raise
            self._acquire(folder / ENDING, where)

    def _acquire(self, path: Path, where: str) -> None:
        from filelock import FileLock, Timeout  # a command that writes nothing does without

        self._path, self._lock = path, FileLock(path, timeout=0, on_acquired=_sign)
        try:
            self._lock.acquire()
        except Timeout:
            if not path.exists():
                raise InputError(
                    "takes no lock: nothing can be written there, or it was in use until now", where
                ) from None
            raise InputError(
                f"is in use by {self._holder()}; wait for it, or give another folder", where
            ) from None

    def _holder(self) -> str:
        with suppress(OSError):
            return self._path.read_text(encoding="utf-8").strip() or "another process"
        return "another process"

    def release(self) -> None:
        """Let others have the folder."""
        if self._lock.is_locked:
            with suppress(OSError):
                self._path.unlink()  # while it is held: whoever waits for it sees that it is gone
            self._lock.release()


def _sign(descriptor: int) -> None:
    os.ftruncate(descriptor, 0)
    os.write(descriptor, f"process {os.getpid()} on {socket.gethostname()}\n".encode())
