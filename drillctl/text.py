"""Text from outside: what a terminal, HTML or SVG must not get is made visible.

Everything that is shown passes here once: text of a design when it is read, messages when they are
made, lines when they are printed.
"""

from __future__ import annotations

import re

LONGEST_NAME = 200  # characters of a name of a section or case
LONGEST_ERROR = 500  # characters of an error in all
LONGEST_PLACE = 240  # characters of it that say where

# Control characters but tab and line feed; marks that change the direction of what follows, hide
# or break lines; halves of characters; what XML does not allow. Joiners stay: emoji and whole
# scripts are written with them.
_HARMFUL = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\xad\u061c\u180e\u200b\u200e\u200f\u2028-\u202e\u2060-\u206f"
    "\ud800-\udfff\ufdd0-\ufdef\ufeff\ufff9-\ufffb\ufffe\uffff\U000e0000-\U000e007f]"
)
_BREAKS = re.compile(r"[\t\n]")


def _visible(found: re.Match[str]) -> str:
    return ascii(found[0])[1:-1]


def clean(text: str) -> str:
    r"""The text with control characters and marks of direction written out, such as `\x1b`."""
    return _HARMFUL.sub(_visible, text)


def one_line(text: str) -> str:
    """The same with tabs and line feeds written out as well."""
    return _BREAKS.sub(_visible, clean(text))


def shortened(text: str, most: int) -> str:
    """At most so many characters: beginning and end of a longer text."""
    if len(text) <= most:
        return text
    end = most // 4
    return f"{text[: most - end - 3]}...{text[len(text) - end :]}"
