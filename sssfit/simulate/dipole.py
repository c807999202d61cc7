"""The dipole: a half space as a point source below its surface and a negative one above.

``simulate_dipole`` is the classical one (Jensen, Marschner, Levoy, Hanrahan 2001, "A practical
model for subsurface light transport"); ``simulate_dipole_grosjean`` uses Grosjean's diffusion
coefficient and the boundary condition of d'Eon and Irving 2011, "A quantized-diffusion model for
rendering translucent materials". With z_v = z_r + 4 A D and d = sqrt(r^2 + z^2)

    R_d(r) = (1 - R_sp) alpha'/(4 pi) sum over z_r, z_v of z (1 + sigma_tr d) exp(-sigma_tr d) / d^3

and the energy beyond r is (1 - R_sp) alpha'/2 times the sum of z exp(-sigma_tr d) / d, so no
quadrature is needed. The factor 1 - R_sp, which the paper applies separately, makes it a share of
the incident light. The dipole has no single scattering, so it is finite near the beam, where R_d ~
1/r.

Next: ``multipole.py`` for slabs and stacks, ``docs/theory.md`` for its errors.
"""

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.grid import make_grid
from sssfit.material import Material
from sssfit.profile import Profile
from sssfit.simulate._deterministic import computed_profile, energies_from_beyond, half_space
from sssfit.simulate._diffusion import (
    Diffusion,
    classical,
    grosjean,
    mismatch_by_moments,
    mismatch_by_polynomial,
)
from sssfit.simulate._walks import relative_eta


def simulate_dipole(
    material: Material, *, dr_mm: float | None = None, radius_mm: float | None = None
) -> Profile:
    """Return the profile of the classical dipole.

    Parameters
    ----------
    material : Material
        A homogeneous half space; any g (through sigma_s'), relative index 0.5 to 2.5.
    dr_mm, radius_mm : float, optional
        Grid, as in `sssfit.grid.make_grid` [mm].

    Returns
    -------
    Profile
        The model to rounding. Standard errors are NaN, because the error of the model itself is
        unknown (2 % of the total at albedo 0.99, 11 % at 0.75). The absorbed energy is unknown too.

    Raises
    ------
    SimulationError
        The material is a slab or a stack, its index is out of range, or the grid is invalid.

    Examples
    --------
    >>> from sssfit.material import load_material
    >>> simulate_dipole(load_material("skin1")).diffuse_reflectance.round(4)
    array([0.4285, 0.2235, 0.1288])
    """
    layer = half_space(material, "dipole")
    boundary = mismatch_by_polynomial(relative_eta(material))
    return _simulate(material, "dipole", classical(layer), boundary, dr_mm, radius_mm)


def simulate_dipole_grosjean(
    material: Material, *, dr_mm: float | None = None, radius_mm: float | None = None
) -> Profile:
    """Return the profile of the dipole with Grosjean's coefficient and the moments' boundary.

    Parameters, result and errors are those of `simulate_dipole`, except that the index may be any.
    Above an albedo of 0.98 totals are good to 1 %; below 0.95 they are worse than the classical
    ones (23 % too high at 0.73), because Grosjean's theory separates single scattering from the
    diffuse light, which is then fainter by a factor alpha', and the dipole has no such part.

    Examples
    --------
    >>> from sssfit.material import load_material
    >>> simulate_dipole_grosjean(load_material("skin1")).diffuse_reflectance.round(4)
    array([0.4419, 0.2365, 0.1459])
    """
    layer = half_space(material, "dipole-grosjean")
    boundary = mismatch_by_moments(relative_eta(material))
    return _simulate(material, "dipole-grosjean", grosjean(layer), boundary, dr_mm, radius_mm)


def dipole_beyond(r_mm: FloatArray, medium: Diffusion, boundary: float) -> FloatArray:
    """Return the share of the entering light that leaves beyond each radius (k, C)."""
    r_mm = r_mm[:, None]
    beyond = np.zeros((len(r_mm), medium.albedo.size))
    for depth_mm in (
        medium.depth_mm,
        medium.depth_mm + 4.0 * boundary * medium.coefficient_mm,
    ):
        distance_mm = np.hypot(r_mm, depth_mm)
        beyond += depth_mm / distance_mm * np.exp(-medium.sigma_tr_per_mm * distance_mm)
    return 0.5 * medium.albedo * beyond


def _simulate(
    material: Material,
    method: str,
    medium: Diffusion,
    boundary: float,
    dr_mm: float | None,
    radius_mm: float | None,
) -> Profile:
    grid = make_grid(material, dr_mm=dr_mm, radius_mm=radius_mm)
    entering = 1.0 - material.specular_reflectance
    beyond = entering * dipole_beyond(grid.r_edges_mm, medium, boundary)
    return computed_profile(material, method, grid, energies_from_beyond(beyond))
