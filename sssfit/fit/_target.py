"""The target of every fit: the pixel-integrated kernel of a profile, on a pitch and a support.

Pixels are never point samples: R_d ~ 1/r near the beam, so every figure of a sampled kernel would
depend on the positions of the samples. Quadrants are computed one channel at a time: 1237 x 1237
pixels take 12 MB and 0.07 s, 3932 x 3932 take 124 MB and 0.7 s.
"""

import math
import warnings
from dataclasses import dataclass
from numbers import Real
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.errors import FitError, SssfitWarning
from sssfit.messages import shown
from sssfit.profile import Profile

MM_PER_PIXEL = 0.3  # a head 0.6 m away on 1080 rows; skin1's whole kernel is 143 pixels
Pitch: TypeAlias = float | Literal["profile"]
KEPT = 0.999  # support "auto": share of every channel's on-grid energy within it
_NOTHING = 1e-9  # share of a channel's light: rounding of its sum
_FAINTEST = 1e-145  # energy: squares of fainter pixels underflow, and with them relative errors
_MAX_BYTES = 2e9
_MIN_MM, _MAX_MM = 1e-12, 1e12  # sizes of a kernel's pixels
_WIDEST = 1e15  # pixels: more would exceed the memory limit anyway; keeps floor() finite


@dataclass(frozen=True, slots=True, eq=False)
class Target:
    """A profile and the pixels of its fit: pitch p, pixels -h to h."""

    profile: Profile
    mm_per_pixel: float
    half_pixels: int

    @property
    def name(self) -> str:
        """The name of the profile in messages and kernels."""
        return self.profile.label

    @property
    def total(self) -> FloatArray:
        """Energy of the kernel (C,): the diffuse reflectance, including light beyond the grid."""
        return self.profile.diffuse_reflectance

    @property
    def is_empty(self) -> npt.NDArray[np.bool_]:
        """Channels that return no light (C,)."""
        empty: npt.NDArray[np.bool_] = self.profile.total_on_grid <= 0.0
        return empty

    @property
    def copies(self) -> FloatArray:
        """Copies of each pixel of a half line (h+1,): one of the middle pixel, else two."""
        return np.where(np.arange(self.half_pixels + 1) == 0, 1.0, 2.0)

    def quadrant(self, channel: int) -> FloatArray:
        """Return energy in pixels (h+1, h+1): `Profile.quadrant_kernel`."""
        return self.profile.quadrant_kernel(self.mm_per_pixel, self.half_pixels, channel=channel)

    def half_line(self) -> FloatArray:
        """Energy in strips one pixel wide, middle first (h+1, C): `Profile.line_kernel`."""
        return self.profile.line_kernel(self.mm_per_pixel, self.half_pixels)[self.half_pixels :]

    def edges_mm(self) -> FloatArray:
        """Edges of the pixels of a half line, (h+2,) [mm]: -p/2, p/2, 3p/2, ..."""
        return self.mm_per_pixel * (np.arange(self.half_pixels + 2, dtype=np.float64) - 0.5)


def make_target(
    profile: Profile, mm_per_pixel: Pitch | None = None, support_mm: float | None = None
) -> Target:
    """Choose the pixels for a profile, and check that it can be fitted.

    Parameters
    ----------
    profile : Profile
        A profile of any method.
    mm_per_pixel : float or "profile", optional [mm]
        Pixel size, by default 0.3, for a picture of a head 0.6 m away. "profile" is the width of
        the first annulus.
    support_mm : float, optional [mm]
        Half width: 2 floor(support / pitch) + 1 pixels, centres on the axis. By default the
        smallest that keeps 99.9 % of every channel's on-grid energy.

    Raises
    ------
    FitError
        Energies are NaN, negative or all zero; the pixel size or support is not a length; the
        profile does not reach the support, or the support holds no light of a channel; a channel
        would need more than 2 GB.

    Warns
    -----
    SssfitWarning
        The kernel is a single pixel (the identity), or the profile returns more energy than went
        in.
    """
    pitch = pitch_of(profile, mm_per_pixel)
    _check_profile(profile)
    if not isinstance(support_mm, Real | None):
        raise FitError(f"support_mm = {shown(support_mm)}; expected a length in mm.")
    support = support_of(profile) if support_mm is None else _as_float(support_mm)
    for name, value in (("mm_per_pixel", pitch), ("support", support)):
        if not _MIN_MM <= value <= _MAX_MM:
            raise FitError(
                f"{name} = {value:g}; expected a length in mm above 0, from {_MIN_MM:g} to "
                f"{_MAX_MM:g}."
            )
    if support_mm is not None:
        _check_reach(profile, support, pitch)
    # 1e-9: a ratio that is an integer up to rounding must not lose a pixel.
    half = math.floor(min(support / pitch, _WIDEST) + 1e-9)
    if half == 0:
        warnings.warn(
            f"a pixel of {pitch:g} mm is wider than the support of {support:.4g} mm: the kernel is "
            "a single pixel, which blurs nothing; use a smaller `mm_per_pixel`.",
            SssfitWarning,
            stacklevel=3,
        )
    target = Target(profile, pitch, half)
    _check_memory(target)
    _check_light(target)
    return target


