"""Rows of the working array of a block: one row a quantity, one column a lane.

All scratch of a block lies in one flat array, row after row, and the names below are where
the rows begin. With the width a constant the compiler knows every distance, sees that no two
rows overlap, and turns the loops over lanes into vector instructions.
"""

import os

WIDTH = int(os.environ.get("DRILLCTL_BLOCK_WIDTH", "16"))
"""Lanes in a block: a few vector registers' worth, so that the state of thirty modes stays in
the first cache. A matter of speed alone: no result depends on it, to the last bit."""

LAW_FIELDS = 8
"""Most numbers that a law may have: the rows kept for each."""

# Law parameters.
FRICTION = 0 * WIDTH
DRIVE = 8 * WIDTH
WEIGHT = 16 * WIDTH

# Constants of a lane.
SET_SPEED = 24 * WIDTH  # rad/s
DRAG = 25 * WIDTH  # torque of all damping to ground at the set speed, N m
PIPE_OFFSET = 26 * WIDTH  # pipe torque that this drag causes, N m

# State between steps.
ANGLE = 27 * WIDTH  # top-drive angle in the frame, rad
BIT_SPEED = 28 * WIDTH  # rad/s, absolute
KINETIC = 29 * WIDTH  # friction torque at that speed, signed, N m
DIRECTION = 30 * WIDTH  # +1, -1 turning; 0 stuck
HOLDING = 31 * WIDTH  # mean torque that held the bit in the last step, N m; -1 if none

# Torques of the step just taken, applied to the string by the next pass.
TOP_TORQUE = 32 * WIDTH  # net of DRAG, N m
BIT_TORQUE = 33 * WIDTH  # N m

# Sums of the pass over the string.
TOP_FREE = 34 * WIDTH  # top angle at the end of the step under no torque, rad
BIT_FREE = 35 * WIDTH  # bit speed (frame) at the end of the step under no torque, rad/s
PIPE = 36 * WIDTH  # pipe torque at its beginning, N m

# Scratch of the scalar inclusion: u + half_gain T(u) = right.
OFFSET = 37 * WIDTH  # top torque were the bit torque zero, N m
SHARE = 38 * WIDTH  # top torque per bit torque
FREE = 39 * WIDTH  # bit speed were the bit torque zero, rad/s
GAIN = 40 * WIDTH  # its fall per bit torque, rad/s per N m
SIGN = 41 * WIDTH  # direction in which the bit would turn
LOAD = 42 * WIDTH  # weight on bit, N
OWN = 43 * WIDTH  # 1 if it keeps the direction it has
RIGHT = 44 * WIDTH
PER_GAIN = 45 * WIDTH  # 1 / GAIN
SPEED = 46 * WIDTH  # the unknown u, rad/s
SLOPE = 47 * WIDTH  # slope of the law where Newton last looked, N m s
OPEN = 48 * WIDTH  # 1 while Newton goes on


# What the step decides, until it is concluded.
NEW_SPEED = 49 * WIDTH
NEW_HOLDING = 50 * WIDTH
NEW_DIRECTION = 51 * WIDTH
NEW_KINETIC = 52 * WIDTH
SPEED_BEFORE = 53 * WIDTH  # bit speed at the beginning of the step, rad/s
STUCK_SHARE = 54 * WIDTH  # share of the step spent stuck

# Measures, in the order in which they leave the kernel.
J1 = 55 * WIDTH
STUCK_TIME = 56 * WIDTH
STICKS = 57 * WIDTH
LATE_LOW = 58 * WIDTH
LATE_HIGH = 59 * WIDTH
LATE_ANGLE = 60 * WIDTH
LATE_STUCK = 61 * WIDTH
BIT_ANGLE = 62 * WIDTH
LOW = 63 * WIDTH
HIGH = 64 * WIDTH
PEAK_PIPE = 65 * WIDTH
PEAK_TOP = 66 * WIDTH
OUTSIDE_NARROW = 67 * WIDTH
OUTSIDE_WIDE = 68 * WIDTH
WORK = 69 * WIDTH
WEIGHT_SUM = 70 * WIDTH
ROP_SUM = 71 * WIDTH

ROWS = 72
FIRST_MEASURE = J1
MEASURES = ROWS - FIRST_MEASURE // WIDTH
"""Number of measures of a lane."""
