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
TABLE_LOW = 67 * WIDTH  # range of the friction table, N
TABLE_HIGH = 68 * WIDTH

# State between steps.
ANGLE = 69 * WIDTH  # top-drive angle in the frame, rad
BIT_SPEED = 70 * WIDTH  # rad/s, absolute
KINETIC = 71 * WIDTH  # friction torque at that speed, signed, N m
DIRECTION = 72 * WIDTH  # +1, -1 turning; 0 stuck
LOAD = 73 * WIDTH  # weight on the bit, N
REST_LOAD = 74 * WIDTH  # weight on it were it at rest, N
HOLDING = 75 * WIDTH  # mean torque that held the bit in the last step, N m; -1 if none

# Torques of the step just taken, applied to the string by the next pass.
TOP_TORQUE = 76 * WIDTH  # net of DRAG, N m
BIT_TORQUE = 77 * WIDTH  # N m

# Sums of the pass over the string.
TOP_FREE = 78 * WIDTH  # top angle at the end of the step under no torque, rad
BIT_FREE = 79 * WIDTH  # bit speed (frame) at the end of the step under no torque, rad/s
PIPE = 80 * WIDTH  # pipe torque at its beginning, N m

# Scratch of the scalar inclusion: u + half_gain T(u) = right.
OFFSET = 81 * WIDTH  # top torque were the bit torque zero, N m
SHARE = 82 * WIDTH  # top torque per bit torque
FREE = 83 * WIDTH  # bit speed were the bit torque zero, rad/s
GAIN = 84 * WIDTH  # its fall per bit torque, rad/s per N m
SIGN = 85 * WIDTH  # direction in which the bit would turn
OWN = 86 * WIDTH  # 1 if it keeps the direction it has
RIGHT = 87 * WIDTH
PER_GAIN = 88 * WIDTH  # 1 / GAIN
SPEED = 89 * WIDTH  # the unknown u, rad/s
SLOPE = 90 * WIDTH  # slope of the law where Newton last looked, N m s
OPEN = 91 * WIDTH  # 1 while Newton goes on
LOW_BOUND = 92 * WIDTH  # bracket of the unknown, rad/s
HIGH_BOUND = 93 * WIDTH
SHARE_NEW = OWN  # of smooth laws: gain of the torque at the end of the step, rad/s per N m


# What the step decides, until it is concluded.
NEW_SPEED = 94 * WIDTH
NEW_HOLDING = 95 * WIDTH
NEW_DIRECTION = 96 * WIDTH
NEW_KINETIC = 97 * WIDTH
SPEED_BEFORE = 98 * WIDTH  # bit speed at the beginning of the step, rad/s
LOAD_BEFORE = 99 * WIDTH  # weight on the bit there, N
STUCK_SHARE = 100 * WIDTH  # share of the step spent stuck

# Measures, in the order in which they leave the kernel.
J1 = 101 * WIDTH
STUCK_TIME = 102 * WIDTH
STICKS = 103 * WIDTH
LATE_LOW = 104 * WIDTH
LATE_HIGH = 105 * WIDTH
LATE_ANGLE = 106 * WIDTH
LATE_STUCK = 107 * WIDTH
BIT_ANGLE = 108 * WIDTH
LOW = 109 * WIDTH
HIGH = 110 * WIDTH
PEAK_PIPE = 111 * WIDTH
PEAK_TOP = 112 * WIDTH
OUTSIDE_NARROW = 113 * WIDTH
OUTSIDE_WIDE = 114 * WIDTH
WORK = 115 * WIDTH
WEIGHT_SUM = 116 * WIDTH
ROP_SUM = 117 * WIDTH
OUTSIDE_TABLE = 118 * WIDTH

ROWS = 119
FIRST_MEASURE = J1
MEASURES = ROWS - FIRST_MEASURE // WIDTH
"""Number of measures of a lane."""
