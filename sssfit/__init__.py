"""sssfit: from a translucent material to the table a real-time shader can afford.

The rooms, in the order a material walks through them:

- ``sssfit.material``: absorption and scattering coefficients, loaded and checked.
- ``sssfit.simulate``: material to diffuse reflectance profile R_d(r).
- ``sssfit.profile``: the profile itself, kept as energy in annuli.
- ``sssfit.chart``: profiles to figures.

This module stays light: the command line imports it before anything else, and ``--help`` must not
wait for numpy or numba.
"""

__version__ = "0.1.0"
