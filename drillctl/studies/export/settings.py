"""Keys of `[export]`: what a drive is exported with."""

from __future__ import annotations

from drillctl.rig import table as q
from drillctl.rig.table import Table

KEY = "export"


class Settings(Table):
    """What the law of a drive is exported with.

    `sampling_period` is that of a drive in continuous time; one with a `sampling_period` of its own
    keeps it. Rated torque and speed count at the pipe, and are what is one per unit: by default
    the limits of the drive, and where it has none torque and speed of steady drilling; 1 kN m where
    that takes no torque.
    """

    sampling_period: q.Time = 0.01
    rated_torque: q.TorqueLimit = None
    rated_speed: q.SpeedLimit = None
