"""Which part and channels of a picture file are read, and whether they can be."""

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING

from sssfit.errors import RenderError
from sssfit.formats._picture_files import called
from sssfit.messages import printable

if TYPE_CHECKING:
    from OpenImageIO import ImageInput, ImageSpec

# What a render holds for each value of the picture, all float64: the irradiance, its padded copy,
# the transform of that, and the result.
BYTES_PER_VALUE = 4 * 8
LARGEST_BYTES = 4_000_000_000
# The largest code of whole numbers, by the library's names.
FULL_SCALE = {"uint8": 255, "uint16": 65535}
_FLOATS = ("half", "float", "double")


# Channels of a layer, in small letters; a layer of X, Y and Z is a place or a direction.
_RGB = (("r", "g", "b"), ("red", "green", "blue"))
_ALPHA = ("a", "alpha")
_PLACE = ("x", "y", "z")


@dataclasses.dataclass(frozen=True, slots=True)
class Choice:
    """The part of a file that is read, its channels and alpha by their places in it."""

    part: int
    spec: "ImageSpec"
    names: tuple[str, ...]
    colours: tuple[int, ...]
    alpha: int | None
    notes: tuple[str, ...]

    @property
    def span(self) -> tuple[int, int]:
        """First place and one past the last of what has to be read."""
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
        """What it is called."""
        return self.prefix or self.part_name


def choose(source: "ImageInput", path: Path, layer: str | None) -> Choice:
    """Take R, G, B of the layer that was asked for; by default those of no layer, else the only.

    Without such a layer Y is used, and last all channels except alpha.
    """
    specs: list[ImageSpec] = []
    while source.seek_subimage(len(specs), 0):
        specs.append(source.spec())
    source.geterror()  # a missing part is not an error; left there it would hide the next one
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
            # TIFF and PNG say which channel is alpha, however it is called.
            if not prefix and alpha is None and spec.alpha_channel not in (-1, *colours):
                name = str(spec.channelnames[spec.alpha_channel])
                alpha = None if "." in name else int(spec.alpha_channel)
            part_name = spec.get_string_attribute("oiio:subimagename")
            layers.append(_Layer(part, prefix, part_name, names, colours, alpha))
    return layers


def _colours(places: dict[str, int], names: tuple[str, ...]) -> tuple[int, ...] | None:
    """Return where a group has the channels, or None."""
    if names == ("Y",):
        is_place = all(each in places for each in _PLACE)
        return None if is_place or "y" not in places else (places["y"],)
    for spelling in _RGB:
        if all(each in places for each in spelling):
            return tuple(places[each] for each in spelling)
    return None


def _named(specs: list["ImageSpec"], layers: list[_Layer], name: str, path: Path) -> Choice:
    """Return the layer of that name, or list those that there are."""
    for each in layers:
        if name in (each.prefix, each.part_name) and name:
            return _chosen(specs, each)
    labels = [each.label for each in layers if each.label]
    what = f"it has {_listed(labels)}" if labels else "it has none of R, G, B or Y with a name"
    raise RenderError(f"{called(path)} has no layer {printable(name)!r}; {what}.")


def _chosen(specs: list["ImageSpec"], layer: _Layer) -> Choice:
    """Say which layer it is where it has a name, and what is not used."""
    used = [f"layer {printable(layer.prefix)} used"] if layer.prefix else []
    notes = (*used, *_left_out(specs, layer.part, layer.colours, layer.alpha))
    return Choice(layer.part, specs[layer.part], layer.names, layer.colours, layer.alpha, notes)


def _unnamed_channels(specs: list["ImageSpec"], path: Path) -> Choice:
    """Take every channel of the first part, where none is called a colour."""
    spec = specs[0]
    # Only beside colours that are known by name is a channel called A alpha; two are grey with it.
    alpha = int(spec.alpha_channel) if spec.nchannels in (2, 4) else -1
    colours = tuple(i for i in range(spec.nchannels) if i != alpha)
    names = [str(each) for each in spec.channelnames]
    # A dot parts a layer from its channel: depth and normals may be among them.
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
    """Say which parts and channels of the file are not used."""
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
    """List names, the first eight of many."""
    shown = ", ".join(printable(name) for name in names[:8])
    return shown if len(names) <= 8 else f"{shown} and {len(names) - 8} more"


def check_kind(choice: Choice, path: Path) -> None:
    """Refuse numbers that say nothing of light, and pixels that lie in depth."""
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
    """Refuse by the header what would not fit the memory."""
    spec, count = choice.spec, len(choice.colours)
    # A window of data may be larger than the picture it belongs to.
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
