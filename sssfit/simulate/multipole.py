"""The multipole: slabs and stacks of layers by diffusion (Donner and Jensen 2005).

"Light diffusion in multi-layered translucent materials". Between two surfaces the sources of the
dipole are mirrored repeatedly, at 2 i H + z_r and 2 i H - z_r - 2 z_0 for every integer i, with H =
d + z_0 + z_d, z_0 = 2 A_0 D and z_d = 2 A_d D beyond the upper and the lower surface. In the
plane's frequencies an image at depth z is +-exp(-s |z|) / 2, s = sqrt(sigma_tr^2 + k^2), and the
sum over all i is a geometric series, so no number of images has to be chosen:

    Rhat(k) = alpha' sinh(s (d + z_d - l)) cosh(s z_0) / sinh(s H)
    That(k) = alpha' sinh(s (l + z_0)) cosh(s z_d) / sinh(s H)          l = 1/sigma_t'

Convolutions are products there, and layers are added as in the theory of Kubelka and Munk, with
repeated reflections between them as 1 / (1 - R1' R2); R1' and T1' are for light from below:

    R = R1 + T1 R2 T1' / (1 - R1' R2),      T = T1 T2 / (1 - R1' R2)

Light that enters a layer from another one is treated like the beam, as if it came along the normal.
All light is assumed to scatter, even the light that crosses a thin slab without a collision, which
the photon walk counts at r = 0. Next: ``docs/theory.md`` for the errors of both.
"""

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import SimulationError, SssfitWarning
from sssfit.grid import make_grid
from sssfit.material import Material
from sssfit.optics import lagrange_shares
from sssfit.profile import Profile
from sssfit.simulate._deterministic import (
    check_is_material,
    computed_profile,
    energies_from_beyond,
    energies_from_cumulative,
)
from sssfit.simulate.dipole import Diffusion, classical, dipole_beyond, mismatch_by_polynomial

# Step of ln k; 0.02 would do. The bias, a factor k^0.5, makes both ends of the range fade: without
# it the periodic transform wraps Rhat(0) around, with an error of 1e-7 instead of 1e-14.
_STEP = 0.01
_BIAS = -0.5
# Extension of the range beyond the relevant scales; 1e-3 and 1e3 leave 1e-10.
_BEYOND_LOW, _BEYOND_HIGH = 1e-13, 1e6

_POINTS = np.arange(-3, 5)  # eight nodes around a point: their error is step^8


def cumulative_from_transform(
    transform: Callable[[FloatArray], FloatArray], r_mm: FloatArray, shortest_mm: float
) -> FloatArray:
    """Return F at radii.

    Parameters
    ----------
    transform : callable
        Takes wavenumbers (n, 1) [1/mm], returns Rhat (n, C): the integral of 2 pi r R_d(r) J0(k r).
    r_mm : (m,) [mm]
        Radii; the first is 0.
    shortest_mm : float [mm]
        The transform is an exponential exp(-k z) or smaller, z at least this, for large k.

    Returns
    -------
    (m, C)
    """
    from scipy.fft import fht, fhtoffset  # 0.2 s that the photon walk does not need

    low = _BEYOND_LOW / r_mm[-1]
    high = _BEYOND_HIGH / min(shortest_mm, float(r_mm[1]))
    n = math.ceil(math.log(high / low) / _STEP)
    steps = _STEP * (np.arange(n) - 0.5 * (n - 1))
    middle = math.sqrt(low * high)
    offset = float(fhtoffset(_STEP, 1, bias=_BIAS))
    values = transform((middle * np.exp(steps))[:, None])
    result = fht(values.T, _STEP, 1, offset=offset, bias=_BIAS)
    # fht gives int Rhat J1(k r) r dk at r = exp(offset + steps) / middle
    at = (np.log(r_mm[1:] * middle) - offset - steps[0]) / _STEP
    return np.vstack((np.zeros((1, len(result))), _interpolated(result, at).T))


def _interpolated(values: FloatArray, at: FloatArray) -> FloatArray:
    """Return Lagrange interpolation (C, m) between values (C, n) at 0, 1, 2, ..."""
    first = np.floor(at).astype(np.intp)
    out: FloatArray = np.zeros((len(values), at.size))
    for place, share in zip(_POINTS, lagrange_shares(_POINTS, at - first), strict=True):
        out += share * values[:, first + place]
    return out


