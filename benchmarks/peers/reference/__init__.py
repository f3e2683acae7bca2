"""The reference solver in plain Python: SciPy's integrator on dense matrices."""
