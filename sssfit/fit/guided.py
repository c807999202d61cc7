"""The guided kernel: one pass, fitted under a guide function that weights the pixels.

Minimise over a the sum of Gamma (R_d - a a^T)^2 subject to (sum a)^2 = ||R_d||_1, with Gamma(x, y;
k) = (x^2 + y^2)^(k/2) (1 - exp(-b x^2)) (1 - exp(-b y^2)) (Jimenez et al. 2015, "Separable
Subsurface Scattering", supplement eqs. S.7 to S.9): k = 0 favours light near the beam, k = 4 light
far from it. x and y are 1 at the channel's own extent, in proportion to its mean free path, so k
and b have the same meaning for narrow and wide channels; docs/fits.md compares other rules. The
search is sequential quadratic programming, from coarse to fine grids.

Gamma vanishes along the axes, so the middle pixel a(0) is almost unconstrained: it takes the energy
that the other pixels leave over and becomes a spike, which is reported and can be bounded.
"""

import math
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray, is_number
from sssfit.errors import FitError, SssfitWarning
from sssfit.fit._nlopt import Function, Minimum, minimise
from sssfit.fit._result import ChannelFit, FitResult, fit_channels
from sssfit.fit._target import Pitch, Target, make_target
from sssfit.messages import shown
from sssfit.optics import gauss_legendre
from sssfit.process import one_blas_thread
from sssfit.profile import Profile
from sssfit.profile.bins import mean_free_paths_mm

# The k for which the paper draws Gamma (figure S.1b). It does not give the pass nearest to the
# pre-integrated one for every channel: that is k = 0 for skin1's red, see docs/fits.md.
DRAWN_K = 1.55
MOST_PIXELS = 513
_COARSEST = 8  # half pixels of the first level; each level has twice as many as the last
_SPIKE = (
    0.25  # share of sum(a): warn of a middle pixel above it and above twice the pre-integrated one
)
_MIN_B, _MAX_B = 1e-3, 1e9  # beyond these, Gamma is 0 or 1 to rounding
_MIN_BOUND = 1e-9
_ACROSS = 64  # least number of quadrature nodes of Gamma along a half line; its steps are 1/7 wide


def fit_guided(
    profile: Profile,
    *,
    mm_per_pixel: Pitch | None = None,
    support_mm: float | None = None,
    normalize: bool = False,
    k: float = DRAWN_K,
    b: float = 50.0,
    centre_bound: float | None = None,
) -> FitResult:
    """Fit one pass with the guide function Gamma as weights.

    Parameters
    ----------
    profile : Profile
        The profile to fit.
    mm_per_pixel, support_mm : float, optional [mm]
        Pixel size and half width of the support, 513 pixels at most; see
        ``sssfit.fit.make_target``. The default and "profile" are widened if they would take more
        pixels.
    normalize : bool
        Scale every channel to unit energy, and keep its energy in ``kernel.scale``.
    k : float
        0 (near scattering) to 4 (far scattering).
    b : float
        How close to the axes Gamma vanishes: within about 1/sqrt(b) of the channel's extent.
    centre_bound : float, optional
        Largest share of sum(a) that the middle pixel may hold, above 0 and up to 1.

    Returns
    -------
    FitResult
        One term. For each channel
        ``kernel.parameters`` has ``extent_mm``, where x = 1 in Gamma, ``centre_share`` = a(0) /
        sum(a), the same for the pre-integrated pass, the remaining share of sum Gamma R_d^2, and
        how each level ended.

    Raises
    ------
    FitError, ProfileError
        The profile, the pixels or a setting is invalid.

    Warns
    -----
    SssfitWarning
        The middle pixel holds over a quarter of sum(a) and over twice its pre-integrated share.
    """
    _check_settings(k, b, centre_bound)
    target = guided_target(profile, mm_per_pixel, support_mm)
    extents_mm = extents_of(target)
    most = 1.0 if centre_bound is None else centre_bound

    def fit_channel(channel: int) -> ChannelFit:
        return fit_one_pass(target, channel, extents_mm[channel], k, b, most)

    # Matrices of at most 257 x 257: a second thread only waits for the first.
    with one_blas_thread():
        result = fit_channels(
            target,
            "guided",
            fit_channel,
            settings={"k": k, "b": b, "centre_bound": centre_bound},
            normalize=normalize,
        )
    _warn_of_spikes(result)
    return result


def extents_of(target: Target) -> FloatArray:
    """Return where x = 1 in each channel's Gamma (C,) [mm]: the support, by mean free path.

    The support reaches to the outer edges of its pixels, and is the extent of the lit channel with
    the longest mean free path. For a profile without mean free paths (a table, a stack of layers)
    it is the extent of all channels, as in the supplement.
    """
    support_mm = target.mm_per_pixel * (target.half_pixels + 0.5)
    paths_mm = mean_free_paths_mm(target.profile)
    if paths_mm is None:
        return np.full(target.profile.n_channels, support_mm)
    return np.asarray(support_mm * paths_mm / paths_mm[~target.is_empty].max())


