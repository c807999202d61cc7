"""What every stress works on: a material's exact profile, its kernels, and what pictures show.

Errors are the 99th percentile of Delta E 2000 over the pixels of a picture, the mean over two
pictures: a disk, and points of light, which show every fetch of a kernel.
"""

import functools
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import SssfitError
from sssfit.fit import fit_separable, fit_taps
from sssfit.fit.on_taps import on_taps
from sssfit.kernel import Kernel
from sssfit.material import Material
from sssfit.measure.delta_e import delta_e_2000, exposure_of
from sssfit.methods import TAPS
from sssfit.process import thread_count
from sssfit.profile import Profile
from sssfit.render import render
from sssfit.render.reference import render_reference
from sssfit.scene.made import make_scene
from sssfit.scene.record import Scene

PICTURES = ("disk", "points")
SIDE = 96  # pixels of a picture
_PERCENT = 99.0

_Given = TypeVar("_Given")
_Found = TypeVar("_Found")


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """A method with its settings, as charts name it."""

    label: str
    method: str
    settings: Mapping[str, Any]
    taps: int | None = None

    def fit(self, profile: Profile, mm_per_pixel: float, **given: Any) -> Kernel:
        """Fit a profile.

        Raises
        ------
        SssfitError
            The fit is refused.
        """
        settings = {"mm_per_pixel": mm_per_pixel, **self.settings, **given}
        if self.method in TAPS:
            return fit_taps(profile, self.method, **settings).kernel
        kernel = fit_separable(profile, self.method, **settings).kernel
        return kernel if self.taps is None else on_taps(kernel, self.taps)


@functools.cache  # the same object, so that stresses share the kernel that `Subject` keeps of it
def cascade(fetches: int) -> Way:
    """Return the cascade of a budget."""
    return Way(f"cascade {fetches}", "cascade", {"fetches": fetches})


CASCADE = cascade(24)
# The cascade and the published methods, side by side in every stress that has room for them.
WAYS = (
    Way("pre-integrated", "preintegrated", {}),
    Way("artist", "artist", {}),
    Way("guided", "guided", {"k": 2.0}),
    Way("svd 1", "svd", {"rank": 1}),
    Way("svd 3", "svd", {"rank": 3}),
    Way("gaussians 4", "gaussians", {"terms": 4}),
    Way("gaussians 6", "gaussians", {"terms": 6}),
    CASCADE,
)


@dataclass(frozen=True, slots=True, eq=False)
class Subject:
    """A material under stress.

    Parameters
    ----------
    name : str
    profile : Profile
        Exact, or the one that was given.
    mm_per_pixel : float [mm]
    seed : int
    threads : int, optional
    is_whole : bool
        Whether cascades have as many seeds and sizes as the others.
    """

    name: str
    profile: Profile
    mm_per_pixel: float
    seed: int = 1
    threads: int | None = None
    is_whole: bool = False

    @property
    def material(self) -> Material | None:
        """What the profile is of, if it says."""
        return self.profile.material

    def each(self, work: Callable[[_Given], _Found], given: Iterable[_Given]) -> list[_Found]:
        """Run work on all threads; the result does not depend on them."""
        with ThreadPoolExecutor(thread_count(self.threads)) as pool:
            return list(pool.map(work, given))

    def true_kernel(self, way: Way) -> Kernel:
        """Return a method's kernel of the profile itself, on the subject's pixels."""
        return _fitted(self, way)

    def scenes(self, mm_per_pixel: float | None = None) -> Sequence[Scene]:
        """Return the pictures on pixels of a size."""
        pitch = self.mm_per_pixel if mm_per_pixel is None else mm_per_pixel
        return _scenes(pitch)

    def error(
        self, kernel: Kernel, truths: Sequence[FloatArray], mm_per_pixel: float | None = None
    ) -> float:
        """Return what a kernel's pictures show beside others of the same scenes.

        On the kernel's own pixels, or on those of a size.
        """
        scenes = self.scenes(kernel.mm_per_pixel if mm_per_pixel is None else mm_per_pixel)
        pairs = zip(scenes, truths, strict=True)
        return float(np.mean([error_of(shown(kernel, scene), true) for scene, true in pairs]))

    def changes(self, way: Way, profiles: Iterable[Profile]) -> FloatArray:
        """Return what kernels of other profiles show beside that of the subject's own (N,).

        Infinite where a fit is refused.
        """
        wanted = self.shows(self.true_kernel(way))

        def change(profile: Profile) -> float:
            return attempted(lambda: self.error(way.fit(profile, self.mm_per_pixel), wanted))

        return np.array(self.each(change, profiles))

    def truths(self, mm_per_pixel: float | None = None) -> list[FloatArray]:
        """Return the pictures of the profile's own 2D kernel."""
        scenes = self.scenes(mm_per_pixel)
        return [render_reference(each, self.profile, threads=1) for each in scenes]

    def shows(self, kernel: Kernel) -> list[FloatArray]:
        """Return the pictures of a kernel."""
        return [shown(kernel, each) for each in self.scenes(kernel.mm_per_pixel)]


@functools.lru_cache(maxsize=64)
def _fitted(subject: Subject, way: Way) -> Kernel:
    return way.fit(subject.profile, subject.mm_per_pixel)


@functools.lru_cache(maxsize=64)
def _scenes(mm_per_pixel: float) -> Sequence[Scene]:
    return tuple(
        make_scene(each, height=SIDE, width=SIDE, mm_per_pixel=mm_per_pixel) for each in PICTURES
    )


def shown(kernel: Kernel, scene: Scene) -> FloatArray:
    """Return a picture by a kernel, on one thread."""
    return np.asarray(render(scene, kernel, threads=1), dtype=np.float64)


def error_of(picture: FloatArray, truth: FloatArray) -> float:
    """Return the 99th percentile of Delta E 2000, at the truth's exposure."""
    ours, true = as_colours(picture), as_colours(truth)
    return float(np.percentile(delta_e_2000(ours, true, exposure_of(true)), _PERCENT))


def as_colours(picture: FloatArray) -> FloatArray:
    """Return pixels (N, 3) or (N, 1): of any channels the first three, of two the first."""
    shown_channels = 3 if picture.shape[-1] >= 3 else 1
    return picture[..., :shown_channels].reshape(-1, shown_channels)


def attempted(work: Callable[[], float]) -> float:
    """Return a measure, infinite where the library refuses in words."""
    try:
        return work()
    except SssfitError:
        return np.inf
