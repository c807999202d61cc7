"""Radial asymmetry of a point response: its variation over angles on circles around the middle.

The true kernel is round, a separable one need not be: low ranks show as crosses and squares around
small highlights.
"""

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray, is_whole
from sssfit.errors import RenderError
from sssfit.formats.colours import as_light
from sssfit.messages import shown

# A multiple of 8, so that axes and diagonals are included; 8192 angles change skin1's rank 1 by
# 2e-5.
ANGLES = 512


def radial_asymmetry(response: npt.ArrayLike, *, from_pixels: int = 1) -> float:
    """Return the part of a point response that depends on the angle; 0 if it is round.

    sqrt(sum_r r var(K) / sum_r r mean(K^2)): with var and mean over angles on circles of radius r =
    ``from_pixels`` to h, weighted by r for their lengths. This is the relative L2 distance from the
    response averaged over angles, without the pixels inside the first circle.

    Parameters
    ----------
    response : array (2h+1, 2h+1)
        The response to one lit pixel in the middle: a 2D kernel, or a picture of one point.
    from_pixels : int
        Radius of the first circle. Near a sharp peak the squareness of pixels dominates: skin1's
        round kernel at 0.1 mm a pixel has 0.055 to 0.083 from 1 on and 0.002 to 0.006 from 4 on.

    Returns
    -------
    float [1]
        From 0 to 1. Values between pixels come from a cubic spline, which sets a floor: a Gaussian
        of sigma 3 px integrated over pixels has 5.6e-5, one of 1 px 8e-3.

    Raises
    ------
    RenderError
        The response is not a square of an odd number of pixels (at least 3), holds NaN, or has no
        such circle.
    """
    mean, mean_square = _moments(response)
    if not is_whole(from_pixels) or not 1 <= from_pixels <= len(mean):
        raise RenderError(
            f"from_pixels = {shown(from_pixels)}; expected 1 to {len(mean)} for this size."
        )
    mean, mean_square = mean[from_pixels - 1 :], mean_square[from_pixels - 1 :]
    radii = np.arange(from_pixels, from_pixels + len(mean))
    total = float(radii @ mean_square)
    variance = float(radii @ np.maximum(mean_square - mean**2, 0.0))
    return float(np.sqrt(variance / total)) if total > 0.0 else 0.0


def asymmetry_by_radius(response: npt.ArrayLike) -> FloatArray:
    """Return sqrt(var(K) / mean(K^2)) over angles on circles of radius 1 to h pixels (h,) [1].

    See `radial_asymmetry`; 0 where the response is 0.
    """
    mean, mean_square = _moments(response)
    variance = np.maximum(mean_square - mean**2, 0.0)
    relative: FloatArray = np.sqrt(
        np.divide(variance, mean_square, out=np.zeros_like(mean), where=mean_square > 0.0)
    )
    return relative


def _moments(response: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return mean and mean square over angles, (h,) each, for radii of 1 to h pixels."""
    from scipy.ndimage import map_coordinates, spline_filter

    picture = _checked(response)
    half = len(picture) // 2
    angles = np.arange(ANGLES) * (2.0 * np.pi / ANGLES)
    directions = np.stack([np.sin(angles), np.cos(angles)])
    mean, mean_square = np.empty(half), np.empty(half)
    spline = spline_filter(picture, order=3, mode="mirror")
    for i in range(half):
        places = half + (i + 1) * directions
        values = map_coordinates(spline, places, order=3, mode="mirror", prefilter=False)
        mean[i], mean_square[i] = values.mean(), np.mean(values**2)
    return mean, mean_square


def _checked(response: npt.ArrayLike) -> FloatArray:
    """Return the response as float64 with its largest value 1, or raise an error."""
    picture = as_light(response, "a point response")
    if picture.ndim != 2 or len(set(picture.shape)) != 1 or len(picture) % 2 == 0:
        raise RenderError(
            f"a point response of shape {picture.shape}; expected one channel, square, with an odd "
            "number of pixels."
        )
    if len(picture) < 3:
        raise RenderError("a point response of one pixel has no angles; expected at least 3 x 3.")
    if not np.isfinite(picture).all():
        raise RenderError("a point response holds NaN or infinite values; expected numbers.")
    largest = float(np.abs(picture).max())
    return picture / largest if largest > 0.0 else picture
