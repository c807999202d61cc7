"""A kernel on a picture, compared with the truth: what it shows, loses and costs."""

import functools
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from sssfit.arrays import FloatArray, plain
from sssfit.errors import RenderError
from sssfit.formats.pictures import image_format, save_image
from sssfit.kernel import Kernel, Taps
from sssfit.measure.asymmetry import radial_asymmetry
from sssfit.measure.cost import Cost, cost_of, seconds_per_megapixel
from sssfit.measure.difference import DifferenceMap, difference_map
from sssfit.measure.score import SCORE_FIGURES, ImageScore, auto_exposure, measure
from sssfit.messages import note
from sssfit.profile import Profile, full_kernel
from sssfit.render import render
from sssfit.render.reference import render_reference
from sssfit.render.screen import render_screen
from sssfit.render.screen_taps import render_screen_taps
from sssfit.render.taps import reach_pixels, response
from sssfit.render.transmittance import transmitted, with_transmitted
from sssfit.scene.record import Scene

_FROM_PIXELS = 4  # skin1's round kernel has .06 from the first circle on, .003 from the fourth on
_CORNER = 8  # pixels
_QUICK_SECONDS = 0.5  # a picture rendered faster is timed again, since other programs disturb it


@dataclass(frozen=True, slots=True, eq=False)
class Evaluation:
    """A rendered picture with its score and price.

    Parameters
    ----------
    scene : Scene
        What was lit; with the light that came through it, where that was asked for.
    kernel : SeparableKernel or Taps
    picture : array (H, W, C)
        Radiant exitance by the kernel; black outside the scene's mask, where it has one: a flat
        kernel carries light past an outline.
    truth : array (H, W, C), optional
        The same by the profile's 2D kernel; None where there is no profile.
    score : ImageScore, optional
        Score of the picture against the truth; within the scene's mask, where it has one.
    cost : Cost
        Cost of the kernel, with measured seconds.
    asymmetry, true_asymmetry : array (C,)
        `radial_asymmetry` of the kernel, and of the profile's on the same pixels: round kernels
        whose light lies within a few pixels have much of it, since pixels are square. NaN where
        kernel or profile do not say.
    transmitted_maximum : array (C,), optional
        The most that comes through the object, where that was asked for.
    difference : DifferenceMap, optional
        Difference of picture and truth, by `with_difference`.
    """

    scene: Scene
    kernel: Kernel
    picture: FloatArray
    truth: FloatArray | None
    score: ImageScore | None
    cost: Cost
    asymmetry: FloatArray
    true_asymmetry: FloatArray
    transmitted_maximum: FloatArray | None = None
    difference: DifferenceMap | None = None

    def with_difference(self, kind: str | None = None, gain: float = 1.0) -> "Evaluation":
        """Add the difference from the truth, as `difference_map` draws it."""
        if self.truth is None:
            raise RenderError("there is no truth to differ from; give the kernel's profile.")
        drawn = difference_map(self.picture, self.truth, kind=kind, gain=gain)
        return replace(self, difference=drawn)

    def to_dict(self) -> dict[str, Any]:
        """Return the figures that ``sssfit render --json`` prints; None: not measured."""
        scene, kernel = self.scene, self.kernel
        score = dict.fromkeys(SCORE_FIGURES) if self.score is None else self.score.to_dict()
        keys = ("gain", "map", "of", "end")
        lost = self.difference.figures() if self.difference else dict.fromkeys(keys)
        return plain(
            {
                "material": kernel.meta.get("material"),
                "method": kernel.method,
                "rank": None if isinstance(kernel, Taps) else kernel.rank,
                "channels": list(kernel.channels),
                "irradiance": scene.name,
                "width": scene.width,
                "height": scene.height,
                "mm_per_pixel": scene.mm_per_pixel,
                **asdict(self.cost),
                "transmitted_maximum": self.transmitted_maximum,
                "radial_asymmetry": self.asymmetry,
                "true_radial_asymmetry": self.true_asymmetry,
                **score,
                **{f"difference_{key}": each for key, each in lost.items()},
            }
        )

    def save(
        self, targets: Mapping[str, Path | BinaryIO], *, exposure: float | None = None
    ) -> None:
        """Write the pictures; what is to be known of the files is noted.

        Parameters
        ----------
        targets : mapping of str to path or stream
            Where to write "picture", "truth" and "difference"; a stream is given EXR.
        exposure : float, optional
            Exposure of PNG files; by default the one that Delta E was measured at.

        Raises
        ------
        RenderError, FileError
            There is no truth or difference, or as `save_image`.
        """
        pixels = {"picture": self.picture, "truth": self.truth}
        pixels["difference"] = None if self.difference is None else self.difference.pixels
        own = self.score.exposure if self.score else auto_exposure(self.picture)
        alpha = self._alpha()
        for what, target in targets.items():
            image = pixels[what]
            if image is None:
                raise RenderError(f"there is no {what} to write; give the kernel's profile.")
            is_light = what != "difference"
            is_map = not is_light and self.difference and self.difference.kind
            form = image_format(target) if isinstance(target, Path) else "exr"
            settings: dict[str, Any] = {
                "channels": self.kernel.channels if form == "exr" and not is_map else None,
                "format": form,
                "mm_per_pixel": self.scene.mm_per_pixel,
                **(alpha if is_light else {}),
            }
            if form == "png" and not is_map:  # false colours are no light
                settings["exposure"] = exposure or own
            for each in save_image(target, image, **settings):
                note(f"{target}: {each}")

    def _alpha(self) -> dict[str, Any]:
        """Return what `save_image` takes of the scene's alpha, where a file can hold it."""
        if self.scene.alpha is None:
            return {}
        channels = self.kernel.channels
        if len(channels) not in (1, 3) or "A" in channels:
            note(f"alpha left out beside the channels {', '.join(channels)}")
            return {}
        multiplied = self.scene.alpha_is_multiplied
        return {"alpha": self.scene.alpha, "alpha_is_multiplied": multiplied}


