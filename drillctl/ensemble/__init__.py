"""A grid or draws, as lanes of the batch engine: one way from a design to many runs.

- `grid.py`: axes over parameters, and the groups of cells that share a string.
- `parameters.py`: what is uncertain, and draws of it.
- `draws.py`: draws at one setting as lanes; `realizations.py`: realizations over a map.
- `running.py`: lanes into measures, block by block, by the threads of this process or by a dask
  cluster; `storing.py`: finished blocks, from which a run resumes.
- `sweeps.py`: a map and its regions; `audit.py`: some cells simulated again with the
  reference solver.
- `probability.py`: regions by probability over realizations; `cases.py`: cases at common draws,
  with confidence intervals of shares, means and differences.
"""
