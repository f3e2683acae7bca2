"""Grids and draws run as lanes of the batch engine."""
