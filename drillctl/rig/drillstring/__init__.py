"""The drillstring as torsional finite elements.

`section.py` turns geometry or direct values into a `Section` and holds the table of API pipes;
`assembly.py` puts sections, top drive and BHA together into M, C and K; `frequencies.py` counts
natural frequencies.

Node 0 is the top drive, the last node the BHA with the bit. Angles are absolute (rad).
"""

from __future__ import annotations

from drillctl.rig.drillstring.assembly import Drillstring, assemble
from drillctl.rig.drillstring.section import GRADES, PIPES, Parts, Pipe, Section, polar_moment

__all__ = ["GRADES", "PIPES", "Drillstring", "Parts", "Pipe", "Section", "assemble", "polar_moment"]
