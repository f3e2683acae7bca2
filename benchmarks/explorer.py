"""How long a page of the explorer takes to answer, in Chromium, as a Markdown table.

    python -m benchmarks.explorer [--design NAME] [--changes N]

Times are those of the page: from the event of the mouse or slider to the frame in which the picture
stands. `drillctl explore` runs in a process of its own; its memory is that of this process. Run it
on an idle machine: the browser shares the cores.
"""

from __future__ import annotations

import argparse
import os
import re
import signal
import statistics
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.commands import _processor

PAPER = "monteiro-trindade-140kn"
ROUNDS = 30  # moves of a slider that are timed
DRAG = 6.0  # length of a drag (s)

LISTEN = """
() => {
  window.seen = { asked: {}, moved: {}, drew: [] };
  let moved = 0; // a place of the mouse may wait for the answer before
  document.addEventListener("pointermove", () => { moved = performance.now(); }, true);
  document.addEventListener("asked", e => {
    window.seen.asked[e.detail] = performance.now();
    window.seen.moved[e.detail] = moved;
  });
  document.addEventListener("drew", e => {
    const whole = document.body.dataset.map === "whole";
    requestAnimationFrame(() => setTimeout(() => {
      const now = performance.now();
      for (const [kind, count] of Object.entries(e.detail))
        window.seen.drew.push({
          kind, count, whole,
          after: now - window.seen.asked[count], moved: now - window.seen.moved[count],
        });
    }, 0));
  });
}
"""
SLIDE = """
([path, value]) => {
  const one = document.getElementById("c-" + path + "-range");
  one.value = value;
  one.dispatchEvent(new Event("input"));
  return Number(document.body.dataset.asked);
}
"""


class Page:
    """A page, with what it drew and when."""

    def __init__(self, browser: Any, address: str) -> None:
        self.page = browser.new_page(viewport={"width": 1280, "height": 720})
        self.page.goto(address)
        self.page.wait_for_function("'map' in document.body.dataset", timeout=60_000)

    def listen(self) -> None:
        self.page.wait_for_function("document.body.dataset.map === 'whole'", timeout=60_000)
        self.page.evaluate(LISTEN)

    def slide(self, path: str, value: float) -> tuple[float, float]:
        """Times (ms) to the first picture and to the whole map."""
        self.page.wait_for_function(
            "document.body.dataset.asked === document.body.dataset.answered"
        )
        count = self.page.evaluate(SLIDE, [path, value])
        mine = f"window.seen.drew.filter(d => d.kind === 'map' && d.count === {count})"
        self.page.wait_for_function(f"{mine}.some(d => d.whole)", timeout=60_000)
        times = self.page.evaluate(f"{mine}.map(d => [d.after, d.whole])")
        return times[0][0], next(after for after, whole in times if whole)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--design", default=PAPER)
    parser.add_argument("--changes", type=int, default=1000, help="changes over which memory grows")
    given = parser.parse_args(arguments)
    from playwright.sync_api import sync_playwright

    from drillctl.reporting.pages import browser as installed

    print(f"{_processor()}, {os.cpu_count()} cores\n\n| | figure | at most |\n|---|---|---|")
    with sync_playwright() as started:
        chromium = started.chromium.launch(executable_path=installed(), args=["--no-sandbox"])
        _served(given.design, chromium)  # kernels on disk
        _all(given.design, chromium, given.changes)
        chromium.close()


def _served(design: str, chromium: Any) -> None:
    process, address, _ = _start(design)
    Page(chromium, address).page.close()
    _end(process)


def _start(design: str) -> tuple[subprocess.Popen[str], str, float]:
    begin = time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, "-m", "drillctl", "explore", design, "--no-browser"], text=True,
        stdout=subprocess.PIPE, env=os.environ | {"PYTHONUNBUFFERED": "1"},
    )  # fmt: skip
    assert process.stdout is not None
    found = re.search(r"http://\S+", process.stdout.readline())
    assert found is not None
    return process, found[0], begin


def _end(process: subprocess.Popen[str]) -> None:
    process.send_signal(signal.SIGINT)
    process.wait(timeout=30)


def _row(name: str, figure: str, most: str) -> None:
    print(f"| {name} | {figure} | {most} |", flush=True)