def _check_reach(profile: Profile, support_mm: float, pitch: float) -> None:
    """Raise FitError for a support that goes on where the profile knows its light as a sum only."""
    reach_mm = float(profile.r_edges_mm[-1])
    beyond = profile.beyond_grid > _NOTHING * profile.diffuse_reflectance
    if support_mm > reach_mm + pitch and beyond.any():
        c = int(np.argmax(beyond))
        raise FitError(
            f"{profile.label}: the profile ends at {reach_mm:.4g} mm and the support at "
            f"{support_mm:.4g} mm, and channel {profile.channels[c]} has light beyond; use a "
            "smaller support, or simulate the profile to a larger radius."
        )


def pitch_of(profile: Profile, mm_per_pixel: Pitch | None = None) -> float:
    """Return the pixel size [mm]: the given one, `MM_PER_PIXEL`, or the profile's for "profile"."""
    if not isinstance(profile, Profile):
        raise FitError(f"profile = {shown(profile)}; expected a Profile. sssfit.load reads files.")
    if mm_per_pixel is None:
        return MM_PER_PIXEL
    if isinstance(mm_per_pixel, str) and mm_per_pixel == "profile":
        return float(profile.r_edges_mm[1])
    if not isinstance(mm_per_pixel, Real):
        raise FitError(
            f"mm_per_pixel = {shown(mm_per_pixel)}; expected a length in mm, or 'profile' for "
            "the width of the profile's first annulus."
        )
    return _as_float(mm_per_pixel)


def _as_float(length_mm: Real) -> float:
    """Return a length as a float; what a float cannot hold is infinite, and is refused as that."""
    try:
        return float(length_mm)
    except OverflowError:
        return math.inf


def support_of(profile: Profile) -> float:
    """Return the smallest radius that keeps 99.9 % of every channel's on-grid energy [mm]."""
    cumulative = profile.cumulative
    kept = cumulative >= KEPT * cumulative[-1]
    return float(profile.r_edges_mm[int(np.argmax(kept.all(axis=1)))])


def _check_memory(target: Target) -> None:
    """Raise FitError for pixels that would not fit in memory, before anything is computed.

    Every fit holds two quadrants at once, the target's and its own, at least for the error.
    """
    size = 2.0 * 8.0 * (target.half_pixels + 1.0) ** 2
    if size > _MAX_BYTES:
        pixels = 2 * target.half_pixels + 1
        raise FitError(
            f"a kernel of {pixels} x {pixels} pixels of {target.mm_per_pixel:.4g} mm would need "
            f"{size / 1e9:.3g} GB of memory a channel, and {_MAX_BYTES / 1e9:.3g} GB is the "
            "most: use a larger `mm_per_pixel` or a smaller support."
        )


def _check_light(target: Target) -> None:
    """Raise FitError for channels that return light, but none within the support."""
    corner_mm = math.sqrt(2.0) * target.mm_per_pixel * (target.half_pixels + 0.5)
    within = target.profile.cumulative_at(np.array([corner_mm]))[0]
    for c in np.flatnonzero(~target.is_empty & (within < _FAINTEST)):
        raise FitError(
            f"channel {target.profile.channels[c]}: of its diffuse reflectance "
            f"{target.total[c]:.3g} the support of {target.half_pixels * target.mm_per_pixel:.4g} "
            f"mm holds {within[c]:.3g}: use a larger support, or set the channel to 0."
        )


def _check_profile(profile: Profile) -> None:
    """Raise FitError for data that no fit can use."""
    energy, name = profile.annulus_energy, profile.label
    if not np.isfinite(energy).all():
        raise FitError(f"{name}: the profile holds NaN or infinite energies; compute it again.")
    if (energy < 0.0).any():
        k, c = (int(each[0]) for each in np.nonzero(energy < 0.0))
        raise FitError(
            f"{name}: annulus {k} of channel {profile.channels[c]} has the negative energy "
            f"{energy[k, c]:.3g}; expected energies from 0 up: set negative noise to 0."
        )
    if profile.n_annuli == 1:
        raise FitError(
            f"{name}: a profile of one annulus has no shape to fit; simulate it with a smaller dr."
        )
    if not (profile.total_on_grid > 0.0).any():
        raise FitError(f"{name}: no channel of the profile returns any energy: nothing to fit.")
    most = float(profile.diffuse_reflectance.max())
    if most > 1.0 + 1e-6:
        warnings.warn(
            f"{name}: the profile returns {most:.4g} times the light that went in; check its unit.",
            SssfitWarning,
            stacklevel=4,
        )
