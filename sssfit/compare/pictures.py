"""The picture error for the artist's fit: the mean Delta E of three coarse pictures.

``fit_artist(profile, target=picture_error)`` fits three numbers a channel to what is seen of a
disk, an edge and a lit head. They are coarse, so that a kernel is judged in some milliseconds: for
skin1 in pixels of .9 mm, whose optimum is that of pixels of .3 mm within 1 % of its Delta E.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from sssfit.arrays import BoolArray, FloatArray
from sssfit.compare._panels import check_colours
from sssfit.fit._target import Target
from sssfit.fit.artist import artist_pass
from sssfit.measure.delta_e import delta_e_2000
from sssfit.measure.score import auto_exposure
from sssfit.profile import Profile
from sssfit.render.borders import source_indices
from sssfit.render.reference import render_reference
from sssfit.scene.made import make_scene
from sssfit.scene.record import Scene

PIXELS = 67  # rows and columns: 60 mm of skin1, between the eyes and the mouth
_SUPPORT_PIXELS = 24  # at most so many make up the half width of a kernel


def picture_error(pixels: Target) -> Callable[[FloatArray], float]:
    """Return what judges the artist's kernel of a profile on a disk, an edge and a head.

    Parameters
    ----------
    pixels : Target
        Of the kernel. The pictures have its pixels, or wider ones of a 24th of its support.

    Returns
    -------
    callable
        From (w, log v_near, log v_far) by channel (3, C) to the mean over the pictures of the mean
        CIE Delta E 2000 against the profile's 2D kernel, at the exposure that `measure` takes. The
        head is left out where a pixel is so wide that none shows it.

    Raises
    ------
    RenderError
        The profile has 2 channels, or more than 3: there is no colour to look at.
    """
    check_colours("the profile", pixels.profile.n_channels)
    support_mm = pixels.half_pixels * pixels.mm_per_pixel
    coarse_mm = max(pixels.mm_per_pixel, support_mm / _SUPPORT_PIXELS)
    target = Target(pixels.profile, coarse_mm, int(support_mm / coarse_mm + 1e-9))
    pictures = [_prepare(pixels.profile, target.half_pixels, *each) for each in _scenes(coarse_mm)]
    truth = np.concatenate([each.truth for each in pictures])
    shares = np.concatenate([np.full(len(each.truth), 1.0 / len(each.truth)) for each in pictures])

    def error(x: FloatArray) -> float:
        passes = [artist_pass(target, c, each) for c, each in enumerate(x.T)]
        shown = np.concatenate([each.rendered(passes) for each in pictures])
        return float(shares @ delta_e_2000(shown, truth)) / len(pictures)

    return error


@dataclass(frozen=True, slots=True, eq=False)
class _Picture:
    """A scene, and its true pixels.

    Parameters
    ----------
    irradiance : array (H, W)
    down, across : array (h+1, H, H), (h+1, W, W)
        How often weight i of a pass takes a pixel's light from another, with mirrored borders: over
        so small a picture a pass is a matrix, and needs no threads.
    counted : array (H, W)
        Which pixels count, N.
    truth : array (N, C)
        Exposed.
    exposure : float
    """

    irradiance: FloatArray
    down: FloatArray
    across: FloatArray
    counted: BoolArray
    truth: FloatArray
    exposure: float

    def rendered(self, passes: list[FloatArray]) -> FloatArray:
        """Return the pixels that count (N, C), exposed, by a pass (h+1,) for every channel."""
        pictures = [
            np.tensordot(half, self.down, 1)
            @ self.irradiance
            @ np.tensordot(half, self.across, 1).T
            for half in passes
        ]
        return self.exposure * np.stack([each[self.counted] for each in pictures], axis=1)


def _scenes(mm_per_pixel: float) -> Iterator[tuple[Scene, BoolArray]]:
    """Yield the pictures and which pixels count: no more than tell, since Delta E takes longest."""

    def made(name: str, height: int = PIXELS, radius_mm: float | None = None) -> Scene:
        own = {} if radius_mm is None else {"radius_mm": radius_mm}
        return make_scene(name, height=height, width=PIXELS, mm_per_pixel=mm_per_pixel, **own)

    quarter = np.arange(PIXELS) <= PIXELS // 2
    disk = made("disk", radius_mm=0.25 * PIXELS * mm_per_pixel)
    yield disk, np.outer(quarter, quarter)  # the others are mirrored
    yield made("edge", height=1), np.ones((1, PIXELS), np.bool_)  # all rows are alike
    head = made("head")
    if head.mask is not None and (head.mask > 0).any():
        yield head, head.mask > 0


def _prepare(profile: Profile, half_pixels: int, scene: Scene, counted: BoolArray) -> _Picture:
    """Render the truth of a picture and prepare its passes."""
    truth = render_reference(scene, profile)
    exposure = auto_exposure(truth, scene.mask)
    return _Picture(
        np.asarray(scene.irradiance[..., 0], dtype=np.float64),
        _takes(scene.height, half_pixels),
        _takes(scene.width, half_pixels),
        counted,
        exposure * truth[counted],
        exposure,
    )


def _takes(size: int, half_pixels: int) -> FloatArray:
    """Return how often weight i takes the light of pixel k to pixel j, as [i, j, k]."""
    sources = source_indices(size, half_pixels, "mirror")
    counts = np.zeros((half_pixels + 1, size, size))
    here = np.arange(size)
    for place in range(-half_pixels, half_pixels + 1):
        counts[abs(place), here, sources[half_pixels + place + here]] += 1.0
    return counts