def gamma(half_pixels: int, k: float, b: float = 50.0, extent: float = 1.0) -> FloatArray:
    """Return the mean of Gamma over every pixel of a quadrant (h+1, h+1) with its axes: eq. S.9.

    ``extent`` is where x = 1, as a share of the support's h + 1/2 pixels: pixel i covers
    (i - 1/2, i + 1/2) / ((h + 1/2) extent).
    """
    unit = (half_pixels + 0.5) * extent  # pixels
    order = max(4, math.ceil(_ACROSS / max(unit, 1.0)))
    nodes, weights = gauss_legendre(order, -0.5, 0.5)
    pixels = np.arange(half_pixels + 1)[:, None]
    square = (((pixels + nodes) / unit) ** 2).ravel()
    rising = -np.expm1(-b * square)
    values = (square[:, None] + square) ** (0.5 * k) * rising[:, None] * rising
    blocks = values.reshape(half_pixels + 1, order, half_pixels + 1, order)
    mean: FloatArray = np.einsum("iajb,a,b->ij", blocks, weights, weights)
    return mean


def rank_one(
    wanted: FloatArray,
    weights: FloatArray,
    start: FloatArray,
    *,
    total: float | None = 1.0,
    centre_bound: float = math.inf,
) -> Minimum:
    """Minimise sum c_i c_j weights_ij (wanted_ij - a_i a_j)^2 over a >= 0 on a half line.

    Parameters
    ----------
    wanted, weights : array (h+1, h+1)
        A quadrant; c counts each pixel's copies in the plane.
    start : array (h+1,)
        Starting point, from which the scale of each a_i is estimated.
    total : float or None
        Required (sum of the whole pass)^2; None leaves it free.
    centre_bound : float
        Largest a_0.

    Returns
    -------
    Minimum
        ``x`` is a; ``value`` is the minimum relative to the value at a = 0.
    """
    copies = np.where(np.arange(start.size) == 0, 1.0, 2.0)
    weights = copies[:, None] * copies * weights
    norm = float(np.sum(weights * wanted**2)) or 1.0
    # In units of 1 / sqrt(second derivative) of each a_i, SLSQP, which starts from the identity as
    # Hessian, needs 11 evaluations at 65 pixels and at 513; in units of a_i itself 227 at 65.
    scale = np.sqrt(norm / (8.0 * weights @ start**2))

    def objective(x: FloatArray) -> tuple[float, FloatArray]:
        return _misfit(scale * x, wanted, weights, scale, norm)

    upper = np.full(start.size, np.inf)
    upper[0] = centre_bound / scale[0]
    found = minimise(
        objective,
        start / scale,
        lower=np.zeros(start.size),
        upper=upper,
        equality=None if total is None else _sum_constraint(math.sqrt(total), copies * scale),
    )
    return Minimum(scale * found.x, found.value, found.evaluations, found.stop_reason)


def _misfit(
    a: FloatArray, wanted: FloatArray, weights: FloatArray, scale: FloatArray, norm: float
) -> tuple[float, FloatArray]:
    """Return sum weights (wanted - a a^T)^2 / norm and its gradient in units of ``scale``."""
    left = wanted - a[:, None] * a
    pull = weights * left
    return float(np.sum(pull * left)) / norm, -4.0 / norm * scale * (pull @ a)


def _sum_constraint(wanted: float, weights: FloatArray) -> Function:
    """Return weights x - wanted with its gradient: (sum a)^2 = total has one root with a >= 0."""

    def equality(x: FloatArray) -> tuple[float, FloatArray]:
        return float(weights @ x) - wanted, weights

    return equality


def fit_one_pass(
    target: Target,
    channel: int,
    extent_mm: float,
    k: float,
    b: float,
    most: float,
    begin: Callable[[FloatArray], FloatArray] | None = None,
) -> ChannelFit:
    """Fit a channel level by level, with energies as shares of its total, so that sum(a) = 1.

    ``extent_mm`` is where x = 1 in Gamma, ``most`` the largest share of the middle pixel. ``begin``
    makes the start of the coarsest level from the pre-integrated pass (h+1,), which it is without.
    """
    total = float(target.total[channel])
    extent = float(extent_mm / (target.mm_per_pixel * (target.half_pixels + 0.5)))
    levels: list[dict[str, Any]] = []
    found: Minimum | None = None
    for half in _levels(target.half_pixels):
        pitch = target.mm_per_pixel * (target.half_pixels + 0.5) / (half + 0.5)
        level = Target(target.profile, pitch, half)
        line = level.half_line()[:, channel]
        if found is not None:
            start = _resampled(found.x, half)
        else:
            start = line if begin is None else begin(line)
        found = rank_one(
            level.quadrant(channel) / total,
            gamma(half, k, b, extent),
            _normalised_pass(start, most),
            centre_bound=most if half else 1.0,
        )
        levels.append(
            {
                "pixels": 2 * half + 1,
                "evaluations": found.evaluations,
                "stop_reason": found.stop_reason,
            }
        )
    assert found is not None
    return ChannelFit(
        np.ones(1),
        math.sqrt(total) * found.x[None],
        found.stop_reason,
        evaluations=sum(level["evaluations"] for level in levels),
        parameters={
            "extent_mm": float(extent_mm),
            "centre_share": float(found.x[0]),
            "preintegrated_centre_share": float(line[0] / (level.copies @ line)),
            "weighted_residual": found.value,
            "levels": levels,
        },
    )


