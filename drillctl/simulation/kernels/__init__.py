"""Compiled loops of the batch engine; nothing here knows of designs, units or files.

- `rows.py`: what each row of a block's memory holds.
- `vectors.py`, `arithmetic.py`: a row as one value; how everything is compiled, memory, choice,
  fused multiply-adds, an exponential of rows.
- `laws.py`: lets the laws of `bit_rock`, `top_drive` and `weight_on_bit` be called by type.
- `string_step.py`: one exact step of the string.
- `drive_step.py`: the mean torque of a drive over a step.
- `weight_step.py`, `observer_step.py`: a weight on bit that comes late, or from an observer.
- `program_step.py`: what changes by the clock.
- `lane_step.py`, `rock_step.py`, `held_rock.py`: the scalar inclusion at the bit.
- `measure_step.py`: what is measured of each step.
- `advance.py`: the loop over steps and blocks.

Importing this package imports numba; compiled code is kept on disk.
"""
