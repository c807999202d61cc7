"""Reads pictures through OpenImageIO: complete, upright and linear."""

import contextlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.errors import FileError
from sssfit.formats._layers import FULL_SCALE, Choice, check_kind, check_size, choose
from sssfit.formats._picture_files import (
    Header,
    called,
    check_png,
    found_format,
    read_header,
    without_lines_of_libpng,
)
from sssfit.formats.colours import matrix_to_bt709, srgb_decode
from sssfit.messages import printable
from sssfit.text import finite_number

if TYPE_CHECKING:
    from OpenImageIO import ImageInput, ImageSpec


# In EXR headers, as text, so that a written picture keeps its pixel size.
SCALE_KEY = "sssfit:mm_per_pixel"
_LONGEST_REASON = 120
# TIFF's numbers, and the end of libtiff's message on a missing one.
_COMPRESSIONS = {
    32946: "deflate",
    34661: "JBIG",
    34712: "JPEG 2000",
    34887: "LERC",
    34925: "LZMA",
    50000: "Zstandard (zstd)",
    50001: "WebP",
    50002: "JPEG XL",
    52546: "JPEG XL",
}
# The reader decodes what it can of a damaged JPEG, and says so; surplus bytes cost no pixel.
_HARMLESS = "extraneous bytes before marker"
_NOT_BUILT = ("compression support is not configured", "decoding is not implemented")


def read_image(path: Path, layer: str | None, largest_bytes: float) -> dict[str, Any]:
    """Return the fields of an `Image`; see `sssfit.formats.pictures.load_image`."""
    format = found_format(path)
    if format == "png":
        check_png(path)
    header = read_header(path, format)
    try:
        with without_lines_of_libpng() if format == "png" else contextlib.nullcontext():
            choice, stored = _stored(path, layer, largest_bytes)
        spec = choice.spec
        whole = _upright(_in_window(stored, spec), spec)
        colour, alpha, is_multiplied, done = _linear(whole, choice)
        light, divided = _without_factors(colour, header)
        primaries = header.primaries or _chromaticities(spec)
        pixels, converted = _in_our_primaries(light, choice, primaries, path)
        scale = finite_number(spec.get_string_attribute(SCALE_KEY)) or 0.0
        return {
            "pixels": pixels,
            "channels": choice.names,
            "mm_per_pixel": scale if scale > 0.0 else None,
            "alpha": alpha,
            "alpha_is_multiplied": is_multiplied,
            "name": path.name,
            "notes": (
                *(*choice.notes, *_about_file(spec), *done),
                *(*divided, *converted),
            ),
        }
    except UnicodeDecodeError:  # bytes of a damaged header, in the library's results or messages
        raise FileError(f"{called(path)} is damaged (a word in its header is not text).") from None


def _stored(path: Path, layer: str | None, largest_bytes: float) -> tuple[Choice, npt.NDArray[Any]]:
    """Return the selected layer of a file, and its values as stored."""
    source = _open(path)
    try:
        choice = choose(source, path, layer)
        check_kind(choice, path)
        check_size(choice, path, largest_bytes)
        stored = source.read_image(choice.part, 0, *choice.span, "unknown")
        words = one_line(source.geterror())
        if stored is None or (words and _HARMLESS not in words):
            raise _unreadable(path, choice.spec, words)
        return choice, stored
    finally:
        source.close()


def _unreadable(path: Path, spec: "ImageSpec", words: str) -> FileError:
    """Distinguish a compression that the library lacks from a damaged file."""
    if not words.endswith(_NOT_BUILT):
        return FileError(f"{called(path)} is damaged or cut short ({words}).")
    code = spec.get_int_attribute("tiff:Compression")
    name = _COMPRESSIONS.get(code, f"scheme {code}")
    return FileError(
        f"{called(path)} is compressed by {name}, which the reader of pictures was built without; "
        "save it with LZW, ZIP or no compression."
    )


def _open(path: Path) -> "ImageInput":
    """Open a file by its content; unmultiplied alpha stays unmultiplied."""
    import OpenImageIO  # 0.2 s

    config = OpenImageIO.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)
    try:
        source = OpenImageIO.ImageInput.open(str(path), config)
    except TypeError:  # raised for a name that is not UTF-8
        raise FileError(f"{called(path)} has a name that is not UTF-8; rename it.") from None
    if source is None:
        raise FileError(
            f"{called(path)} is damaged or cut short ({one_line(OpenImageIO.geterror())})."
        )
    return source


def one_line(text: str) -> str:
    """Shorten a message of the library to one line."""
    line = printable(text.strip().partition("\n")[0]).rstrip(".")
    return line if len(line) <= _LONGEST_REASON else f"{line[:_LONGEST_REASON]}..."


def _in_window(raw: npt.NDArray[Any], spec: "ImageSpec") -> npt.NDArray[Any]:
    """Put an EXR's data window into its picture: black around it, cropped outside."""
    if (spec.x, spec.y, spec.width, spec.height) == (
        *(spec.full_x, spec.full_y),
        *(spec.full_width, spec.full_height),
    ):
        return raw
    whole = np.zeros((spec.full_height, spec.full_width, raw.shape[2]), dtype=raw.dtype)
    top, left = spec.y - spec.full_y, spec.x - spec.full_x
    rows = slice(max(top, 0), max(top + spec.height, 0))
    columns = slice(max(left, 0), max(left + spec.width, 0))
    target = whole[rows, columns]
    first_row, first_column = max(-top, 0), max(-left, 0)
    target[:] = raw[first_row:, first_column:][: target.shape[0], : target.shape[1]]
    return whole


