"""Pictures beside their differences, and the picture error for the artist's fit.

``fit_artist(profile, target=picture_error)`` fits three numbers a channel to what is seen of a
disk, an edge and a lit head: the mean Delta E of three pictures. They are coarse, so that a kernel
is judged in some milliseconds: for skin1 in pixels of .9 mm, whose optimum is that of pixels of .3
mm within 1 % of its Delta E.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sssfit.arrays import BoolArray, FloatArray, ReadOnly
from sssfit.errors import RenderError
from sssfit.fit._target import Target
from sssfit.fit.artist import artist_pass
from sssfit.formats.colours import srgb_encode
from sssfit.measure.delta_e import delta_e_of_lab, lab, shown
from sssfit.measure.score import ImageScore, auto_exposure, measure
from sssfit.profile import Profile
from sssfit.render.borders import source_indices
from sssfit.render.reference import render_reference
from sssfit.scene.made import make_scene
from sssfit.scene.record import Scene

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # Y of linear sRGB, IEC 61966-2-1
_COLOURS = (1, 3)
# CIE 1976: L = 116 Y^(1/3) - 16 above the joint, linear below.
_JOINT, _SLOPE = (6.0 / 29.0) ** 3, (29.0 / 3.0) ** 3


@dataclass(frozen=True, slots=True, eq=False)
class Panel(ReadOnly):
    """A picture as a display shows it, and its distance from the true one.

    Parameters
    ----------
    codes : array (H, W, 3)
        sRGB codes, 0 to 1, at the truth's exposure.
    difference : array (H, W)
        CIE lightness L* shown less that of the truth, -100 to 100; 0 outside the scene's mask.
        Not luminance: light leaks into shadows, where eyes and Delta E tell small steps apart.
    score : ImageScore
        Score of the picture against the truth, within the mask.
    """

    codes: FloatArray
    difference: FloatArray
    score: ImageScore

    def __post_init__(self) -> None:
        for array in (self.codes, self.difference):
            array.setflags(write=False)


def make_panel(
    picture: FloatArray,
    truth: FloatArray,
    *,
    exposure: float,
    mask: npt.NDArray[np.int32] | None = None,
    counts: npt.NDArray[np.int32] | None = None,
    shown_part: tuple[slice, slice] = (slice(None), slice(None)),
) -> Panel:
    """Compare a picture (H, W, C) with a truth; C is 1 (grey) or 3.

    ``mask`` (H, W) is the outline outside which no difference is drawn, ``counts`` the pixels that
    the score is of, the mask's by default. Only ``shown_part`` of rows and columns is drawn.

    Raises
    ------
    RenderError
        As `measure`.
    """
    score = measure(picture, truth, exposure=exposure, mask=mask if counts is None else counts)
    ours, true = (shown(each, exposure) for each in (picture, truth))
    difference = lightness(ours) - lightness(true)
    if mask is not None:
        difference = np.where(mask > 0, difference, 0.0)
    return Panel(srgb_encode(ours[shown_part]), difference[shown_part], score)


def lightness(linear: FloatArray) -> FloatArray:
    """Return CIE 1976 L*, 0 to 100, of linear sRGB (..., 3)."""
    y: FloatArray = linear @ _LUMINANCE
    above = 116.0 * np.cbrt(np.maximum(y, _JOINT)) - 16.0
    found: FloatArray = np.where(y > _JOINT, above, _SLOPE * y)
    return found


def check_colours(name: str, channels: int) -> None:
    """Refuse what a display cannot show."""
    if channels not in _COLOURS:
        raise RenderError(
            f"{name} has {channels} channels; expected 1 (grey) or 3 (red, green, blue) to look at."
        )


PIXELS = 67  # rows and columns: 60 mm of skin1, between the eyes and the mouth
_SUPPORT_PIXELS = 24  # at most so many make up the half width of a kernel


def picture_error(pixels: Target) -> Callable[[FloatArray], float]:
    """Return what judges the artist's kernel of a profile on a disk, an edge and a head.

    Parameters
    ----------
    pixels : Target
        Pixels of the kernel. The pictures have the same, or wider ones of a 24th of its support.

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
    pictures = [_prepare(pixels.profile, *each) for each in _scenes(coarse_mm)]
    sizes = {size for each in pictures for size in each.irradiance.shape}
    takes = {size: _takes(size, target.half_pixels) for size in sizes}
    truth = np.concatenate([each.truth for each in pictures])
    shares = np.concatenate([np.full(len(each.truth), 1.0 / len(each.truth)) for each in pictures])

    true = lab(shown(truth))

    def error(x: FloatArray) -> float:
        passes = [artist_pass(target, c, each) for c, each in enumerate(x.T)]
        matrices = {
            size: [np.tensordot(half, own, 1) for half in passes] for size, own in takes.items()
        }
        seen = np.concatenate([each.rendered(matrices) for each in pictures])
        return float(shares @ delta_e_of_lab(lab(shown(seen)), true)) / len(pictures)

    return error


@dataclass(frozen=True, slots=True, eq=False)
class _Picture:
    """A scene, and its true pixels.

    Parameters
    ----------
    irradiance : array (H, W)
    counted : array (H, W)
        True for the N pixels that count.
    truth : array (N, C)
        Exposed.
    exposure : float
    """

    irradiance: FloatArray
    counted: BoolArray
    truth: FloatArray
    exposure: float

    def rendered(self, matrices: Mapping[int, list[FloatArray]]) -> FloatArray:
        """Return the pixels that count (N, C), exposed.

        Over so small a picture a pass is a matrix, and needs no threads. Given are those of every
        channel, by the size of a picture.
        """
        down, across = (matrices[size] for size in self.irradiance.shape)
        pictures = [y @ self.irradiance @ x.T for y, x in zip(down, across, strict=True)]
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


def _prepare(profile: Profile, scene: Scene, counted: BoolArray) -> _Picture:
    """Render the truth of a picture."""
    truth = render_reference(scene, profile)
    exposure = auto_exposure(truth, scene.mask)
    return _Picture(
        np.asarray(scene.irradiance[..., 0], dtype=np.float64),
        counted,
        exposure * truth[counted],
        exposure,
    )


def _takes(size: int, half_pixels: int) -> FloatArray:
    """Return how often weight i takes the light of pixel k to pixel j, mirrored, as [i, j, k]."""
    sources = source_indices(size, half_pixels, "mirror")
    counts = np.zeros((half_pixels + 1, size, size))
    here = np.arange(size)
    for place in range(-half_pixels, half_pixels + 1):
        counts[abs(place), here, sources[half_pixels + place + here]] += 1.0
    return counts
