"""Locally stable, J1 under a level, attracted: three regions of one map.

`study.py`: the regions; `attraction.py`: long runs of its cells; `steady.py`: operating points of
the cells of a grid.
"""
