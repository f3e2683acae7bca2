"""The linear side: the string as a state-space plant, its loops, modes and frequency response.

- `state_space.py`: state matrices of the string and of its loops; `plant`, `closed_loop`,
  `open_loop` give them as `control.StateSpace` with named signals.
- `modal.py`: natural frequencies, damping ratios and shapes, top free and top held.
- `poles.py`: poles and their shapes in modal coordinates; what `modal.py` computes with.
- `response.py`: `frequency_response`, solved frequency by frequency from M, C and K.

Transfer functions are never formed: their coefficients lose all digits on a string of some
thirty elements. `control` is imported where a system is made and not before, as it is slow.
"""

from drillctl.linear.modal import Mode, Modes, modes
from drillctl.linear.response import (
    FrequencyResponse,
    frequency_response,
    telling_frequencies,
)
from drillctl.linear.state_space import closed_loop, open_loop, plant

__all__ = [
    "FrequencyResponse",
    "Mode",
    "Modes",
    "closed_loop",
    "frequency_response",
    "modes",
    "open_loop",
    "plant",
    "telling_frequencies",
]
