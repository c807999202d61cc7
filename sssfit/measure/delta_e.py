"""CIE Delta E 2000, and the checks, exposure and displayed colours of all measures."""

import functools
from types import ModuleType

import numpy as np
import numpy.typing as npt

from sssfit.arrays import BoolArray, FloatArray, is_number
from sssfit.errors import RenderError
from sssfit.formats.colours import as_light
from sssfit.messages import shown as in_words

# Blocks that fit in the cache: 1080p takes 0.7 s, but 2 s in blocks of 65536 and 4 s whole.
BLOCK_PIXELS = 16384


def delta_e_2000(image: FloatArray, truth: FloatArray, exposure: float = 1.0) -> FloatArray:
    """Return CIE Delta E 2000 of pixels, k_L = k_C = k_H = 1.

    Parameters
    ----------
    image, truth : array (N, 3) or (N, 1)
        Linear sRGB or grey.
    exposure : float
        Factor applied before pixels are clipped to [0, 1].

    Returns
    -------
    array (N,)

    References
    ----------
    G. Sharma, W. Wu, E. N. Dalal, "The CIEDE2000 color-difference formula: implementation notes,
    supplementary test data, and mathematical observations", Color Research and Application 30(1),
    2005, equations 2 to 22.
    """
    differences = np.empty(len(image))
    for start in range(0, len(image), BLOCK_PIXELS):
        block = slice(start, start + BLOCK_PIXELS)
        colour, true = (lab(shown(pixels[block], exposure)) for pixels in (image, truth))
        differences[block] = delta_e_of_lab(colour, true)
    return differences


def delta_e_of_lab(colour: FloatArray, true: FloatArray) -> FloatArray:
    """Return CIE Delta E 2000 (N,) of colours `lab` (N, 3)."""
    found: FloatArray = np.asarray(load_colour().difference.delta_E_CIE2000(colour, true))
    return found


def lab(pixels: FloatArray) -> FloatArray:
    """Return CIE L, a, b of linear sRGB pixels (N, 3)."""
    colour = load_colour()
    whitepoint = colour.RGB_COLOURSPACES["sRGB"].whitepoint
    colours: FloatArray = np.asarray(colour.XYZ_to_Lab(pixels @ _to_xyz().T, whitepoint))
    return colours


@functools.cache
def _to_xyz() -> FloatArray:
    """Return the matrix from the primaries, and not the standard's, whose white has b = 0.01."""
    colour = load_colour()
    srgb = colour.RGB_COLOURSPACES["sRGB"]
    return np.asarray(colour.normalised_primary_matrix(srgb.primaries, srgb.whitepoint))


def load_colour() -> ModuleType:
    """Import colour-science: 0.8 s for any of its parts, so only when colours are compared."""
    with np.printoptions():  # on import it sets numpy's print options to those of 1.13
        import colour
    return colour


# The largest channel and not the luminance: red is 1.7 times the luminance of skin1, so with the
# luminance at 0.8 lit red would be clipped.
AUTO_VALUE, AUTO_PERCENTILE = 0.8, 99.0


