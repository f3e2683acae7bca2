"""A report as PDF, printed by a browser without a window."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from drillctl.errors import DrillctlError

BROWSERS = (
    "chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome",
    "microsoft-edge",
)  # fmt: skip
"""Commands that print, in the order in which they are looked for."""
CHOICE = "DRILLCTL_BROWSER"
"""Variable of the environment that names another one."""
PATIENCE = 120.0
"""Longest time for printing (s)."""
OPTIONS = (
    "--headless", "--disable-gpu", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--disable-extensions", "--disable-quic",
    "--no-pdf-header-footer", "--hide-scrollbars",
)  # fmt: skip


def browser() -> str | None:
    """The command of a browser that prints, if there is one."""
    asked = os.environ.get(CHOICE)
    if asked is not None:
        return shutil.which(asked)
    return next((found for name in BROWSERS if (found := shutil.which(name))), None)


def printed(page: Path, target: Path) -> Path:
    """Print a page."""
    command = browser()
    if command is None:
        raise DrillctlError(
            "no PDF: it is printed by Chromium, which was not found; install it ('apt install "
            f"chromium', or Chrome or Edge), or name its command in {CHOICE}; any browser prints "
            "report.html to PDF as well"
        )
    target.unlink(missing_ok=True)
    with tempfile.TemporaryDirectory(prefix="drillctl-") as profile:
        options = [*OPTIONS, f"--user-data-dir={profile}", f"--print-to-pdf={target.resolve()}"]
        if hasattr(os, "geteuid") and os.geteuid() == 0:  # its sandbox refuses the superuser
            options.append("--no-sandbox")
        try:
            done = subprocess.run(
                [command, *options, page.resolve().as_uri()],
                capture_output=True, text=True, timeout=PATIENCE, check=False,
            )  # fmt: skip
        except (OSError, subprocess.TimeoutExpired) as error:
            raise DrillctlError(f"no PDF: {command} failed: {error}") from None
    if not target.is_file():
        last = (done.stderr.strip().splitlines() or ["it said nothing"])[-1]
        raise DrillctlError(f"no PDF: {command} wrote none: {last}")
    return target
