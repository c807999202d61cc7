"""Picture files before a pixel is read: format, header, layers, and whether they can be read.

A format is known by its first bytes, and for writing by its ending.
"""

import contextlib
import dataclasses
import math
import os
import struct
import sys
import threading
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from sssfit.errors import FileError, RenderError
from sssfit.files import check_target, has_mark, path_of, reason
from sssfit.messages import counted, one_of, printable, shown

if TYPE_CHECKING:
    from OpenImageIO import ImageInput, ImageSpec


_LONGEST_HEADER = 1 << 20
_LARGEST = 1e30  # product of exposures; Radiance's own numbers span 1e-38 to 1e38
_PNG_SIGNATURE = 8  # bytes


@dataclass(frozen=True, slots=True)
class Header:
    """Encoding of a file's light: factors (3,), and the primaries of R, G, B.

    ``exposure`` and ``correction`` are 1 and ``primaries`` is None if the header has no entry.
    """

    exposure: float = 1.0
    correction: tuple[float, ...] = (1.0, 1.0, 1.0)
    primaries: tuple[float, ...] | None = None


def read_header(path: Path, format: str) -> Header:
    """Return the encoding from the header of a Radiance or PNG file; the default for others.

    Raises
    ------
    FileError
        The file is unreadable, or a line of its Radiance header is invalid.
    RenderError
        The file is a Radiance file of CIE XYZ.
    """
    try:
        if format == "hdr":
            return _radiance(path)
        if format == "png":
            return Header(primaries=_png_primaries(path))
    except OSError as error:
        raise FileError(f"{called(path)} cannot be read: {reason(error)}.") from error
    return Header()


def _radiance(path: Path) -> Header:
    """Read a Radiance header (Ward, Radiance file formats): all factors, the last primaries.

    A picture holds the light times all of these factors.
    """
    with path.open("rb") as stream:
        text = stream.read(_LONGEST_HEADER).replace(b"\r", b"").partition(b"\n\n")[0]
    exposure, primaries = 1.0, None
    correction: tuple[float, ...] = (1.0, 1.0, 1.0)
    for line in text.decode("latin-1").split("\n")[1:]:
        key, _, value = line.strip().partition("=")
        key = key.strip()
        if key == "FORMAT" and value.strip() == "32-bit_rle_xyze":
            raise RenderError(
                f"{called(path)} holds CIE XYZ (FORMAT={value.strip()}); expected R, G, B: convert "
                "it with Radiance's ra_xyze -r."
            )
        if key == "EXPOSURE":
            exposure *= _numbers(path, key, value, 1)[0]
        elif key == "COLORCORR":
            factors = _numbers(path, key, value, 3)
            correction = tuple(a * b for a, b in zip(correction, factors, strict=True))
        elif key == "PRIMARIES":
            primaries = _numbers(path, key, value, 8)
    if not all(1.0 / _LARGEST <= each <= _LARGEST for each in (exposure, *correction)):
        raise FileError(
            f"{called(path)} is damaged (the product of its EXPOSURE or COLORCORR lines is out of "
            "range)."
        )
    return Header(exposure, correction, primaries)


def _numbers(path: Path, key: str, value: str, count: int) -> tuple[float, ...]:
    """Return the numbers of a line, all above 0."""
    try:
        numbers = tuple(float(each) for each in value.split())
    except ValueError:
        numbers = ()
    if len(numbers) != count or not all(math.isfinite(each) and each > 0.0 for each in numbers):
        raise FileError(
            f"{called(path)} is damaged ({key}={printable(value.strip()[:60])} in its header; "
            f"expected {counted(count, 'number')} above 0)."
        )
    return numbers


def _png_primaries(path: Path) -> tuple[float, ...] | None:
    """Return the numbers of the cHRM chunk, unless another chunk overrides it (PNG 3, 11.3.2.1)."""
    found = None
    with path.open("rb") as stream:
        stream.seek(_PNG_SIGNATURE)
        while len(head := stream.read(8)) == 8:
            length, name = struct.unpack(">I4s", head)
            if name in (b"sRGB", b"iCCP", b"cICP"):
                return None
            if name in (b"IDAT", b"IEND"):
                break
            if name == b"cHRM" and length == 32:
                white_first = struct.unpack(">8I", stream.read(32))
                found = tuple(each / 100_000.0 for each in (*white_first[2:], *white_first[:2]))
                length = 0
            stream.seek(length + 4, 1)
    return found


