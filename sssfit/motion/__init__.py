"""Light that changes from frame to frame: control variates, and adaptive sampling that bears it.

`moving` has the estimators over time, `variate` the formulas of control variates, `table` the
supplement's measurement of them; `adaptive` renders frames by samples where the variance asks, and
`run` a sequence of them beside other renderers. A new light is a function in `lights` and an entry
in ``sssfit.methods.LIGHTS``, a new renderer one in `ways` and in ``sssfit.methods.RENDERERS``.
"""
