"""Pictures of linear light, to and from EXR, TIFF and PNG files; HDR, JPG and TGA are read too.

Files are recognised by content. 8- and 16-bit pictures are decoded from sRGB, floating point is
linear; the result has the primaries of sRGB. `Image.notes` lists the conversions.
"""

import contextlib
import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray, ReadOnly, true_or_false
from sssfit.errors import FileError, RenderError
from sssfit.files import check_target, reason, temporary_folder, write_atomically
from sssfit.formats._picture_files import (
    FORMATS,
    FULL_SCALE,
    LARGEST_BYTES,
    MAKER,
    Choice,
    Header,
    as_path,
    called,
    check_kind,
    check_png,
    check_size,
    choose,
    found_format,
    image_format,
    is_image_file,
    note_on_names,
    read_header,
    without_lines_of_libpng,
)
from sssfit.formats.colours import (
    as_float32,
    as_format_has_it,
    as_light,
    channel_names,
    check_alpha,
    check_values,
    matrix_to_bt709,
    names_for,
    png_codes,
    positive,
    srgb_decode,
    srgb_encode,
)
from sssfit.messages import printable, shown
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
            "name": printable(path.name),
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


# The library would write the current time, so a picture written twice would differ.
_DATE = "1980:01:01 00:00:00"


def image_bytes(
    pixels: npt.NDArray[Any],
    *,
    format: str,
    channels: Sequence[str],
    mm_per_pixel: float | None,
    has_alpha: bool,
    is_multiplied: bool,
) -> bytes:
    """Return the whole file of (H, W, C) float32, or uint16 for PNG; alpha is the last channel.

    The library writes to named files only, so the file first goes to a temporary folder.

    Raises
    ------
    FileError
        The temporary folder cannot be written.
    """
    import OpenImageIO  # 0.2 s

    height, width, count = pixels.shape
    spec = OpenImageIO.ImageSpec(
        width, height, count, pixels.dtype.name.replace("float32", "float")
    )
    spec.channelnames = tuple(channels)
    spec.attribute("Software", MAKER)
    spec.alpha_channel = count - 1 if has_alpha else -1
    if has_alpha and not is_multiplied:
        spec.attribute("oiio:UnassociatedAlpha", 1)  # the library writes the values unchanged
    if format == "png":
        spec.attribute("oiio:ColorSpace", "srgb_rec709_scene")
    else:
        spec.attribute("DateTime", _DATE)
        # TIFF is not compressed, because not every reader supports the predictor of compressed
        # floats.
        spec.attribute("compression", "zip" if format == "exr" else "none")
    if format == "exr" and mm_per_pixel is not None:
        spec.attribute(SCALE_KEY, repr(float(mm_per_pixel)))
    try:
        with temporary_folder() as folder:
            path = folder / f"picture.{format}"
            target = OpenImageIO.ImageOutput.create(str(path))
            # The library does not accept other layouts in memory.
            packed = np.ascontiguousarray(pixels)
            assert target is not None  # these formats are part of the library
            with without_lines_of_libpng() if format == "png" else contextlib.nullcontext():
                is_written = (
                    target.open(str(path), spec) and target.write_image(packed) and target.close()
                )
            if not is_written:
                said = one_line(target.geterror())
                raise FileError(f"the picture cannot be written: {said}.")
            return path.read_bytes()
    except OSError as error:
        raise FileError(f"the picture cannot be written: {reason(error)}.") from error


