"""Rows of a block's memory: one row a quantity, one column a lane.

All that a block of lanes keeps from step to step lies in one flat array, row after row. The names
below are where the rows begin; after them come the states of the string, the signals that a late
weight remembers, and the states of an observer. What lives within a step is no row: it is a value
of the compiled code (see `vectors.py`).
"""

import os
import platform

from llvmlite.binding import get_host_cpu_features
from numba.core import config


def _machine() -> tuple[int, int, bool]:
    """Of the machine that is compiled for: doubles in a register, lanes in a pass, fused sums."""
    given = config.CPU_FEATURES
    features = get_host_cpu_features().flatten() if given is None else given
    if platform.machine() in ("arm64", "aarch64"):
        return 2, 8, True
    if "+avx512f" in features:
        return 8, 16, True
    return (4, 8, "+fma" in features) if "+avx" in features else (2, 4, False)


REGISTER, PASS, FUSES = _machine()
WIDTH = int(os.environ.get("DRILLCTL_BLOCK_WIDTH", "16"))
"""Lanes in a block: with AVX2 two passes, so that the processor begins one while the inclusion of
the other still takes its time."""
PASS = min(PASS, WIDTH)
"""Lanes that take a step together: two registers a row, so that one waits while the other works,
and the sums over the modes find registers; four of the thirty-two small ones of ARM. Like `WIDTH` a
matter of speed alone: no result depends on them, to the last bit."""

_taken = 0


def _next(rows: int = 1) -> int:
    """Where the next rows begin."""
    global _taken
    begin = _taken * WIDTH
    _taken += rows
    return begin


# Law parameters, as many rows as the law of that kind with the most numbers needs.
FRICTION = _next(32)
DRIVE = _next(56)
WEIGHT = _next(16)
PROGRAM = _next(52)
MOST_FIELDS = {FRICTION: 32, DRIVE: 56, WEIGHT: 16, PROGRAM: 52}
"""Most numbers that a law may have, by where its rows begin."""

# Constants of a lane.
SET_SPEED = _next()  # rad/s
DRAG = _next()  # torque of all damping to ground at the set speed, N m
PIPE_OFFSET = _next()  # pipe torque that this drag causes, N m
TABLE_LOW = _next()  # range of the friction table, N
TABLE_HIGH = _next()

# A drive with its string. Ideal: torque of a step = LEVEL + BACK angle + FORTH free angle.
LINE_LEVEL = _next()  # net of DRAG, N m
LINE_BACK = _next()  # N m/rad
LINE_FORTH = _next()  # N m/rad
SHRINK = _next()  # of a real drive that nothing limits: what its own slopes leave of its torque
SHARE = _next()  # top torque per bit torque
GAIN = _next()  # fall of the bit speed per bit torque, rad/s per N m
PER_GAIN = _next()  # 1 / GAIN

# State between steps.
ANGLE = _next()  # top-drive angle in the frame, rad
BIT_SPEED = _next()  # rad/s, absolute
SPEED_BEFORE = _next()  # one step earlier
SPEED_BEFORE_THAT = _next()  # two steps
KINETIC = _next()  # friction torque at that speed against it, N m
SLOPE = _next()  # slope of the friction there, N m s/rad
DIRECTION = _next()  # +1, -1 turning; 0 stuck
LOAD = _next()  # weight on the bit, N
REST_LOAD = _next()  # weight on it were it at rest, on the mean over the step, N
REST_END = _next()  # the same at its end
HELD = _next(4)  # `rock_step.HeldRock` at the weights of this step, or of all

# A rock that varies along the way.
FACTOR = _next()  # of its torques at the end of the step
FACTOR_MEAN = _next()  # on the mean over it
TURNED = _next()  # angle of the bit since time zero, rad
SUNK = _next()  # depth that it has drilled since, m, and its rate, m/s: none without axial motion
SINKING = _next()

# Torques of the step just taken, applied to the string by the next pass.
TOP_TORQUE = _next()  # net of DRAG, N m
BIT_TORQUE = _next()  # N m

# Program: set speed of the moment less the final one, and its integral at both ends of a step.
LEAD = _next()  # rad/s
SHIFT = _next()  # rad
SHIFT_NEW = _next()
NOMINAL = _next()  # final nominal weight, N

