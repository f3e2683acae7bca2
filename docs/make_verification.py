"""Write the tables of verification.md from the tests: what they hold, and what they measure.

python docs/make_verification.py

A test file says in `HOLDS` what it holds to what; tests that take `figure` note what they measured.
"""

import ast
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "verification.md"


def held(root: Path = ROOT) -> dict[tuple[str, str], list[str]]:
    """Files by what they hold and what it is held to."""
    found: dict[tuple[str, str], list[str]] = {}
    for path in sorted((root / "tests").rglob("test_*.py")):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "HOLDS":
                for row in ast.literal_eval(node.value).items():
                    found.setdefault(row, []).append(path.relative_to(root).as_posix())
    return found


def rows(found: dict[tuple[str, str], list[str]]) -> str:
    """A table of what is held."""
    lines = ["| what | held to | test |", "|---|---|---|"]
    for (what, to), files in found.items():
        lines.append(f"| {what} | {to} | {', '.join(f'`{file}`' for file in files)} |")
    return "\n".join(lines)


def measured() -> list[dict[str, object]]:
    """What the tests that take `figure` have noted, in a run of their own."""
    files = [
        str(path)
        for path in sorted((ROOT / "tests").rglob("test_*.py"))
        if re.search(r"^def test_\w+\([^)]*\bfigure\b", path.read_text("utf-8"), re.MULTILINE)
    ]
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "figures.json"
        command = [sys.executable, "-m", "pytest", "-q", "-m", "not slow", "--figures", str(target)]
        subprocess.run([*command, *files], cwd=ROOT, check=True)
        found: list[dict[str, object]] = json.loads(target.read_text(encoding="utf-8"))
    return found


def figures(found: list[dict[str, object]]) -> str:
    """A table of figures; of several of one name from the least to the largest."""
    named: dict[tuple[str, str], list[float]] = {}
    for one in found:
        named.setdefault((str(one["figure"]), str(one["test"])), []).append(
            float(str(one["value"]))
        )
    lines = ["| figure | measured | test |", "|---|---|---|"]
    for (name, test), values in named.items():
        span = dict.fromkeys(f"{value:.3g}" for value in (min(values), max(values)))
        lines.append(f"| {name} | {' to '.join(span)} | `{test}` |")
    return "\n".join(lines)


def put(text: str, name: str, table: str) -> str:
    """The page with one of its tables made anew."""
    begin, end = f"<!-- {name}: begin, made by make_verification.py -->", f"<!-- {name}: end -->"
    head, rest = text.split(begin)
    return f"{head}{begin}\n{table}\n{end}{rest.split(end)[1]}"


def main() -> None:
    """Write both tables."""
    text = put(PAGE.read_text(encoding="utf-8"), "held", rows(held()))
    PAGE.write_text(put(text, "measured", figures(measured())), encoding="utf-8")


if __name__ == "__main__":
    main()