# Formats that are written: in words, and their endings.
_WRITTEN = {
    "exr": ("EXR", ".exr"),
    "tiff": ("TIFF", ".tif", ".tiff"),
    "png": ("16-bit PNG", ".png"),
}
FORMATS = tuple(_WRITTEN)
ENDINGS = one_of([endings[0] for _, *endings in _WRITTEN.values()])
_ENDINGS = {each: name for name, (_, *endings) in _WRITTEN.items() for each in endings}
_PNG = b"\x89PNG\r\n\x1a\n"
# Formats that are read, by first bytes, so a wrong ending does no harm. TIFF has two byte orders,
# and a variant for more than 4 GB.
_MAGIC = {
    "exr": (b"\x76\x2f\x31\x01",),
    "hdr": (b"#?RADIANCE", b"#?RGBE"),
    "tiff": (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"),
    "png": (_PNG,),
    "jpeg": (b"\xff\xd8\xff",),
}
READ = one_of([*("JPG" if name == "jpeg" else name.upper() for name in _MAGIC), "TGA"])
# A TGA file begins with no mark: the new form ends with one, the old needs its file ending.
_TGA_END = b"TRUEVISION-XFILE.\0"
_TGA_ENDINGS = (".tga", ".targa")
# Types with palettes, colours and greys, plain and run-length encoded.
_TGA_TYPES = (1, 2, 3, 9, 10, 11)
_TGA_DEPTHS = (8, 15, 16, 24, 32)  # bits a pixel
_STDERR = threading.Lock()  # two at once would restore the wrong stderr
_LONGEST_CALLED = 400  # characters of a path in messages
# How pictures that we write name their maker; PNG has it in its Exif, which uses TIFF's tags.
MAKER = "sssfit picture"
_MARKS = {
    begin: b"Software\0string\0\x0e\0\0\0" + MAKER.encode()
    if name == "exr"
    else MAKER.encode() + b"\0"
    for name, begins in _MAGIC.items()
    for begin in begins
}
_CRC_BLOCK = 1 << 20  # bytes in memory while the checksum of a chunk is computed


def image_format(target: str | Path | BinaryIO) -> str:
    """Return the format of a path by its ending: "exr", "tiff" or "png".

    Raises
    ------
    FileError
        The path has another ending, or a stream has none.
    """
    check_target(target)
    if not isinstance(target, str | Path):
        raise FileError(f"a stream has no ending; name a format: {', '.join(FORMATS)}.")
    if (chosen := _ENDINGS.get(Path(target).suffix.lower())) is None:
        kinds = one_of([words for words, *_ in _WRITTEN.values()])
        raise FileError(
            f"{called(Path(target))}: pictures are written as {kinds}; end it in {ENDINGS}."
        )
    return chosen


def as_path(path: object) -> Path:
    """Return the path of a picture; raises an error if it cannot be one."""
    if not isinstance(path, str | os.PathLike) or isinstance(os.fspath(path), bytes):
        raise FileError(f"{shown(path)} is not a path; name an {READ} file.")
    return path_of(os.fspath(path))


def is_image_file(path: str | Path) -> bool:
    """Return whether a file is a picture that we wrote, by the maker it names."""
    try:
        return has_mark(as_path(path), _MARKS)
    except FileError:
        return False


def found_format(path: Path) -> str:
    """Return the format of a file by its content: a key of ``_MAGIC``, or "tga".

    Raises
    ------
    FileError
        The file is missing, unreadable, a folder or device, empty, or of another format.
    """
    name = called(path)
    try:
        if path.exists() and not path.is_file():
            raise FileError(f"{name} is a folder or a device; name an {READ} file.")
        found = _format_of(path)
        is_empty = path.stat().st_size == 0
    except OSError as error:
        raise FileError(f"{name} cannot be read: {reason(error)}.") from error
    if found is None:
        what = "is empty" if is_empty else f"is not an {READ} file"
        raise FileError(f"{name} {what}; name a picture in one of these formats.")
    return found


def called(path: Path) -> str:
    """Return a path for messages: on one line, and shortened in the middle if it is long."""
    text = printable(str(path))
    half = _LONGEST_CALLED // 2
    return text if len(text) <= _LONGEST_CALLED else f"{text[:half]}...{text[-half:]}"


@contextlib.contextmanager
def without_lines_of_libpng() -> Iterator[None]:
    """Capture stderr, because libpng writes its errors there and also returns them."""
    with _STDERR:
        with contextlib.suppress(OSError, ValueError, AttributeError):
            sys.stderr.flush()
        try:
            kept = os.dup(2)
        except OSError:  # closed: no need to capture it
            yield
            return
        try:
            with Path(os.devnull).open("wb") as nowhere:
                os.dup2(nowhere.fileno(), 2)
            yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)


