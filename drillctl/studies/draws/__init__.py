"""What is uncertain, and draws from it.

`parameters.py`: distributions and draws; `sampling.py`: the points behind them; `lanes.py`: the
lanes of draws; `runs.py`: runs of draws, equal mean weights; `intervals.py`: shares and means.
"""