def _upright(stored: npt.NDArray[Any], spec: "ImageSpec") -> npt.NDArray[Any]:
    """Turn rows and columns by the orientation, 1 to 8 as in TIFF and Exif."""
    turned = {
        2: stored[:, ::-1],
        3: stored[::-1, ::-1],
        4: stored[::-1],
        5: stored.transpose(1, 0, 2),
        6: np.rot90(stored, -1),
        7: stored[::-1, ::-1].transpose(1, 0, 2),
        8: np.rot90(stored),
    }
    return turned.get(spec.get_int_attribute("Orientation", 1), stored)


def _about_file(spec: "ImageSpec") -> list[str]:
    """Return notes on header entries that changed the picture, and on ignored ones."""
    notes = []
    if (orientation := spec.get_int_attribute("Orientation", 1)) in range(2, 9):
        notes.append(f"turned upright from orientation {orientation}")
    if (spec.width, spec.height) != (spec.full_width, spec.full_height):
        notes.append(
            f"{spec.width} x {spec.height} pixels of data put into the {spec.full_width} x "
            f"{spec.full_height} of the picture"
        )
    profile = spec.get_string_attribute("ICCProfile:profile_description")
    if profile and "sRGB" not in profile:
        notes.append(f"colour profile {printable(profile)} not applied")
    return notes


def _without_factors(colour: FloatArray, header: Header) -> tuple[FloatArray, list[str]]:
    """Divide the light by the factors of a Radiance header, and return notes."""
    notes = []
    if header.exposure != 1.0:
        notes.append(f"divided by the exposure of {header.exposure:.4g} in its header")
    if set(header.correction) != {1.0}:
        words = " ".join(f"{each:.4g}" for each in header.correction)
        notes.append(f"divided by the colour correction of {words} in its header")
    if not notes:
        return colour, []
    with np.errstate(over="ignore"):  # infinite values raise an error later
        return colour / (header.exposure * np.array(header.correction)), notes


def _chromaticities(spec: "ImageSpec") -> tuple[float, ...] | None:
    """Return the primaries of an EXR header; None if they are missing or invalid."""
    found = spec.getattribute("chromaticities")
    is_usual = isinstance(found, tuple) and len(found) == 8
    return tuple(float(each) for each in found) if is_usual else None


def _linear(
    whole: npt.NDArray[Any], choice: Choice
) -> tuple[FloatArray, FloatArray | None, bool, list[str]]:
    """Return linear colour, alpha, whether alpha is in the colour, and notes."""
    spec, first = choice.spec, choice.span[0]
    colour = _as_float64(whole[..., [place - first for place in choice.colours]])
    alpha, is_multiplied, notes = None, False, []
    if choice.alpha is not None:
        alpha = _as_float64(whole[..., choice.alpha - first])
        is_multiplied = not spec.get_int_attribute("oiio:UnassociatedAlpha")
        notes.append(_about_alpha(is_multiplied, choice.bits))
        if is_multiplied and choice.bits:  # the sRGB curve applies to the colour without alpha
            safe = np.where(alpha > 0.0, alpha, 1.0)[..., None]
            colour, is_multiplied = np.minimum(colour / safe, 1.0), False
    space = spec.get_string_attribute("oiio:ColorSpace")
    if choice.bits is None:
        if space and not space.startswith("lin"):
            notes.append(f"colour space {printable(space)} of the file taken for linear")
        return colour, alpha, is_multiplied, notes
    if space.startswith("lin"):
        return colour, alpha, is_multiplied, [*notes, f"{choice.bits}-bit, linear as the file says"]
    if gamma := spec.get_float_attribute("oiio:Gamma"):
        notes.append(f"gamma {gamma:.3g} of the file taken for sRGB")
    elif space and not space.startswith("srgb"):
        notes.append(f"colour space {printable(space)} of the file taken for sRGB")
    notes.append(f"{choice.bits}-bit sRGB decoded to linear")
    return srgb_decode(colour), alpha, is_multiplied, notes


def _in_our_primaries(
    colour: FloatArray, choice: Choice, primaries: Sequence[float] | None, path: Path
) -> tuple[FloatArray, list[str]]:
    """Return R, G, B in the primaries of sRGB, and notes.

    A colour outside the sRGB triangle would have negative light, which no surface receives.
    """
    if primaries is None or choice.names != ("R", "G", "B"):
        return colour, []
    if (matrix := matrix_to_bt709(primaries, called(path))) is None:
        return colour, []
    words = " ".join(f"{each:.4g}" for each in primaries)
    notes = [f"converted from the chromaticities {words} to those of sRGB"]
    converted = colour @ matrix.T
    is_outside = (converted < 0.0) & (colour >= 0.0).all(axis=-1, keepdims=True)
    if is_outside.any():
        notes.append(
            f"{int(is_outside.sum())} of {colour.size} values outside sRGB's triangle set to 0"
        )
    return np.where(is_outside, 0.0, converted), notes


def _as_float64(stored: npt.NDArray[Any]) -> FloatArray:
    """Return floats unchanged, and integers as shares of their largest code."""
    with np.errstate(invalid="ignore"):  # some NaN warn when widened; they raise an error later
        return stored.astype(np.float64) / FULL_SCALE.get(stored.dtype.name, 1)


def _about_alpha(is_multiplied: bool, bits: int | None) -> str:
    if is_multiplied and bits:
        return "alpha kept apart, colour divided by it"
    state = "multiplied by it" if is_multiplied else "without it"
    return f"alpha kept apart, colour used as stored, {state}"
