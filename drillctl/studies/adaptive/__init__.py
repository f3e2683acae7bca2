"""Adaptive maps: the contours of a fine grid from a fraction of its cells.

`study.py`: the map; `contour_search.py`: which cells; `lattices.py`: nested lattices of a grid;
`chosen_cells.py`: their lanes; `checks.py`: a sample, or all, of what was left out.
"""
