"""A picture's values: what may be read, and what each format can hold."""

from collections.abc import Sequence
from numbers import Real

import numpy as np
import numpy.typing as npt

from sssfit._image_srgb import srgb_encode
from sssfit._material_checks import printable, shown
from sssfit.errors import RenderError

FloatArray = npt.NDArray[np.float64]

_LONGEST_PNG = 1_000_000  # pixels a side: libpng's own limit
_LONGEST_NAME = 255  # bytes of a channel's name: the most that an EXR keeps
_CODES = 65535  # the largest of 16 bits
_ROUNDING = 1e-6  # of white: what no code shows is not said to be clipped


def as_light(values: npt.ArrayLike, what: str) -> FloatArray:
    """Return numbers as float64; refuse words, objects, complex numbers and ragged rows."""
    try:
        array = np.asarray(values)
        found = f"of type {array.dtype}"
    except (TypeError, ValueError) as error:  # rows of unlike lengths
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
    is_number = isinstance(value, Real) and not isinstance(value, bool)
    if not is_number or not 0.0 < float(value) < np.inf:  # type: ignore[arg-type]
        said = f"{value:g}" if isinstance(value, float) else shown(value)
        raise RenderError(f"{what} = {said}; expected a number above 0.")
    return float(value)  # type: ignore[arg-type]


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
    if format != "exr":
        if count not in usual:
            raise RenderError(
                f"{count} channels do not fit a {format.upper()} file, which takes 1 or 3; "
                "write an EXR."
            )
        return usual[count]
    if given is not None and not isinstance(given, Sequence):
        raise RenderError(f"channels = {shown(given)}; expected a list of names.")
    names = tuple(given) if given is not None else usual.get(count, ())
    for name in names:
        if not (
            isinstance(name, str) and name.isprintable() and len(name.encode()) <= _LONGEST_NAME
        ):
            raise RenderError(
                f"channel name {shown(name)}; expected a text of at most {_LONGEST_NAME} bytes "
                "that can be printed."
            )
    if len(set(names)) != count or "" in names:
        raise RenderError(f"{len(names)} channel names for {count} channels; give one to each.")
    return names


def check_values(
    pixels: FloatArray, channels: Sequence[str], origin: str, *, negative: bool
) -> None:
    """Refuse NaN and infinite values, and negative ones unless allowed: how many, where first."""
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
    """Return coverage (H, W); refuse what does not fit the picture, or would not be found again."""
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
    """Return the light with alpha in it or not, whether it is, and what was done, in words."""
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
    """Return 16-bit sRGB codes, those of alpha as shares behind them; how many were clipped."""
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
    """Return float32, alpha behind the colours, or refuse what it cannot hold."""
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
