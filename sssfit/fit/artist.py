"""The artist-friendly kernel: two Gaussians in one pass, fitted or set by hand.

a_m(x) = w G(x, v_near) + (1 - w) G(x, v_far) per channel (Jimenez et al. 2015, "Separable
Subsurface Scattering", supplement E). A shader multiplies each sample by
exp(-d_z^2 / (2 max(v_near, v_far))) for the depth between it and the middle; that variance goes
into the kernel's parameters.

Least squares fits one channel at a time to its line integral or to its 2D kernel. The visible error
of a picture depends on all channels together, and this room renders no pictures, so the caller
passes the function that judges the parameters (`sssfit.compare.pictures`).
"""

import functools
import itertools
import math
from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import FitError
from sssfit.fit._by_hand import (
    gaussian_pixels,
    kernel_misfit,
    line_misfit,
    normalised,
    per_channel,
)
from sssfit.fit._nlopt import Minimum, minimise, minimise_by_simplex
from sssfit.fit._result import ChannelFit, FitResult, fit_channels
from sssfit.fit._target import Pitch, Target, make_target
from sssfit.messages import printable
from sssfit.profile import Profile

_WIDTHS = 10  # widths tried for each Gaussian, in all pairs, before the best are refined
_REFINED = 3
# Starts of the search by pictures, the same for all channels: log(w / (1 - w)), and the logs of
# v_near and v_far relative to the square of the radius that holds half of the channel's energy.
_SHARES = (-1.0, 0.0, 1.0)
_NEAR = (-3.0, -1.5, 0.0)
_FAR = (1.0, 2.0, 3.0)
# Step and tolerance of these parameters; tolerance of a Delta E.
_STEP, _CHANGE, _VALUE_CHANGE = 0.5, 0.02, 1e-3
_MAX_EVALUATIONS = 1000
# By hand; the limits of kernel files, and squares of less underflow.
_MIN_MM2, _MAX_MM2 = 1e-18, 1e18

PerChannel = float | Sequence[float]
Misfit = Callable[[FloatArray], tuple[float, FloatArray]]
# Takes the kernel's pixels; returns a function of (w, log v_near, log v_far) by channel (3, C).
PictureTarget = Callable[[Target], Callable[[FloatArray], float]]


def fit_artist(
    profile: Profile,
    *,
    mm_per_pixel: Pitch | None = None,
    support_mm: float | None = None,
    normalize: bool = False,
    target: Literal["line", "kernel"] | PictureTarget = "line",
    near_mm2: PerChannel | None = None,
    far_mm2: PerChannel | None = None,
    weight: PerChannel | None = None,
) -> FitResult:
    """Fit two Gaussians per channel, or use given ones.

    The pass preserves the profile's energy, including the part that the support cuts off.

    Parameters
    ----------
    profile : Profile
        The profile to fit.
    mm_per_pixel, support_mm : float, optional [mm]
        Pixel size and half width of the support; see ``sssfit.fit.make_target``.
    normalize : bool
        Scale every channel to unit energy, and keep its energy in ``kernel.scale``.
    target : str or callable
        What to fit by least squares: "line", the profile integrated along lines, which decides how
        a long straight edge looks, or "kernel", all pixels of the 2D kernel. Or a function such as
        ``sssfit.compare.pictures.picture_error`` that takes the `Target` and returns one from (w,
        log v_near, log v_far) by channel (3, C) to a Delta E of pictures, which Nelder and Mead's
        simplex minimises over the parameters of all channels together.
    near_mm2, far_mm2 : float or one per channel, optional [mm^2]
        Variances per axis, set by hand together with ``weight``.
    weight : float or one per channel, optional
        Share of the near Gaussian, 0 to 1.

    Returns
    -------
    FitResult
        One term. For each channel
        ``kernel.parameters`` has ``near_mm2``, ``far_mm2``, ``weight`` and ``depth_variance_mm2``.

    Raises
    ------
    FitError, ProfileError
        The profile, the pixels or a setting is invalid.
    """
    is_named = isinstance(target, str) and target in ("line", "kernel")
    if not is_named and not callable(target):
        raise FitError(
            f'target = "{printable(str(target))}"; expected "line", "kernel" or a function that '
            "judges pictures."
        )
    pixels = make_target(profile, mm_per_pixel, support_mm)
    by_hand = _by_hand(near_mm2, far_mm2, weight, profile.channels)

    @functools.cache  # called with the first channel, so that the time counts as the fit's
    def by_pictures() -> list[Minimum]:
        assert callable(target)
        return fit_to_pictures(pixels, target(pixels))

    def fit_channel(channel: int) -> ChannelFit:
        if by_hand is not None:
            x = by_hand[:, channel]
            return _channel_fit(pixels, channel, x, "set by hand", 0)
        if callable(target):
            found = by_pictures()[channel]
        else:
            found = fit_two_gaussians(pixels.edges_mm(), _misfit_of(pixels, channel, target))
        return _channel_fit(pixels, channel, found.x, found.stop_reason, found.evaluations)

    named = "picture" if callable(target) else target
    settings = {"target": named, "by_hand": by_hand is not None}
    return fit_channels(
        pixels,
        "artist",
        fit_channel,
        settings=settings,
        normalize=normalize,
        is_fitted=by_hand is None,
    )


