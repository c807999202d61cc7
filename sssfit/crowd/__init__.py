"""Heads in a row, by diffusion in texture space and in screen space: what a scene's budget buys.

After Jimenez and Gutierrez 2008, "Faster rendering of human skin". `row` has the heads, the camera
and the lights, which the paper leaves open; `frame` renders one picture with and without savings,
`table` the paper's Table 1.
"""
