"""Recorded logs of torque and speed: read, cleaned, cut into windows, and used to identify a rig.

`quantities.py` finds columns by their names and units, `files.py` reads files in pieces,
`record.py` holds a log with all that was found wrong with it, `windows.py` ranks its windows.
"""
