"""What a choice is judged on: the head at its distance, and wider views around a close-up."""

import math
from collections.abc import Sequence

import numpy as np

from sssfit.compare._choose_options import Option
from sssfit.compare.metrics import measure
from sssfit.errors import RenderError
from sssfit.fit import FitResult
from sssfit.profile import Profile
from sssfit.render.irradiance import make_scene
from sssfit.render.reference import convolve, render_reference
from sssfit.render.scene import FloatArray, Scene
from sssfit.render.separable import render_separable

MOST_PIXELS = 512  # of a picture, along an edge
# Middle of the head on which most is lost: mean Delta E of the pre-integrated skin1, and no blur:
# 25 mm .17, 2.9; 51 mm .27, 3.1; 64 mm .34, 3.6; 76 mm .31, 3.6; 102 mm .25, 2.7; 203 mm .20, 2.2.
# Between 64 and 88 mm materials differ (apple: 64 mm .311, 72 .300, 80 .315, 88 .311, 96 .284), and
# with 64 mm alone apple's cost rose from 514 to 760 weights from .10 to .15 m at a tolerance of .3.
HARDEST_MM = (64.0, 80.0, 88.0)
# Share of the tolerance that these may have: a kernel that just holds on one of them need not hold
# on a view in between, which is up to 4 % worse.
WIDER = 0.95


def mm_per_pixel_at(distance_mm: float, fov_degrees: float, rows: int) -> float:
    """Return the size of a pixel on the plane at a distance [mm]: 2 d tan(fov / 2) / rows.

    Parameters
    ----------
    distance_mm : float [mm]
        From the eye.
    fov_degrees : float [degrees]
        Vertical field of view, of which half lies above the middle: above 0, below 180.
    rows : int
        Of the frame.

    Raises
    ------
    RenderError
        A value out of its range.

    Examples
    --------
    >>> round(mm_per_pixel_at(600.0, 30.0, 1080), 4)
    0.2977
    """
    if not (math.isfinite(distance_mm) and distance_mm > 0.0):
        raise RenderError(f"distance = {distance_mm:g} mm; expected a length above 0.")
    if not 0.0 < fov_degrees < 180.0:
        raise RenderError(
            f"field of view = {fov_degrees:g} degrees; expected an angle between 0 and 180."
        )
    if rows < 1:
        raise RenderError(f"{rows} rows; expected at least 1.")
    return 2.0 * distance_mm * math.tan(math.radians(fov_degrees / 2.0)) / rows


class Views:
    """Pictures with their truths, each made when it is first looked at.

    Parameters
    ----------
    profile : Profile
        Of the truth.
    scenes : list of Scene
        The first is what was asked for.
    threads : int, optional
    """

    def __init__(self, profile: Profile, scenes: Sequence[Scene], threads: int | None) -> None:
        self.profile, self.scenes, self.threads = profile, scenes, threads
        self._truths: dict[int, FloatArray] = {}

    def score_of_option(
        self,
        option: Option | None,
        tolerance: float,
        profile: Profile | None = None,
        *,
        wider: float = WIDER,
    ) -> tuple[float, float, float, bool]:
        """Return Delta E mean, 99th percentile and pitch [mm] of the worst view, and if it will do.

        No option is no blur. Looks no further once a view is out of tolerance, of which the wider
        ones have the share ``wider``. ``profile`` is what is fitted, the truth's by default.
        """
        worst, within = (-1.0, 0.0, 0.0), True
        for k, scene in enumerate(self.scenes):
            fitted = _fitted(option, profile or self.profile, scene.mm_per_pixel)
            if fitted is None:
                picture = scene.irradiance * self.profile.diffuse_reflectance
            else:
                blurred = render_separable(scene, fitted.kernel, threads=self.threads)
                picture = np.asarray(blurred, dtype=np.float64)
            found = (*self._measured(k, picture), scene.mm_per_pixel)
            worst = max(worst, found)
            within = found[0] <= tolerance * (wider if k else 1.0)
            if not within:
                return *found, False
        return *worst, within

    def score_of_cut(self, half: int) -> float:
        """Delta E of the profile's own 2D kernel on 2h+1 pixels a side, with all its energy."""
        scene = self.scenes[0]
        quadrant = self.profile.quadrant_kernel(scene.mm_per_pixel, half)
        copies = np.where(np.arange(half + 1) == 0, 1.0, 2.0)
        energy = np.einsum("i,k,ikc->c", copies, copies, quadrant)
        lacking = self.profile.diffuse_reflectance / np.where(energy > 0.0, energy, 1.0)
        return self._measured(0, convolve(scene.irradiance, quadrant * lacking))[0]

    def _measured(self, k: int, picture: FloatArray) -> tuple[float, float]:
        """Return mean and 99th percentile of Delta E 2000 of a view."""
        scene = self.scenes[k]
        if k not in self._truths:
            self._truths[k] = render_reference(scene, self.profile, threads=self.threads)
        score = measure(picture, self._truths[k], mask=scene.mask)
        return score.delta_e_2000_mean, score.delta_e_2000_p99


def _fitted(option: Option | None, profile: Profile, mm_per_pixel: float) -> FitResult | None:
    return None if option is None else option.fit(profile, mm_per_pixel)


def head_scenes(
    mm_per_pixel: float, distance_mm: float, frame: tuple[int, int], threads: int | None
) -> list[Scene]:
    """Make the middle of a frame on the head; for a close-up, the wider views around it as well.

    Nearer than these the picture shows less and less of the eyes and their shadows, and less
    is lost on it; what is needed near would be less than what is needed farther out. So a close-up
    has to hold there too: at a greater distance, on larger pixels, with the same support in mm.
    """
    height, width = (min(each, MOST_PIXELS) for each in frame)
    seen_mm = min(height, width) * mm_per_pixel
    return [
        make_scene(
            "head",
            height=height,
            width=width,
            mm_per_pixel=mm_per_pixel * times,
            distance_mm=distance_mm * times,
            threads=threads,
        )
        for times in (1.0, *(wide_mm / seen_mm for wide_mm in HARDEST_MM if wide_mm > seen_mm))
    ]


def checked_scene(scene: Scene, mm_per_pixel: float) -> Scene:
    """Return the middle of a picture of one's own, or refuse what no choice can be made on.

    Raises
    ------
    RenderError
        Pixels of another size than those asked for, or one colour all over.
    """
    if abs(scene.mm_per_pixel - mm_per_pixel) > 1e-6 * mm_per_pixel:
        raise RenderError(
            f"{scene.name} has {scene.mm_per_pixel:.7g} mm per pixel, and distance, field of view "
            f"and resolution give {mm_per_pixel:.7g}; change one of them, or the picture."
        )
    rows, columns = (_middle(each) for each in (scene.height, scene.width))
    pixels = scene.irradiance[rows, columns]
    seen = pixels if scene.mask is None else pixels[scene.mask[rows, columns] > 0]
    seen = seen.reshape(-1, scene.channels)
    if len(seen) == 0 or not np.ptp(seen, axis=0).any():
        raise RenderError(
            f"{scene.name} is of one colour, and blurring it shows nothing; use a picture with "
            "edges, such as the head."
        )
    return Scene(
        scene.name,
        pixels,
        scene.mm_per_pixel,
        mask=None if scene.mask is None else scene.mask[rows, columns],
    )


def _middle(size: int) -> slice:
    """Return the middle 512 of so many pixels."""
    first = max(size - MOST_PIXELS, 0) // 2
    return slice(first, first + min(size, MOST_PIXELS))