THIN = 2.0  # reduced mean free paths: the beam's source is then nearer to the bottom than the top
UNSCATTERED = 0.01


def simulate_multipole(
    material: Material, *, dr_mm: float | None = None, radius_mm: float | None = None
) -> Profile:
    """Return the profile of a slab or a stack by diffusion, reflected and transmitted.

    Parameters
    ----------
    material : Material
        Layers thicker than one reduced mean free path in every channel, any g (through sigma_s');
        the last may have no bottom. One layer without a bottom gives the classical dipole.
    dr_mm, radius_mm : float, optional
        Grid, as in `sssfit.grid.make_grid` [mm].

    Returns
    -------
    Profile
        The model's F, to 1e-13 of the light that enters. The error of the model itself is unknown
        (standard errors are NaN), and so is the absorbed energy. Has a transmittance if the stack
        has a bottom.

    Raises
    ------
    SimulationError
        A layer is clear or too thin in a channel, a relative index is outside 0.5 to 2.5, or the
        grid is invalid.

    Warns
    -----
    SssfitWarning
        A layer is thinner than two reduced mean free paths, or over 1 % of the light crosses the
        stack without a collision.
    """
    check_is_material(material)
    _check_layers(material)
    grid = make_grid(material, dr_mm=dr_mm, radius_mm=radius_mm)
    entering = 1.0 - material.specular_reflectance
    layers = _layers(material)
    if material.is_semi_infinite:
        medium, boundary = layers[0].medium, layers[0].above
        beyond = entering * dipole_beyond(grid.r_edges_mm, medium, boundary)
        return computed_profile(material, "multipole", grid, energies_from_beyond(beyond))
    _warn_of_thin(material)
    total = _stack(layers, np.zeros((1, 1)))

    def energies(name: str, shortest_mm: float) -> FloatArray:
        """Return reflected or transmitted light by annulus, as shares of the light that enters."""
        cumulative = cumulative_from_transform(
            lambda k: getattr(_stack(layers, k), name), grid.r_edges_mm, shortest_mm
        )
        return entering * energies_from_cumulative(cumulative, getattr(total, name)[0])

    transmitted = None
    if np.isfinite(layers[-1].thickness_mm):
        left_mm = sum(each.thickness_mm - each.medium.depth_mm for each in layers)
        transmitted = energies("transmitted", float(np.min(left_mm)))
    reflected = energies("reflected", float(layers[0].medium.depth_mm.min()))
    return computed_profile(material, "multipole", grid, reflected, transmitted=transmitted)


@dataclass(frozen=True, slots=True)
class _Layer:
    """A layer by diffusion: medium, thickness [mm], and A at the interfaces above and below."""

    medium: Diffusion
    thickness_mm: float
    above: float
    below: float


@dataclass(frozen=True, slots=True)
class _Response:
    """Reflected and transmitted light at each wavenumber and channel (n, C).

    For light from above, and (``_up``) for light from below.
    """

    reflected: FloatArray
    transmitted: FloatArray
    reflected_up: FloatArray
    transmitted_up: FloatArray


def _layers(material: Material) -> list[_Layer]:
    """Return each layer with the A of its interfaces; it is 1 without an interface."""
    etas = [material.eta_above, *(each.eta for each in material.layers), material.eta_below]
    return [
        _Layer(
            medium=classical(layer),
            thickness_mm=layer.thickness_mm,
            above=mismatch_by_polynomial(layer.eta / above),
            # without a bottom there is no interface, and eta_below has no effect
            below=mismatch_by_polynomial(layer.eta / below)
            if np.isfinite(layer.thickness_mm)
            else 1.0,
        )
        for above, layer, below in zip(etas[:-2], material.layers, etas[2:], strict=True)
    ]


def _stack(layers: list[_Layer], k_per_mm: FloatArray) -> _Response:
    """Return the response of a stack, from the top down, at wavenumbers (n, 1) [1/mm]."""
    whole = _single_layer(layers[0], k_per_mm)
    for layer in layers[1:]:
        whole = _layer_on_stack(whole, _single_layer(layer, k_per_mm))
    return whole