def evaluate(
    scene: Scene,
    kernel: Kernel,
    profile: Profile | None = None,
    *,
    truth: FloatArray | None = None,
    transmit: bool = False,
    border: str = "mirror",
    exposure: float | None = None,
    structure: bool = False,
    intermediate: str | None = None,
    is_timed: bool = True,
    threads: int | None = None,
) -> Evaluation:
    """Render a scene with a kernel and with a profile's 2D kernel, and compare.

    Parameters
    ----------
    scene : Scene
        Flat: its depth is not looked at.
    kernel : SeparableKernel or Taps
        On the scene's pixels; a table of taps serves others, too.
    profile : Profile, optional
        What the truth is made from; without it nothing is measured but the cost.
    truth : array (H, W, C), optional
        Rendered already, as `render_reference` does it with this border; no profile is needed then.
    transmit : bool
        Add the light that the kernel lets through the scene's objects, by `with_transmitted`.
    border, threads
        As `render_separable`.
    exposure, structure
        As `measure`.
    intermediate
        As `render_taps`, for tables of taps.
    is_timed : bool
        Measure the kernel's seconds, for which it is rendered several times.

    Raises
    ------
    RenderError
        The kernel does not fit the scene or the profile, or as `measure`.
    """
    scene = scene.for_channels(kernel.channels)
    through = None
    if transmit:
        through = _most_through(scene, kernel)
        scene = with_transmitted(scene, kernel)
    settings = {"border": border, "threads": threads, **_between_passes(kernel, intermediate)}

    def shown(lit: Scene) -> FloatArray:
        return np.asarray(render(lit, kernel, **settings), dtype=np.float64)

    picture, seconds = timed(shown, scene) if is_timed else (shown(scene), None)
    if truth is None and profile is not None:
        _check_channels(kernel, profile)
        truth = render_reference(scene, profile, border=border, threads=threads)
    score = None
    if truth is not None:
        score = measure(picture, truth, exposure=exposure, mask=scene.mask, structure=structure)
        truth = _within(scene, truth)
    return Evaluation(
        scene,
        kernel,
        _within(scene, picture),
        truth,
        score,
        cost_of(kernel, seconds),
        asymmetry_of(kernel),
        true_asymmetry(kernel, profile),
        through,
    )


def _between_passes(kernel: Kernel, intermediate: str | None) -> dict[str, str]:
    """Return the setting of the format between passes, where one is given and the kernel fits."""
    if intermediate is not None and not isinstance(kernel, Taps):
        raise RenderError(
            f'`intermediate = "{intermediate}"` is for tables of taps, and this is a separable '
            "kernel; leave it out."
        )
    return {} if intermediate is None else {"intermediate": intermediate}


