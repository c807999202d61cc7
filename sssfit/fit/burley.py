"""Normalised diffusion fitted to a profile: one shape s per channel, as engines use it.

Christensen and Burley 2015, "Approximate reflectance profiles for efficient subsurface scattering":
R_d(r) = A s (exp(-s r) + exp(-s r / 3)) / (8 pi r), with A the diffuse reflectance. A is the
profile's own; s minimises

    int_0^R (F(r) - A (1 - exp(-s r) / 4 - 3 exp(-s r / 3) / 4))^2 dr

over the grid, where F(r) is the energy within r. The fit uses energies and not densities, because
R_d ~ 1/r would make the objective depend on the pixels or on the width of the first annulus, and F
is known exactly at the edges. The kernel is the model's line integral, in closed form: s/(4 pi)
(K0(s x) + K0(s x / 3)) integrated over each pixel, as `sssfit.fit.preintegrated` does with the
profile itself. The model's energy outside the support is restored in the same way.
"""

import math

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import FitError
from sssfit.fit._nlopt import root
from sssfit.fit._result import ChannelFit, FitResult, fit_channels, rescales_energy
from sssfit.fit._target import Pitch, make_target
from sssfit.profile import Profile
from sssfit.shapes import diffusion_cdf, diffusion_line_integral

_PER_DECADE = 20  # starts tried: the shape is bracketed to 12 % before it is refined
# Of s r: 1e-2 at the last edge leaves 0.5 % of the energy on the grid, 100 at the first all of it.
_MIN, _MAX = 1e-2, 1e2


def fit_burley(
    profile: Profile,
    *,
    energy: str = "rescale",
    mm_per_pixel: Pitch | None = None,
    support_mm: float | None = None,
    normalize: bool = False,
) -> FitResult:
    """Fit the shape of normalised diffusion, channel by channel.

    Parameters
    ----------
    profile : Profile
        The profile to fit.
    energy : str
        "rescale" (default) scales every channel to its diffuse reflectance A; "keep" keeps the
        energy of the model's strips within the support.
    mm_per_pixel, support_mm : float, optional [mm]
        Pixels; see ``sssfit.fit.make_target``. The shape does not depend on them.
    normalize : bool
        Scale every channel to unit energy, and keep its energy in ``kernel.scale``.

    Returns
    -------
    FitResult
        One term; ``kernel.parameters`` has each channel's ``s_per_mm``, its
        ``diffuse_reflectance`` A and the ``cumulative_error``, the largest |A cdf - F| at an
        annulus edge as a share of A.

    Raises
    ------
    FitError, ProfileError
        The profile, the pitch, the support or the energy is invalid, or a channel's grid does not
        determine its shape.
    """
    rescale = rescales_energy(energy)
    target = make_target(profile, mm_per_pixel, support_mm)
    edges_mm = target.edges_mm()

    def fit_channel(channel: int) -> ChannelFit:
        total = float(target.total[channel])
        shares = profile.cumulative[:, channel] / total
        s, evaluations, reason = _fit_shape(profile.r_edges_mm, shares, profile.channels[channel])
        line = total * diffusion_line_integral(edges_mm[:-1], edges_mm[1:], s)
        within = float(target.copies @ line)
        error = np.abs(diffusion_cdf(profile.r_edges_mm, s) - shares).max()
        return ChannelFit(
            np.ones(1),
            (math.sqrt(total if rescale else within) / within * line)[None],
            reason,
            evaluations,
            {"s_per_mm": s, "diffuse_reflectance": total, "cumulative_error": float(error)},
        )

    return fit_channels(
        target,
        "burley",
        fit_channel,
        settings={"energy": energy},
        normalize=normalize,
        keeps_energy=rescale,
    )


def _fit_shape(r_mm: FloatArray, shares: FloatArray, channel: str) -> tuple[float, int, str]:
    """Return the least-squares s [1/mm] for F / A at the edges (n+1,), evaluations, stop reason.

    A scan of log s finds the best interval, so that no start has to be guessed. There the zero of
    the objective's slope gives s to rounding, which its smallest value would not.
    """
    weights = 0.5 * (np.diff(r_mm, append=r_mm[-1]) + np.diff(r_mm, prepend=r_mm[0]))

    def objective(log_s: float) -> float:
        return float(weights @ (diffusion_cdf(r_mm, math.exp(log_s)) - shares) ** 2)

    def slope(log_s: float) -> float:
        t = r_mm * math.exp(log_s)
        rise = 0.25 * t * (np.exp(-t) + np.exp(-t / 3.0))  # of the CDF, by log s
        return float(weights @ ((diffusion_cdf(t, 1.0) - shares) * rise))

    first, last = math.log(_MIN / r_mm[-1]), math.log(_MAX / r_mm[1])
    scan = np.linspace(first, last, math.ceil(_PER_DECADE * (last - first) / math.log(10.0)))
    best = int(np.argmin([objective(each) for each in scan]))
    low, high = scan[max(best - 1, 0)], scan[min(best + 1, len(scan) - 1)]
    if not slope(low) < 0.0 < slope(high):
        raise FitError(
            f"channel {channel}: no shape of normalised diffusion fits better than ever smaller or "
            "larger ones; the profile needs annuli within which, and a radius beyond which, only "
            "part of the energy lies."
        )
    log_s, evaluations, reason = root(slope, low, high)
    return math.exp(log_s), len(scan) + evaluations, reason
