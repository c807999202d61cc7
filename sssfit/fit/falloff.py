"""The model of 2012: the red skin profile, stretched, with part of the light left unscattered.

s(w, t, f)[x] = p(x / m) t / m + delta(x) (1 - t) with m = STRETCH w (0.001 + f), width w, strength
t and falloff f, and p the red channel of d'Eon's six-Gaussian skin (Jimenez, Jarabo, Gutierrez
2012, "Separable Subsurface Scattering", RR-02-12, eqs. 1 to 3). Where the report is ambiguous:

- Eq. 1 prints p[x w / (0.001 + f)], in which a larger width narrows the kernel, but in figure 6 and
  the released shader it widens. This fit follows the figure.
- x has no unit. ``STRETCH`` makes the parameters of table 1 fit the six-Gaussian skin best, and the
  red channel is then 1.02 times as wide as p: docs/make_falloff.py finds it.
- Only the product of w and 0.001 + f matters: four numbers for the scales of three channels. A fit
  gives the widest channel the falloff 1.
- p is the skin integrated along lines, of unit integral. Read as R_d along a radius it fits worse.
- delta is the middle pixel, so the strength depends on the pixel size. For small pixels it is 1.
"""

import functools
import itertools
import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.errors import FitError
from sssfit.fit._by_hand import gaussian_pixels, kernel_misfit, normalised, per_channel
from sssfit.fit._nlopt import Minimum, minimise
from sssfit.fit._result import ChannelFit, FitResult, fit_channels
from sssfit.fit._target import Pitch, make_target
from sssfit.profile import Profile
from sssfit.shapes import SKIN_VARIANCES_MM2, SKIN_WEIGHTS

STRETCH = 127.7

_SIGMAS_MM = np.sqrt(SKIN_VARIANCES_MM2)
_RED = np.array([row[0] for row in SKIN_WEIGHTS])
_MIN_FALLOFF = 0.001
_WIDTHS, _MAX_FALLOFF = (1e-9, 1e9), 1e6  # by hand; beyond them squares overflow double precision
# Every pixel is a sample up to here; farther out samples are an eighth of their distance apart.
_DENSE = 8
_SCALES = 24  # scales tried with each strength, before the best are refined
_STRENGTHS = (0.25, 0.5, 0.75, 1.0)
_REFINED = 3

PerChannel = float | Sequence[float]


def fit_falloff(
    profile: Profile,
    *,
    mm_per_pixel: Pitch | None = None,
    support_mm: float | None = None,
    normalize: bool = False,
    width: float | None = None,
    strength: PerChannel | None = None,
    falloff: PerChannel | None = None,
) -> FitResult:
    """Fit width, strength and falloff to the 2D kernel, or use given ones.

    The pass preserves the profile's energy, including the part that the support cuts off.

    Parameters
    ----------
    profile : Profile
        The profile to fit.
    mm_per_pixel, support_mm : float, optional [mm]
        Pixel size and half width of the support; see ``sssfit.fit.make_target``.
    normalize : bool
        Scale every channel to unit energy, and keep its energy in ``kernel.scale``.
    width : float, optional
        Width of all channels, above 0, set by hand together with ``strength`` and ``falloff``.
    strength : float or one per channel, optional
        Share of the light that scatters, 0 to 1.
    falloff : float or one per channel, optional
        Reach of a channel, 0 or above.

    Returns
    -------
    FitResult
        One term. For each channel ``kernel.parameters`` has ``width`` (the same for all),
        ``strength``, ``falloff`` and ``misfit``, which is `sampled_misfit`.

    Raises
    ------
    FitError, ProfileError
        The profile, the pixels or a setting is invalid.
    """
    target = make_target(profile, mm_per_pixel, support_mm)
    given = _by_hand(width, strength, falloff, profile.channels)
    edges, total = target.edges_mm(), target.total
    lit = [int(c) for c in np.flatnonzero(~target.is_empty)]

    def quadrant_of(channel: int) -> FloatArray:
        return target.quadrant(channel) / float(total[channel])

    @functools.cache  # called with the first channel, so that the time counts as the fit's
    def all_channels() -> tuple[dict[int, Minimum], FloatArray]:
        if given is not None:
            return {}, given
        found = {c: fit_scale(quadrant_of(c), edges) for c in lit}
        return found, _model_parameters(found, profile.n_channels)

    def fit_channel(channel: int) -> ChannelFit:
        found, values = all_channels()
        w, t, f = (float(each) for each in values[:, channel])
        half, _ = stretched_skin(np.array((t, math.log(scale_of(w, f)))), edges)
        minimum = found.get(channel)
        return ChannelFit(
            np.ones(1),
            math.sqrt(float(total[channel])) * half[None],
            "set by hand" if minimum is None else minimum.stop_reason,
            0 if minimum is None else minimum.evaluations,
            {
                "width": w,
                "strength": t,
                "falloff": f,
                "misfit": sampled_misfit(half, quadrant_of(channel))[0],
            },
        )

    settings = {"by_hand": given is not None}
    return fit_channels(
        target,
        "falloff",
        fit_channel,
        settings=settings,
        normalize=normalize,
        is_fitted=given is None,
    )