def _most_through(scene: Scene, kernel: Kernel) -> FloatArray | None:
    """Return the most light that arrives through the object (C,)."""
    arrives = transmitted(scene, kernel)
    if arrives is None:
        return None
    if not arrives.any():
        note(
            f"{scene.name}: nothing goes through, since no part in the picture is both lit from "
            "behind and thin enough. With a larger `size` the made head shows its ears."
        )
    most: FloatArray = arrives.max(axis=(0, 1))
    return most


def _within(scene: Scene, picture: FloatArray) -> FloatArray:
    """Leave a picture black outside the scene's objects."""
    return picture if scene.mask is None else np.where(scene.mask[..., None] > 0, picture, 0.0)


def _check_channels(kernel: Kernel, profile: Profile) -> None:
    """Refuse a profile of other channels than the kernel's."""
    if kernel.channels != profile.channels:
        raise RenderError(
            f"the kernel has the channels {', '.join(kernel.channels)} and the profile "
            f"{', '.join(profile.channels)}; give the profile that the kernel was fitted to."
        )


@functools.lru_cache(maxsize=4)  # a comparison asks once for every picture
def asymmetry_of(kernel: Kernel) -> FloatArray:
    """`radial_asymmetry` of each channel's 2D kernel (C,), from the fourth circle on.

    Nearer circles see the squareness of pixels. NaN where the kernel does not reach that far.
    """
    return _asymmetry(_responses(kernel))


def _responses(kernel: Kernel) -> list[FloatArray]:
    """Return the 2D kernel (P, P) of each channel; of a table of taps what one point becomes."""
    if isinstance(kernel, Taps):
        seen = response(kernel)
        return [seen[:, :, c] for c in range(seen.shape[2])]
    return [kernel.full(c) for c in range(len(kernel.channels))]


def _half_pixels(kernel: Kernel) -> int:
    return reach_pixels(kernel) if isinstance(kernel, Taps) else kernel.half_pixels


def true_asymmetry(kernel: Kernel, profile: Profile | None) -> FloatArray:
    """Return the same of the profile's own kernel on the kernel's pixels."""
    if profile is None:
        return np.full(len(kernel.channels), np.nan)
    quadrants = profile.quadrant_kernel(kernel.mm_per_pixel, _half_pixels(kernel))
    return _asymmetry([full_kernel(quadrants[:, :, c]) for c in range(quadrants.shape[2])])


def _asymmetry(kernels: Sequence[FloatArray]) -> FloatArray:
    """Return `radial_asymmetry` of 2D kernels (P, P) from the fourth circle on."""
    if len(kernels[0]) // 2 < _FROM_PIXELS:
        return np.full(len(kernels), np.nan)
    return np.array([radial_asymmetry(each, from_pixels=_FROM_PIXELS) for each in kernels])


def timed(render: Callable[[Scene], FloatArray], scene: Scene) -> tuple[FloatArray, float]:
    """Render a scene; the picture, and seconds per 1e6 pixels without compiling.

    A corner goes first, which compiles what is yet to be. Quick renderers are timed three times
    more, and the least counts.
    """
    render(scene.corner(_CORNER))
    begun = time.perf_counter()
    picture = render(scene)
    seconds = time.perf_counter() - begun
    pixels = scene.height * scene.width
    if seconds < _QUICK_SECONDS:
        return picture, seconds_per_megapixel(lambda: render(scene), pixels, repeats=3)
    return picture, seconds * 1e6 / pixels


def evaluate_in_screen_space(
    scene: Scene,
    kernel: Kernel,
    *,
    transmit: bool = False,
    follow: str = "gaussian",
    border: str = "mirror",
    intermediate: str | None = None,
    threads: int | None = None,
) -> Evaluation:
    """Render a scene as a shader does; in perspective there is no truth to compare it with.

    Parameters and errors are those of `render_screen`, for a table of taps of `render_screen_taps`.
    They add the light through a scene that has any; ``transmit`` says how much that is.
    """
    settings: dict[str, Any] = {"follow": follow, "border": border, "threads": threads}
    settings |= _between_passes(kernel, intermediate)
    through = _most_through(scene, kernel) if transmit else None

    def rendered(shown: Scene) -> FloatArray:
        if isinstance(kernel, Taps):
            return np.asarray(render_screen_taps(shown, kernel, **settings), dtype=np.float64)
        return render_screen(shown, kernel, **settings)

    picture, seconds = timed(rendered, scene)
    cost, asymmetry = cost_of(kernel, seconds), asymmetry_of(kernel)
    unknown = true_asymmetry(kernel, None)
    return Evaluation(scene, kernel, picture, None, None, cost, asymmetry, unknown, through)
