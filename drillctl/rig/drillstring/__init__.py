"""The drillstring as torsional finite elements.

`section.py` holds a `Section` and its yield; `catalogue.py` pipes, collars and tools by name, and
tool joints; `assembly.py` puts sections, top drive and BHA together into M, C and K;
`frequencies.py` counts natural frequencies.

Node 0 is the top drive, the last node the BHA with the bit. Angles are absolute (rad).
"""

from __future__ import annotations

from drillctl.rig.drillstring.assembly import Drillstring, assemble
from drillctl.rig.drillstring.catalogue import PIPES, Joint, Pipe
from drillctl.rig.drillstring.section import GRADES, Parts, Section, polar_moment

__all__ = [
    "GRADES", "PIPES", "Drillstring", "Joint", "Parts", "Pipe", "Section", "assemble",
    "polar_moment",
]  # fmt: skip
