"""Bloom: the part of a picture's light that an eye or a lens scatters over its surroundings."""

from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.arrays import is_number
from sssfit.errors import RenderError
from sssfit.formats.colours import as_light
from sssfit.messages import shown

# Standard deviations over the picture's height, and their shares: a narrow core and a wide veil, as
# measured glare has them (Spencer, Shirley, Zimmerman, Greenberg 1995, figure 4).
_WIDTHS, _SHARES = (0.004, 0.016, 0.064), (0.5, 0.3, 0.2)


def bloomed(picture: npt.NDArray[np.floating[Any]], share: float) -> npt.NDArray[np.float64]:
    """Return a picture with a share of its light spread out by three Gaussians.

    Without a threshold, so that the picture has as much light as before: (1 - s) E + s sum w G * E.
    Light that would leave the picture is reflected at its border.

    Parameters
    ----------
    picture : array (H, W, C)
        Linear light.
    share : float
        s, 0 to 1.

    Raises
    ------
    RenderError
        The share is not from 0 to 1, or the picture is none.
    """
    from scipy.ndimage import gaussian_filter

    if not is_number(share) or not 0.0 <= share <= 1.0:
        raise RenderError(f"bloom = {shown(share)}; expected a share of the light from 0 to 1.")
    light = as_light(picture, "the picture")
    if light.ndim != 3:
        raise RenderError(
            f"the picture has shape {light.shape}; expected rows, columns and channels."
        )
    spread = np.zeros_like(light)
    for width, part in zip(_WIDTHS, _SHARES, strict=True):
        sigma = width * light.shape[0]
        spread += part * gaussian_filter(light, (sigma, sigma, 0.0), mode="reflect")
    found: npt.NDArray[np.float64] = (1.0 - share) * light + share * spread
    return found
