"""Colours of pictures: sRGB, primaries, and the values that each format can hold."""

import contextlib
import re
from collections.abc import Sequence
from numbers import Real

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.errors import ArgumentError, RenderError
from sssfit.messages import counted, printable, shown

# The rounded numbers of the standard. Its two pieces differ by 2e-8 where they meet, far below the
# 1.5e-5 of a 16-bit code.
_JOINT_LINEAR, _JOINT_CODE = 0.0031308, 0.04045
_SLOPE, _OFFSET, _POWER = 12.92, 0.055, 2.4
_HEX = re.compile("#(?:[0-9a-fA-F]{3}|[0-9a-fA-F]{6})")


def srgb_encode(linear: npt.ArrayLike) -> FloatArray:
    """Return the sRGB code, 0 to 1, of linear light.

    Parameters
    ----------
    linear : array
        Linear light; below 0 and above 1 the two pieces of the curve continue.

    Returns
    -------
    array of the same shape
        12.92 L up to L = 0.0031308, 1.055 L^(1/2.4) - 0.055 above (IEC 61966-2-1).
    """
    light = np.asarray(linear, dtype=np.float64)
    above = np.maximum(light, _JOINT_LINEAR) ** (1.0 / _POWER)
    return np.where(light <= _JOINT_LINEAR, _SLOPE * light, (1.0 + _OFFSET) * above - _OFFSET)


def srgb_decode(code: npt.ArrayLike) -> FloatArray:
    """Return the linear light of an sRGB code, 0 to 1.

    Parameters
    ----------
    code : array
        V, the integer of a file divided by the largest one (255 or 65535).

    Returns
    -------
    array of the same shape
        V / 12.92 up to V = 0.04045, ((V + 0.055) / 1.055)^2.4 above (IEC 61966-2-1).
    """
    value = np.asarray(code, dtype=np.float64)
    above = ((np.maximum(value, _JOINT_CODE) + _OFFSET) / (1.0 + _OFFSET)) ** _POWER
    return np.where(value <= _JOINT_CODE, value / _SLOPE, above)


def reflectance_of_codes(codes: str | Sequence[float]) -> str | list[float]:
    """Return the linear reflectances (C,) of 8-bit sRGB codes; of three the colour in hex.

    A text is taken for hex, and returned. Raises ArgumentError for what is no code of 8 bits.
    """
    if isinstance(codes, str):
        return codes
    for each in codes:
        if not (float(each).is_integer() and 0.0 <= each <= 255.0):
            raise ArgumentError(
                f"`srgb` takes codes of 8 bits, whole numbers from 0 to 255, and not {each:g}."
            )
    if len(codes) == 3:
        return "#" + "".join(f"{round(each):02x}" for each in codes)
    return [float(srgb_decode(each / 255.0)) for each in codes]


def linear_from_hex(code: str) -> FloatArray:
    """Return the linear R, G, B (3,) of an sRGB colour in hex, ``#c58c6b``.

    Raises
    ------
    RenderError
        The text is not # and three or six digits from 0 to f.
    """
    if not isinstance(code, str) or not _HEX.fullmatch(code.strip()):
        raise RenderError(f"{shown(code)} is not an sRGB colour in hex, such as #c58c6b.")
    digits = code.strip()[1:]
    pairs = [each * 2 for each in digits] if len(digits) == 3 else re.findall("..", digits)
    return srgb_decode([int(each, 16) / 255.0 for each in pairs])


# x, y of red, green, blue and white (D65): ITU-R BT.709-6, also the default of OpenEXR.
BT709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
_ALIKE = 5e-4  # files round to three or four digits; no colour changes by over .2 % of white
# Cone responses of K. M. Lam's thesis (Bradford, 1985), as in CIE 15 and the ICC's profiles.
_BRADFORD = np.array(
    [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]]
)


