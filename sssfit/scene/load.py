"""Loads a scene by the name of a made picture or from a picture file."""

import math
from collections.abc import Sequence
from typing import Any

from sssfit.errors import RenderError
from sssfit.formats.pictures import load_image
from sssfit.messages import note
from sssfit.scene.head import whole_face_mm_per_pixel
from sssfit.scene.made import EDGE_DEGREES, MADE, make_scene, options_of
from sssfit.scene.record import Scene

_ROWS = 512  # rows and columns of made pictures
_MOST_ROWS = 1080  # largest head whose size is not given


def load_scene(
    name: str,
    mm_per_pixel: float | None = None,
    *,
    otherwise: float | None = None,
    size: tuple[int, int] | None = None,
    layer: str | None = None,
    mask: str | None = None,
    seed: int = 1,
    **options: Any,
) -> Scene:
    """Make a picture of ``MADE``, or read one from a file; see `sssfit.messages.note`.

    Parameters
    ----------
    name : str
        Name of a made picture, or path of a file that `load_image` reads.
    mm_per_pixel, otherwise : float, optional [mm]
        Size of a pixel; ``otherwise`` is used for a file without it in its header.
    size : tuple of int, optional
        Rows and columns of a made picture; by default 512 of each, and for the head as many as the
        whole face needs, up to 1080.
    layer : str, optional
        Layer of a file; see `load_image`.
    mask : {"alpha"}, optional
        For a file: the object is the part that its alpha covers by half or more.
    seed : int
        Seed of random made pictures.
    **options
        Options of a made picture; see `make_scene`.

    Returns
    -------
    Scene

    Raises
    ------
    RenderError
        Options are invalid, or the pixel size is unknown.
    FileError
        The file cannot be read.

    Examples
    --------
    >>> scene = load_scene("edge", 0.5, size=(8, 8), angle_degrees=30.0)
    >>> scene.irradiance.shape
    (8, 8, 1)
    """
    if name in MADE:
        pitch = mm_per_pixel or otherwise
        if pitch is None:
            raise RenderError(f"{name} is made on pixels of any size; give `mm_per_pixel`.")
        height, width = size or _default_size(name, pitch)
        if "seed" in options_of(name):
            options["seed"] = seed
        return make_scene(name, height=height, width=width, mm_per_pixel=pitch, **options)
    image = load_image(name, layer=layer)
    pitch = mm_per_pixel or image.mm_per_pixel or otherwise
    if pitch is None:
        raise RenderError(f"{name} does not say how large its pixels are; give `mm_per_pixel`.")
    scene = Scene.from_image(image, pitch, alpha_is_mask=mask == "alpha")
    for each in image.notes:
        note(f"{name}: {each}")
    return scene


def load_scenes(
    names: Sequence[str],
    mm_per_pixel: float | None = None,
    *,
    otherwise: float | None = None,
    size: tuple[int, int] | None = None,
    layer: str | None = None,
    mask: str | None = None,
    seed: int = 1,
) -> list[Scene]:
    """Return pictures to compare kernels on, all on the same pixels; edges are at 30 degrees.

    Parameters and errors are those of `load_scene`; made pictures have 512 x 512 pixels by default.
    The pixel size is ``mm_per_pixel``, else that of the first file, else ``otherwise``.
    """
    found = {
        name: load_scene(name, mm_per_pixel, layer=layer, mask=mask)
        for name in names
        if name not in MADE
    }
    pitch = next((scene.mm_per_pixel for scene in found.values()), mm_per_pixel or otherwise)
    for name in names:
        if name in MADE:
            own: dict[str, Any] = {"angle_degrees": EDGE_DEGREES} if name == "edge" else {}
            whole = size or (_ROWS, _ROWS)
            found[name] = load_scene(name, pitch, size=whole, seed=seed, **own)
    return [found[name] for name in names]


def _default_size(name: str, mm_per_pixel: float) -> tuple[int, int]:
    """Return 512 x 512, or the rows of a head, up to 1080, noting if it is cropped."""
    if name != "head":
        return _ROWS, _ROWS
    # The smaller a pixel, the more rows the face needs.
    wanted = math.ceil(whole_face_mm_per_pixel(1, 1) / mm_per_pixel)
    rows = min(wanted, _MOST_ROWS)
    if wanted > rows:
        note(
            f"The whole face takes {wanted} rows of {mm_per_pixel:.4g} mm; {rows} show its "
            f"middle. Give `size = {wanted}x{wanted}`, or fit the kernel to larger pixels."
        )
    return rows, rows
