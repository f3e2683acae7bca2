"""Reports of a point, each written by a process of its own that ends with its page."""

from __future__ import annotations

import subprocess
import sys
import threading
from collections.abc import Callable, Hashable
from pathlib import Path
from typing import Any

from drillctl.design import Design, to_toml


class Reports:
    """Reports in a folder that the server shows."""

    def __init__(self, folder: Path, address: str) -> None:
        self._folder, self._address = folder, address
        self._running: dict[Hashable, subprocess.Popen[str]] = {}
        self._count = 0

    def write(
        self, owner: Hashable, design: Design, tell: Callable[[dict[str, Any]], None]
    ) -> None:
        """Begin a report; an older one of the page ends."""
        self.drop(owner)
        self._count += 1
        name = f"report-{self._count}"
        file = self._folder / f"{name}.toml"
        file.write_text(to_toml(design), encoding="utf-8")
        words = ["report", str(file), "--profile", "quick", "--out", str(self._folder / name)]
        process = subprocess.Popen(
            [sys.executable, "-m", "drillctl", *words], text=True,
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
        )  # fmt: skip
        self._running[owner] = process
        threading.Thread(target=self._wait, args=(owner, process, name, tell), daemon=True).start()

    def _wait(
        self, owner: Hashable, process: subprocess.Popen[str], name: str,
        tell: Callable[[dict[str, Any]], None],
    ) -> None:  # fmt: skip
        _, said = process.communicate()
        if self._running.get(owner) is not process:
            return  # dropped
        del self._running[owner]
        page = self._folder / name / "report.html"
        if page.is_file():
            tell({"said": "Open the report", "href": f"{self._address}/{name}/report.html"})
        else:
            lines = said.strip().splitlines() or [f"exit code {process.returncode}"]
            tell({"said": f"No report: {lines[-1]}"})

    def drop(self, owner: Hashable) -> None:
        """End the report of a page."""
        process = self._running.pop(owner, None)
        if process is not None:
            process.terminate()

    def end(self) -> None:
        """End all."""
        for owner in list(self._running):
            self.drop(owner)