def scale_of(width: float, falloff: float) -> float:
    """Return the width of a channel relative to red skin: m = STRETCH w (0.001 + f)."""
    return STRETCH * width * (_MIN_FALLOFF + falloff)


def stretched_skin(x: FloatArray, edges_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return s over pixels, scaled to sum 1 (h+1,), and its derivatives (2, h+1).

    ``x`` is (t, log m), ``edges_mm`` (h+2,) are those of `Target.edges_mm`.
    """
    energy, slope = gaussian_pixels(edges_mm, _SIGMAS_MM * math.exp(x[1]))
    delta = np.zeros(edges_mm.size - 1)
    delta[0] = 1.0
    skin = _RED @ energy
    slopes = np.stack((skin - delta, x[0] * (_RED @ slope)))
    return normalised(x[0] * skin + (1.0 - x[0]) * delta, slopes)


def sampled_misfit(half: FloatArray, quadrant: FloatArray) -> tuple[float, FloatArray]:
    """Return eq. 3's sum for a pass (h+1,), relative to an empty pass, and its gradient.

    Summed over pairs of sampled pixels of a quadrant (h+1, h+1) and their copies in the plane.
    """
    at = sampled_pixels(half.size)
    value, sampled = kernel_misfit(half[at], quadrant[np.ix_(at, at)], np.where(at == 0, 1.0, 2.0))
    gradient = np.zeros(half.size)
    gradient[at] = sampled
    return value, gradient


def sampled_pixels(pixels: int) -> npt.NDArray[np.int64]:
    """Return the pixels of a half line that eq. 3 samples, dense near the middle."""
    at = [0]
    while (farther := at[-1] + max(1, at[-1] // _DENSE)) < pixels:
        at.append(farther)
    return np.array(at)


def fit_scale(quadrant: FloatArray, edges_mm: FloatArray) -> Minimum:
    """Fit (t, log m) to one channel's quadrant (h+1, h+1) of unit energy, 0 <= t <= 1."""

    def objective(x: FloatArray) -> tuple[float, FloatArray]:
        half, slopes = stretched_skin(x, edges_mm)
        value, gradient = sampled_misfit(half, quadrant)
        return value, slopes @ gradient

    # From skin that is a point in the middle pixel to skin that is flat over the support.
    logs = np.log(np.array((0.2 * edges_mm[1], 2.0 * edges_mm[-1])) / _SIGMAS_MM[-1])
    grid = itertools.product(_STRENGTHS, np.linspace(logs[0], logs[1], _SCALES))
    starts = sorted((np.array(x) for x in grid), key=lambda x: objective(x)[0])
    lower, upper = np.array((0.0, logs[0])), np.array((1.0, logs[1]))
    found = [minimise(objective, x, lower=lower, upper=upper) for x in starts[:_REFINED]]
    best = min(found, key=lambda each: each.value)
    evaluations = len(starts) + sum(each.evaluations for each in found)
    return Minimum(best.x, best.value, evaluations, best.stop_reason)


def _model_parameters(found: dict[int, Minimum], channels: int) -> FloatArray:
    """Return width, strength and falloff (3, C): the widest channel has the falloff 1."""
    widest = math.exp(max(each.x[1] for each in found.values()))
    values = np.zeros((3, channels))
    values[0] = widest / (STRETCH * (_MIN_FALLOFF + 1.0))
    for c, each in found.items():
        share = math.exp(each.x[1]) / widest
        values[1:, c] = each.x[0], max(0.0, share * (_MIN_FALLOFF + 1.0) - _MIN_FALLOFF)
    return values


def _by_hand(
    width: float | None,
    strength: PerChannel | None,
    falloff: PerChannel | None,
    channels: tuple[str, ...],
) -> FloatArray | None:
    """Return width, strength and falloff (3, C), or None if nothing is given."""
    given = {"width": width, "strength": strength, "falloff": falloff}
    values = per_channel(given, channels)
    if values is None:
        return None
    least, most = _WIDTHS
    if (values[0] != values[0, 0]).any() or not least <= values[0, 0] <= most:
        raise FitError(
            f"width = {width}; expected one number above 0 for all channels, from {least:g} to "
            f"{most:g}."
        )
    if ((values[1] < 0.0) | (values[1] > 1.0)).any():
        raise FitError(f"strength = {strength}; expected shares from 0 to 1.")
    if ((values[2] < 0.0) | (values[2] > _MAX_FALLOFF)).any():
        raise FitError(f"falloff = {falloff}; expected numbers from 0 to {_MAX_FALLOFF:g}.")
    return values
