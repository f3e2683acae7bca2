"""A weight on bit that follows the bit speed, against the delay of its path.

`study.py`: the study; `lanes.py`: its lanes; `limits.py`: where a benefit ends.
"""
