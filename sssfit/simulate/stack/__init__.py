"""The solver for layers: plane layers with any g and refractive indices, without noise.

The transport equation under a pencil beam, Fourier-transformed along the surface: for each
wavenumber k, ``nodes`` and ``azimuth`` choose directions, ``phase`` has scattering between them,
``modes`` the eigenmodes of a layer and ``embedding`` puts layers on one another. ``assembly`` does
this for a stack, ``single`` separates light that is scattered once, ``sampling`` covers all stacks
that share layers, ``changes`` gives most wavenumbers few directions, ``transform`` goes back to
radii (between wavenumbers by ``spline``), ``solution`` adds directions until the answer stands
(``tails``: what more would change),
``profiles`` does so for all channels and ``solved`` makes records of what they found.

Sources: Stamnes et al. 1988, Applied Optics 27, 2502 (discrete ordinates); Liemert, Reitzle and
Kienle 2017, Scientific Reports 7, 3819 (a relative in spherical harmonics).
"""

from sssfit.simulate.stack.profiles import solve_stacks

__all__ = ["solve_stacks"]
