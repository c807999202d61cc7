"""A kernel sampled at random, each pixel as often as it asks: unbiased, noisy, a fetch a sample.

A sample draws an offset from the profile and fetches the irradiance of the pixel there. The annulus
comes from the energies of the flat annuli that pixels are integrated from, so the expected picture
is that of `sssfit.render.reference`, to rounding. One offset serves all channels: annuli are drawn
by the sum of the channels' energies, and a channel's weight is its energy over the probability, at
most the sum of the reflectances. In even light the samples of skin1 then have the variances .023,
.005, .008; drawn by shares of each channel's own energy, which favours blue, .078, .002, .004.

A frame remembers nothing here; `sssfit.motion.adaptive` decides the numbers of samples over time.
"""

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray, check_record, is_number, is_whole, read_only
from sssfit.errors import RenderError
from sssfit.formats.colours import as_light, positive
from sssfit.messages import shown
from sssfit.process import thread_count
from sssfit.profile import Profile
from sssfit.render.borders import check_memory, scene_for, source_indices
from sssfit.render.reference import far_irradiance, reference_half_pixels
from sssfit.scene.record import Scene

CountArray = npt.NDArray[np.int32]

LEAST_SAMPLES, MOST_SAMPLES = 1, 64
_ROWS = 8  # of a block: numbers of samples differ, so that small blocks keep threads busy
_LARGEST = 2**63 - 1  # of a seed or a frame


@dataclass(frozen=True, slots=True, eq=False)
class KernelSampler:
    """A profile on pixels of a size, ready to be sampled; `make_sampler` makes it.

    Parameters
    ----------
    profile : Profile
    mm_per_pixel : float [mm]
    cut : array (N,) of uint32
    other : array (N,) of int
        Walker's alias table of the annuli.
    squares : array (N, 2) [pixels^2]
        Squared inner radius of each annulus, and how much larger the squared outer one is.
    weights : array (N, C)
        Energy of an annulus over its probability.
    """

    profile: Profile
    mm_per_pixel: float
    cut: npt.NDArray[np.uint32]
    other: npt.NDArray[np.intp]
    squares: npt.NDArray[np.float32]
    weights: npt.NDArray[np.float32]


def make_sampler(profile: Profile, mm_per_pixel: float) -> KernelSampler:
    """Make the tables of a profile for pixels of a size.

    Raises
    ------
    RenderError
        The pixel size is not a length above 0.
    """
    check_record("profile", profile, Profile, RenderError)
    if not is_number(mm_per_pixel) or not 0.0 < mm_per_pixel < np.inf:
        raise RenderError(f"`mm_per_pixel = {shown(mm_per_pixel)}`; expected a length above 0.")
    edges_mm, density = profile.flat_annuli()
    squares = np.square(edges_mm / mm_per_pixel)
    energy = density * (np.pi * np.diff(np.square(edges_mm)))[:, None]
    # Imports and inversions may have annuli of less than no energy; their weights are negative.
    size = np.abs(energy).sum(axis=1)
    probability = size / size.sum() if size.any() else np.full(len(size), 1.0 / len(size))
    weights = np.divide(
        energy, probability[:, None], out=np.zeros_like(energy), where=probability[:, None] > 0.0
    )
    cut, other = alias_table(probability)
    pairs = np.stack((squares[:-1], np.diff(squares)), axis=1)
    return KernelSampler(
        profile, mm_per_pixel, cut, other, pairs.astype(np.float32), weights.astype(np.float32)
    )


def alias_table(
    probability: FloatArray,
) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.intp]]:
    """Return Walker's table for drawing one of N with these probabilities in one step.

    Walker 1977, "An efficient method for generating discrete random variables with general
    distributions"; filled as by Vose 1991. An even draw of k and of a fraction gives k where the
    fraction is below cut[k] / 2^32, else other[k].
    """
    scaled = probability * probability.size
    other = np.arange(probability.size)
    small = list(np.flatnonzero(scaled < 1.0))
    large = list(np.flatnonzero(scaled >= 1.0))
    while small and large:
        k, donor = small.pop(), large[-1]
        other[k] = donor
        scaled[donor] -= 1.0 - scaled[k]
        if scaled[donor] < 1.0:
            small.append(large.pop())
    for k in (*small, *large):  # what rounding leaves over
        scaled[k] = 1.0
    cut = np.minimum(np.floor(scaled * 2.0**32), 2.0**32 - 1.0).astype(np.uint32)
    return cut, other


