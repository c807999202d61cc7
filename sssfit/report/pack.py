"""Pictures and texts as base64 of deflated bytes, which a page decodes without a library."""

import base64
import zlib
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.errors import RenderError

# Of deflation: 6 s for a page at 9.
_LEVEL = 6
_LARGEST = float(np.finfo(np.float16).max)


def packed_picture(picture: npt.NDArray[np.floating[Any]]) -> dict[str, Any]:
    """Return a picture as half floats, deflated.

    A half float's 16 bits are taken as a whole number, and each as its difference from what its
    left, upper and upper left neighbours predict, modulo 2^16. High and low bytes stand apart:
    a smooth picture's high bytes are nearly all 0, which saves a third.

    Parameters
    ----------
    picture : array (H, W, C)

    Returns
    -------
    dict
        ``shape`` (H, W, C) and ``data``, as `unpacked_picture` and the page read them.

    Raises
    ------
    RenderError
        A value exceeds what half floats hold.
    """
    if not np.abs(picture).max(initial=0.0) <= _LARGEST:
        raise RenderError(
            f"light of {np.abs(picture).max():.3g} is more than the {_LARGEST:g} of half floats; "
            "divide the picture by a factor."
        )
    bits = np.ascontiguousarray(picture, np.float16).view(np.uint16)
    planes = np.moveaxis(bits, 2, 0)
    left = np.diff(planes, axis=2, prepend=np.uint16(0))
    steps = np.diff(left, axis=1, prepend=np.uint16(0))
    halves = np.stack((steps >> 8, steps & 255)).astype(np.uint8)
    return {"shape": list(picture.shape), "data": _packed(halves.tobytes())}


def unpacked_picture(given: dict[str, Any]) -> FloatArray:
    """Return the picture (H, W, C) that `packed_picture` packed."""
    height, width, channels = given["shape"]
    raw = zlib.decompress(base64.b64decode(given["data"]))
    high, low = np.frombuffer(raw, np.uint8).reshape(2, channels, height, width).astype(np.uint16)
    steps = high * np.uint16(256) + low
    planes = steps.cumsum(axis=1, dtype=np.uint16).cumsum(axis=2, dtype=np.uint16)
    bits = np.ascontiguousarray(np.moveaxis(planes, 0, 2))
    return bits.view(np.float16).astype(np.float64)


def packed_bytes(values: bytes) -> str:
    """Return bytes deflated, as base64."""
    return _packed(values)


def packed_numbers(values: FloatArray) -> str:
    """Return numbers of 64 bits deflated, as base64."""
    return _packed(np.ascontiguousarray(values, "<f8").tobytes())


def packed_text(text: str) -> str:
    """Return a text deflated, as base64."""
    return _packed(text.encode())


def _packed(raw: bytes) -> str:
    return base64.b64encode(zlib.compress(raw, _LEVEL)).decode("ascii")
