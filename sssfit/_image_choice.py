"""What of a picture file is read: the part and the channels; and whether it can be."""

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING

from sssfit._material_checks import printable
from sssfit.errors import RenderError

if TYPE_CHECKING:
    from OpenImageIO import ImageInput, ImageSpec

# What a render holds for each value of the picture, all float64: the irradiance, its padded copy,
# the transform of that, and the result.
BYTES_PER_VALUE = 4 * 8
LARGEST_BYTES = 4_000_000_000
# The largest code of whole numbers, by the library's names.
FULL_SCALE = {"uint8": 255, "uint16": 65535}
_FLOATS = ("half", "float", "double")


@dataclasses.dataclass(frozen=True, slots=True)
class Choice:
    """The part of a file that is read and its channels, by their places in it."""

    part: int
    spec: "ImageSpec"
    colours: tuple[int, ...]
    notes: tuple[str, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """The channels' names."""
        return tuple(str(self.spec.channelnames[place]) for place in self.colours)

    @property
    def alpha(self) -> int | None:
        """The place of alpha, if there is one and it is no colour: some call their first "A"."""
        place = int(self.spec.alpha_channel)
        return place if place >= 0 and place not in self.colours else None

    @property
    def span(self) -> tuple[int, int]:
        """First place and one past the last of what has to be read."""
        places = [*self.colours, *([] if self.alpha is None else [self.alpha])]
        return min(places), max(places) + 1

    @property
    def bits(self) -> int | None:
        """8 or 16 for whole numbers, None for floating point."""
        return {"uint8": 8, "uint16": 16}.get(str(self.spec.format))


def choose(source: "ImageInput", path: Path) -> Choice:
    """Take R, G, B of the first part that has them, else Y, else all that is no alpha."""
    specs: list[ImageSpec] = []
    while source.seek_subimage(len(specs), 0):
        specs.append(source.spec())
    for wanted in (("R", "G", "B"), ("Y",)):
        for part, spec in enumerate(specs):
            names = list(spec.channelnames)
            if set(wanted) <= set(names):
                colours = tuple(names.index(name) for name in wanted)
                return Choice(part, spec, colours, _left_out(specs, part, colours))
    # Only beside colours that are known by name is a channel called A alpha; two are grey with it.
    alpha = specs[0].alpha_channel if specs[0].nchannels in (2, 4) else -1
    colours = tuple(i for i in range(specs[0].nchannels) if i != alpha)
    # A dot parts a layer from its channel: depth and normals may be among them.
    if not colours or any("." in name for name in specs[0].channelnames):
        names = list(specs[0].channelnames)
        raise RenderError(
            f"{path} has the channels {_listed(names)}; expected R, G, B or Y: write the layer "
            "that is meant into a picture of its own."
        )
    return Choice(0, specs[0], colours, _left_out(specs, 0, colours))


def _left_out(specs: list["ImageSpec"], part: int, colours: tuple[int, ...]) -> tuple[str, ...]:
    """Say which parts and channels of the file are not used."""
    spec, notes = specs[part], []
    if len(specs) > 1:
        notes.append(f"part {part + 1} of {len(specs)} used")
    others = [
        name
        for place, name in enumerate(spec.channelnames)
        if place not in colours and place != spec.alpha_channel
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
        raise RenderError(f"{path} has several samples in a pixel's depth; flatten it first.")
    kinds = {str(spec.channelformats[place]) for place in choice.colours if spec.channelformats}
    kinds = kinds or {str(spec.format)}
    if not kinds <= {*_FLOATS, *FULL_SCALE}:
        raise RenderError(
            f"{path} has pixels of {' and '.join(sorted(kinds))}; expected 8 or 16 bits, half, "
            "float or double: write it as one of these."
        )


def check_size(choice: Choice, path: Path, largest_bytes: float) -> None:
    """Refuse by the header what would not fit the memory."""
    spec, count = choice.spec, len(choice.colours)
    # A window of data may be larger than the picture it belongs to.
    width, height = max(spec.width, spec.full_width), max(spec.height, spec.full_height)
    if width < 1 or height < 1:
        raise RenderError(f"{path} has {height} rows of {width} pixels; expected at least one.")
    needed = BYTES_PER_VALUE * width * height * count
    if needed > largest_bytes:
        raise RenderError(
            f"{path} is {width} x {height} with {count} channels: rendering needs "
            f"{needed / 1e9:.3g} GB, the limit is {largest_bytes / 1e9:.3g} GB; crop or scale it."
        )
