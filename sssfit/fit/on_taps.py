"""A separable kernel thinned to the few bilinear fetches a pass that a shader can afford.

All terms and channels share the offsets o_1 < .. < o_n beside the middle one, so the first pass is
shared: R terms of N = 2 n + 1 taps cost (R + 1) N fetches. A fetch between texels i and i + 1, at
o = i + f, has the second moment

    m(o) = (1 - f) i^2 + f (i + 1)^2,

and each dense weight at x is given to the two taps around it by hats in x^2,

    m(o_i) <= x^2 <= m(o_{i+1}):   (m(o_{i+1}) - x^2) / (m(o_{i+1}) - m(o_i))  to o_i, the rest to
    o_{i+1},

so that what is rendered has the energy and the second moment of every term and channel. The
farthest tap lies at the end of the kernel. Offsets and weights can also be fitted to the profile's
kernel as pictures see it (``_fitted_taps``); that keeps the energy only.
"""

import operator
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sssfit.arrays import FloatArray, check_record
from sssfit.errors import FitError, KernelError
from sssfit.fit._fitted_taps import refined
from sssfit.fit._spectrum import SpectralTarget, pictures_of, spectral_target
from sssfit.fit._target import make_target
from sssfit.kernel import SeparableKernel, Stage, Taps
from sssfit.kernel.structure import MOST_PAIRS
from sssfit.messages import counted, shown
from sssfit.process import one_blas_thread
from sssfit.profile import Profile
from sssfit.scene.record import Scene

PLACES = ("cumulative", "quadratic", "fitted")
LEAST_TAPS, MOST_TAPS = 3, 2 * MOST_PAIRS + 1


def on_taps(
    kernel: SeparableKernel,
    taps: int,
    *,
    place: str = "cumulative",
    profile: Profile | None = None,
    spectrum: str | None = None,
    irradiance: str | Path | Scene | None = None,
) -> Taps:
    """Thin a kernel to a number of bilinear fetches a pass.

    Parameters
    ----------
    kernel : SeparableKernel
    taps : int
        Fetches of a pass, N: odd, 3 to 129, at most the kernel's pixels; with all of them the table
        is the kernel.
    place : {"cumulative", "quadratic", "fitted"}
        Where the taps lie: each with a like share of the cube root of the weights, or at
        distances that grow as i^2, as in Jimenez' shaders, one texel apart at least; or fitted,
        with their weights, to the profile's kernel under the power of pictures, from the better of
        the two. Second moments are then not kept.
    profile : Profile, optional
        What the kernel was fitted to, for ``errors["spectral"]``; NaN without it. "fitted" needs
        it.
    spectrum, irradiance : optional
        What the kernel is for; see `sssfit.fit.weighted.fit_weighted`.

    Returns
    -------
    Taps
        Unchained, one pair of passes for each term; ``blend`` has the terms' signed energies.

    Raises
    ------
    FitError
        The number, place or picture is invalid, or a term of the kernel has no energy.
    ArgumentError, FileError, RenderError
        There is no such picture, or it cannot be read.
    """
    check_record("kernel", kernel, SeparableKernel, FitError)
    count = _checked(taps, kernel, place)
    half = kernel.weights[:, kernel.half_pixels :]  # (T, h+1, C)
    lit, wanted = _wanted(kernel, profile, spectrum, irradiance)
    if place == "fitted":
        offsets, passes = _fitted(kernel, half, count, lit, wanted)
    else:
        offsets, passes = _thinned(half, count, place)
    stages, blend = [], [np.zeros(len(kernel.channels))]
    for signs, own in zip(kernel.signs, passes, strict=True):
        stage, sums = Stage.of_term(offsets * kernel.mm_per_pixel, own)
        stages.append(stage)
        blend.append(signs * sums**2 * kernel.scale)
    error = np.full(len(kernel.channels), np.nan)
    if wanted is not None:
        error[lit] = _spectral_error(stages, np.array(blend)[:, lit], kernel, lit, wanted)
    settings = {**kernel.meta.get("settings", {}), "taps": count, "place": place}
    try:
        return Taps(
            method=kernel.method,
            mm_per_pixel=kernel.mm_per_pixel,
            channels=kernel.channels,
            chained=False,
            stages=tuple(stages),
            blend=np.array(blend),
            errors={"spectral": error, "energy": kernel.energy_error},
            meta={**kernel.meta, "settings": settings},
        )
    except KernelError:
        raise FitError(
            f"{kernel.method}: a term has next to no energy, so that its taps cannot be scaled to "
            "add up to 1; use fewer terms or another method."
        ) from None


def _checked(taps: object, kernel: SeparableKernel, place: str) -> int:
    """Return the number of taps, or raise FitError."""
    if not isinstance(place, str) or place not in PLACES:
        raise FitError(f"place = {shown(place)}; expected {' or '.join(map(repr, PLACES))}.")
    try:
        count = operator.index(taps)  # type: ignore[arg-type]
    except TypeError:
        count = 0
    if not (LEAST_TAPS <= count <= MOST_TAPS and count % 2):
        raise FitError(
            f"taps = {shown(taps)}; expected an odd number from {LEAST_TAPS} to {MOST_TAPS}: the "
            "middle and mirrored pairs."
        )
    if count > kernel.pixels:
        raise FitError(
            f"taps = {count} for a kernel of {counted(kernel.pixels, 'pixel')}; expected at most "
            "as many taps "
            "as pixels, or a larger support."
        )
    return count


