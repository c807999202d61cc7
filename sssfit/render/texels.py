"""Formats of the pictures that a shader keeps between its passes, and what they round away.

"float32" and "half" are IEEE 754's; numpy rounds to them to the nearest, ties to even. "r11g11b10"
has unsigned floats of 5 bits of exponent (bias 15, with denormals) and 6, 6 and 5 bits of mantissa:
the largest are (2 - 2^-6) 2^15 = 65 024 and, for blue, 64 512. It has no sign and three channels.
"half-truncated" is "half" rounded towards 0, as Direct3D prescribes for render targets ("Data
conversion rules": round-to-zero between float formats) and Mesa's drivers do it; every pass darkens
by up to 2^-11. "rgba8" and "srgb8" are 255 steps from 0 to 1, even in light or in its sRGB code.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.errors import RenderError
from sssfit.formats.colours import srgb_decode, srgb_encode
from sssfit.kernel.taps import BYTES, Taps
from sssfit.messages import shown

FloatArray = npt.NDArray[np.floating[Any]]
Store = Callable[[FloatArray], FloatArray]

_MANTISSA_BITS = (6, 6, 5)
_LEAST_EXPONENT = -14  # of normal numbers; below it the steps stay the same
_LARGEST = {
    "float32": float(np.finfo(np.float32).max),
    "half": 65504.0,
    "half-truncated": 65504.0,
    "r11g11b10": 65024.0,
    "rgba8": 1.0,
    "srgb8": 1.0,
}
_UNSIGNED = {"r11g11b10", "rgba8", "srgb8"}
_CODES = 255.0


def store_of(intermediate: str | None, taps: Taps) -> Store | None:
    """Return what a picture (..., C) becomes when a pass writes it; None: it stays as it is.

    Parameters
    ----------
    intermediate : str, optional
        "float32", "half", "half-truncated", "r11g11b10", "rgba8" or "srgb8".
    taps : Taps
        What the passes apply.

    Raises
    ------
    RenderError
        The format is unknown, or it has no sign and the table has weights below 0 or other than 1
        or 3 channels. What is returned raises it for light beyond the format's range.
    """
    if intermediate is None:
        return None
    if not isinstance(intermediate, str) or intermediate not in BYTES:
        raise RenderError(f"intermediate = {shown(intermediate)}; expected {', '.join(BYTES)}.")
    if intermediate in _UNSIGNED:
        _check_unsigned(intermediate, taps)

    def store(pixels: FloatArray) -> FloatArray:
        with np.errstate(over="ignore"):  # checked below
            rounded = _ROUND[intermediate](pixels)
        if not np.isfinite(rounded).all():
            raise RenderError(
                f"between passes the light reaches {np.abs(pixels).max():.4g}, and {intermediate} "
                f"holds up to {_LARGEST[intermediate]:.5g}; scale the picture down, or choose "
                "float32."
            )
        return rounded

    return store


def _check_unsigned(name: str, taps: Taps) -> None:
    if len(taps.channels) not in (1, 3):
        raise RenderError(
            f"{name} holds 1 or 3 channels, and the table has {len(taps.channels)}; choose half."
        )
    if (taps.blend < 0.0).any() or taps.has_negative_weights:
        raise RenderError(
            f"{name} has no sign, and the table has weights below 0; choose half or float32."
        )


def _float32(pixels: FloatArray) -> FloatArray:
    return pixels.astype(np.float32).astype(pixels.dtype)


def _half(pixels: FloatArray) -> FloatArray:
    return pixels.astype(np.float16).astype(pixels.dtype)


def _half_truncated(pixels: FloatArray) -> FloatArray:
    nearest = pixels.astype(np.float16)
    beyond = np.abs(nearest.astype(np.float64)) > np.abs(pixels)
    held = np.where(beyond & np.isfinite(nearest), np.nextafter(nearest, np.float16(0.0)), nearest)
    return held.astype(pixels.dtype)


def _r11g11b10(pixels: FloatArray) -> FloatArray:
    """Round to the nearest, ties to even; the steps of a number follow from its exponent."""
    bits = np.array(_MANTISSA_BITS[: pixels.shape[-1]])
    _, above = np.frexp(pixels)  # pixels = m 2^above with m in [1/2, 1)
    scale = bits - np.maximum(above - 1, _LEAST_EXPONENT)
    rounded = np.ldexp(np.rint(np.ldexp(pixels, scale)), -scale)
    largest = (2.0 - 2.0**-bits) * 2.0**15
    return np.where(rounded > largest, np.inf, rounded).astype(pixels.dtype)


def _rgba8(pixels: FloatArray) -> FloatArray:
    codes = np.rint(_CODES * pixels)
    return np.where(codes > _CODES, np.inf, codes / _CODES).astype(pixels.dtype)


def _srgb8(pixels: FloatArray) -> FloatArray:
    codes = np.rint(_CODES * srgb_encode(pixels))
    return np.where(codes > _CODES, np.inf, srgb_decode(codes / _CODES)).astype(pixels.dtype)


_ROUND: dict[str, Store] = {
    "float32": _float32,
    "half": _half,
    "half-truncated": _half_truncated,
    "r11g11b10": _r11g11b10,
    "rgba8": _rgba8,
    "srgb8": _srgb8,
}
