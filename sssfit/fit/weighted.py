"""Separable terms fitted to the kernel's spectrum as pictures see it.

The decomposition's terms are best in the Frobenius norm, which weighs every frequency alike; for
R_d ~ 1/r it spends them on the middle pixel. Here

    minimise  sum_w S(w) (K^(w) - sum_t s_t a^_t(wx) a^_t(wy))^2,
    a^(w) = a_0 + 2 sum_i a_i cos(w i),

with the power S of pictures (``_spectrum``). Where S is that of natural ones, it is infinite at
w = 0, so the energy is exact. White S gives the decomposition itself. S can also be the power of
one picture; then the search starts from the terms for natural ones, too, and the better end is
kept. Terms are not nested: those of rank 2 are fitted as two. Two of them do what five of the
decomposition do for skin1.
"""

import operator
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import FitError
from sssfit.fit._result import (
    ChannelFit,
    FitResult,
    energy_factor,
    fit_channels,
    frobenius_error,
)
from sssfit.fit._spectrum import (
    SpectralTarget,
    even_frequencies,
    pictures_of,
    recorded,
    spectral_target,
)
from sssfit.fit._target import Pitch, Target, make_target
from sssfit.fit.svd import eigenpairs
from sssfit.messages import shown
from sssfit.profile import Profile
from sssfit.scene.record import Scene

_MOST_RANK = 8
_STEPS = 3000  # skin1's three terms take 200
_WHITE = "the decomposition, which is the optimum of white pictures"
_STOPPED = f"stopped after {_STEPS} steps, the best of them kept"


def fit_weighted(
    profile: Profile,
    *,
    rank: int = 2,
    spectrum: str | None = None,
    irradiance: str | Path | Scene | None = None,
    mm_per_pixel: Pitch | None = None,
    support_mm: float | None = None,
    normalize: bool = False,
) -> FitResult:
    """Fit separable terms under the spectrum of pictures.

    Parameters
    ----------
    profile : Profile
        The profile to fit.
    rank : int
        Number of terms, 1 to 8, or less for a smaller kernel.
    spectrum : {"natural", "white"}, optional
        Spectrum of the pictures that the kernel is for, by default natural; "white" is the
        decomposition.
    irradiance : str, Path or Scene, optional
        The picture that the kernel is for, in place of a spectrum: a name of
        ``sssfit.scene.made.MADE``, a file or a scene, at least as large as the kernel.
    mm_per_pixel, support_mm : float, optional [mm]
        Pixel size and half width of the support; see ``sssfit.fit.make_target``.
    normalize : bool
        Scale every channel to unit energy, and keep its energy in ``kernel.scale``.

    Returns
    -------
    FitResult
        ``kernel.parameters`` has each channel's ``spectral_error``, as a share.

    Raises
    ------
    FitError, ProfileError
        The rank, spectrum, picture, profile, pixel size or support is invalid.
    ArgumentError, FileError, RenderError
        There is no such picture, or it cannot be read.
    """
    target = make_target(profile, mm_per_pixel, support_mm)
    rank = _checked_rank(rank, target)
    grid = even_frequencies(target.half_pixels)
    pictures = pictures_of(target, spectrum, irradiance)
    first = ["natural"] if isinstance(pictures, Scene) else []

    def fit_channel(channel: int) -> ChannelFit:
        stages = [spectral_target(target, [channel], each, grid) for each in (*first, pictures)]
        return _fit_channel(target, stages, channel, rank, is_white=pictures == "white")

    settings = {"rank": rank, **recorded(pictures)}
    return fit_channels(target, "weighted", fit_channel, settings=settings, normalize=normalize)


def _checked_rank(rank: object, target: Target) -> int:
    try:
        terms = operator.index(rank)  # type: ignore[arg-type]
    except TypeError:
        terms = 0
    if not 1 <= terms <= _MOST_RANK:
        raise FitError(f"rank = {shown(rank)}; expected a whole number from 1 to {_MOST_RANK}.")
    return min(terms, target.half_pixels + 1)


def _fit_channel(
    target: Target, stages: Sequence[SpectralTarget], channel: int, rank: int, *, is_white: bool
) -> ChannelFit:
    """Fit a channel's terms to the last of the targets, also from those for the targets before."""
    quadrant, wanted = target.quadrant(channel), stages[-1]
    values, vectors = eigenpairs(quadrant, rank)
    start = vectors * np.sqrt(np.abs(values))[:, None]
    if is_white:
        signs, half, evaluations, reason = np.where(values < 0.0, -1.0, 1.0), start, 0, _WHITE
        factor = energy_factor(float(wanted.energy[0]), target, channel, signs, half)
        half = half * np.sqrt(factor)
    else:
        signs = np.ones(rank)
        half, evaluations, reason = _minimised(target, wanted, start)
        for before in stages[:-1]:
            first, more, _ = _minimised(target, before, start)
            second, still_more, other = _minimised(target, wanted, first)
            evaluations += more + still_more
            if _error(target, wanted, signs, second) < _error(target, wanted, signs, half):
                half, reason = second, other
    return ChannelFit(
        signs,
        half,
        reason,
        evaluations=evaluations,
        parameters={"spectral_error": _error(target, wanted, signs, half)},
        relative_frobenius_error=frobenius_error(target, quadrant, signs, half),
    )


def _error(target: Target, wanted: SpectralTarget, signs: FloatArray, half: FloatArray) -> float:
    """Return the misfit of terms (R, h+1), as a share."""
    seen = half @ wanted.cosines(target).T
    return float(wanted.error(((seen * signs[:, None]).T @ seen)[None])[0])


def _minimised(
    target: Target, wanted: SpectralTarget, start: FloatArray
) -> tuple[FloatArray, int, str]:
    """Return passes (R, h+1) with all of the energy, evaluations, and why the search ended."""
    cosines = wanted.cosines(target)
    energy, power, kernel = float(wanted.energy[0]), wanted.power[0], wanted.wanted[0]

    def misfit(x: FloatArray) -> tuple[float, FloatArray]:
        """Return the squared misfit of the terms, scaled to the energy, and its gradient."""
        seen = x.reshape(start.shape) @ cosines.T  # (R, n)
        own = float(seen[:, 0] @ seen[:, 0])
        scale = energy / own
        product = seen.T @ seen
        apart = scale * product - kernel
        weighted = power * apart
        by_seen = 4.0 * scale * seen @ weighted
        by_seen[:, 0] -= 4.0 * scale / own * float(np.vdot(weighted, product)) * seen[:, 0]
        return float(np.vdot(weighted, apart)), (by_seen @ cosines).ravel()

    from scipy.optimize import minimize  # 0.3 s that other methods do not need

    found = minimize(
        misfit,
        start.ravel(),
        jac=True,
        method="L-BFGS-B",
        options={"maxiter": _STEPS, "maxcor": 30, "ftol": 1e-13, "gtol": 1e-13},
    )
    half = found.x.reshape(start.shape)
    half = half * np.sqrt(energy) / np.linalg.norm(half @ target.copies)
    reason = _STOPPED if found.nit >= _STEPS else "converged"
    return np.where(half[:, :1] < 0.0, -half, half), int(found.nfev), reason