__all__ = [
    "Image",
    "image_format",
    "is_image_file",
    "load_image",
    "save_image",
    "srgb_decode",
    "srgb_encode",
]


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Image(ReadOnly):
    """A picture of linear light. Arrays are stored as read-only float64.

    Parameters
    ----------
    pixels : array (H, W, C)
        Linear light; row 0 is the top.
    channels : tuple of str
        Names of the channels: ("R", "G", "B"), ("Y",) for grey, or others from an EXR.
    mm_per_pixel : float, optional [mm]
        Size of a pixel; None if the file does not say.
    alpha : array (H, W), optional
        Coverage, stored separately from the colour.
    alpha_is_multiplied : bool
        Whether ``pixels`` are multiplied by the coverage, as in an EXR.
    name : str
        The file's name without its folder.
    notes : tuple of str
        Conversions of the file's values, as text for stderr.

    Raises
    ------
    RenderError
        An array does not hold real numbers, or has the wrong shape; or another field is invalid.
    """

    pixels: FloatArray
    channels: tuple[str, ...]
    mm_per_pixel: float | None = None
    alpha: FloatArray | None = None
    alpha_is_multiplied: bool = False
    name: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        self._store("pixels", 3)
        if self.alpha is not None:
            self._store("alpha", 2)
            if self.alpha.shape != self.pixels.shape[:2]:
                raise RenderError(
                    f"alpha of shape {self.alpha.shape} for a picture of {self.pixels.shape[:2]}; "
                    "expected the same rows and columns."
                )
        if not isinstance(self.name, str):
            raise RenderError(f"name = {shown(self.name)}; expected a text.")
        kept = {
            "channels": names_for(self.pixels.shape[2], self.channels, "channels"),
            "alpha_is_multiplied": true_or_false(
                "alpha_is_multiplied", self.alpha_is_multiplied, RenderError
            ),
        }
        if self.mm_per_pixel is not None:
            kept["mm_per_pixel"] = positive(self.mm_per_pixel, "mm_per_pixel")
        for field, value in kept.items():
            object.__setattr__(self, field, value)

    def __repr__(self) -> str:
        height, width = self.pixels.shape[:2]
        size = "" if self.mm_per_pixel is None else f" of {self.mm_per_pixel:.4g} mm"
        names = shown(", ".join(self.channels))
        return f"<Image {shown(self.name)}: {width} x {height} pixels{size}, channels {names}>"

    def _store(self, field: str, dimensions: int) -> None:
        """Store an array read-only, in C order."""
        kept = np.array(as_light(getattr(self, field), field), order="C")
        if kept.ndim != dimensions:
            raise RenderError(
                f"{field} of shape {kept.shape}; expected {dimensions} dimensions: rows, columns"
                f"{' and channels' if dimensions == 3 else ''}."
            )
        kept.setflags(write=False)
        object.__setattr__(self, field, kept)


def load_image(
    path: str | Path, *, layer: str | None = None, largest_bytes: float = LARGEST_BYTES
) -> Image:
    """Read a picture as linear light.

    From an EXR it takes R, G, B of the first part that has them, or of the only layer that has
    them, else Y, else all channels; its data window is placed in the picture, with black around.
    Palettes become RGB, grey stays one channel. Primaries other than those of sRGB are converted
    with white kept: the chromaticities of an EXR, PRIMARIES of a Radiance file, cHRM of a PNG.
    Negative values that result are set to 0. Radiance's EXPOSURE and COLORCORR are divided out.

    Parameters
    ----------
    path : str or Path
        An EXR, Radiance HDR, TIFF, PNG, JPG or TGA file, recognised by its content; only TGA files
        of the first version also need their ending.
    layer : str, optional
        Layer of an EXR: the part of its channels' names before the last dot, or the name of a part.
    largest_bytes : float [bytes]
        Limit of the memory for rendering the picture, 32 bytes for each of its values.

    Returns
    -------
    Image
        The upright picture; 8- and 16-bit values are sRGB-decoded (IEC 61966-2-1) unless the file
        says that they are linear.

    Raises
    ------
    FileError
        The file is missing, unreadable, damaged, truncated, of another format, or uses a
        compression that the library lacks.
    RenderError
        The picture is too large, has no usable channels, has several layers and none is selected,
        or has NaN, infinite or negative values.
    """
    source = as_path(path)
    largest = positive(largest_bytes, "largest_bytes")
    if layer is not None and not isinstance(layer, str):
        raise RenderError(f"layer = {shown(layer)}; expected a name.")
    image = Image(**read_image(source, layer, largest))
    origin = called(source)
    check_values(image.pixels, image.channels, origin, negative=False)
    if image.alpha is not None:
        check_values(image.alpha[..., None], ("alpha",), origin, negative=True)
    return image


