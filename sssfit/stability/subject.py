"""What every stress works on: a material's exact profile, its kernels, and what pictures show.

Errors are the 99th percentile of Delta E 2000 over the pixels of a picture, the mean over two
pictures: a disk, and points of light, which show every fetch of a kernel.
"""

import functools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import SssfitError
from sssfit.kernel import Kernel
from sssfit.material import Material
from sssfit.measure.delta_e import delta_e_of_lab, exposure_of, lab
from sssfit.measure.delta_e import shown as displayed
from sssfit.profile import Profile
from sssfit.render import render
from sssfit.render.reference import render_reference
from sssfit.scene.made import make_scene
from sssfit.scene.record import Scene
from sssfit.stability.ways import Way
from sssfit.stability.workers import Workers

PICTURES = ("disk", "points")
SIDE = 96  # pixels of a picture
_PERCENT = 99.0

_Given = TypeVar("_Given")
_Found = TypeVar("_Found")


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
        Threads of the exact solver.
    is_whole : bool
        Whether cascades are searched again for every walk and have as many sizes as the others.
    workers : Workers, optional
        What shares the work; without them it is done here.
    """

    name: str
    profile: Profile
    mm_per_pixel: float
    seed: int = 1
    threads: int | None = None
    is_whole: bool = False
    workers: Workers | None = None
    _kernels: dict[tuple[object, ...], Kernel | SssfitError] = field(default_factory=dict)

    @property
    def material(self) -> Material | None:
        """What the profile is of, if it says."""
        return self.profile.material

    def each(
        self, work: Callable[["Subject", _Given], _Found], given: Iterable[_Given]
    ) -> list[_Found]:
        """Return work(subject, each), by all workers; the result does not depend on them.

        Parameters
        ----------
        work : callable
            A function of a module, or a partial of one. Workers have a subject of their own, so
            kernels that all of them need are given along.
        given : iterable
            What takes longest comes first.
        """
        if self.workers is None:
            return [work(self, each) for each in given]
        return self.workers.each(work, given)

    def fit(
        self, way: Way, profile: Profile, mm_per_pixel: float | None = None, **given: Any
    ) -> Kernel:
        """Fit a profile, on the subject's pixels and from its seed.

        Raises
        ------
        SssfitError
            The fit is refused.
        """
        pitch = self.mm_per_pixel if mm_per_pixel is None else mm_per_pixel
        return way.fit(profile, pitch, **({"seed": self.seed} if way.is_seeded else {}), **given)

    def prepare(self, ways: Iterable[Way]) -> None:
        """Fit the profile itself by several methods at once, and keep their kernels or refusals."""
        missing = {each.key: each for each in ways if each.key not in self._kernels}
        self._kernels.update(zip(missing, self.each(_fitted, missing.values()), strict=True))

    def true_kernel(self, way: Way) -> Kernel:
        """Return a method's kernel of the profile itself, on the subject's pixels.

        Raises
        ------
        SssfitError
            The fit is refused.
        """
        self.prepare([way])
        found = self._kernels[way.key]
        if isinstance(found, SssfitError):
            raise found
        return found

    def true_kernels(self, ways: Iterable[Way]) -> dict[str, Kernel]:
        """Return them by the methods' labels, what takes longest given first."""
        ways = tuple(ways)
        self.prepare(ways)
        return {each.label: self.true_kernel(each) for each in ways}

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
        return float(np.mean(self.errors(kernel, truths, mm_per_pixel)))

    def errors(
        self, kernel: Kernel, truths: Sequence[FloatArray], mm_per_pixel: float | None = None
    ) -> list[float]:
        """Return it for each of `PICTURES`."""
        scenes = self.scenes(kernel.mm_per_pixel if mm_per_pixel is None else mm_per_pixel)
        return [
            error_of(shown(kernel, scene), true) for scene, true in zip(scenes, truths, strict=True)
        ]

    def changes(
        self, ways: Sequence[Way], series: Sequence[Sequence[Profile]], limit: float
    ) -> list[list[list[float]]]:
        """Return what kernels of other profiles show beside those of the subject's own.

        For each series of profiles, from good to bad, and each way: a list that ends behind the
        first profile whose measure exceeds the limit; infinite where a fit is refused.
        """
        kernels = self.true_kernels(ways)
        wanted = [(each, self.shows(kernels[each.label])) for each in ways]
        return self.each(functools.partial(_changes, wanted, limit), series)

    def truths(self, mm_per_pixel: float | None = None) -> list[FloatArray]:
        """Return the pictures of the profile's own 2D kernel."""
        return _truths(self, self.mm_per_pixel if mm_per_pixel is None else mm_per_pixel)

    def shows(self, kernel: Kernel) -> list[FloatArray]:
        """Return the pictures of a kernel."""
        return [shown(kernel, each) for each in self.scenes(kernel.mm_per_pixel)]


def _fitted(subject: Subject, way: Way) -> Kernel | SssfitError:
    try:
        return subject.fit(way, subject.profile)
    except SssfitError as error:
        return error


def _changes(
    wanted: Sequence[tuple[Way, list[FloatArray]]],
    limit: float,
    subject: Subject,
    profiles: Sequence[Profile],
) -> list[list[float]]:
    """Return what kernels of a series show, by way; sums of Gaussians begin with fewer."""
    found: list[list[float]] = [[] for _ in wanted]
    for profile in profiles:
        for own, each in zip(found, wanted, strict=True):
            if not own or own[-1] <= limit:
                own.append(attempted(functools.partial(_change, subject, profile, *each)))
    return found


def _change(subject: Subject, profile: Profile, way: Way, wanted: list[FloatArray]) -> float:
    return subject.error(subject.fit(way, profile), wanted)


@functools.lru_cache(maxsize=32)
def _truths(subject: Subject, mm_per_pixel: float) -> list[FloatArray]:
    scenes = subject.scenes(mm_per_pixel)
    return [render_reference(each, subject.profile, threads=1) for each in scenes]


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
    true = as_colours(truth)
    exposure, wanted = _as_seen(true.tobytes(), true.shape[1])
    colours = lab(displayed(as_colours(picture), exposure))
    return float(np.percentile(delta_e_of_lab(colours, wanted), _PERCENT))


@functools.lru_cache(maxsize=64)  # a truth serves up to a hundred pictures
def _as_seen(true: bytes, channels: int) -> tuple[float, FloatArray]:
    """Return the exposure and the colours `lab` of pixels."""
    pixels = np.frombuffer(true, dtype=np.float64).reshape(-1, channels)
    exposure = exposure_of(pixels)
    return exposure, lab(displayed(pixels, exposure))


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
