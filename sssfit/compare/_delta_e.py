"""Colour differences as seen: linear sRGB to CIE Lab to CIE Delta E 2000, in blocks of pixels.

Lab is under D65 with the 2 degree observer, and its white is linear sRGB (1, 1, 1).
"""

from types import ModuleType

import numpy as np
import numpy.typing as npt

from sssfit.compare._pixels import shown

FloatArray = npt.NDArray[np.float64]

# Blocks that stay in the cache: 1080p takes 0.7 s so, 2 s in blocks of 65536 and 4 s whole.
BLOCK_PIXELS = 16384


def delta_e_2000(image: FloatArray, truth: FloatArray, exposure: float = 1.0) -> FloatArray:
    """Return CIE Delta E 2000 of pixels, k_L = k_C = k_H = 1.

    Parameters
    ----------
    image, truth : array (N, 3) or (N, 1)
        Linear sRGB or grey.
    exposure : float
        Factor before pixels are cut to [0, 1].

    Returns
    -------
    array (N,)

    References
    ----------
    G. Sharma, W. Wu, E. N. Dalal, "The CIEDE2000 color-difference formula: implementation notes,
    supplementary test data, and mathematical observations", Color Research and Application 30(1),
    2005, equations 2 to 22.
    """
    delta_e = _load_colour().difference.delta_E_CIE2000
    differences = np.empty(len(image))
    for start in range(0, len(image), BLOCK_PIXELS):
        block = slice(start, start + BLOCK_PIXELS)
        colour, true = (lab(shown(pixels[block], exposure)) for pixels in (image, truth))
        differences[block] = delta_e(colour, true)
    return differences


def lab(pixels: FloatArray) -> FloatArray:
    """Return CIE L, a, b of linear sRGB pixels (N, 3)."""
    colour = _load_colour()
    srgb = colour.RGB_COLOURSPACES["sRGB"]
    # From the primaries, not the standard's table: its four digits give white b = 0.01.
    to_xyz = colour.normalised_primary_matrix(srgb.primaries, srgb.whitepoint)
    colours: FloatArray = np.asarray(colour.XYZ_to_Lab(pixels @ to_xyz.T, srgb.whitepoint))
    return colours


def _load_colour() -> ModuleType:
    """Import colour-science: 0.8 s for any of its parts, so only when colours are compared."""
    with np.printoptions():  # at its import it sets how all of numpy prints, to the way of 1.13
        import colour
    return colour