def _thinned(half: FloatArray, count: int, place: str) -> tuple[FloatArray, FloatArray]:
    """Return offsets (n,) [pixels] and the weights (T, n+1, C) that each tap stands for."""
    offsets = _places(half, count, place)
    return offsets, np.stack([_spread(each, offsets) for each in half])


def _wanted(
    kernel: SeparableKernel,
    profile: Profile | None,
    spectrum: str | None,
    irradiance: str | Path | Scene | None,
) -> tuple[list[int], SpectralTarget | None]:
    """Return the channels that return light, and their spectrum, or None without any."""
    if profile is None:
        return [], None
    target = make_target(profile, kernel.mm_per_pixel, kernel.support_mm)
    lit = [int(c) for c in np.flatnonzero(~target.is_empty)]
    with one_blas_thread():
        return lit, spectral_target(target, lit, pictures_of(target, spectrum, irradiance))


def _fitted(
    kernel: SeparableKernel,
    half: FloatArray,
    count: int,
    lit: list[int],
    wanted: SpectralTarget | None,
) -> tuple[FloatArray, FloatArray]:
    """Return offsets (n,) [pixels] and weights (T, n+1, C) fitted to the profile's kernel."""
    if wanted is None:
        raise FitError('place = "fitted" needs the profile that the kernel was fitted to.')
    scale = np.sqrt(kernel.scale[lit])
    starts = [_thinned(half, count, each) for each in ("cumulative", "quadratic")]
    with one_blas_thread():
        offsets, own = refined(
            wanted,
            [(at, weights[:, :, lit] * scale) for at, weights in starts],
            kernel.signs[:, lit],
        )
    passes = np.stack([_spread(each, offsets) for each in half])
    passes[:, :, lit] = own / scale
    return offsets, passes


def _places(half: FloatArray, taps: int, place: str) -> FloatArray:
    """Return offsets (n,) [pixels], rising by a pixel at least; the last is the kernel's end."""
    count, last = (taps - 1) // 2, half.shape[1] - 1
    share = np.arange(1, count + 1) / count
    if place == "quadratic":
        wished = last * share**2
    else:
        wished = np.interp(share, _cumulative(half), np.arange(last + 1.0))
    least = np.arange(1.0, count + 1.0)
    rising = np.maximum.accumulate(wished - least) + least
    found: FloatArray = np.minimum(np.maximum(rising, least), last - count + least)
    return found


def _cumulative(half: FloatArray) -> FloatArray:
    """Return how much of the cube root of the weights lies within x = 0 .. h pixels (h+1,).

    Of terms and channels the mean. Nodes as dense as the cube root are those of the least error of
    interpolation, where the curvature goes as the weights. At equal shares of the weights
    themselves the pre-integrated pass of skin1 on 25 taps shows 16.4 (mean 99th percentile of
    Delta E, as in docs/cascades.md), of the square root 9.4, of the cube root 8.0.
    """
    size = np.abs(half)  # (T, h+1, C)
    total = size.sum(axis=1, keepdims=True)
    root = np.cbrt(np.divide(size, total, out=np.zeros_like(size), where=total > 0.0))
    density = root.mean(axis=(0, 2))
    between = 0.5 * (density[1:] + density[:-1])
    cumulative = np.concatenate(([0.0], np.cumsum(between)))
    found: FloatArray = cumulative / cumulative[-1] if cumulative[-1] > 0.0 else cumulative
    return found


def _spread(weights: FloatArray, offsets: FloatArray) -> FloatArray:
    """Return weights of the middle and of each mirrored pair's fetches (n+1, C)."""
    whole = np.floor(offsets)
    part = offsets - whole
    moments = np.concatenate(([0.0], (1.0 - part) * whole**2 + part * (whole + 1.0) ** 2))
    squares = np.arange(len(weights)) ** 2.0
    lower = np.clip(np.searchsorted(moments, squares, side="right") - 1, 0, len(offsets) - 1)
    upper = (squares - moments[lower]) / (moments[lower + 1] - moments[lower])
    both = np.where(np.arange(len(weights)) == 0, 1.0, 2.0)[:, None] * weights
    own = np.zeros((len(offsets) + 1, weights.shape[1]))
    np.add.at(own, lower, both * (1.0 - upper)[:, None])
    np.add.at(own, lower + 1, both * upper[:, None])
    own[1:] *= 0.5
    return own


def _spectral_error(
    stages: Sequence[Stage],
    blend: FloatArray,
    kernel: SeparableKernel,
    lit: list[int],
    wanted: SpectralTarget,
) -> FloatArray:
    """Return the norm of the difference from the profile's kernel as pictures see it.

    ``blend`` (L+1, n) and the result (n,) are of the ``lit`` channels.
    """
    with one_blas_thread():
        rows = [each.pass_weights(kernel.mm_per_pixel) for each in stages]
        spectrum = np.zeros_like(wanted.wanted)
        for own, share in zip(rows, blend[1:], strict=True):
            x = np.arange(len(own)) - len(own) // 2
            seen = np.cos(np.outer(wanted.frequencies, x)) @ own[:, lit]  # (n, C)
            spectrum += np.einsum("nc,mc,c->cnm", seen, seen, share)
        return wanted.error(spectrum)