def check_pair(image: npt.ArrayLike, truth: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return both pictures as float64 (H, W, C), or raise an error."""
    pictures = _numbers(image, "image"), _numbers(truth, "truth")
    if pictures[0].shape != pictures[1].shape:
        raise RenderError(
            f"image is {pictures[0].shape} and truth {pictures[1].shape}; expected the same rows, "
            "columns and channels."
        )
    for name, picture in zip(("image", "truth"), pictures, strict=True):
        check_picture(name, picture)
    return pictures


def _numbers(picture: npt.ArrayLike, name: str) -> FloatArray:
    """Return a picture as float64, not copied if it is already."""
    if type(picture) is np.ndarray and picture.dtype == np.float64:
        return picture
    return as_light(picture, name)


def check_picture(name: str, picture: FloatArray) -> None:
    """Check that an array is a picture; kernels with negative terms may ring below 0."""
    if picture.ndim != 3 or 0 in picture.shape:
        raise RenderError(
            f"{name} has shape {picture.shape}; expected rows, columns and channels, at least one "
            "of each."
        )
    bad = picture.size - int(np.count_nonzero(np.isfinite(picture)))
    if bad:
        raise RenderError(f"{name} has {bad} NaN or infinite values; expected numbers.")


def selection(mask: npt.ArrayLike | None, picture: FloatArray) -> BoolArray:
    """Return which pixels (H, W) count: those where the mask is above 0, or all without a mask."""
    if mask is None:
        return np.ones(picture.shape[:2], dtype=np.bool_)
    given = as_light(mask, "mask")
    selected = given > 0
    if selected.shape != picture.shape[:2]:
        raise RenderError(
            f"mask is {selected.shape} and the picture {picture.shape[:2]}; expected the same rows "
            "and columns."
        )
    if not selected.any():
        raise RenderError("mask has no pixel above 0; expected some of the object, or no mask.")
    return selected


def selected_pixels(picture: FloatArray, selected: BoolArray) -> FloatArray:
    """Return pixels (N, C) of a picture, without a copy where all are selected."""
    return picture.reshape(-1, picture.shape[-1]) if selected.all() else picture[selected]


def auto_exposure(truth: npt.ArrayLike, mask: npt.ArrayLike | None = None) -> float:
    """Return the factor that brings the 99th percentile of the largest channel to 0.8.

    It depends on the truth alone, so every picture compared with it has the same exposure. Black
    pixels are ignored, so a small lit object is exposed as if it filled the picture.

    Parameters
    ----------
    truth : array (H, W, C)
        Linear light.
    mask : array (H, W), optional
        Only pixels where it is above 0 count.

    Raises
    ------
    RenderError
        No pixel is lit, or the truth or the mask is invalid.
    """
    picture = as_light(truth, "truth")
    check_picture("truth", picture)
    return exposure_of(selected_pixels(picture, selection(mask, picture)))


def exposure_of(pixels: FloatArray) -> float:
    """Return `auto_exposure` of pixels (N, C)."""
    largest = pixels.max(axis=-1)
    lit = largest[largest > np.finfo(np.float64).tiny]  # below this, the inverse overflows
    if lit.size == 0:
        raise RenderError("truth is black: no exposure can be found; give one.")
    return float(AUTO_VALUE / np.percentile(lit, AUTO_PERCENTILE))


def check_exposure(exposure: float) -> float:
    """Return a given exposure, or raise an error."""
    if not is_number(exposure) or not 0.0 < exposure <= np.finfo(np.float64).max:
        said = f"{exposure:g}" if isinstance(exposure, float) else in_words(exposure)
        raise RenderError(f"exposure = {said}; expected a factor above 0.")
    return float(exposure)


# Of the brightest light: less is rounding of the convolution. 1e308 makes it white, too.
_DARKEST = 1e-6
# Displayed light that rounds to the first of 256 sRGB codes: less than 1 / (2 255 12.92).
_BLACK = 1.5e-4


def check_shows(exposure: float, pixels: FloatArray, true: FloatArray) -> None:
    """Refuse an exposure at which two pictures (N, C) are all white or all black.

    Delta E would be 0. Channels that are no colour have none.
    """
    if true.shape[1] not in (1, 3) or not true.max() > 0.0:
        return
    lit = true.max(axis=1) > _DARKEST * true.max()
    # Divided, since the product may overflow or vanish.
    for is_all, colour, other in (
        (min(pixels[lit].min(), true[lit].min()) > 1.0 / exposure, "white", "smaller"),
        (max(pixels.max(), true.max()) < _BLACK / exposure, "black", "larger"),
    ):
        if is_all:
            raise RenderError(
                f"at the exposure {exposure:g} all that is lit is {colour}, so Delta E says "
                f"nothing; use a {other} exposure, such as {exposure_of(true):.3g}."
            )


def shown(pixels: FloatArray, exposure: float = 1.0) -> FloatArray:
    """Return the displayed picture: exposed, clipped to [0, 1], grey as three channels."""
    with np.errstate(over="ignore"):  # infinite light is clipped to 1 as well
        cut: FloatArray = np.clip(pixels * exposure, 0.0, 1.0)
    return np.repeat(cut, 3, axis=-1) if cut.shape[-1] == 1 else cut