# Memory of a real drive.
TOP_SPEED = _next()  # top-drive speed in the frame, rad/s
SEEN = _next()  # the same as the encoder shows it
FELT = _next()  # torque felt, behind its filter, N m
SLOW = _next()  # its slow part, N m
INTEGRAL = _next()  # of the speed error, rad
MOTOR = _next()  # torque of the motor, N m
COMMAND = _next()  # of a sampled controller, N m
PENDING = _next()  # its next one, N m
SEEN_LAST = _next()  # speed that it saw last, rad/s
IMPULSE = _next()  # of the motor since then, N m s
LEAST = _next()  # limits of the torque in this step, N m
MOST = _next()
ERROR = _next()  # mean speed error but for what the end of the step adds, rad/s
MOVED = _next()  # by how much a limit of rate lets the motor move, N m; 0 if it does not limit

# Memory of a weight on bit on its way.
SIGNAL = _next()  # what stands for the bit speed, rad/s
HOISTED = _next()  # weight at the end of the step, N
CALLED = _next()  # weight asked for at the end of the last step, N
LEVEL = _next()  # of an alarm: weight asked for over the nominal one
LEVEL_NEXT = _next()  # once it is known
LEVEL_FROM = _next()  # from when on, s
WINDOW_END = _next()  # s
WINDOW_LOW = _next()  # bit speed in the window, rad/s
WINDOW_HIGH = _next()
WINDOW_SUM = _next()
WINDOW_COUNT = _next()

# What a sample of a trace shows of the string, seen before the pass completes it.
SEEN_TOP = _next()  # top speed in the frame, rad/s
SEEN_TWIST = _next()  # bit angle in the frame, rad

# What is measured of the last steps, signal after signal, step after step.
CHUNK = 16
"""Steps from one look at measures to the next: a power of two that fits the first cache."""
SPEED_LAST = _next()  # bit speed as they began, rad/s
SPEEDS = _next(CHUNK)  # at their ends, rad/s
BIT_TORQUES = _next(CHUNK)  # mean, N m
TOP_TORQUES = _next(CHUNK)  # mean, net of DRAG, N m
PIPE_TORQUES = _next(CHUNK)  # as they began, without PIPE_OFFSET, N m
STUCK = _next(CHUNK)  # share of the step that the bit was stuck
WEIGHTS = _next(
    -(-CHUNK // WIDTH)
)  # half the seconds of each step that count for J1, a number each
# Extremes, net of DRAG and without PIPE_OFFSET, N m
TOP_LOW = _next()
TOP_HIGH = _next()
PIPE_LOW = _next()
PIPE_HIGH = _next()
BACKWARDS = _next()  # what a bit that turns backwards drills beyond what it turns, rad

PIPE = _next()  # pipe torque as the step began, without PIPE_OFFSET, N m

# Measures, in the order in which they leave the kernel.
J1 = _next()
STUCK_TIME = _next()  # in steps until the end
STICKS = _next()
LATE_LOW = _next()
LATE_HIGH = _next()
LATE_ANGLE = _next()
LATE_STUCK = _next()
BIT_ANGLE = _next()
LOW = _next()
HIGH = _next()
PEAK_PIPE = _next()
PEAK_TOP = _next()
OUTSIDE_NARROW = _next()
OUTSIDE_WIDE = _next()
WORK = _next()
WEIGHT_SUM = _next()
ROP_SUM = _next()
OUTSIDE_TABLE = _next()
AT_TORQUE_LIMIT = _next()  # of a real drive, s
AT_POWER_LIMIT = _next()
OVER_CONTINUOUS = _next()
PEAK_POWER = _next()  # W
WALL_WORK = _next()  # taken by the wall, J
# of axial motion; m, m s, s, s
DRILLED = _next()
CUT_SUM = _next()
AXIAL_STUCK = _next()
OFF_BOTTOM = _next()
AXIAL_WORK = _next()  # J; in `WORK` at the end
BOUND = _next()  # J1 of a lane that was found over the level at which lanes are given up; else 0

ROWS = _taken
FIRST_MEASURE = J1
MEASURES = ROWS - FIRST_MEASURE // WIDTH  # number of measures of a lane