def save_image(
    target: str | Path | BinaryIO,
    pixels: npt.ArrayLike,
    *,
    channels: Sequence[str] | None = None,
    format: str | None = None,
    exposure: float = 1.0,
    mm_per_pixel: float | None = None,
    alpha: npt.ArrayLike | None = None,
    alpha_is_multiplied: bool = False,
) -> tuple[str, ...]:
    """Write linear light: unchanged float32 to EXR or TIFF, 16-bit sRGB to PNG.

    A PNG holds ``exposure`` times the light, clipped to 0 to 1 and sRGB-encoded. By the conventions
    of the formats, an EXR holds the light times alpha and a PNG the light without it; a TIFF says
    which. Files are written completely or not at all, and the same picture gives the same bytes.

    Parameters
    ----------
    target : path or binary stream
        Where to write.
    pixels : array (H, W, C)
        Linear light; row 0 is the top.
    channels : sequence of str, optional
        Names for EXR; needed for other counts than 1 (Y) and 3 (R, G, B), which only EXR can hold.
        TIFF and PNG hold no others than these.
        `load_image` interprets some: of X and Y it reads Y, and of a and b it takes a for alpha.
    format : str, optional
        "exr", "tiff" or "png"; by default from the ending.
    exposure : float
        Factor for PNG; the other formats keep the light unchanged.
    mm_per_pixel : float, optional [mm]
        Stored in the header of an EXR, from which `load_image` reads it.
    alpha : array (H, W), optional
        Coverage, for pictures of 1 or 3 channels.
    alpha_is_multiplied : bool
        Whether ``pixels`` are multiplied by the coverage.

    Returns
    -------
    tuple of str
        Conversions of the values, and names of channels that `load_image` takes for something
        else, as text for stderr.

    Raises
    ------
    FileError
        The file cannot be written; an older one stays unchanged.
    RenderError
        The values are not finite, or do not fit the format.
    """
    check_target(target)
    is_default = format is None or (isinstance(format, str) and not format)
    chosen = image_format(target) if is_default else format
    if not isinstance(chosen, str) or chosen not in FORMATS:
        raise FileError(f"format {shown(chosen)}: pictures are written as {', '.join(FORMATS)}.")
    light = as_light(pixels, "the picture")
    alpha_is_multiplied = true_or_false("alpha_is_multiplied", alpha_is_multiplied, RenderError)
    exposure = positive(exposure, "exposure")
    pitch = None if mm_per_pixel is None else positive(mm_per_pixel, "mm_per_pixel")
    names = channel_names(light, channels, chosen)
    check_values(light, names, "the picture", negative=True)
    coverage = None if alpha is None else check_alpha(alpha, light, names)
    light, is_multiplied, done = as_format_has_it(light, coverage, alpha_is_multiplied, chosen)
    values: npt.NDArray[np.uint16] | npt.NDArray[np.float32]
    clipped: tuple[str, ...] = ()
    if chosen == "png":
        values, clipped = png_codes(light, exposure, coverage)
    else:
        values = as_float32(light, exposure, coverage)
    data = image_bytes(
        values,
        format=chosen,
        channels=names if coverage is None else (*names, "A"),
        mm_per_pixel=pitch,
        has_alpha=coverage is not None,
        is_multiplied=is_multiplied,
    )
    if isinstance(target, str | Path):
        _write(as_path(target), data)
    else:
        target.write(data)
    own = note_on_names(names) if chosen == "exr" else ()
    return (*done, *clipped, *own)


def _write(path: Path, data: bytes) -> None:
    """Write the whole file or nothing."""
    try:
        write_atomically(path, lambda stream: stream.write(data))
    except OSError as error:  # a name that is invalid in every file system
        raise FileError(f"{called(path)} cannot be written: {reason(error)}.") from None
