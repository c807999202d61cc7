"""Light that changes from frame to frame: control variates, and adaptive sampling that bears it.

`moving` has the estimators over time, `variate` the formulas of control variates, `table` the
supplement's measurement of them; `adaptive` renders frames by samples where the variance asks, and
`run` a sequence of them beside other renderers. A new light is an entry in ``lights.LIGHTS``, a new
renderer one in ``ways.WAYS``.
"""