def render_samples(
    scene: Scene,
    sampler: KernelSampler,
    counts: npt.ArrayLike,
    *,
    scale: npt.ArrayLike = 1.0,
    frame: int = 0,
    seed: int = 1,
    border: str = "mirror",
    threads: int | None = None,
) -> FloatArray:
    """Estimate the picture of the true kernel by samples.

    Parameters
    ----------
    scene : Scene
        A flat picture: only its irradiance and pixel size are used.
    sampler : KernelSampler
        A sampler for the scene's pixel size.
    counts : int or array (H, W) of int
        Samples of each pixel, 1 to 64; the mean of n samples has 1/n of the variance of one.
    scale : float or array (H, W)
        Factor of the radii that a pixel gathers light from, above 0: a map of mean free paths.
    frame : int
        From 0; every frame has its own random numbers.
    seed : int
        From 0; random numbers are a function of seed, frame, pixel and sample.
    border : str
        One of ``sssfit.render.borders.BORDERS``.
    threads : int, optional
        Threads to use, by default all cores; the result does not depend on them.

    Returns
    -------
    array (H, W, C)
        Radiant exitance, in the irradiance's unit; its expected value is `render_reference`'s, with
        the profile of the pixel's scale.

    Raises
    ------
    RenderError
        Numbers of samples, scale, frame or seed are out of range, or scene and sampler do not fit.
    """
    check_record("sampler", sampler, KernelSampler, RenderError)
    from sssfit._jit import thread_pool
    from sssfit._jit.adaptive import frame_key, sample_rows  # numba: 0.4 s

    profile = sampler.profile
    scene = scene_for(scene, profile.channels)
    _check_pitch(scene, sampler)
    shape = scene.height, scene.width
    many, factor = _checked_counts(counts, shape), _checked_scale(scale, shape)
    for name, value in (("frame", frame), ("seed", seed)):
        if not (is_whole(value) and 0 <= value <= _LARGEST):
            raise RenderError(f"{name} = {shown(value)}; expected a whole number from 0.")
    pitch = scene.mm_per_pixel / float(factor.max())  # of the widest profile's own pixels
    half = reference_half_pixels(profile, pitch, *shape)
    check_memory(16.0 * half, f"a kernel of {half} pixels each way", "use larger pixels")
    light = np.pad(scene.irradiance, ((0, 1), (0, 1), (0, 0))).astype(np.float32)
    far = far_irradiance(scene.irradiance, border)
    tables = sampler.cut, sampler.other, sampler.squares, sampler.weights
    places = (source_indices(size, half, border) for size in shape)
    everywhere = np.broadcast_to(far, scene.channels).astype(np.float32)
    out = np.empty((*shape, profile.n_channels))
    key = np.uint64(frame_key(seed, frame))
    maps = read_only(many), read_only(factor)
    given = light, everywhere, *places, half, *tables, *maps, key, out
    _run_blocks(thread_pool(thread_count(threads), "sssfit-samples"), sample_rows, given)
    out += profile.beyond_grid * far
    return out


def _run_blocks(pool: Any, work: Any, given: tuple[Any, ...]) -> None:
    """Run compiled work on blocks of rows, and wait for all of them."""
    rows = len(given[-1])
    with pool:
        blocks = itertools.pairwise([*range(0, rows, _ROWS), rows])
        for done in [pool.submit(work, *given, *block) for block in blocks]:
            done.result()


def samples_for(
    variance: npt.ArrayLike, target_variance: float, start: npt.ArrayLike
) -> CountArray:
    """Return how many samples bring the variance of a mean down to a target, 1 to 64.

    Parameters
    ----------
    variance : array (...)
        Variance of one sample.
    target_variance : float
        Variance of the mean, above 0: that of n samples is 1/n of that of one.
    start : int or array (...)
        Where the variance is not known, NaN.

    Raises
    ------
    RenderError
        The target is not above 0, or the variance or the start is no array of numbers that fit.
    """
    target_variance = positive(target_variance, "target_variance")
    wanted = as_light(variance, "variance") / target_variance
    first = as_light(start, "start")
    if first.shape not in ((), wanted.shape):
        raise RenderError(f"start has shape {first.shape}; expected a number or {wanted.shape}.")
    known = np.where(np.isnan(wanted), first, np.minimum(wanted, MOST_SAMPLES))
    return np.clip(np.ceil(known), LEAST_SAMPLES, MOST_SAMPLES).astype(np.int32)


def _checked_counts(counts: npt.ArrayLike, shape: tuple[int, int]) -> CountArray:
    as_light(counts, "counts")  # raises for what is no array of numbers
    given = np.asarray(counts)
    if given.dtype.kind not in "iu" or given.shape not in ((), shape):
        raise RenderError(
            f"numbers of samples of the type {given.dtype} and shape {given.shape}; expected whole "
            f"numbers of shape {shape}, or one."
        )
    if given.min() < LEAST_SAMPLES or given.max() > MOST_SAMPLES:
        raise RenderError(
            f"numbers of samples from {given.min()} to {given.max()}; expected {LEAST_SAMPLES} to "
            f"{MOST_SAMPLES}."
        )
    return np.ascontiguousarray(np.broadcast_to(given, shape), dtype=np.int32)


def _checked_scale(scale: npt.ArrayLike, shape: tuple[int, int]) -> npt.NDArray[np.float32]:
    with np.errstate(over="ignore"):  # checked below
        given = as_light(scale, "scale").astype(np.float32)
    if given.shape not in ((), shape):
        raise RenderError(f"a scale of shape {given.shape}; expected {shape}, or one number.")
    if not (np.isfinite(given).all() and (given > 0.0).all()):
        raise RenderError("the scale has values that are not numbers above 0.")
    return np.ascontiguousarray(np.broadcast_to(given, shape))


def _check_pitch(scene: Scene, sampler: KernelSampler) -> None:
    if abs(sampler.mm_per_pixel - scene.mm_per_pixel) > 1e-6 * scene.mm_per_pixel:
        raise RenderError(
            f"the sampler has {sampler.mm_per_pixel:.7g} mm per pixel and {scene.name} "
            f"{scene.mm_per_pixel:.7g}; make it at `mm_per_pixel = {scene.mm_per_pixel:.7g}`."
        )
