"""Rows of the working array of a block: one row a quantity, one column a lane.

All scratch of a block lies in one flat array, row after row, and the names below are where
the rows begin. With the width a constant the compiler knows every distance, sees that no two
rows overlap, and turns the loops over lanes into vector instructions.
"""

import os

WIDTH = int(os.environ.get("DRILLCTL_BLOCK_WIDTH", "16"))
"""Lanes in a block: a few vector registers' worth, so that the state of thirty modes stays in
the first cache. A matter of speed alone: no result depends on it, to the last bit."""

# Law parameters, as many rows as the law of that kind with the most numbers needs.
FRICTION = 0 * WIDTH
DRIVE = 32 * WIDTH
WEIGHT = 48 * WIDTH
MOST_FIELDS = 32
"""Most numbers that a bit-rock law may have; the others have room for 16."""

# Constants of a lane.
SET_SPEED = 64 * WIDTH  # rad/s
DRAG = 65 * WIDTH  # torque of all damping to ground at the set speed, N m
PIPE_OFFSET = 66 * WIDTH  # pipe torque that this drag causes, N m

# State between steps.
ANGLE = 67 * WIDTH  # top-drive angle in the frame, rad
BIT_SPEED = 68 * WIDTH  # rad/s, absolute
KINETIC = 69 * WIDTH  # friction torque at that speed, signed, N m
DIRECTION = 70 * WIDTH  # +1, -1 turning; 0 stuck
HOLDING = 71 * WIDTH  # mean torque that held the bit in the last step, N m; -1 if none

# Torques of the step just taken, applied to the string by the next pass.
TOP_TORQUE = 72 * WIDTH  # net of DRAG, N m
BIT_TORQUE = 73 * WIDTH  # N m

# Sums of the pass over the string.
TOP_FREE = 74 * WIDTH  # top angle at the end of the step under no torque, rad
BIT_FREE = 75 * WIDTH  # bit speed (frame) at the end of the step under no torque, rad/s
PIPE = 76 * WIDTH  # pipe torque at its beginning, N m

# Scratch of the scalar inclusion: u + half_gain T(u) = right.
OFFSET = 77 * WIDTH  # top torque were the bit torque zero, N m
SHARE = 78 * WIDTH  # top torque per bit torque
FREE = 79 * WIDTH  # bit speed were the bit torque zero, rad/s
GAIN = 80 * WIDTH  # its fall per bit torque, rad/s per N m
SIGN = 81 * WIDTH  # direction in which the bit would turn
LOAD = 82 * WIDTH  # weight on bit, N
OWN = 83 * WIDTH  # 1 if it keeps the direction it has
RIGHT = 84 * WIDTH
PER_GAIN = 85 * WIDTH  # 1 / GAIN
SPEED = 86 * WIDTH  # the unknown u, rad/s
SLOPE = 87 * WIDTH  # slope of the law where Newton last looked, N m s
OPEN = 88 * WIDTH  # 1 while Newton goes on
# Of smooth laws beside these.
SHARE_NEW = OWN  # gain of the torque at the end of the step, rad/s per N m
LOW_BOUND = 112 * WIDTH  # bracket of the unknown, rad/s
HIGH_BOUND = 113 * WIDTH


# What the step decides, until it is concluded.
NEW_SPEED = 89 * WIDTH
NEW_HOLDING = 90 * WIDTH
NEW_DIRECTION = 91 * WIDTH
NEW_KINETIC = 92 * WIDTH
SPEED_BEFORE = 93 * WIDTH  # bit speed at the beginning of the step, rad/s
STUCK_SHARE = 94 * WIDTH  # share of the step spent stuck

# Measures, in the order in which they leave the kernel.
J1 = 95 * WIDTH
STUCK_TIME = 96 * WIDTH
STICKS = 97 * WIDTH
LATE_LOW = 98 * WIDTH
LATE_HIGH = 99 * WIDTH
LATE_ANGLE = 100 * WIDTH
LATE_STUCK = 101 * WIDTH
BIT_ANGLE = 102 * WIDTH
LOW = 103 * WIDTH
HIGH = 104 * WIDTH
PEAK_PIPE = 105 * WIDTH
PEAK_TOP = 106 * WIDTH
OUTSIDE_NARROW = 107 * WIDTH
OUTSIDE_WIDE = 108 * WIDTH
WORK = 109 * WIDTH
WEIGHT_SUM = 110 * WIDTH
ROP_SUM = 111 * WIDTH

ROWS = 114
FIRST_MEASURE = J1
MEASURES = 112 - FIRST_MEASURE // WIDTH
"""Number of measures of a lane."""
