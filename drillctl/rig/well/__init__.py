"""The well around the string: its path, what the string weighs and rubs in it.

`survey.py` holds the path by minimum curvature; `soft_string.py` tension, side force and torque;
`wall.py` the friction of the wall at nodes of a string.
"""
