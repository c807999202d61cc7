"""Constants of a source that holds several tables: the names of the profiles, their pixels."""

import re
from collections.abc import Iterator, Sequence

from sssfit.errors import KernelError
from sssfit.export.constants import Writer
from sssfit.kernel import Taps
from sssfit.messages import of_material

_OTHER = re.compile(r"[^A-Z0-9]+")


def profile_names(tables: Sequence[Taps]) -> dict[str, int]:
    """Return the numbers of the tables of known materials, by their names.

    A name is the material's, with the pixel size where two have the same.

    Raises
    ------
    KernelError
        Two names are the same all the same.
    """
    known = {
        k: str(each.meta["material"]) for k, each in enumerate(tables) if each.meta.get("material")
    }
    plain = [_identifier(each) for each in known.values()]
    names: dict[str, int] = {}
    for k, material in known.items():
        name, pixel_mm = _identifier(material), tables[k].mm_per_pixel
        if plain.count(name) > 1:
            name += f"_{_identifier(f'{pixel_mm:.6g}mm')}"
        if name in names:
            other = known[names[name]]
            both = f"two tables of {of_material(material)}"
            if other != material:
                both = f"{of_material(other)} and {of_material(material)}"
            raise KernelError(
                f"profiles {names[name]} and {k} would both be called {name}: {both} for pixels of "
                f"{pixel_mm:.6g} mm; leave one out, or export it on its own."
            )
        names[name] = k
    return names


def profile_constants(tables: Sequence[Taps], write: Writer) -> Iterator[str]:
    """Yield a constant for each profile of a known material, its number in the arrays."""
    for name, k in profile_names(tables).items():
        yield write.scalar("uint", f"PROFILE_{name}", [k])


def has_own_pixels(tables: Sequence[Taps]) -> bool:
    """Return whether tables were made for pixels of different sizes."""
    return len({each.mm_per_pixel for each in tables}) > 1


def pixel_constant(tables: Sequence[Taps], write: Writer) -> Iterator[str]:
    """Yield the size of the pixels that tables were made for, of each where they differ."""
    sizes_mm = [each.mm_per_pixel for each in tables]
    if has_own_pixels(tables):
        yield from write.rows("MM_PER_PIXEL", [[each] for each in sizes_mm])
    else:
        yield write.scalar("float", "MM_PER_PIXEL", sizes_mm[:1])


def _identifier(text: str) -> str:
    return _OTHER.sub("_", text.upper()).strip("_") or "UNKNOWN"
