"""The guided fit for several k: guide function Gamma, residual and pass.

Supplement figure S.1 (Jimenez et al. 2015, "Separable Subsurface Scattering") draws Gamma_p, under
which the pre-integrated pass is the optimum, and Gamma for k = 1.55; here each k has its own, with
the fit that follows from it. ``sssfit.chart`` draws the record.

Eq. S.8 asks for a Gamma_p and leaves open which of many. With Gamma_p(x, y) = 1 / (a_p(x) a_p(y))
and a = a_p u the objective is that of the best rank one of R_d / sqrt(a_p a_p), whose rows, times
sqrt(a_p), add up to sqrt(a_p): that is its first singular vector, and u = 1 the optimum of all, not
only a point where the slope is 0.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray, plain
from sssfit.errors import FitError, SssfitWarning
from sssfit.fit import FitResult, fit_guided
from sssfit.fit._target import Pitch, Target
from sssfit.fit.guided import DRAWN_K, extents_of, gamma, guided_target
from sssfit.messages import printable
from sssfit.profile import Profile

DRAWN = (0.0, DRAWN_K, 4.0)  # the paper's nearest light, what it draws, its farthest light
MOST = 4


@dataclass(frozen=True, slots=True, eq=False)
class Guide:
    """Guided fits of one channel for K values of k, on a quadrant of h + 1 pixels.

    Parameters
    ----------
    profile : Profile
    channel : int
        Number of the profile's channel.
    mm_per_pixel : float [mm]
    ks : tuple of float
        0 (near) to 4 (far).
    gamma : array (K, h+1, h+1) [1]
        Mean of the guide function over each pixel, over its largest.
    residual : array (K, h+1, h+1) [1]
        R_d - a a^T in each pixel, as a share of the channel's energy.
    passes : array (K, h+1) [1]
        a / sum(a), middle first.
    preintegrated : array (h+1,) [1]
        The same of the profile integrated along lines.
    preintegrated_gamma, preintegrated_residual : array (h+1, h+1) [1]
        Gamma_p, over its largest, NaN in rows without light; what the pre-integrated pass leaves.
    relative_frobenius_error, weighted_residual : array (K,) [1]
        ||R_d - a a^T|| / ||R_d||; sum Gamma (R_d - a a^T)^2 over sum Gamma R_d^2.
    preintegrated_errors : tuple of two floats [1]
        The same of the pre-integrated pass, weighted by Gamma_p.
    """

    profile: Profile
    channel: int
    mm_per_pixel: float
    ks: tuple[float, ...]
    gamma: FloatArray
    residual: FloatArray
    passes: FloatArray
    preintegrated: FloatArray
    preintegrated_gamma: FloatArray
    preintegrated_residual: FloatArray
    relative_frobenius_error: FloatArray
    weighted_residual: FloatArray
    preintegrated_errors: tuple[float, float]

    @property
    def pixels(self) -> int:
        """Pixels along an edge of the kernel."""
        return 2 * self.preintegrated.size - 1

    @property
    def centre_share(self) -> FloatArray:
        """a(0) / sum(a), the spike, for each k (K,)."""
        return self.passes[:, 0]

    @property
    def misplaced(self) -> FloatArray:
        """Half the sum of |residual| over all pixels, for each k (K,)."""
        copies = np.where(np.arange(self.preintegrated.size) == 0, 1.0, 2.0)
        return 0.5 * np.asarray(np.abs(self.residual) @ copies @ copies)

    @property
    def preintegrated_misplaced(self) -> float:
        """The same of the pre-integrated pass."""
        copies = np.where(np.arange(self.preintegrated.size) == 0, 1.0, 2.0)
        return 0.5 * float(np.abs(self.preintegrated_residual) @ copies @ copies)

    def to_dict(self) -> dict[str, Any]:
        """Return the figures of ``sssfit chart --guide --json``: a value for each k."""
        return plain(
            {
                "channel": self.profile.channels[self.channel],
                "mm_per_pixel": self.mm_per_pixel,
                "pixels": self.pixels,
                "k": self.ks,
                "centre_share": self.centre_share,
                "preintegrated_centre_share": self.preintegrated[0],
                "misplaced": self.misplaced,
                "relative_frobenius_error": self.relative_frobenius_error,
                "weighted_residual": self.weighted_residual,
                "preintegrated_misplaced": self.preintegrated_misplaced,
                "preintegrated_frobenius_error": self.preintegrated_errors[0],
                "preintegrated_weighted_residual": self.preintegrated_errors[1],
            }
        )


def compute_guide(
    profile: Profile,
    *,
    ks: Sequence[float] = DRAWN,
    channel: str | None = None,
    mm_per_pixel: Pitch | None = None,
    support_mm: float | None = None,
) -> Guide:
    """Fit the guided kernel for each k, and keep what it looked at and what it left.

    A middle pixel that holds much of the pass is in the record, so it is not warned of.

    Parameters
    ----------
    profile : Profile
    ks : sequence of float
        One to four, from 0 (near scattering) to 4 (far scattering).
    channel : str, optional
        Its name; by default the first that returns light.
    mm_per_pixel, support_mm : float, optional [mm]
        Pixels; see ``sssfit.fit.fit_guided``.

    Raises
    ------
    FitError, ProfileError
        Invalid profile, channel, pixels or k.

    Examples
    --------
    >>> from sssfit.material import load_material
    >>> from sssfit.simulate import simulate_exact
    >>> found = compute_guide(simulate_exact(load_material("skin1")), mm_per_pixel=0.3)
    >>> (100 * found.centre_share).round(1).tolist()
    [14.5, 21.3, 30.4]
    """
    if not 1 <= len(ks) <= MOST:
        raise FitError(f"{len(ks)} values of k; expected one to {MOST}.")
    target = guided_target(profile, mm_per_pixel, support_mm)
    c = _chosen(target, channel)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SssfitWarning)  # of the target they were given above
        fits = [
            fit_guided(profile, mm_per_pixel=target.mm_per_pixel, support_mm=support_mm, k=k)
            for k in ks
        ]
    wanted = target.quadrant(c) / target.total[c]
    support_mm = target.mm_per_pixel * (target.half_pixels + 0.5)
    extent = extents_of(target)[c] / support_mm
    guides = np.stack([gamma(target.half_pixels, k, extent=extent) for k in ks])
    halves = np.stack([_half(fit, c) for fit in fits]) / np.sqrt(target.total[c])
    line = target.half_line()[:, c]
    line = line / (target.copies @ line)
    guide_of_line = _gamma_p(wanted @ target.copies)
    left_by_line = wanted - line[:, None] * line
    found = [fit.kernel.parameters[profile.channels[c]] for fit in fits]
    return Guide(
        profile,
        c,
        target.mm_per_pixel,
        tuple(float(k) for k in ks),
        guides / guides.max(axis=(1, 2), keepdims=True),
        wanted - halves[:, :, None] * halves[:, None, :],
        halves / (halves @ target.copies)[:, None],
        line,
        guide_of_line,
        left_by_line,
        np.array([fit.relative_frobenius_error[c] for fit in fits]),
        np.array([each["weighted_residual"] for each in found]),
        (
            _share(left_by_line, wanted, np.ones_like(wanted)) ** 0.5,
            _share(left_by_line, wanted, np.nan_to_num(guide_of_line)),
        ),
    )


def _gamma_p(line: FloatArray) -> FloatArray:
    """Return 1 / (a_p a_p) of rows (h+1,) over its largest; NaN where a row has no light."""
    lit = np.where(line > 0.0, line, np.nan)
    least = float(np.nanmin(lit))
    guide: FloatArray = (least / lit[:, None]) * (least / lit)
    return guide


def _share(left: FloatArray, wanted: FloatArray, weights: FloatArray) -> float:
    """Return sum weights left^2 over sum weights wanted^2, over the plane."""
    copies = np.where(np.arange(len(wanted)) == 0, 1.0, 2.0)
    parts = [copies @ (weights * each**2) @ copies for each in (left, wanted)]
    return float(parts[0] / parts[1])


def _chosen(target: Target, channel: str | None) -> int:
    """Return the index of a channel that has light."""
    names = target.profile.channels
    if channel is None:
        return int(np.argmin(target.is_empty))
    if not isinstance(channel, str) or channel not in names:
        raise FitError(
            f"there is no channel {printable(str(channel))}; expected one of {', '.join(names)}."
        )
    if target.is_empty[names.index(channel)]:
        raise FitError(f"channel {channel} returns no light: choose another.")
    return names.index(channel)


def _half(fit: FitResult, channel: int) -> FloatArray:
    """Return a pass from the middle outwards (h+1,)."""
    half: FloatArray = fit.kernel.weights[0, fit.kernel.half_pixels :, channel]
    return half
