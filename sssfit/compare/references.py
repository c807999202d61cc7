"""Reference pictures, and which of their pixels count: a figure must not depend on the size.

Far from a border every kernel that keeps energy is right: the more of that a picture has, the
smaller its mean. 512 x 512 pixels of .3 mm gave a fourth of the Delta E of 200 x 200.
"""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from sssfit.arrays import BoolArray, FloatArray
from sssfit.errors import RenderError
from sssfit.fit import support_of
from sssfit.measure.score import auto_exposure
from sssfit.profile import Profile
from sssfit.render.reference import render_reference
from sssfit.scene.patterns import DISK_RADIUS_MM
from sssfit.scene.record import Scene


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """A picture by a profile's whole 2D kernel, with which those by others are compared.

    Parameters
    ----------
    scene : Scene
        What is lit, with a mask of the pixels that count.
    border : str
        How it goes on past its rim.
    truth : array (H, W, C)
    exposure : float
        `auto_exposure` of the truth.
    """

    scene: Scene
    border: str
    truth: FloatArray
    exposure: float


def references(
    scenes: Sequence[Scene], profile: Profile, *, threads: int | None = None
) -> list[Reference]:
    """Render scenes by the profile itself, each with the pixels that count of it.

    Raises
    ------
    RenderError
        A scene is black.
    """
    found = []
    for each in scenes:
        if not each.irradiance.any():
            raise RenderError(f"{each.name} is black; expected a picture with light.")
        scene = evaluated_scene(each, profile)
        border = border_of(scene)
        truth = render_reference(scene, profile, border=border, threads=threads)
        found.append(Reference(scene, border, truth, auto_exposure(truth, scene.mask)))
    return found


def check_one_pitch(scenes: Sequence[Scene]) -> None:
    """Refuse pictures of several pixel sizes; those of files are equal up to rounding."""
    first = scenes[0]
    for each in scenes:
        if abs(each.mm_per_pixel - first.mm_per_pixel) > 1e-6 * first.mm_per_pixel:
            raise RenderError(
                f"{each.name} has {each.mm_per_pixel:.7g} mm per pixel and {first.name} "
                f"{first.mm_per_pixel:.7g}; expected the same: a kernel belongs to its pixels."
            )


def evaluated_scene(scene: Scene, profile: Profile) -> Scene:
    """Return a scene with a mask of the pixels that count; others than disk and edge as they are.

    With R the radius that keeps 99.9 % of the profile's widest channel: of a disk, pixels within R
    of a lit one, for which the picture is enlarged by black where a disk of the usual radius fits
    and its light does not; of an edge, pixels within R of it on either side, and, where there is
    room, R or more from the picture's ends along it, where a mirror bends it.

    Parameters
    ----------
    scene : Scene
        With a mask of its own it is returned as it is.
    profile : Profile
    """
    scene = scene.for_channels(profile.channels)
    if scene.mask is not None or scene.name not in ("disk", "edge"):
        return scene
    reach = support_of(profile) / scene.mm_per_pixel
    if scene.name == "disk":
        scene = _enlarged(scene, reach)
    light = scene.irradiance[..., 0]
    counts = _within(light > 0.0, reach)
    if scene.name == "edge":
        counts &= _within(light < light.max(), reach) & _away_from_ends(light, reach)
    return dataclasses.replace(scene, mask=counts.astype(np.int32))


def border_of(scene: Scene) -> str:
    """Return how a made picture goes on past its rim: around a disk it is black, without end.

    With mirrors, light beyond the profile's grid would be the picture's mean, and 2.2 % of marble's
    red is there: on 200 x 200 pixels of .3 mm its kernels had twice the Delta E of 512 x 512.
    """
    return "zero" if scene.mask is not None and scene.name == "disk" else "mirror"


def _within(chosen: BoolArray, reach: float) -> BoolArray:
    """Tell which pixels are within so many pixels of a chosen one."""
    from scipy.ndimage import distance_transform_edt  # .1 s that other comparisons do not need

    near: BoolArray = distance_transform_edt(~chosen) <= reach
    return near


def _enlarged(scene: Scene, reach: float) -> Scene:
    """Put black around a disk until its light has so many pixels to go."""
    lit = scene.irradiance[..., 0] > 0.0
    if (lit.any(axis=0).sum() + 1) * scene.mm_per_pixel < 2.0 * DISK_RADIUS_MM:
        return scene
    wanted = math.ceil(reach) + 1
    pads = []
    for axis in (0, 1):
        places = np.flatnonzero(lit.any(axis=1 - axis))
        room = min(int(places[0]), lit.shape[axis] - 1 - int(places[-1]))
        pads.append((max(wanted - room, 0),) * 2)
    return dataclasses.replace(scene, irradiance=np.pad(scene.irradiance, (*pads, (0, 0))))


def _away_from_ends(light: npt.NDArray[np.float64], reach: float) -> BoolArray:
    """Tell which pixels are off the two sides of the picture that the edge runs into."""
    across = abs(light[:, -1].mean() - light[:, 0].mean())
    up = abs(light[-1].mean() - light[0].mean())
    axis = 0 if across >= up else 1
    size, inset = light.shape[axis], math.ceil(reach)
    kept = np.ones(size, dtype=np.bool_)
    if 2 * inset < size:
        kept[:inset] = kept[size - inset :] = False
    return np.broadcast_to(kept[:, None] if axis == 0 else kept[None, :], light.shape)