def matrix_to_bt709(primaries: Sequence[float], origin: str) -> FloatArray | None:
    """Return the matrix (3, 3) from linear R, G, B of these primaries to those of BT.709.

    White stays white: it is adapted with Bradford's cone responses. None if nothing changes.

    Parameters
    ----------
    primaries : eight numbers
        CIE 1931 x and y of red, green, blue and white.
    origin : str
        Name of the file, for messages.

    Raises
    ------
    RenderError
        The numbers span no colour space.
    """
    given = np.asarray(primaries, dtype=np.float64)
    if given.shape == (8,) and np.abs(given - BT709).max() <= _ALIKE:
        return None
    try:
        theirs, ours = _to_xyz(given), _to_xyz(np.array(BT709))
        # The columns' sums are the two whites.
        seen, wanted = _BRADFORD @ theirs.sum(axis=1), _BRADFORD @ ours.sum(axis=1)
        scaled = (wanted / seen)[:, None] * _BRADFORD
        adapted = np.linalg.solve(_BRADFORD, scaled)
        matrix: FloatArray = np.asarray(np.linalg.solve(ours, adapted @ theirs), np.float64)
    except (ValueError, FloatingPointError, np.linalg.LinAlgError):
        words = " ".join(f"{each:g}" for each in given.ravel()[:8])
        raise RenderError(
            f"{origin} has the chromaticities {words}, which span no colour space; expected x and "
            "y of red, green, blue and white."
        ) from None
    return matrix


def _to_xyz(primaries: FloatArray) -> FloatArray:
    """Return the matrix (3, 3) from linear R, G, B to CIE XYZ with white of Y = 1."""
    x, y = primaries.reshape(4, 2).T
    with np.errstate(all="raise"):
        columns = np.stack((x / y, np.ones(4), (1.0 - x - y) / y))
    if not np.isfinite(columns).all() or abs(np.linalg.det(columns[:, :3])) < 1e-6:
        raise FloatingPointError
    matrix: FloatArray = columns[:, :3] * np.linalg.solve(columns[:, :3], columns[:, 3])
    return matrix


_LONGEST_PNG = 1_000_000  # pixels a side: libpng's own limit
_LONGEST_NAME = 255  # bytes of a channel's name: the most that an EXR stores
_CODES = 65535  # the largest of 16 bits
_ROUNDING = 1e-6  # share of white: clipping that changes no code is not reported


def as_light(values: npt.ArrayLike, what: str) -> FloatArray:
    """Return numbers as float64; raises for words, objects, complex numbers and ragged rows.

    Masked arrays are refused, because the values under a mask would be used as light.
    """
    if isinstance(values, np.ma.MaskedArray) and np.ma.is_masked(values):
        raise RenderError(f"{what} is a masked array; fill it first: array.filled(0.0).")
    try:
        array = np.asarray(values)
        found = f"of type {array.dtype}"
    except (TypeError, ValueError) as error:  # rows of different lengths
        array = np.array(None)
        found = str(error).partition(".")[0]
    if array.dtype.kind not in "biuf":
        raise RenderError(
            f"{what} is not an array of real numbers ({printable(found[:80])}); expected rows and "
            "columns of them."
        )
    return array.astype(np.float64)


def positive(value: object, what: str) -> float:
    """Return a finite number above 0."""
    number = np.nan
    if isinstance(value, Real) and not isinstance(value, bool):
        with contextlib.suppress(OverflowError):  # an integer of 400 digits
            number = float(value)
    if not 0.0 < number < np.inf:
        said = f"{value:g}" if isinstance(value, float) else shown(value)
        raise RenderError(f"{what} = {said}; expected a number above 0.")
    return number


def names_for(count: int, given: object, what: str) -> tuple[str, ...]:
    """Return a name for each channel; raises for other counts, and for names that are no texts."""
    names = tuple(given) if isinstance(given, list | tuple | str) else ()
    if not all(isinstance(each, str) for each in names) or len({*names}) != count:
        raise RenderError(
            f"{what} = {shown(given)} for {counted(count, 'channel')}; give each one name."
        )
    return names


def channel_names(light: FloatArray, given: Sequence[str] | None, format: str) -> tuple[str, ...]:
    """Check the shape and return a name for each channel."""
    if light.ndim != 3 or 0 in light.shape:
        raise RenderError(
            f"pixels of shape {light.shape}; expected rows, columns and channels, one or more each."
        )
    count = light.shape[2]
    usual = {1: ("Y",), 3: ("R", "G", "B")}
    if format == "png" and max(light.shape) > _LONGEST_PNG:
        raise RenderError(
            f"{light.shape[1]} x {light.shape[0]} pixels do not fit a PNG file, which takes "
            f"{_LONGEST_PNG} a side; write an EXR."
        )
    if format != "exr" and count not in usual:
        raise RenderError(
            f"{count} channels do not fit a {format.upper()} file, which takes 1 or 3; "
            "write an EXR."
        )
    if given is not None and not isinstance(given, Sequence):
        raise RenderError(f"channels = {shown(given)}; expected a list of names.")
    names = tuple(given) if given is not None else usual.get(count, ())
    if format != "exr" and names != usual[count]:
        raise RenderError(
            f"channels = {shown(list(names))}; a {format.upper()} file has no names but "
            f"{', '.join(usual[count])}: leave `channels` out, or write an EXR."
        )
    for name in names:
        if not (
            isinstance(name, str) and name.isprintable() and len(name.encode()) <= _LONGEST_NAME
        ):
            raise RenderError(
                f"channel name {shown(name)}; expected a text of at most {_LONGEST_NAME} bytes "
                "that can be printed."
            )
    if len(set(names)) != count or "" in names:
        raise RenderError(
            f"{counted(len(names), 'channel name')} for {counted(count, 'channel')}; give one to "
            "each."
        )
    return names