def _all(design: str, chromium: Any, changes: int) -> None:
    process, address, begin = _start(design)
    one = Page(chromium, address)
    _row("from the command to the first map", f"{time.perf_counter() - begin:.1f} s", "5 s")
    one.listen()
    # What comes by itself after the first map is over: audit and recommendation.
    one.page.wait_for_function(
        "/passes|fragile|none/.test(document.getElementById('sentence').className)", timeout=180_000
    )
    weights = [100 + k % 40 for k in range(0, 7 * ROUNDS, 7)]
    _sliders(one, "weight slider", "operating_point-weight_on_bit", weights, "120 ms")
    _sliders(one, "depth slider", "depth", [2000 + 50 * (k % 37) for k in range(ROUNDS)], "300 ms")
    one.slide("operating_point-weight_on_bit", 140)
    one.slide("depth", 3000)
    _drag(one)
    _rocks(one)
    _memory(one, process, changes)
    _three(one, chromium, address)
    _end(process)


def _sliders(one: Page, name: str, path: str, values: list[int], most: str) -> None:
    times = [one.slide(path, value) for value in values]
    first, whole = (statistics.median(column) for column in zip(*times, strict=True))
    worst = max(time for time, _ in times)
    _row(f"{name} to a coarse map, median", f"{first:.0f} ms (worst {worst:.0f})", most)
    _row(
        f"{name} to the whole map, median", f"{whole:.0f} ms", "400 ms" if "weight" in name else ""
    )


def _drag(one: Page) -> None:
    box = one.page.locator("#map").bounding_box()
    x, y = box["x"] + 0.6 * box["width"], box["y"] + 0.6 * box["height"]
    one.page.mouse.move(x, y)
    one.page.mouse.down()
    one.page.evaluate("() => { window.seen.drew = []; }")
    begin, step = time.perf_counter(), 0
    while time.perf_counter() - begin < DRAG:
        step += 1
        one.page.mouse.move(x - 60 + step % 120, y - 30 + step % 60)
        time.sleep(1 / 60)
    seconds = time.perf_counter() - begin
    drew = one.page.evaluate("window.seen.drew")
    one.page.mouse.up()
    runs = [d["moved"] for d in drew if d["kind"] == "response"]
    loops = [d for d in drew if d["kind"] == "loop"]
    _row("drag: responses a second", f"{len(runs) / seconds:.0f}", "at least 15")
    far = statistics.quantiles(runs, n=20)[-1]
    _row("drag: from the mouse to the response, median (95 %)",
         f"{statistics.median(runs):.0f} ms ({far:.0f})", "60 ms")  # fmt: skip
    _row("drag: frequency pictures a second", f"{len(loops) / seconds:.0f}", "at least 4")


def _rocks(one: Page) -> None:
    begin = time.perf_counter()
    one.page.select_option("#mode", "200")
    said = "document.getElementById('map-said').textContent"
    one.page.wait_for_function(f"{said}.includes('of 200 rocks')", timeout=60_000)
    first = time.perf_counter() - begin
    one.page.wait_for_function(f"{said}.startsWith('share of 200 of')", timeout=120_000)
    _row("200 drawn rocks: first picture", f"{first:.2f} s", "1 s")
    _row("200 drawn rocks: all", f"{time.perf_counter() - begin:.1f} s", "25 s")
    one.page.select_option("#mode", "0")


def _memory(one: Page, process: subprocess.Popen[str], changes: int) -> None:
    sizes = []
    for change in range(changes):
        one.slide("operating_point-weight_on_bit", 100 + change % 40)
        sizes.append(_resident(process.pid))
    tail = sizes[len(sizes) // 5 :]
    slope = statistics.linear_regression(range(len(tail)), tail).slope
    _row(f"memory after {changes} changes", f"{sizes[-1] / 1024:.0f} MiB", "700 MiB")
    _row("memory a change, over the last four fifths", f"{slope:.1f} KiB", "20 KiB")


def _resident(pid: int) -> int:
    """KiB in memory of a process."""
    found = re.search(r"VmRSS:\s+(\d+) kB", Path(f"/proc/{pid}/status").read_text())
    assert found is not None
    return int(found[1])


def _three(one: Page, chromium: Any, address: str) -> None:
    pages = [one, Page(chromium, address), Page(chromium, address)]
    for other in pages[1:]:
        other.listen()
    times: list[float] = []
    for turn in range(10):
        counts = [
            page.page.evaluate(SLIDE, ["operating_point-weight_on_bit", 100 + turn * 3 + k])
            for k, page in enumerate(pages)
        ]
        for page, count in zip(pages, counts, strict=True):
            mine = f"window.seen.drew.filter(d => d.kind === 'map' && d.count === {count})"
            page.page.wait_for_function(f"{mine}.some(d => d.whole)", timeout=60_000)
            times.append(page.page.evaluate(f"{mine}[0].after"))
    _row("three pages at once: coarse map, median (worst)",
         f"{statistics.median(times):.0f} ms ({max(times):.0f})", "400 ms")  # fmt: skip


if __name__ == "__main__":
    main()
