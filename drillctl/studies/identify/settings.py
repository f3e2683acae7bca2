"""Keys of `[identify]`: what is fitted to a log, and how sure one wants to be."""

from __future__ import annotations

from typing import Literal

from drillctl.rig import table as q
from drillctl.rig.table import Table

KEY = "identify"


class Settings(Table):
    """What is fitted to a log beside the friction, and what is written.

    `free`: numbers of the rig that are fitted as well, within a third and three times those of
    the design; the others are checked. `law`: the one to write, by default the best in predicting
    the next window. `window`: length of a window, by default three cycles; `windows`, most of them.
    `torque_lag`, `speed_lag`: how late the signals are, by filters of the drive. `floor`: least
    half width of the band, relative, for what scatter between windows does not show; 0.6 of it
    from 20 samples a second. `draws`: rows of the file of joint samples.
    """

    free: tuple[Literal["travel_time", "impedance", "bit_inertia", "drive_inertia"], ...] = ()
    law: Literal["navarro-lopez-suarez", "jansen-van-den-steen", "tabulated"] | None = None
    window: q.Duration | None = None
    windows: q.Count = 24
    confidence: q.Share = 0.9
    torque_lag: q.TimeOrZero = 0.0
    speed_lag: q.TimeOrZero = 0.0
    floor: q.Share = 0.005
    draws: q.Count = 1000
    seed: q.CountOrZero = 2012
