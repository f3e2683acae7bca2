"""Draw explorer.png: the page of the paper's rig in a browser, after its recommendation has come.

python docs/make_explorer.py
"""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

from drillctl.reporting.pages import browser

HERE = Path(__file__).resolve().parent
ADVISED = "/passes|fragile|none/.test(document.getElementById('sentence').className)"


def main() -> None:
    """Open a page, drag nothing, and take its picture."""
    process = subprocess.Popen(
        [sys.executable, "-m", "drillctl", "explore", "monteiro-trindade-140kn", "--no-browser"],
        text=True,
        stdout=subprocess.PIPE,
        env=os.environ | {"PYTHONUNBUFFERED": "1"},
    )
    assert process.stdout is not None
    address = re.search(r"http://\S+", process.stdout.readline())
    assert address is not None
    with sync_playwright() as started:
        chromium = started.chromium.launch(executable_path=browser(), args=["--no-sandbox"])
        page = chromium.new_page(viewport={"width": 1280, "height": 720}, color_scheme="light")
        page.goto(address[0])
        page.wait_for_function(ADVISED, timeout=300_000)
        page.screenshot(path=HERE / "explorer.png")
        chromium.close()
    process.send_signal(signal.SIGINT)
    process.wait()


if __name__ == "__main__":
    main()
