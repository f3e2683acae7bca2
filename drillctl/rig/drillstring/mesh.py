"""Elements of a string where a design names none, chosen by what is asked of the mesh.

Asked is that the first `ASKED` elastic frequencies, with the top free and held, lie within
`WITHIN` of those of the exact line. A piece shorter than `SHORT` of an element is made one with a
neighbour that is left to the choice as well, its inertia, compliance and damping kept: alone it
would add a frequency far above all others and nothing to those asked for.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drillctl.rig.drillstring.frequencies import frequency_counter, natural_frequencies
from drillctl.rig.drillstring.section import Parts, Section

ASKED = 5  # elastic frequencies that are asked for
WITHIN = 0.0025
"""How far they may be from those of the exact line, relative: 0.3 % is promised of the string
itself, of which tool joints and lumped pieces take a part."""
SHORT = 0.5  # length of a piece under which it is lumped, over that of an element, in travel time
EXACT = 20_000  # elements that stand for the continuum: 1e-7 off where a length holds ten waves
MOST_CHOSEN = 3_000  # elements of a length; beyond them the given sections or rounding decide


@lru_cache(maxsize=16)  # thousands of draws of a rock share a string
def meshed(parts: Parts, free: tuple[bool, ...]) -> tuple[Section, ...]:
    """Sections of a string with the elements of the `free` ones chosen, the others as given."""
    if not any(free):
        return parts.sections
    asked = {held: _frequencies(parts, free, held, ASKED) for held in (False, True)}
    highest = max(float(x.max(initial=0.0)) for x in asked.values())
    total = sum(x.travel_time for x, own in zip(parts.sections, free, strict=True) if own)
    # Of equal elements, each a phase w h long, a frequency is (w h)^2 / 24 too high.
    count = max(1, int(0.8 * highest * total / math.sqrt(24.0 * WITHIN)))
    while True:
        sections = _of_elements(parts.sections, free, total / count)
        if count >= MOST_CHOSEN or _within(parts, sections, asked, WITHIN):
            return sections
        count += max(1, count // 40)


class MeshedSection(NamedTuple):
    """What became of a section of a design."""

    name: str
    elements: int  # 0 where it was lumped
    length: float  # of an element (m); NaN where it was lumped, or of a lumped spring
    chosen: bool  # whether its elements were chosen, not given
    lumped_into: str  # section that holds it as well; empty for none

    @property
    def said(self) -> str:
        """The same in words."""
        if self.lumped_into:
            return f"lumped into {self.lumped_into}"
        if math.isnan(self.length):
            return "lumped spring"
        return "chosen" if self.chosen else "given"

    def summary(self) -> dict[str, Any]:
        """As strict JSON values."""
        length = None if math.isnan(self.length) else self.length
        return self._asdict() | {"length": length, "lumped_into": self.lumped_into or None}


def what_was_done(
    sections: tuple[Section, ...], names: Iterable[str], free: Iterable[bool]
) -> tuple[MeshedSection, ...]:
    """The mesh by the sections of the design, from top to bottom."""
    holder = {name: made for made in sections for name in (made.name, *made.lumped)}
    result = []
    for name, chosen in zip(names, free, strict=True):
        made = holder[name]
        if made.name == name:
            length = made.length / made.elements if made.inertia else math.nan
            result.append(MeshedSection(name, made.elements, length, chosen, ""))
        else:
            result.append(MeshedSection(name, 0, math.nan, chosen, made.name))
    return tuple(result)


@lru_cache(maxsize=16)
def off_the_line(parts: Parts, within: float) -> bool:
    """Whether any of the first `ASKED` frequencies is further from those of the exact line."""
    free = tuple(x.inertia > 0.0 for x in parts.sections)
    asked = {held: _frequencies(parts, free, held, ASKED) for held in (False, True)}
    return not _within(parts, parts.sections, asked, within)


def _frequencies(
    parts: Parts, free: tuple[bool, ...], held: bool, count: int
) -> NDArray[np.float64]:
    """The lowest elastic frequencies (rad/s) with the free sections as continua."""
    exact = tuple(
        replace(x, elements=EXACT) if own else x
        for x, own in zip(parts.sections, free, strict=True)
    )
    lowest = natural_frequencies(
        replace(parts, sections=exact), "finite-elements", count + (not held), held, bisections=36
    )
    return lowest[lowest > 0.0]


def _within(
    parts: Parts,
    sections: tuple[Section, ...],
    asked: dict[bool, NDArray[np.float64]],
    share: float,
) -> bool:
    """Whether each frequency asked for has its own in the mesh within a share of itself."""
    made = replace(parts, sections=sections)
    for held, exact in asked.items():
        below = frequency_counter(made, "finite-elements", top_held=held)
        order = np.arange(len(exact)) + (not held)  # the rigid body is the first of a free string
        low, high = np.split(below(np.concatenate([exact * (1 - share), exact * (1 + share)])), 2)
        if (low > order).any() or (high <= order).any():
            return False
    return True


def _of_elements(
    sections: tuple[Section, ...], free: tuple[bool, ...], longest: float
) -> tuple[Section, ...]:
    """Short pieces lumped, and elements of a travel time of at most `longest` (s)."""
    made = list(zip(sections, free, strict=True))
    while (place := _shortest(made, SHORT * longest)) is not None:
        made[place : place + 2] = [(_one(made[place][0], made[place + 1][0]), True)]
    return tuple(
        replace(x, elements=max(1, math.ceil(x.travel_time / longest * (1.0 - 1e-12))))
        if own
        else x
        for x, own in made
    )


def _shortest(made: list[tuple[Section, bool]], least: float) -> int | None:
    """Upper of the two neighbours to lump next: the shortest piece with its shorter neighbour."""
    times = [x.travel_time for x, _ in made]
    pairs = [i for i in range(len(made) - 1) if made[i][1] and made[i + 1][1]]
    # An inertia between two pieces goes to the end of both, where that is near.
    pairs = [i for i in pairs if made[i][0].end_inertia == 0.0 or times[i + 1] < times[i]]
    short = [i for i in pairs if min(times[i], times[i + 1]) < least]
    return min(
        short,
        key=lambda i: (min(times[i], times[i + 1]), max(times[i], times[i + 1])),
        default=None,
    )


def _one(upper: Section, lower: Section) -> Section:
    """Two pieces as one: inertia, compliance and damping of slow motion are theirs together."""
    pieces = (upper, lower)
    longer = max(pieces, key=lambda x: x.travel_time)
    other = lower if longer is upper else upper
    stiffness = 1.0 / sum(1.0 / x.stiffness for x in pieces)
    inertia = sum(x.inertia for x in pieces)
    share = [stiffness / x.stiffness for x in pieces]  # of the twist
    return replace(
        longer,
        elements=1,
        stiffness=stiffness,
        inertia=inertia,
        end_inertia=upper.end_inertia + lower.end_inertia,
        length=upper.length + lower.length,
        coupling_damping=sum(
            x.coupling_damping * part**2 for x, part in zip(pieces, share, strict=True)
        ),
        stiffness_damping=sum(
            x.stiffness_damping * part for x, part in zip(pieces, share, strict=True)
        ),
        mass_damping=sum(x.mass_damping * x.inertia for x in pieces) / inertia,
        drag=upper.drag + lower.drag,
        yield_torque=min(x.yield_torque for x in pieces),
        lumped=(*longer.lumped, other.name, *other.lumped),
    )