def two_gaussians(edges_mm: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a_m over pixels (h+1,) and its derivatives (3, h+1) by w, log v_near, log v_far.

    ``x`` is (w, log v_near, log v_far).
    """
    energy, slope = gaussian_pixels(edges_mm, np.exp(0.5 * x[1:]))
    shares = np.array((x[0], 1.0 - x[0]))
    slopes = 0.5 * shares[:, None] * slope
    return shares @ energy, np.concatenate((energy[:1] - energy[1:], slopes))


def fit_two_gaussians(edges_mm: FloatArray, misfit: Misfit) -> Minimum:
    """Minimise over (w, log v_near, log v_far), starting at the best of a grid of variances.

    Parameters
    ----------
    edges_mm : array (h+2,) [mm]
        `Target.edges_mm`.
    misfit : callable
        Takes a pass of sum 1 (h+1,); returns its error and the gradient.
    """

    def objective(x: FloatArray) -> tuple[float, FloatArray]:
        # With the energy of the final pass; otherwise a pass wider than the support would look
        # good.
        half, slopes = normalised(*two_gaussians(edges_mm, x))
        value, gradient = misfit(half)
        return value, slopes @ gradient

    log_v = _log_variances(edges_mm)
    pairs = itertools.combinations(np.linspace(log_v[0], log_v[1], _WIDTHS + 2)[1:-1], 2)
    starts = [np.array((w, *pair)) for pair in pairs for w in (0.25, 0.5, 0.75)]
    starts.sort(key=lambda x: objective(x)[0])
    lower = np.array((0.0, log_v[0], log_v[0]))
    upper = np.array((1.0, log_v[1], log_v[1]))
    found = [minimise(objective, x, lower=lower, upper=upper) for x in starts[:_REFINED]]
    best = min(found, key=lambda each: each.value)
    evaluations = len(starts) + sum(each.evaluations for each in found)
    return Minimum(_near_first(best.x), best.value, evaluations, best.stop_reason)


def fit_to_pictures(pixels: Target, objective: Callable[[FloatArray], float]) -> list[Minimum]:
    """Minimise over (w, log v_near, log v_far) of all channels; return a `Minimum` per channel.

    Parameters
    ----------
    pixels : Target
        The profile and its pixels.
    objective : callable
        Takes these parameters by channel (3, C); returns the error of the pictures. Channels
        without light get 1, 0, 0 and are not fitted.
    """
    lit = np.flatnonzero(~pixels.is_empty)
    log_v = _log_variances(pixels.edges_mm())

    def by_channel(x: FloatArray) -> FloatArray:
        values: FloatArray = np.zeros((3, pixels.is_empty.size))
        values[0] = 1.0
        values[:, lit] = x.reshape(3, lit.size)
        values[0, lit] = 1.0 / (1.0 + np.exp(-values[0, lit]))
        return values

    def of_shape(shape: tuple[float, ...]) -> FloatArray:
        sizes = 2.0 * np.log(_half_energy_radii(pixels)[lit])
        return np.concatenate((np.full(lit.size, shape[0]), shape[1] + sizes, shape[2] + sizes))

    starts = [of_shape(each) for each in itertools.product(_SHARES, _NEAR, _FAR)]
    found = minimise_by_simplex(
        lambda x: objective(by_channel(x)),
        min(starts, key=lambda x: objective(by_channel(x))),
        step=_STEP,
        lower=np.repeat((-np.inf, log_v[0], log_v[0]), lit.size),
        upper=np.repeat((np.inf, log_v[1], log_v[1]), lit.size),
        change=_CHANGE,
        value_change=_VALUE_CHANGE,
        most_evaluations=_MAX_EVALUATIONS,
    )
    evaluations = len(starts) + found.evaluations
    return [
        Minimum(_near_first(x), found.value, evaluations, found.stop_reason)
        for x in by_channel(found.x).T
    ]


def artist_pass(pixels: Target, channel: int, x: FloatArray) -> FloatArray:
    """Return the half line (h+1,) for (w, log v_near, log v_far), with the channel's energy."""
    half, _ = normalised(*two_gaussians(pixels.edges_mm(), x))
    return math.sqrt(float(pixels.total[channel])) * half


def _log_variances(edges_mm: FloatArray) -> FloatArray:
    """Return the bounds of the log variances, from a tenth of a pixel and twice the support.

    The first Gaussian is a point in its pixel, the second is flat over the support.
    """
    limits: FloatArray = 2.0 * np.log(np.array((0.2 * edges_mm[1], 2.0 * edges_mm[-1])))
    return limits


def _half_energy_radii(pixels: Target) -> FloatArray:
    """Return the radius that holds half of the energy on the grid (C,) [mm]."""
    profile = pixels.profile
    within = profile.cumulative
    return np.array(
        [
            np.interp(0.5 * each[-1], each, profile.r_edges_mm) if each[-1] > 0.0 else 0.0
            for each in within.T
        ]
    )


def _misfit_of(pixels: Target, channel: int, target: str) -> Misfit:
    """Return the misfit of a pass of sum 1 to the channel's line integral or 2D kernel."""
    copies = pixels.copies
    if target == "line":
        line = pixels.half_line()[:, channel]
        return lambda half: line_misfit(half, line / (copies @ line), copies)
    quadrant = pixels.quadrant(channel) / float(pixels.total[channel])
    return lambda half: kernel_misfit(half, quadrant, copies)


def _near_first(x: FloatArray) -> FloatArray:
    """Return the parameters with the narrower Gaussian as the near one."""
    return x if x[1] <= x[2] else np.array((1.0 - x[0], x[2], x[1]))


def _channel_fit(
    pixels: Target, channel: int, x: FloatArray, stop_reason: str, evaluations: int
) -> ChannelFit:
    """Return the pass with the profile's energy, and its parameters."""
    half = artist_pass(pixels, channel, x)
    near, far = (float(each) for each in np.exp(x[1:]))
    parameters = {"near_mm2": near, "far_mm2": far, "weight": float(x[0])}
    parameters["depth_variance_mm2"] = max(near, far)
    return ChannelFit(np.ones(1), half[None], stop_reason, evaluations, parameters)


def _by_hand(
    near_mm2: PerChannel | None,
    far_mm2: PerChannel | None,
    weight: PerChannel | None,
    channels: tuple[str, ...],
) -> FloatArray | None:
    """Return (w, log v_near, log v_far) by channel (3, C), or None if nothing is given."""
    values = per_channel({"weight": weight, "near_mm2": near_mm2, "far_mm2": far_mm2}, channels)
    if values is None:
        return None
    if ((values[0] < 0.0) | (values[0] > 1.0)).any():
        raise FitError(f"weight = {weight}; expected shares from 0 to 1.")
    if ((values[1:] < _MIN_MM2) | (values[1:] > _MAX_MM2)).any():
        raise FitError(
            f"near_mm2 = {near_mm2}, far_mm2 = {far_mm2}; expected variances above 0, from "
            f"{_MIN_MM2:g} to {_MAX_MM2:g} mm^2."
        )
    return np.concatenate((values[:1], np.log(values[1:])))
