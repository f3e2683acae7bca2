"""What the batch engine does with a design.

`examination.py` looks, `result.py` is what is found; `error_estimate.py`, `engine_speed.py`: its
errors from itself, and its speed.
"""
