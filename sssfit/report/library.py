"""An index of materials: a swatch of each, its reflectance and how far its light goes."""

import dataclasses
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.material import Material
from sssfit.measure.delta_e import auto_exposure
from sssfit.profile import Profile
from sssfit.render.reference import render_reference
from sssfit.report.html import data_text, is_report_file, rendered, script_text
from sssfit.report.pack import packed_picture
from sssfit.report.pictures import distance_of
from sssfit.scene.made import make_scene
from sssfit.simulate.truth import true_profile

_SIDE, _MM_PER_PIXEL = 96, 2.3  # of a swatch: the whole face
_SCRIPTS = ("half", "colour", "swatches")


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Swatch:
    """A material in the index.

    Parameters
    ----------
    name, source : str
    reflectance : array (C,)
    radius_mm : array (C,) [mm]
        The radius that holds 90 % of a channel's light.
    picture : array (H, W, 3)
        The lit head, exposed.
    """

    name: str
    source: str
    reflectance: FloatArray
    radius_mm: FloatArray
    picture: FloatArray


def swatch_of(material: Material, *, threads: int | None = None) -> Swatch:
    """Return a material's swatch: the head by the exact profile."""
    profile: Profile = true_profile(material, threads=threads)
    pitch = _MM_PER_PIXEL
    view = {"mm_per_pixel": pitch, "distance_mm": distance_of(pitch)}
    scene = make_scene("head", height=_SIDE, width=_SIDE, **view)
    truth = render_reference(scene, profile, threads=threads)
    shown = truth * auto_exposure(truth, scene.mask)
    return Swatch(
        material.name,
        material.source,
        profile.diffuse_reflectance,
        profile.energy_radii_mm([0.9])[0],
        np.broadcast_to(shown, (*shown.shape[:2], 3)),
    )


def library_page(
    materials: Iterable[Material],
    *,
    beside: Path | None = None,
    threads: int | None = None,
    progress: Callable[[int, int, str], None] | None = None,
) -> str:
    """Return an HTML page with a swatch of each material.

    Parameters
    ----------
    materials : iterable of Material
    beside : Path, optional
        The folder of the page; names of materials link to pages of ours that are in it.
    threads : int, optional
    progress : callable, optional
        Called with how many materials are done, of how many, and the name of the next.

    Raises
    ------
    SimulationError
        A material is not one half space.
    """
    wanted = list(materials)
    found = []
    for done, each in enumerate(wanted):
        if progress is not None:
            progress(done, len(wanted), each.name)
        found.append(swatch_of(each, threads=threads))
    data = {"swatches": [packed_picture(each.picture) for each in found]}
    return rendered(
        "library.html",
        script=script_text(_SCRIPTS),
        title="materials",
        data=data_text(data),
        swatches=found,
        linked=_linked(found, beside),
    )


def _linked(swatches: list[Swatch], beside: Path | None) -> set[str]:
    """Return the names of the materials that have a page of ours in a folder."""
    if beside is None:
        return set()
    return {each.name for each in swatches if is_report_file(beside / f"{each.name}.html")}
