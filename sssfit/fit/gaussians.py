"""A sum of Gaussians: the classical kernel, N separable passes of known widths.

minimise  int r (R_d(r) - sum_i w_i G(v_i, r))^2 dr,   G(v, r) = exp(-r^2 / 2v) / (2 pi v)

with the sum of the weights held at the diffuse reflectance (Jimenez et al. 2015, "Separable
Subsurface Scattering", supplement eq. S.1; without that constraint d'Eon and Luebke 2007, "Advanced
techniques for realistic real-time skin rendering", GPU Gems 3, chapter 14). A Gaussian in the plane
is a product of two along the axes, so each term is one pass, integrated over the pixels. One factor
restores the energy of the Gaussians outside the support, unless ``energy="keep"``: 45 % for six
Gaussians of skin1's red on 13 pixels of .3 mm.

The fit uses the profile's annuli and not the pixels, so variances and weights do not depend on the
pixel size. The exceptions are profiles with R_d ~ 1/r near the beam, where the integral of r R^2
diverges as annuli narrow; these are evaluated at the resolution of the pixels, with a warning.

Next: ``_gaussians_objective.py`` has the objective, ``_gaussians_search.py`` the search and the
resolution.
"""

import math
import operator
import warnings

import numpy as np

from sssfit.errors import FitError, SssfitWarning
from sssfit.fit._gaussians_objective import make_annuli
from sssfit.fit._gaussians_search import GaussianSum, fitted_annuli, is_steep, search
from sssfit.fit._result import ChannelFit, FitResult, energy_factor, fit_channels, rescales_energy
from sssfit.fit._target import Pitch, Target, make_target
from sssfit.messages import counted, shown
from sssfit.process import one_blas_thread
from sssfit.profile import Profile
from sssfit.shapes import gaussian_line_integral

MOST_TERMS = 10
# Of the first annulus's width: a Gaussian this narrow has 0.9997 of its energy there, and narrower
# ones cannot be distinguished from it.
_NARROWEST = 0.25


def fit_gaussians(
    profile: Profile,
    *,
    terms: int = 4,
    signed: bool = False,
    free_energy: bool = False,
    energy: str = "rescale",
    mm_per_pixel: Pitch | None = None,
    support_mm: float | None = None,
    normalize: bool = False,
) -> FitResult:
    """Fit a sum of Gaussians to the profile by r-weighted least squares.

    Parameters
    ----------
    profile : Profile
        The profile to fit.
    terms : int
        Number N of Gaussians, 1 to 10; the result has fewer if one more does not lower the error.
    signed : bool
        Allow negative weights.
    free_energy : bool
        Do not constrain the sum of the weights to the diffuse reflectance: a smaller error near the
        beam, but a wrong energy.
    energy : str
        "rescale" (default) scales the terms of every channel to the sum of its weights, the energy
        without a support; "keep" keeps the energy within the support.
    mm_per_pixel, support_mm : float, optional [mm]
        Pixel size and half width of the support; see ``sssfit.fit.make_target``.
    normalize : bool
        Scale every channel to unit energy, and keep its energy in ``kernel.scale``.

    Returns
    -------
    FitResult
        The kernel's ``parameters`` have for each channel ``variances_mm2`` (ascending), ``weights``
        (energies without a support and before ``normalize``) and ``relative_error``, as in the
        literature, sqrt(int r (R - fit)^2 dr / int r R^2 dr) over the profile's grid.

    Raises
    ------
    FitError, ProfileError
        The number of terms is out of range or too large for the annuli; the profile, the pixel size
        or the support is invalid.

    Warns
    -----
    SssfitWarning
        R_d rises towards the beam like 1/r, so Gaussians and errors depend on the pixel size.
    """
    number, rescale = _checked_terms(terms), rescales_energy(energy)
    target = make_target(profile, mm_per_pixel, support_mm)
    _check_annuli(profile, number)
    _warn_of_pitch(target)

    def fit_channel(channel: int) -> ChannelFit:
        edges_mm, annulus_energy = fitted_annuli(target, channel)
        on_grid = float(annulus_energy.sum())
        total = None if free_energy else float(target.total[channel]) / on_grid
        annuli = make_annuli(edges_mm, annulus_energy, total, signed=signed)
        narrowest_mm = _NARROWEST * float(edges_mm[1])
        found = search(annuli, number, narrowest_mm**2, float(edges_mm[-1]) ** 2)
        return _as_passes(target, channel, found, on_grid, rescale=rescale)

    # One BLAS thread: matrices of a few thousand rows and 10 columns do not profit from more.
    with one_blas_thread():
        return fit_channels(
            target,
            "gaussians",
            fit_channel,
            settings={
                "terms": number,
                "signed": signed,
                "free_energy": free_energy,
                "energy": energy,
            },
            normalize=normalize,
            keeps_energy=rescale and not free_energy,
        )


def _as_passes(
    target: Target, channel: int, found: GaussianSum, on_grid: float, *, rescale: bool
) -> ChannelFit:
    """Integrate the Gaussians over the pixels; each pass takes the square root of the weight."""
    weights, edges_mm = found.weights * on_grid, target.edges_mm()
    columns = gaussian_line_integral(edges_mm[:-1], edges_mm[1:], found.variances_mm2[:, None])
    signs, half = np.sign(weights), np.sqrt(np.abs(weights))[:, None] * columns
    wanted = float(weights.sum())
    factor = energy_factor(wanted, target, channel, signs, half) if rescale else 1.0
    return ChannelFit(
        signs=signs,
        half=math.sqrt(factor) * half,
        stop_reason=found.stop_reason,
        evaluations=found.evaluations,
        parameters={
            "variances_mm2": found.variances_mm2.tolist(),
            "weights": weights.tolist(),
            "relative_error": found.error,
        },
    )


def _checked_terms(terms: int) -> int:
    """Check the number of Gaussians."""
    try:
        number = operator.index(terms)
    except TypeError:
        number = 0
    if not 1 <= number <= MOST_TERMS:
        raise FitError(f"terms = {shown(terms)}; expected a whole number from 1 to {MOST_TERMS}.")
    return number


def _check_annuli(profile: Profile, terms: int) -> None:
    """Raise FitError if there are more unknowns than data."""
    if profile.n_annuli < 2 * terms:
        raise FitError(
            f"{profile.label}: a profile of {counted(profile.n_annuli, 'annulus')} cannot fix "
            "the width and "
            f"the weight of each Gaussian, terms = {terms}; give a finer profile or fewer terms."
        )


def _warn_of_pitch(target: Target) -> None:
    """Warn if the objective depends on the resolution."""
    if any(is_steep(target, int(c)) for c in np.flatnonzero(~target.is_empty)):
        warnings.warn(
            f"{target.name}: R_d is steep near the beam (single "
            "scattering is 1/r), so the Gaussians depend on the pitch of "
            f"{target.mm_per_pixel:.3g} mm: compare fits of one pitch and one profile grid only.",
            SssfitWarning,
            stacklevel=3,
        )
