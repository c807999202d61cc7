"""The dipole: a half space as a point source below its surface and a negative one above.

``simulate_dipole`` is the classical one (Jensen, Marschner, Levoy, Hanrahan 2001, "A practical
model for subsurface light transport"); ``simulate_dipole_grosjean`` uses Grosjean's diffusion
coefficient and the boundary condition of d'Eon and Irving 2011, "A quantized-diffusion model for
rendering translucent materials". With z_v = z_r + 4 A D and d = sqrt(r^2 + z^2)

    R_d(r) = (1 - R_sp) alpha'/(4 pi) sum over z_r, z_v of z (1 + sigma_tr d) exp(-sigma_tr d) / d^3

and the energy beyond r is (1 - R_sp) alpha'/2 times the sum of z exp(-sigma_tr d) / d, so no
quadrature is needed. The factor 1 - R_sp, which the paper applies separately, makes it a share of
the incident light. The dipole has no single scattering, so it is finite near the beam, where the
true R_d grows like 1/r.

The coefficients and the boundary condition here serve all diffusion models. Scattering enters as
sigma_s' = (1 - g) sigma_s: diffusion depends on directions only through their mean, so g other than
0 needs no further approximation. A is the boundary condition: flux lost through the surface puts
the zero of the fluence 2 A D outside it, farther for a denser medium.

Next: ``multipole.py`` for slabs and stacks, ``docs/theory.md`` for its errors.
"""

import math
from dataclasses import dataclass

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import SimulationError
from sssfit.grid import make_grid
from sssfit.material import Layer, Material
from sssfit.optics import fresnel_reflectance, gauss_legendre
from sssfit.profile import Profile
from sssfit.simulate._deterministic import computed_profile, energies_from_beyond, half_space
from sssfit.simulate._walks import relative_eta

# The polynomials for F_dr are within 0.006 of the integral in this range, and above 1 from 3.9 on.
MIN_ETA, MAX_ETA = 0.5, 2.5
_NODES = 200


@dataclass(frozen=True, slots=True)
class Diffusion:
    """Coefficients of a layer for the diffusion equation, by channel.

    ``albedo`` alpha' = sigma_s' / sigma_t' (C,); ``depth_mm`` z_r = 1 / sigma_t' (C,) where the
    beam is assumed to become diffuse; ``coefficient_mm`` D (C,); ``sigma_tr_per_mm`` sqrt(sigma_a /
    D) (C,), the decay of fluence with distance.
    """

    albedo: FloatArray
    depth_mm: FloatArray
    coefficient_mm: FloatArray
    sigma_tr_per_mm: FloatArray


def classical(layer: Layer) -> Diffusion:
    """D = 1 / (3 sigma_t'): Jensen et al. 2001, "A practical model for subsurface light transport".

    Every channel must absorb or scatter.
    """
    return _with_coefficient(layer, 1.0 / (3.0 * layer.reduced_sigma_t_per_mm))


def grosjean(layer: Layer) -> Diffusion:
    """D = (2 sigma_a + sigma_s') / (3 sigma_t'^2): Grosjean 1956, right for strong absorption.

    Used for a dipole by d'Eon and Irving 2011, "A quantized-diffusion model".
    """
    both = 2.0 * layer.sigma_a_per_mm + layer.reduced_sigma_s_per_mm
    return _with_coefficient(layer, both / (3.0 * layer.reduced_sigma_t_per_mm**2))


def _with_coefficient(layer: Layer, coefficient_mm: FloatArray) -> Diffusion:
    return Diffusion(
        albedo=layer.reduced_sigma_s_per_mm / layer.reduced_sigma_t_per_mm,
        depth_mm=1.0 / layer.reduced_sigma_t_per_mm,
        coefficient_mm=coefficient_mm,
        sigma_tr_per_mm=np.sqrt(layer.sigma_a_per_mm / coefficient_mm),
    )


def mismatch_by_polynomial(eta: float) -> float:
    """Return A = (1 + F_dr) / (1 - F_dr), F_dr by polynomial; exactly 1 at eta 1.

    F_dr = -1.440/eta^2 + 0.710/eta + 0.668 + 0.0636 eta above 1 (Jensen et al. 2001), and
    -0.4399 + 0.7099/eta - 0.3319/eta^2 + 0.0636/eta^3 below (Egan and Hilgeman 1979, as in Donner
    and Jensen 2005); eta is the index inside over that outside.

    Raises
    ------
    SimulationError
        eta is outside 0.5 to 2.5, where the polynomials do not approximate Fresnel's formulas.
    """
    if not MIN_ETA <= eta <= MAX_ETA:
        raise SimulationError(
            f"an interface has the relative refractive index {eta:.4g}; this method covers "
            f"{MIN_ETA} to {MAX_ETA}: use montecarlo (or, without a bottom, dipole-grosjean)."
        )
    if eta == 1.0:
        return 1.0
    if eta > 1.0:
        reflected = -1.440 / eta**2 + 0.710 / eta + 0.668 + 0.0636 * eta
    else:
        reflected = -0.4399 + 0.7099 / eta - 0.3319 / eta**2 + 0.0636 / eta**3
    return (1.0 + reflected) / (1.0 - reflected)


def mismatch_by_moments(eta: float) -> float:
    """Return A = (1 + 3 C_2) / (1 - 2 C_1) with the moments of the internal Fresnel reflectance.

    The boundary condition with the full first moment; see d'Eon and Irving 2011.
    """
    first, second = fresnel_moments(eta)
    return (1.0 + 3.0 * second) / (1.0 - 2.0 * first)


def fresnel_moments(eta: float) -> tuple[float, float]:
    """Return C_i = int_0^1 R_F(mu) mu^i dmu for i = 1, 2, mu the cosine inside; to 1e-10.

    Below mu_c all light is reflected; above it, mu = mu_c + (1 - mu_c) t^2 removes the square root.
    eta is the index inside over that outside.
    """
    t, w = gauss_legendre(_NODES)
    critical = math.sqrt(max(0.0, 1.0 - 1.0 / eta**2))
    mu = critical + (1.0 - critical) * t**2
    weights = w * 2.0 * (1.0 - critical) * t * fresnel_reflectance(mu, eta)
    first = 0.5 * critical**2 + float(weights @ mu)
    second = critical**3 / 3.0 + float(weights @ mu**2)
    return first, second


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
        unknown: at a reduced albedo of 0.75 the total is 15 % too low for index 1, 11 % too high
        for 1.3 and 25 % too high for 1.4; at 0.99 it is 0.8 to 1.8 % too low. The absorbed energy
        is unknown too.

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
    At an albedo of 0.99 totals are good to 1 % for indices up to 1.4. For indices from 1.3 they are
    worse than the classical ones below 0.95 (23 % too high at 0.73 for 1.3, 40 % for 1.4), because
    Grosjean's theory separates single scattering from the diffuse light, which is then fainter by a
    factor alpha', and the dipole has no such part; for index 1 they are the better ones (10 % too
    low at 0.73, the classical ones 15 %).

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
