"""Visible structure: SSIM and FLIP of the displayed picture; both need the extra ``metrics``."""

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.errors import RenderError
from sssfit.measure.delta_e import (
    auto_exposure,
    check_exposure,
    check_pair,
    selection,
    shown,
)

SSIM_SIGMA_PIXELS = 1.5
SSIM_HALF_PIXELS = 5
# A 0.7 m wide display of 3840 pixels seen from 0.7 m: the FLIP paper's setting.
PIXELS_PER_DEGREE = 67.0


def ssim(
    image: npt.ArrayLike,
    truth: npt.ArrayLike,
    exposure: float | None = None,
    *,
    mask: npt.ArrayLike | None = None,
) -> float:
    """Return the mean structural similarity; 1 for identical pictures.

    Computed from sRGB code values in [0, 1], by channel, with a Gaussian window of sigma 1.5 on 11
    x 11 pixels and K = (0.01, 0.03); the mean is over windows inside the picture.

    Parameters
    ----------
    image, truth : array (H, W, C)
        Linear light, at least 11 x 11 pixels.
    exposure : float, optional
        Factor before display; `auto_exposure` of the truth unless given.
    mask : array (H, W), optional
        Only windows whose middle pixel is above 0 count; they include the pixels around it.

    Raises
    ------
    RenderError
        As ``measure``; also too few pixels, or the extra ``metrics`` is missing.

    References
    ----------
    Z. Wang, A. C. Bovik, H. R. Sheikh, E. P. Simoncelli, "Image quality assessment: from error
    visibility to structural similarity", IEEE Transactions on Image Processing 13(4), 2004, eq. 13.
    """
    try:
        from skimage.metrics import structural_similarity
    except ImportError as error:
        raise _missing("SSIM", "scikit-image") from error
    codes, true_codes, selected = _codes(image, truth, exposure, mask)
    edge = SSIM_HALF_PIXELS
    counts = selected[edge:-edge, edge:-edge]
    if not counts.any():
        raise RenderError(
            f"a picture of {selected.shape} pixels with {int(selected.sum())} in the mask has no "
            "11 x 11 window for SSIM inside it; give a larger one."
        )
    _, similarity = structural_similarity(
        codes,
        true_codes,
        channel_axis=-1,
        data_range=1.0,
        gaussian_weights=True,
        sigma=SSIM_SIGMA_PIXELS,
        use_sample_covariance=False,
        full=True,
    )
    return float(np.mean(similarity[edge:-edge, edge:-edge][counts]))


def flip(
    image: npt.ArrayLike,
    truth: npt.ArrayLike,
    exposure: float | None = None,
    *,
    pixels_per_degree: float = PIXELS_PER_DEGREE,
    mask: npt.ArrayLike | None = None,
) -> float:
    """Return the mean LDR-FLIP, the visible difference when flipping between pictures, 0 to 1.

    Parameters
    ----------
    image, truth : array (H, W, 3) or (H, W, 1)
        Linear sRGB or grey.
    exposure : float, optional
        Factor before display; `auto_exposure` of the truth unless given.
    pixels_per_degree : float [1/degree]
        Pixels per degree of visual angle.
    mask : array (H, W), optional
        The mean is over pixels above 0; the pixels around them are seen too.

    Raises
    ------
    RenderError
        As ``measure``; also other channel counts, or the extra ``metrics`` is missing.

    References
    ----------
    P. Andersson, J. Nilsson, T. Akenine-Möller, M. Oskarsson, K. Åström, M. D. Fairchild, "FLIP: a
    difference evaluator for alternating images", Proc. ACM CGIT 3(2), 2020.
    """
    if not (np.isfinite(pixels_per_degree) and pixels_per_degree > 0.0):
        raise RenderError(f"pixels_per_degree = {pixels_per_degree:g}; expected a number above 0.")
    try:
        from flip_evaluator import evaluate
    except ImportError as error:
        raise _missing("FLIP", "flip-evaluator") from error
    codes, true_codes, selected = _codes(image, truth, exposure, mask)
    if codes.shape[2] != 3:
        raise RenderError(f"FLIP of {codes.shape[2]} channels; expected 3, or 1 for grey.")
    errors, _, _ = evaluate(
        np.ascontiguousarray(true_codes, dtype=np.float32),
        np.ascontiguousarray(codes, dtype=np.float32),
        "LDR",
        applyMagma=False,
        computeMeanError=False,
        parameters={"ppd": float(pixels_per_degree)},
    )
    return float(np.mean(errors.reshape(selected.shape)[selected], dtype=np.float64))


def _codes(
    image: npt.ArrayLike,
    truth: npt.ArrayLike,
    exposure: float | None,
    mask: npt.ArrayLike | None,
) -> tuple[FloatArray, FloatArray, npt.NDArray[np.bool_]]:
    """Return both pictures as sRGB code values in [0, 1], and the pixels that count."""
    pictures = check_pair(image, truth)
    factor = auto_exposure(truth, mask) if exposure is None else check_exposure(exposure)
    codes, true_codes = (_srgb_code(shown(picture, factor)) for picture in pictures)
    return codes, true_codes, selection(mask, pictures[1])


def _srgb_code(linear: FloatArray) -> FloatArray:
    """Encode linear light in [0, 1] by IEC 61966-2-1."""
    curve = 1.055 * np.maximum(linear, 0.0031308) ** (1.0 / 2.4) - 0.055
    code: FloatArray = np.where(linear <= 0.0031308, 12.92 * linear, curve)
    return code


def _missing(measure: str, library: str) -> RenderError:
    """Return the error for a missing library of the extra ``metrics``."""
    return RenderError(f'{measure} needs {library}, which is not here: install "sssfit[metrics]".')
