"""The drillstring as torsional finite elements.

`section.py` turns geometry or direct values into a `Section`; `pipes.py` is the table of API
pipes; `assembly.py` puts sections, top drive and BHA together into M, C and K.

Node 0 is the top drive, the last node the BHA with the bit. Angles are absolute (rad).
"""

from drillctl.drillstring.assembly import Drillstring, Parts, assemble
from drillctl.drillstring.pipes import GRADES, PIPES, Pipe
from drillctl.drillstring.section import Section, polar_moment

__all__ = ["GRADES", "PIPES", "Drillstring", "Parts", "Pipe", "Section", "assemble", "polar_moment"]
