"""A commented design file to start one's own rig from."""

from __future__ import annotations

from pathlib import Path

from drillctl.errors import InputError, shown

STARTER = """\
# A rig for drillctl. Quantities are text with units; gains and factors are bare numbers.
# `drillctl validate FILE` checks it, `drillctl show FILE` prints it with all defaults.

schema = 1
title = "{name}"
source = "where the numbers come from"

[operating_point]
speed = "100 rpm"                 # final set speed of the top drive
weight_on_bit = "120 kN"

# The string from top to bottom. A section is an API pipe by name, or geometry
# (outer_diameter, inner_diameter), or polar_moment, or a lumped spring (stiffness).
[[drillstring.sections]]
name = "pipe"
pipe = "5 in 19.5 lb/ft"
grade = "S-135"                   # results then say the share of torsional yield used
length = "2800 m"
# elements = 28                   # default: elements of at most 100 m
# stiffness_damping = "1e-3 s"    # internal damping over stiffness
# drag = "0.01 N*s/rad"           # viscous drag on the borehole wall, per length

[[drillstring.sections]]
name = "collars"
outer_diameter = "6 3/4 in"
inner_diameter = "2 13/16 in"
length = "200 m"

[top_drive]
inertia = "2000 kg*m^2"

[bha]
inertia = "50 kg*m^2"             # bit and whatever is not a section

# Torque on the bit: [a1 + (a2 - a1) exp(-beta |speed|)] x weight on bit; at rest anything up
# to a2 x weight on bit.
[bit_rock]
law = "navarro-lopez-suarez"
a1 = 0.029                        # m, at high speed
a2 = 0.079                        # m, at rest
beta = 0.097                      # s/rad

[controller]
law = "pi"                        # or "constant-torque" with torque = "10 kN*m"
kp = 600.0                        # N m s
ki = 120.0                        # N m

[start]
kind = "turning"                  # or "rest", "wound_up"
speed = "70 rpm"

[simulation]
duration = "100 s"

[map]
axes = [
    {{ path = "controller.kp", min = 0, max = 2000, points = 41 }},
    {{ path = "controller.ki", min = 0, max = 1000, points = 41 }},
]
levels = [20, 30, 40, 50]         # of J1, in seconds

# [uncertain."bit_rock.a1_factor"] # by default a1_factor and a2_factor, lognormal, 5 %
# distribution = "lognormal"      # or normal, uniform, triangular
# cov = 0.05                      # standard deviation over mean

# [[compare.cases]]               # the first is the baseline
# name = "as it is"
# [[compare.cases]]
# name = "stiffer drive"
# set = {{ "controller.kp" = 900.0 }}
"""


def write_starter(name: str) -> Path:
    """Write the starter file."""
    path = Path(name)
    if not path.name or not name.isprintable():
        raise InputError(f"{shown(name)} is not a file name")
    path = path if path.suffix == ".toml" else path.with_name(f"{path.name}.toml")
    title = path.stem.replace("\\", "").replace('"', "")
    try:
        with path.open("x", encoding="utf-8") as stream:
            stream.write(STARTER.format(name=title))
    except FileExistsError:
        raise InputError("exists already; it is not overwritten", str(path)) from None
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror}", str(path)) from None
    return path
