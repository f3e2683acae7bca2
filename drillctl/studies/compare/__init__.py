"""Cases at the same draws.

`study.py`: distributions and paired differences; `cases.py`: what makes cases comparable;
`nominal.py`: their maps and motions at their own values.
"""
