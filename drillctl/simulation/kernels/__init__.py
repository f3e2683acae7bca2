"""Compiled loops of the batch engine; nothing here knows of designs, units or files.

- `rows.py`: what each row of a block's memory holds.
- `vectors.py`: a row as one value; its operators emit instructions. Memory, choice, loops.
- `arithmetic.py`: fused multiply-adds, an exponential of rows, the numbers of laws in memory.
- `string_step.py`: one exact step of the string.
- `drive_step.py`: the mean torque of a drive over a step.
- `weight_step.py`, `observer_step.py`: a weight on bit that comes late, or from an observer.
- `program_step.py`: what changes by the clock.
- `rock_step.py`: the scalar inclusion at the bit.
- `measure_step.py`: what is measured of each step.
- `advance.py`: the loop over steps and blocks.

All but `advance.run` is called once for each combination of laws, when its kernel is compiled.
Importing this package imports numba; compiled code is kept on disk.
"""