def _single_layer(layer: _Layer, k_per_mm: FloatArray) -> _Response:
    """Return the response of one layer."""
    # sinh(s d) / sinh(s H) has a limit at s = 0, which a length of 1e100 mm reaches exactly
    s = np.maximum(np.hypot(layer.medium.sigma_tr_per_mm, k_per_mm), 1e-100)
    down = _transforms(layer.medium, layer.thickness_mm, layer.above, layer.below, s)
    up = _transforms(layer.medium, layer.thickness_mm, layer.below, layer.above, s)
    return _Response(*down, *up)


def _transforms(
    medium: Diffusion, thickness_mm: float, entered: float, other: float, s: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return Rhat and That (n, C) of the module docstring, for light from the side ``entered``.

    The hyperbolic functions are written as decaying exponentials, so an infinite thickness needs no
    special case.
    """
    depth, near = medium.depth_mm, 2.0 * entered * medium.coefficient_mm
    far = 2.0 * other * medium.coefficient_mm
    common = 0.5 * medium.albedo / _one_minus_exp(2.0 * s * (thickness_mm + near + far))
    reflected = (
        np.exp(-s * depth)
        * (1.0 + np.exp(-2.0 * s * near))
        * _one_minus_exp(2.0 * s * (thickness_mm + far - depth))
    )
    transmitted = (
        np.exp(-s * (thickness_mm - depth))
        * (1.0 + np.exp(-2.0 * s * far))
        * _one_minus_exp(2.0 * s * (depth + near))
    )
    return common * reflected, common * transmitted


def _one_minus_exp(exponent: FloatArray) -> FloatArray:
    """Return 1 - exp(-exponent)."""
    return np.asarray(-np.expm1(-exponent), dtype=np.float64)


def _layer_on_stack(top: _Response, bottom: _Response) -> _Response:
    """Return the response of one layer on another."""
    between = 1.0 / (1.0 - top.reflected_up * bottom.reflected)
    back = top.transmitted * bottom.reflected * top.transmitted_up * between
    forth = bottom.transmitted_up * top.reflected_up * bottom.transmitted * between
    return _Response(
        reflected=top.reflected + back,
        transmitted=top.transmitted * bottom.transmitted * between,
        reflected_up=bottom.reflected_up + forth,
        transmitted_up=bottom.transmitted_up * top.transmitted_up * between,
    )


def _check_layers(material: Material) -> None:
    """Raise an error for layers that diffusion cannot describe."""
    for k, layer in enumerate(material.layers):
        for channel, path_mm in zip(material.channels, layer.mean_free_path_mm, strict=True):
            where = f"{material.name}: layer {k + 1}, channel {channel}"
            if np.isinf(path_mm):
                raise SimulationError(
                    f"{where} is clear; multipole needs layers that scatter: use montecarlo."
                )
            if layer.thickness_mm <= path_mm:
                raise SimulationError(
                    f"{where} is {layer.thickness_mm / path_mm:.3g} reduced mean free paths thick; "
                    "multipole needs more than 1: use montecarlo."
                )


def _warn_of_thin(material: Material) -> None:
    """Warn if the model is off by more than a few percent."""
    thinnest = min(
        float(np.min(each.thickness_mm / each.mean_free_path_mm)) for each in material.layers
    )
    if thinnest < THIN:
        warnings.warn(
            f"{material.name}: a layer is {thinnest:.3g} reduced mean free paths thick; diffusion "
            f"is off by some 5 % at {THIN:g} and by more below: compare with montecarlo.",
            SssfitWarning,
            stacklevel=3,
        )
    depth = sum(each.thickness_mm * each.sigma_t_per_mm for each in material.layers)
    unscattered = float(np.exp(-np.min(depth)))
    if unscattered > UNSCATTERED:
        warnings.warn(
            f"{material.name}: {100.0 * unscattered:.2g} % of the light that enters crosses "
            "without a collision; multipole assumes that it scatters: compare with montecarlo.",
            SssfitWarning,
            stacklevel=3,
        )