def check_png(path: Path) -> None:
    """Check the checksums of a PNG's chunks, which libpng does for some of them only.

    Raises
    ------
    FileError
        The file is truncated or damaged.
    """
    try:
        with path.open("rb") as stream:
            stream.seek(len(_PNG))
            is_whole = _chunks_are_whole(stream)
    except OSError as error:
        raise FileError(f"{called(path)} cannot be read: {reason(error)}.") from error
    if not is_whole:
        raise FileError(f"{called(path)} is damaged or cut short; write or copy it again.")


def _chunks_are_whole(stream: BinaryIO) -> bool:
    """Return whether every chunk up to IEND is present with the right checksum."""
    while len(head := stream.read(8)) == 8:
        length, name = struct.unpack(">I4s", head)
        total = zlib.crc32(name)
        while length:
            if not (block := stream.read(min(length, _CRC_BLOCK))):
                return False
            total = zlib.crc32(block, total)
            length -= len(block)
        if stream.read(4) != struct.pack(">I", total):
            return False
        if name == b"IEND":
            return True
    return False


def _format_of(path: Path) -> str | None:
    with path.open("rb") as stream:
        head = stream.read(18)
        if found := next(
            (name for name, begins in _MAGIC.items() if head.startswith(begins)), None
        ):
            return found
        is_old = path.suffix.lower() in _TGA_ENDINGS
        return "tga" if _begins_a_tga(head) and (is_old or _ends_a_tga(stream)) else None


def _begins_a_tga(head: bytes) -> bool:
    """Return whether 18 bytes can be a TGA header (Truevision, TGA file format, version 2.0)."""
    if len(head) < 18:
        return False
    has_palette, kind = head[1], head[2]
    width, height = struct.unpack("<HH", head[12:16])
    is_known = has_palette in (0, 1) and kind in _TGA_TYPES and head[16] in _TGA_DEPTHS
    return is_known and width > 0 and height > 0


def _ends_a_tga(stream: BinaryIO) -> bool:
    size = stream.seek(0, os.SEEK_END)
    stream.seek(max(size - len(_TGA_END), 0))
    return stream.read() == _TGA_END


# Memory of a render for each value of the picture, all float64: the irradiance, its padded copy,
# the transform of that, and the result.
BYTES_PER_VALUE = 4 * 8
LARGEST_BYTES = 4_000_000_000
# The largest code of whole numbers, by the library's names.
FULL_SCALE = {"uint8": 255, "uint16": 65535}
_FLOATS = ("half", "float", "double")


# Channels of a layer, in lower case; a layer of X, Y and Z is a position or a direction.
_RGB = (("r", "g", "b"), ("red", "green", "blue"))
_ALPHA = ("a", "alpha")
_PLACE = ("x", "y", "z")


@dataclasses.dataclass(frozen=True, slots=True)
class Choice:
    """The part of a file that is read, with the indices of its channels and alpha."""

    part: int
    spec: "ImageSpec"
    names: tuple[str, ...]
    colours: tuple[int, ...]
    alpha: int | None
    notes: tuple[str, ...]

    @property
    def span(self) -> tuple[int, int]:
        """First index and one past the last index to read."""
        places = [*self.colours, *([] if self.alpha is None else [self.alpha])]
        return min(places), max(places) + 1

    @property
    def bits(self) -> int | None:
        """8 or 16 for whole numbers, None for floating point."""
        return {"uint8": 8, "uint16": 16}.get(str(self.spec.format))


