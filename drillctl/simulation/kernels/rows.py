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
WEIGHT = 56 * WIDTH
PROGRAM = 72 * WIDTH
MOST_FIELDS = {FRICTION: 32, DRIVE: 24, WEIGHT: 16, PROGRAM: 8}
"""Most numbers that a law may have, by where its rows begin."""

# Constants of a lane.
SET_SPEED = 80 * WIDTH  # rad/s
DRAG = 81 * WIDTH  # torque of all damping to ground at the set speed, N m
PIPE_OFFSET = 82 * WIDTH  # pipe torque that this drag causes, N m
TABLE_LOW = 83 * WIDTH  # range of the friction table, N
TABLE_HIGH = 84 * WIDTH

# State between steps.
ANGLE = 85 * WIDTH  # top-drive angle in the frame, rad
BIT_SPEED = 86 * WIDTH  # rad/s, absolute
KINETIC = 87 * WIDTH  # friction torque at that speed, signed, N m
DIRECTION = 88 * WIDTH  # +1, -1 turning; 0 stuck
LOAD = 89 * WIDTH  # weight on the bit, N
REST_LOAD = 90 * WIDTH  # weight on it were it at rest, on the mean over the step, N
REST_END = 91 * WIDTH  # the same at its end
HOLDING = 92 * WIDTH  # mean torque that held the bit in the last step, N m; -1 if none

# Program: set speed of the hour less the final one, and its integral at both ends of a step.
LEAD = 93 * WIDTH  # rad/s
SHIFT = 94 * WIDTH  # rad
SHIFT_NEW = 95 * WIDTH
NOMINAL = 96 * WIDTH  # final nominal weight, N

# Memory of a real drive.
TOP_SPEED = 97 * WIDTH  # top-drive speed in the frame, rad/s
SEEN = 98 * WIDTH  # the same as the encoder shows it
FELT = 99 * WIDTH  # torque felt, behind its filter, N m
SLOW = 100 * WIDTH  # its slow part, N m
INTEGRAL = 101 * WIDTH  # of the speed error, rad
MOTOR = 102 * WIDTH  # torque of the motor, N m
COMMAND = 103 * WIDTH  # of a sampled controller, N m
PENDING = 104 * WIDTH  # its next one, N m
SEEN_LAST = 105 * WIDTH  # speed that it saw last, rad/s
IMPULSE = 106 * WIDTH  # of the motor since then, N m s
LEAST = 107 * WIDTH  # limits of the torque in this step, N m
MOST = 108 * WIDTH
ERROR = 109 * WIDTH  # mean speed error but for what the end of the step adds, rad/s
MOVED = 110 * WIDTH  # by how much a limit of rate lets the motor move, N m; 0 if it does not limit

# Memory of a weight on bit on its way.
SIGNAL = 111 * WIDTH  # what stands for the bit speed, rad/s
SIGNAL_FIRST = 112 * WIDTH  # the same at the start
HOISTED = 113 * WIDTH  # weight at the end of the step, N
CALLED = 114 * WIDTH  # weight asked for at the end of the last step, N
LEVEL = 115 * WIDTH  # of an alarm: weight asked for over the nominal one
LEVEL_NEXT = 116 * WIDTH  # once it is known
LEVEL_FROM = 117 * WIDTH  # from when on, s
WINDOW_END = 118 * WIDTH  # s
WINDOW_LOW = 119 * WIDTH  # bit speed in the window, rad/s
WINDOW_HIGH = 120 * WIDTH
WINDOW_SUM = 121 * WIDTH
WINDOW_COUNT = 122 * WIDTH

# Torques of the step just taken, applied to the string by the next pass.
TOP_TORQUE = 123 * WIDTH  # net of DRAG, N m
BIT_TORQUE = 124 * WIDTH  # N m

# Sums of the pass over the string.
TOP_FREE = 125 * WIDTH  # top angle at the end of the step under no torque, rad
BIT_FREE = 126 * WIDTH  # bit speed (frame) at the end of the step under no torque, rad/s
TOP_SPEED_FREE = 127 * WIDTH  # top speed likewise, where something asks for it, rad/s
PIPE = 128 * WIDTH  # pipe torque at its beginning, N m

# Scratch of the scalar inclusion: u + half_gain T(u) = right.
OFFSET = 129 * WIDTH  # top torque were the bit torque zero, N m
SHARE = 130 * WIDTH  # top torque per bit torque
FREE = 131 * WIDTH  # bit speed were the bit torque zero, rad/s
GAIN = 132 * WIDTH  # its fall per bit torque, rad/s per N m
SIGN = 133 * WIDTH  # direction in which the bit would turn
OWN = 134 * WIDTH  # 1 if it keeps the direction it has
RIGHT = 135 * WIDTH
PER_GAIN = 136 * WIDTH  # 1 / GAIN
SPEED = 137 * WIDTH  # the unknown u, rad/s
SLOPE = 138 * WIDTH  # slope of the law where Newton last looked, N m s
OPEN = 139 * WIDTH  # 1 while Newton goes on
LOW_BOUND = 140 * WIDTH  # bracket of the unknown, rad/s
HIGH_BOUND = 141 * WIDTH
SHARE_NEW = OWN  # of smooth laws: gain of the torque at the end of the step, rad/s per N m

# What the step decides, until it is concluded.
NEW_SPEED = 142 * WIDTH
NEW_HOLDING = 143 * WIDTH
NEW_DIRECTION = 144 * WIDTH
NEW_KINETIC = 145 * WIDTH
SPEED_BEFORE = 146 * WIDTH  # bit speed at the beginning of the step, rad/s
TOP_SPEED_BEFORE = 147 * WIDTH  # top speed there, rad/s
LOAD_BEFORE = 148 * WIDTH  # weight on the bit there, N
STUCK_SHARE = 149 * WIDTH  # share of the step spent stuck

# Measures, in the order in which they leave the kernel.
J1 = 150 * WIDTH
STUCK_TIME = 151 * WIDTH
STICKS = 152 * WIDTH
LATE_LOW = 153 * WIDTH
LATE_HIGH = 154 * WIDTH
LATE_ANGLE = 155 * WIDTH
LATE_STUCK = 156 * WIDTH
BIT_ANGLE = 157 * WIDTH
LOW = 158 * WIDTH
HIGH = 159 * WIDTH
PEAK_PIPE = 160 * WIDTH
PEAK_TOP = 161 * WIDTH
OUTSIDE_NARROW = 162 * WIDTH
OUTSIDE_WIDE = 163 * WIDTH
WORK = 164 * WIDTH
WEIGHT_SUM = 165 * WIDTH
ROP_SUM = 166 * WIDTH
OUTSIDE_TABLE = 167 * WIDTH

ROWS = 168
FIRST_MEASURE = J1
MEASURES = ROWS - FIRST_MEASURE // WIDTH
"""Number of measures of a lane."""
