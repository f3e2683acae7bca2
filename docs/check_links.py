"""Every link, picture and anchor of a built site leads somewhere: `check_links.py FOLDER`.

Addresses on the network are left alone: whether a site elsewhere answers is not ours to decide.
"""

import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class Page(HTMLParser):
    """Where a page leads, and the anchors that it has."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.anchors: set[str] = set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note links and anchors of one tag."""
        told = {key: value for key, value in attrs if value}
        self.links += [told[key] for key in ("href", "src") if key in told]
        self.anchors |= {told[key] for key in ("id", "name") if key in told}


def broken(folder: Path) -> Iterator[str]:
    """What leads nowhere, as `page: link`."""
    pages = {path.resolve(): Page(path) for path in sorted(folder.rglob("*.html"))}
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not target.exists():
                yield f"{path.relative_to(folder.resolve())}: {link}"
                continue
            anchors = pages[target].anchors if target in pages else set()
            if parts.fragment and target in pages and unquote(parts.fragment) not in anchors:
                yield f"{path.relative_to(folder.resolve())}: {link}: no such anchor"


def main() -> int:
    """Tell what is broken; 1 if anything is."""
    folder = Path(sys.argv[1])
    found = list(broken(folder))
    sys.stderr.write("".join(f"{line}\n" for line in found))
    sys.stdout.write(f"links of {len(list(folder.rglob('*.html')))} pages: {len(found)} broken\n")
    return 1 if found else 0


if __name__ == "__main__":
    raise SystemExit(main())