@dataclasses.dataclass(frozen=True, slots=True)
class _Layer:
    """Channels of a part that belong together: "name.R" belongs to name, "R" to its part."""

    part: int
    prefix: str
    part_name: str
    names: tuple[str, ...]
    colours: tuple[int, ...]
    alpha: int | None

    @property
    def label(self) -> str:
        """Name of the layer."""
        return self.prefix or self.part_name


def choose(source: "ImageInput", path: Path, layer: str | None) -> Choice:
    """Select R, G, B of the requested layer; by default those without a layer, else the only ones.

    Without such a layer Y is used, and last all channels except alpha.
    """
    specs: list[ImageSpec] = []
    while source.seek_subimage(len(specs), 0):
        specs.append(source.spec())
    source.geterror()  # a missing part is not an error; without this it would hide the next error
    return _choice(specs, path, layer)


def note_on_names(names: tuple[str, ...]) -> tuple[str, ...]:
    """Return a note, if any, on names of an EXR's channels that are read as something else."""
    from OpenImageIO import ImageSpec  # 0.2 s

    spec = ImageSpec(1, 1, len(names), "float")
    spec.channelnames = names
    lower = [each.lower() for each in names]
    spec.alpha_channel = next((lower.index(each) for each in _ALPHA if each in lower), -1)
    try:
        found = _choice([spec], Path("the file"), None)
    except RenderError:
        return (f"channels {_listed(list(names))} are not read back; leave out the dots",)
    colours = tuple(names[place] for place in found.colours)
    others = {*names} - {*colours}
    if not others or (colours in (("R", "G", "B"), ("Y",)) and others <= {"A", "Z"}):
        return ()  # alpha and depth are what these names are for
    read = f"{_listed(list(colours))} alone"
    if found.alpha is not None:
        read += f", with {names[found.alpha]} as alpha"
    return (f"channels {_listed(list(names))} are read back as {read}; give other names",)


def _choice(specs: list["ImageSpec"], path: Path, layer: str | None) -> Choice:
    """Select as `choose` does, from the headers of all parts."""
    coloured = _layers(specs, ("R", "G", "B"))
    grey = _layers(specs, ("Y",))
    if layer is not None:
        return _named(specs, [*coloured, *grey], layer, path)
    for found in (coloured, grey):
        plain = [each for each in found if not each.prefix]
        if plain:
            return _chosen(specs, plain[0])
        if len(found) > 1:
            raise RenderError(
                f"{called(path)} has the layers {_listed([each.label for each in found])}; name "
                "the one that is meant with `layer`."
            )
        if found:
            return _chosen(specs, found[0])
    return _unnamed_channels(specs, path)


def _layers(specs: list["ImageSpec"], names: tuple[str, ...]) -> list[_Layer]:
    """Return the layers of all parts that have R, G, B, or Y, in the order of the file."""
    layers = []
    for part, spec in enumerate(specs):
        groups: dict[str, dict[str, int]] = {}
        for place, name in enumerate(spec.channelnames):
            prefix, _, channel = str(name).rpartition(".")
            groups.setdefault(prefix, {}).setdefault(channel.lower(), place)
        for prefix, places in groups.items():
            if (colours := _colours(places, names)) is None:
                continue
            alpha = next((places[each] for each in _ALPHA if each in places), None)
            # TIFF and PNG say which channel is alpha, under any name.
            if not prefix and alpha is None and spec.alpha_channel not in (-1, *colours):
                name = str(spec.channelnames[spec.alpha_channel])
                alpha = None if "." in name else int(spec.alpha_channel)
            part_name = spec.get_string_attribute("oiio:subimagename")
            layers.append(_Layer(part, prefix, part_name, names, colours, alpha))
    return layers


def _colours(places: dict[str, int], names: tuple[str, ...]) -> tuple[int, ...] | None:
    """Return the indices of the channels in a group, or None."""
    if names == ("Y",):
        is_place = all(each in places for each in _PLACE)
        return None if is_place or "y" not in places else (places["y"],)
    for spelling in _RGB:
        if all(each in places for each in spelling):
            return tuple(places[each] for each in spelling)
    return None


