"""Figures of what the other rooms compute.

- `modes.py`: `mode_shapes`, angle and torque of the modes along the string.
- `frequency.py`: `bode`, response of the speeds to the top torque.
- `friction.py`: `friction_curves`, bit torque against bit speed at each weight on bit.
- `style.py`: colours, sizes and the making of figures, shared by all.

Every function takes `ax`, the axes to draw on, or makes a figure of its own; it returns the
figure and never shows it. Nothing here touches the state of pyplot. Axes are in the units of
the rig floor: rpm, kN, kN m, m.
"""

from drillctl.plots.frequency import bode
from drillctl.plots.friction import friction_curves
from drillctl.plots.modes import mode_shapes

__all__ = ["bode", "friction_curves", "mode_shapes"]
