"""Compiled loops of the batch engine; nothing here knows of designs, units or files.

- `arithmetic.py`, `compiling.py`: fused multiply-adds; how everything is compiled.
- `exponential.py`: an exponential that the compiler can run on many lanes at once.
- `laws.py`: lets the laws of `bit_rock`, `top_drive` and `weight_on_bit` be called by type.
- `rows.py`: what each row of a block's working array holds.
- `string_step.py`: one exact step of the string, for a block of lanes.
- `drive_step.py`, `drive_numbers.py`, `top_motion.py`: the mean torque of a drive over a step.
- `weight_step.py`, `observer_step.py`: a weight on bit that comes late, or from an observer.
- `program_step.py`: what changes by the clock.
- `lane_step.py`, `rock_step.py`, `held_rock.py`: the scalar inclusion at the bit.
- `measure_step.py`: what is measured of each step.
- `advance.py`: the loop over steps and blocks.

Importing this package imports numba; compiled code is kept on disk.
"""