def _named(specs: list["ImageSpec"], layers: list[_Layer], name: str, path: Path) -> Choice:
    """Return the layer of that name, or raise an error that lists the layers."""
    for each in layers:
        if name in (each.prefix, each.part_name) and name:
            return _chosen(specs, each)
    labels = [each.label for each in layers if each.label]
    what = f"it has {_listed(labels)}" if labels else "it has none of R, G, B or Y with a name"
    raise RenderError(f"{called(path)} has no layer {printable(name)!r}; {what}.")


def _chosen(specs: list["ImageSpec"], layer: _Layer) -> Choice:
    """Return notes on the name of the layer and on unused layers."""
    used = [f"layer {printable(layer.prefix)} used"] if layer.prefix else []
    notes = (*used, *_left_out(specs, layer.part, layer.colours, layer.alpha))
    return Choice(layer.part, specs[layer.part], layer.names, layer.colours, layer.alpha, notes)


def _unnamed_channels(specs: list["ImageSpec"], path: Path) -> Choice:
    """Select every channel of the first part, if none has the name of a colour."""
    spec = specs[0]
    # A channel named A is alpha only with colours known by name; two channels are grey with alpha.
    alpha = int(spec.alpha_channel) if spec.nchannels in (2, 4) else -1
    colours = tuple(i for i in range(spec.nchannels) if i != alpha)
    names = [str(each) for each in spec.channelnames]
    # A dot separates layer and channel; depth and normals may be among them.
    if not colours or any("." in name for name in names):
        raise RenderError(
            f"{called(path)} has the channels {_listed(names)}; expected R, G, B or Y: write the "
            "layer that is meant into a picture of its own."
        )
    kept = None if alpha < 0 else alpha
    notes = _left_out(specs, 0, colours, kept)
    return Choice(0, spec, tuple(names[place] for place in colours), colours, kept, notes)


def _left_out(
    specs: list["ImageSpec"], part: int, colours: tuple[int, ...], alpha: int | None
) -> tuple[str, ...]:
    """Return notes on parts and channels of the file that are not used."""
    spec, notes = specs[part], []
    if len(specs) > 1:
        notes.append(f"part {part + 1} of {len(specs)} used")
    others = [
        name
        for place, name in enumerate(spec.channelnames)
        if place not in colours and place != alpha
    ]
    if others:
        notes.append(f"channels {_listed(others)} left out")
    return tuple(notes)


def _listed(names: list[str]) -> str:
    """Return a list of names as text, the first eight of many."""
    shown = ", ".join(printable(name) for name in names[:8])
    return shown if len(names) <= 8 else f"{shown} and {len(names) - 8} more"


def check_kind(choice: Choice, path: Path) -> None:
    """Raise an error for values that are not light, and for deep pixels."""
    spec = choice.spec
    if spec.deep or spec.depth > 1:
        raise RenderError(
            f"{called(path)} has several samples in a pixel's depth; flatten it first."
        )
    kinds = {str(spec.channelformats[place]) for place in choice.colours if spec.channelformats}
    kinds = kinds or {str(spec.format)}
    if not kinds <= {*_FLOATS, *FULL_SCALE}:
        raise RenderError(
            f"{called(path)} has pixels of {' and '.join(sorted(kinds))}; expected 8 or 16 bits, "
            "half, float or double: write it as one of these."
        )


def check_size(choice: Choice, path: Path, largest_bytes: float) -> None:
    """Raise an error, from the header alone, for a picture that would not fit in memory."""
    spec, count = choice.spec, len(choice.colours)
    # A data window may be larger than its picture.
    width, height = max(spec.width, spec.full_width), max(spec.height, spec.full_height)
    if width < 1 or height < 1:
        raise RenderError(
            f"{called(path)} has {height} rows of {width} pixels; expected at least one."
        )
    needed = BYTES_PER_VALUE * width * height * count
    if needed > largest_bytes:
        raise RenderError(
            f"{called(path)} is {width} x {height} with {count} channels: rendering needs "
            f"{needed / 1e9:.3g} GB, the limit is {largest_bytes / 1e9:.3g} GB; crop or scale it."
        )
