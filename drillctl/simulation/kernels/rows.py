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
WEIGHT = 64 * WIDTH
PROGRAM = 80 * WIDTH
MOST_FIELDS = {FRICTION: 32, DRIVE: 32, WEIGHT: 16, PROGRAM: 8}
"""Most numbers that a law may have, by where its rows begin."""

# Constants of a lane.
SET_SPEED = 88 * WIDTH  # rad/s
DRAG = 89 * WIDTH  # torque of all damping to ground at the set speed, N m
PIPE_OFFSET = 90 * WIDTH  # pipe torque that this drag causes, N m
TABLE_LOW = 91 * WIDTH  # range of the friction table, N
TABLE_HIGH = 92 * WIDTH

# State between steps.
ANGLE = 93 * WIDTH  # top-drive angle in the frame, rad
BIT_SPEED = 94 * WIDTH  # rad/s, absolute
KINETIC = 95 * WIDTH  # friction torque at that speed, signed, N m
DIRECTION = 96 * WIDTH  # +1, -1 turning; 0 stuck
LOAD = 97 * WIDTH  # weight on the bit, N
REST_LOAD = 98 * WIDTH  # weight on it were it at rest, on the mean over the step, N
REST_END = 99 * WIDTH  # the same at its end
HELD_REST = 100 * WIDTH  # friction over a table at the weights of this step, `held_rock.HeldRock`
HELD_LEVEL = 101 * WIDTH
HELD_SPREAD = 102 * WIDTH
HELD_DECAY = 103 * WIDTH
HOLDING = 104 * WIDTH  # mean torque that held the bit in the last step, N m; -1 if none

# Program: set speed of the hour less the final one, and its integral at both ends of a step.
LEAD = 105 * WIDTH  # rad/s
SHIFT = 106 * WIDTH  # rad
SHIFT_NEW = 107 * WIDTH
NOMINAL = 108 * WIDTH  # final nominal weight, N

# Memory of a real drive.
TOP_SPEED = 109 * WIDTH  # top-drive speed in the frame, rad/s
SEEN = 110 * WIDTH  # the same as the encoder shows it
FELT = 111 * WIDTH  # torque felt, behind its filter, N m
SLOW = 112 * WIDTH  # its slow part, N m
INTEGRAL = 113 * WIDTH  # of the speed error, rad
MOTOR = 114 * WIDTH  # torque of the motor, N m
COMMAND = 115 * WIDTH  # of a sampled controller, N m
PENDING = 116 * WIDTH  # its next one, N m
SEEN_LAST = 117 * WIDTH  # speed that it saw last, rad/s
IMPULSE = 118 * WIDTH  # of the motor since then, N m s
LEAST = 119 * WIDTH  # limits of the torque in this step, N m
MOST = 120 * WIDTH
ERROR = 121 * WIDTH  # mean speed error but for what the end of the step adds, rad/s
MOVED = 122 * WIDTH  # by how much a limit of rate lets the motor move, N m; 0 if it does not limit

# Memory of a weight on bit on its way.
SIGNAL = 123 * WIDTH  # what stands for the bit speed, rad/s
HOISTED = 124 * WIDTH  # weight at the end of the step, N
CALLED = 125 * WIDTH  # weight asked for at the end of the last step, N
LEVEL = 126 * WIDTH  # of an alarm: weight asked for over the nominal one
LEVEL_NEXT = 127 * WIDTH  # once it is known
LEVEL_FROM = 128 * WIDTH  # from when on, s
WINDOW_END = 129 * WIDTH  # s
WINDOW_LOW = 130 * WIDTH  # bit speed in the window, rad/s
WINDOW_HIGH = 131 * WIDTH
WINDOW_SUM = 132 * WIDTH
WINDOW_COUNT = 133 * WIDTH

# Torques of the step just taken, applied to the string by the next pass.
TOP_TORQUE = 134 * WIDTH  # net of DRAG, N m
BIT_TORQUE = 135 * WIDTH  # N m

# Sums of the pass over the string.
TOP_FREE = 136 * WIDTH  # top angle at the end of the step under no torque, rad
BIT_FREE = 137 * WIDTH  # bit speed (frame) at the end of the step under no torque, rad/s
TOP_SPEED_FREE = 138 * WIDTH  # top speed likewise, where something asks for it, rad/s
PIPE = 139 * WIDTH  # pipe torque at its beginning, N m

# Scratch of the scalar inclusion: u + half_gain T(u) = right.
OFFSET = 140 * WIDTH  # top torque were the bit torque zero, N m
SHARE = 141 * WIDTH  # top torque per bit torque
FREE = 142 * WIDTH  # bit speed were the bit torque zero, rad/s
GAIN = 143 * WIDTH  # its fall per bit torque, rad/s per N m
SIGN = 144 * WIDTH  # direction in which the bit would turn
OWN = 145 * WIDTH  # 1 if it keeps the direction it has
RIGHT = 146 * WIDTH
PER_GAIN = 147 * WIDTH  # 1 / GAIN
SPEED = 148 * WIDTH  # the unknown u, rad/s
SLOPE = 149 * WIDTH  # slope of the law where Newton last looked, N m s
OPEN = 150 * WIDTH  # 1 while Newton goes on
LOW_BOUND = 151 * WIDTH  # bracket of the unknown, rad/s
HIGH_BOUND = 152 * WIDTH
SHARE_NEW = OWN  # of smooth laws: gain of the torque at the end of the step, rad/s per N m

# What the step decides, until it is concluded.
NEW_SPEED = 153 * WIDTH
NEW_HOLDING = 154 * WIDTH
NEW_DIRECTION = 155 * WIDTH
NEW_KINETIC = 156 * WIDTH
SPEED_BEFORE = 157 * WIDTH  # bit speed at the beginning of the step, rad/s
TOP_SPEED_BEFORE = 158 * WIDTH  # top speed there, rad/s
LOAD_BEFORE = 159 * WIDTH  # weight on the bit there, N
STUCK_SHARE = 160 * WIDTH  # share of the step spent stuck

# Measures, in the order in which they leave the kernel.
J1 = 161 * WIDTH
STUCK_TIME = 162 * WIDTH
STICKS = 163 * WIDTH
LATE_LOW = 164 * WIDTH
LATE_HIGH = 165 * WIDTH
LATE_ANGLE = 166 * WIDTH
LATE_STUCK = 167 * WIDTH
BIT_ANGLE = 168 * WIDTH
LOW = 169 * WIDTH
HIGH = 170 * WIDTH
PEAK_PIPE = 171 * WIDTH
PEAK_TOP = 172 * WIDTH
OUTSIDE_NARROW = 173 * WIDTH
OUTSIDE_WIDE = 174 * WIDTH
WORK = 175 * WIDTH
WEIGHT_SUM = 176 * WIDTH
ROP_SUM = 177 * WIDTH
OUTSIDE_TABLE = 178 * WIDTH

ROWS = 179
FIRST_MEASURE = J1
MEASURES = ROWS - FIRST_MEASURE // WIDTH
"""Number of measures of a lane."""