def check_values(
    pixels: FloatArray, channels: Sequence[str], origin: str, *, negative: bool
) -> None:
    """Raise an error for NaN, infinite and, unless allowed, negative values, with their count."""
    for what, bad in (
        ("NaN or infinite", ~np.isfinite(pixels)),
        ("negative", np.zeros(0, dtype=bool) if negative else pixels < 0.0),
    ):
        if bad.any():
            row, column, channel = (int(i[0]) for i in np.nonzero(bad))
            raise RenderError(
                f"{origin}: {int(bad.sum())} of {bad.size} values are {what}, the first at row "
                f"{row}, column {column}, channel {channels[channel]}; mend them first."
            )


def check_alpha(alpha: npt.ArrayLike, light: FloatArray, names: Sequence[str]) -> FloatArray:
    """Return coverage (H, W); raises an error if it does not fit the picture or the format."""
    coverage = as_light(alpha, "alpha")
    if coverage.shape != light.shape[:2]:
        raise RenderError(
            f"alpha of shape {coverage.shape} for a picture of {light.shape[:2]}; expected the "
            "same rows and columns."
        )
    if light.shape[2] not in (1, 3) or "A" in names:
        raise RenderError(
            f"alpha beside the channels {', '.join(names)}; it goes with 1 or 3, none called A."
        )
    check_values(coverage[..., None], ("alpha",), "the picture", negative=True)
    return coverage


def as_format_has_it(
    light: FloatArray, alpha: FloatArray | None, is_multiplied: bool, format: str
) -> tuple[FloatArray, bool, tuple[str, ...]]:
    """Return the light with or without alpha, whether it is included, and notes."""
    if alpha is None or format == "tiff" or is_multiplied == (format == "exr"):
        return light, is_multiplied, ()
    coverage = alpha[..., None]
    if format == "exr":
        return light * coverage, True, ("colour multiplied by alpha, as an EXR has it",)
    colour = np.divide(light, coverage, out=np.zeros_like(light), where=coverage > 0.0)
    return colour, False, ("colour divided by alpha, as a PNG has it",)


def png_codes(
    light: FloatArray, exposure: float, alpha: FloatArray | None = None
) -> tuple[npt.NDArray[np.uint16], tuple[str, ...]]:
    """Return 16-bit sRGB codes, followed by those of alpha, and the number of clipped values."""
    with np.errstate(over="ignore"):  # infinite light is clipped as well
        exposed = exposure * light
    clipped = int(((exposed < -_ROUNDING) | (exposed > 1.0 + _ROUNDING)).sum())
    codes = np.rint(_CODES * srgb_encode(np.clip(exposed, 0.0, 1.0))).astype(np.uint16)
    said = f"{clipped} of {light.size} values clipped to 0 to 1"
    if alpha is not None:
        shares = np.rint(_CODES * np.clip(alpha, 0.0, 1.0)).astype(np.uint16)
        codes = np.concatenate((codes, shares[..., None]), axis=2)
    return codes, (said,) if clipped else ()


def as_float32(
    light: FloatArray, exposure: float, alpha: FloatArray | None = None
) -> npt.NDArray[np.float32]:
    """Return float32, with alpha after the colours; raises for values beyond float32."""
    if exposure != 1.0:
        raise RenderError(
            f"exposure = {exposure:g} is for PNG; EXR and TIFF keep the light as it is: leave it "
            "at 1 or write a PNG."
        )
    values = light if alpha is None else np.concatenate((light, alpha[..., None]), axis=2)
    largest = float(np.abs(values).max())
    if largest > float(np.finfo(np.float32).max):
        raise RenderError(f"{largest:.3g} does not fit 32-bit floats; scale the picture down.")
    return values.astype(np.float32)