def _levels(half_pixels: int) -> list[int]:
    """Return the half pixels of each level, coarse to fine: 8, 16, ..., up to the full number."""
    halves = [half_pixels]
    while halves[0] >= 2 * _COARSEST:
        halves.insert(0, halves[0] // 2)
    return halves


def _resampled(half_line: FloatArray, half_pixels: int) -> FloatArray:
    """Resample a pass (h'+1,) to more pixels on the same support, keeping its sum and sign."""
    from scipy.interpolate import PchipInterpolator

    def edges(half: int) -> FloatArray:
        return np.concatenate(([0.0], (np.arange(half + 1) + 0.5) / (half + 0.5)))

    # Interpolate the cumulative sum from the axis outwards, monotone between the known edges.
    within = np.cumsum(np.concatenate(([0.0, 0.5 * half_line[0]], half_line[1:])))
    fine = np.diff(PchipInterpolator(edges(half_line.size - 1), within)(edges(half_pixels)))
    fine[0] *= 2.0
    return np.asarray(fine)


def _normalised_pass(a: FloatArray, most: float) -> FloatArray:
    """Scale a half line to a whole pass of sum 1 whose middle pixel holds at most ``most``."""
    a = a / (2.0 * a.sum() - a[0])
    if a[0] <= most or a.size == 1:
        return a
    rest = a[1:].sum()
    outer = a[1:] / rest if rest > 0.0 else np.full(a.size - 1, 1.0 / (a.size - 1))
    return np.concatenate(([most], 0.5 * (1.0 - most) * outer))


def _check_settings(k: float, b: float, centre_bound: float | None) -> None:
    if not is_number(k) or not 0.0 <= k <= 4.0:
        raise FitError(
            f"k = {_said(k)} is outside [0, 4]; 0 favours near scattering, 4 far scattering."
        )
    if not is_number(b) or not _MIN_B <= b <= _MAX_B:
        raise FitError(
            f"b = {_said(b)}; expected a number above 0, from {_MIN_B:g} to {_MAX_B:g}, such as 50."
        )
    is_share = is_number(centre_bound) and _MIN_BOUND <= centre_bound <= 1.0
    if centre_bound is not None and not is_share:
        raise FitError(
            f"centre_bound = {_said(centre_bound)}; expected a share from {_MIN_BOUND:g} to 1."
        )


def _said(value: object) -> str:
    return f"{value:g}" if is_number(value) else shown(value)


def guided_target(profile: Profile, mm_per_pixel: Pitch | None, support_mm: float | None) -> Target:
    """Choose pixels as `make_target` does, but at most 513.

    Raises FitError, which names a sufficient pixel size, if a given one takes more; warns if the
    default is widened.
    """
    target = make_target(profile, mm_per_pixel, support_mm)
    pixels, pitch = 2 * target.half_pixels + 1, target.mm_per_pixel
    if pixels <= MOST_PIXELS:
        return target
    # The optimiser's matrices are dense: time grows with the third power of the pixels.
    enough = _rounded_up((target.half_pixels + 1) * pitch / (MOST_PIXELS // 2 + 1))
    what = (
        f"the guided fit takes up to {MOST_PIXELS} pixels, and the support is {pixels} pixels of "
        f"{pitch:.4g} mm"
    )
    if mm_per_pixel not in (None, "profile"):
        raise FitError(f"{what}: use `mm_per_pixel = {enough:.3g}` or more, or a smaller support.")
    warnings.warn(f"{what}: pixels of {enough:.3g} mm are used.", SssfitWarning, stacklevel=3)
    return make_target(profile, enough, support_mm)


def _rounded_up(value: float) -> float:
    """Round up to three digits."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return float(f"{math.ceil(value / unit) * unit:.3g}")


def _warn_of_spikes(result: FitResult) -> None:
    """Warn of channels with a spike in the middle pixel."""
    spikes = []
    for channel, found in result.kernel.parameters.items():
        share, line = found["centre_share"], found["preintegrated_centre_share"]
        if share > max(_SPIKE, 2.0 * line):
            spikes.append(f"{channel} {share:.2f} (pre-integrated {line:.2f})")
    if spikes:
        warnings.warn(
            f"the guided kernel's middle pixel holds much of its sum, {', '.join(spikes)}: "
            "centre_bound limits it, a smaller k lowers it.",
            SssfitWarning,
            stacklevel=3,
        )
