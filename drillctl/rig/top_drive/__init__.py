"""Top-drive laws: torque of the drive from what it sees of the string.

A law is a `NamedTuple` of numbers with two pure functions, in the frame that turns at the
set speed: `angle` (rad) and `speed` (rad/s) of the top drive are measured in that frame, so
that both are zero in steady drilling.

- `torque(angle, speed)`: torque (N m) on the top-drive inertia; the reference solver's form.
- `mean_torque(angle, rate)`: mean torque over a step of length 1 / `rate` that starts at
  `angle`, as the pair (offset, slope) of `offset - slope * angle_at_the_end`; the batch
  engine's form.
- `impedance(s)`: torque against the motion per speed (N m s/rad) of the linearised law; what
  acts on the string, without the drive inertia.

`RealDrive` and `SampledDrive` have a memory: filters, integral, motor. They have an `impedance` and
the `torque` of steady motion; how they move is in `real_drive`.

Each law has a file, which `drillctl.registry` names: its keys in a design, one pure function from
these and the string to the numbers of its controller, and its `LAWS` entry. What makes a drive real
goes around any of them (`law.py`).
"""

from __future__ import annotations

from drillctl.rig.top_drive.ideal import PI, ConstantTorque
from drillctl.rig.top_drive.law import TopDriveLaw
from drillctl.rig.top_drive.real_drive import RealDrive, SampledDrive

__all__ = ["PI", "ConstantTorque", "RealDrive", "SampledDrive", "TopDriveLaw"]
