"""How far a point response is from round: its spread over angles on circles about the middle.

The true kernel is round; a separable one need not be, and its low ranks show as crosses and squares
about small highlights.
"""

import numpy as np
import numpy.typing as npt

from sssfit.errors import RenderError

FloatArray = npt.NDArray[np.float64]

# A multiple of 8, so that axes and diagonals are among them; 2048 change skin1's figures by 1e-6.
ANGLES = 512


def radial_asymmetry(response: npt.ArrayLike) -> float:
    """Return the share of a point response that depends on the angle; 0 if it is round.

    sqrt(sum_r r var(K) / sum_r r mean(K^2)): var and mean over angles on circles of radius r = 1 to
    h pixels, r for their lengths. It is the relative L2 distance to the same response averaged over
    angles, without the middle pixel.

    Parameters
    ----------
    response : array (2h+1, 2h+1)
        What one lit pixel in the middle becomes: a 2D kernel, or a picture of one point.

    Returns
    -------
    float [1]
        0 to 1. Values between pixels come from a cubic spline, and pixels are square: a Gaussian of
        sigma 3 px integrated over pixels has 2.1e-4, one of 6 px 1.3e-5.

    Raises
    ------
    RenderError
        No square of an odd number of pixels, at least 3, or NaN in it.
    """
    mean, mean_square = _moments(response)
    radii = np.arange(1, len(mean) + 1)
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
    """Return the response as float64 with its largest value 1, or refuse it."""
    picture = np.asarray(response, dtype=np.float64)
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
