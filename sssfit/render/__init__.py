"""Kernels applied to irradiance: radiant exitance of a lit, translucent surface.

`scene` holds what is lit; `reference` convolves with the true 2D kernel, `separable` with a fitted
one, `screen` does what a shader does in screen space, with `transmittance` through thin slabs.
"""
