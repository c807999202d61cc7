"""What ``sssfit compare`` looks at: a profile, made where there is none, and its pictures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sssfit.methods import DEON_SKIN

from ._input import load
from ._options import Common
from ._progress import say_if_compiling
from ._scene import MADE, Picture, check_file_options, made_options, make_or_read

if TYPE_CHECKING:
    from sssfit.material import Material
    from sssfit.profile import Profile
    from sssfit.scene.record import Scene

_SIZE = (512, 512)


def profile_of(name: str, common: Common) -> Profile:
    """Read a profile, ``-`` for stdin, or make the exact one of a material."""
    from sssfit.profile import Profile

    if name == "-" or name.endswith(".npz"):
        return load(Profile, name)
    if name == DEON_SKIN:
        from sssfit.simulate import simulate_deon_skin

        return simulate_deon_skin()
    return _exact(name, common)


def material_of(name: str) -> Material:
    """Load the material of a budget; a profile has no light to trace."""
    from sssfit.errors import ProfileError
    from sssfit.material import load_material

    if name == DEON_SKIN:
        raise ProfileError(f"{name} has no coefficients to simulate with; name a material.")
    if name.endswith(".npz"):
        raise ProfileError(
            f"{name} is a profile, and a budget simulates a material: name that, such as skin1 or "
            "a .toml file of your own."
        )
    return load_material(name)


def _exact(name: str, common: Common) -> Profile:
    """Solve a half space; for others there is no exact method."""
    from sssfit.errors import SimulationError
    from sssfit.material import load_material
    from sssfit.simulate import simulate_exact

    material = load_material(name)
    if not material.is_semi_infinite:
        raise SimulationError(
            f"{material.name} is not one half space, the only thing that is solved exactly: walk "
            f"its photons with `sssfit simulate`, and compare {material.name}.profile.npz."
        )
    say_if_compiling(common, solver=True)
    return simulate_exact(material, threads=common.threads)


def scenes_of(
    pictures: Sequence[str],
    size: tuple[int, int] | None,
    mm_per_pixel: float | None,
    common: Common,
    *,
    layer: str | None = None,
    mask: str | None = None,
) -> tuple[list[Scene], float]:
    """Return pictures on the same pixels, and the pixels' size [mm].

    That is what was asked for, else what the first file says, else the default.
    """
    for name in pictures:
        if not name or (name not in MADE and not Path(name).exists()):
            raise click.UsageError(
                f"there is no picture {name!r}; expected {', '.join(MADE)}, or your own file."
            )
    files = [name for name in pictures if name not in MADE]
    if size is not None and len(files) == len(pictures):
        raise click.UsageError("--size is for made pictures; leave it out.")
    check_file_options(layer, mask, has_file=bool(files))
    # The size of made pictures is known only once files have been read.
    read = {
        name: make_or_read(Picture(name, None, mm_per_pixel, {}, layer, mask), 0.0, common)
        for name in files
    }
    from sssfit.fit import MM_PER_PIXEL

    pitch = next((each.mm_per_pixel for each in read.values()), mm_per_pixel or MM_PER_PIXEL)
    return [
        read[name]
        if name in read
        else make_or_read(Picture(name, size or _SIZE, None, made_options(name)), pitch, common)
        for name in pictures
    ], pitch
