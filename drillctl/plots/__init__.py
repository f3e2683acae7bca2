"""Figures of what the other rooms compute.

- `modes.py`: `mode_shapes`, angle and torque of the modes along the string.
- `frequency.py`: `bode`, response of the speeds to the top torque.
- `friction.py`: `friction_curves`, bit torque against bit speed at each weight on bit.
- `map.py`: `stability_map` with regions and audit; `sweep_line` for a single parameter.
- `time_response.py`: `time_response`, speeds against time with sticks shaded.
- `style.py`: colours, sizes and the making of figures, shared by all.

Every function takes `ax`, the axes to draw on, or makes a figure of its own; it returns the
figure and never shows it. Nothing here touches the state of pyplot. Axes are in the units of
the rig floor: rpm, kN, kN m, m.
"""

from drillctl.plots.frequency import bode
from drillctl.plots.friction import friction_curves
from drillctl.plots.map import stability_map, sweep_line
from drillctl.plots.modes import mode_shapes
from drillctl.plots.time_response import time_response

__all__ = [
    "bode",
    "friction_curves",
    "mode_shapes",
    "stability_map",
    "sweep_line",
    "time_response",
]
