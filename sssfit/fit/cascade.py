"""A cascade: a chain of small blurs whose stages are all added up.

One pass over a wide kernel with few taps skips texels. A chain does not: every stage reads what the
stage before has already smoothed, and later stages work on halved pictures, so fetches grow with
the logarithm of the support. The stages' pictures are blended,

    E_0 = E,  E_l = B_l E_{l-1},    M = sum_l m_l E_l,    sum_l m_l = ||R_d||_1 per channel,

with all weights positive: every stage is a convex average, energy is exact, nothing rings. Offsets,
weights and blend are fitted together to the kernel's spectrum, weighted as pictures are
(``_spectrum``). Related: d'Eon and Luebke 2007, a chain of Gaussians whose weights are set by the
Gaussians; Farbman, Fattal and Lischinski 2011, "Convolution pyramids", one small filter for all
levels.

Halved pictures alias: what they show of light depends on its place among their texels. The squared
images are weighed in (``_chain_pairs``), which makes pictures better and light that moves stiller.
"""

import time
from collections.abc import Mapping, Sequence
from numbers import Real
from pathlib import Path

import numpy as np
from scipy import optimize

from sssfit.arrays import FloatArray, is_number, is_whole, true_or_false
from sssfit.errors import FitError, KernelError
from sssfit.fit._chain import Chain, Numbers, Searched
from sssfit.fit._chain_pairs import PairChain
from sssfit.fit._chain_stars import StarChain
from sssfit.fit._result import TapsFit, provenance
from sssfit.fit._spectrum import Pictures, pictures_of, recorded, search_targets
from sssfit.fit._target import Pitch, Target, make_target, pitch_of, support_of
from sssfit.fit._tied_chain import one_shape
from sssfit.fit.structures import best_structure, width_pixels
from sssfit.kernel.structure import Shape, cost_of_chain, parse, text_of
from sssfit.kernel.taps import Stage, Taps
from sssfit.messages import counted, shown
from sssfit.process import one_blas_thread
from sssfit.profile import Profile
from sssfit.scene.record import Scene

FETCHES = 24  # skin1 at .3 mm: 99 % of a picture's pixels within a Delta E of .10
FEWEST = 7
_KEPT, _MOST_PIXELS = 0.9999, 320
_STARTS, _KEPT_STARTS, _SHAPES = 16, 4, 2
_ROUGH_STEPS = 150  # at most, of a start
# Weights of aliasing. skin1, 24 fetches: mean over eight pictures of the 99th percentile of Delta
# E .261 with 0, .101 with .3, .107 with 1; of a point moved by a pixel 3.1, .74 and .69.
ALIASING, _TIMES = 0.3, 10.0 / 3.0
# Of one picture the squared error itself: its images along x and along y. On points at .3 mm 14
# fetches fitted with .3 had 1.08 times the error of those for natural pictures, with 2 they have
# .85 times.
_IMAGES = 2.0
# Standard deviations of the hops, in logarithms of offset steps: past the texel at which a local
# optimum ends.
_HOPS = 4 * (0.15, 0.3)


def fit_cascade(
    profile: Profile,
    *,
    fetches: float | None = None,
    stages: str | None = None,
    passes: int | None = None,
    full_resolution: bool = False,
    spectrum: str | None = None,
    irradiance: str | Path | Scene | None = None,
    still: bool = False,
    like: Taps | None = None,
    seed: int = 1,
    mm_per_pixel: Pitch | None = None,
    support_mm: float | None = None,
) -> TapsFit:
    """Fit a chain of small blurs to a profile.

    Parameters
    ----------
    profile : Profile
        The profile to fit.
    fetches : float, optional
        Most texture fetches a pixel, from 7 up; by default 24.
    stages : str, optional
        The structure, such as "1-1|2-2|2-2" (`sssfit.kernel.structure`), in place of fetches.
    passes : int, optional
        Most passes of the stages.
    full_resolution : bool
        Use no structure that halves the picture.
    spectrum : {"natural", "white"}, optional
        Spectrum of the pictures that the kernel is for, by default natural.
    irradiance : str, Path or Scene, optional
        The picture that the kernel is for, in place of a spectrum: a name of
        ``sssfit.scene.made.MADE``, a file or a scene, at least as large as the kernel. Takes twice
        the time: the search also starts from the cascade for natural pictures.
    still : bool
        Weigh the aliasing of halved pictures three times as much as for the least error: a point
        that moves by a pixel changes less.
    like : Taps, optional
        A cascade of the same channels for pixels of another size. If it has the same stages, the
        search also starts from it: tables of similar optima can be mixed (`taps_between`). One of
        other stages is not used.
    seed : int
        Seed of the random starts; the same seed and ``like`` give the same bits.
    mm_per_pixel, support_mm : float, optional [mm]
        Pixel size, and half width of the pixels of the profile's kernel; see
        ``sssfit.fit.make_target``. By default 99.99 % of every channel's energy lies within, or at
        least 99.9 % where that takes more than 320 pixels; the kernel has all of it.

    Returns
    -------
    TapsFit

    Raises
    ------
    FitError, ProfileError
        The budget, structure, picture, profile, pixel size or support is invalid, or ``like`` is
        not a cascade of the same channels with light in those of the profile.
    ArgumentError, FileError, RenderError
        There is no such picture, or it cannot be read.
    """
    begun = time.perf_counter()
    check_seed(seed)
    still = true_or_false("still", still, FitError)
    full_resolution = true_or_false("full_resolution", full_resolution, FitError)
    width = width_pixels(profile, pitch_of(profile, mm_per_pixel))
    shapes = structure_for(fetches, stages, passes, width, full_resolution=full_resolution)
    target, lit = whole_target(profile, mm_per_pixel, support_mm)
    pictures = pictures_of(target, spectrum, irradiance)
    first = ["natural"] if isinstance(pictures, Scene) else []
    near = None if like is None else _near(like, shapes, target, lit)
    starts: list[FloatArray] = []
    evaluations = 0
    with one_blas_thread():
        kind = PairChain if all(each.is_upright for each in shapes) else StarChain
        for each in (*first, pictures):
            weight = _aliasing(each, still=still)
            few, chain = (kind(of, shapes, weight) for of in search_targets(target, lit, each))
            starts += _of_one_shape(few, seed)
            starts += [] if near is None else [few.start_from(near)]
            x, count = searched(few, chain, seed, starts, effort=_effort(shapes))
            starts, evaluations = [x], evaluations + count
    settings = {
        "fetches": fetches,
        "stages": stages,
        "passes": passes,
        "full_resolution": full_resolution,
        **recorded(pictures),
        "still": still,
        "fit_seed": seed,
    }
    if like is not None and near is not None:
        settings["like_mm_per_pixel"] = like.mm_per_pixel
    taps = table_of("cascade", target, chain, x, settings)
    return TapsFit(taps, evaluations, time.perf_counter() - begun)


def _near(like: object, shapes: Sequence[Shape], target: Target, lit: list[int]) -> Numbers | None:
    """Return a cascade's numbers on the target's pixels; None if it has other stages."""
    channels = target.profile.channels
    if not isinstance(like, Taps) or not like.chained:
        raise FitError(f"like = {shown(like)}; expected a cascade.")
    if like.channels != channels:
        raise FitError(
            f"like.channels = {shown(list(like.channels))}; expected those of the profile, "
            f"{shown(list(channels))}."
        )
    if not (like.blend[:, lit].sum(axis=0) > 0.0).all():
        raise FitError("like has no light in a channel that the profile lights; leave it out.")
    if like.structure != text_of(shapes):
        return None
    return numbers_of(like, lit, target.mm_per_pixel)


def check_seed(seed: object) -> None:
    """Raise FitError for what is no seed of random starts."""
    if not is_whole(seed) or seed < 0:  # type: ignore[operator]
        raise FitError(f"seed = {shown(seed)}; expected a whole number from 0 up.")


def whole_target(
    profile: Profile, mm_per_pixel: Pitch | None, support_mm: float | None
) -> tuple[Target, list[int]]:
    """Return the pixels that hold nearly all light unless a support is given, and lit channels.

    Raises
    ------
    FitError
        As `make_target`; or a pixel is wider than the support, where it warns.
    """
    pitch = pitch_of(profile, mm_per_pixel)
    support_mm = _reach_mm(profile, mm_per_pixel) if support_mm is None else support_mm
    if isinstance(support_mm, Real) and 0.0 < support_mm < (1.0 - 1e-9) * pitch:
        raise FitError(
            f"a pixel of {pitch:g} mm is wider than the support of {support_mm:.4g} mm, which "
            "leaves nothing to blur; use a smaller `mm_per_pixel`."
        )
    target = make_target(profile, mm_per_pixel, support_mm)
    return target, lit_channels(target)


def lit_channels(target: Target) -> list[int]:
    """Return the channels that return light."""
    return [int(c) for c in np.flatnonzero(~target.is_empty)]


def _reach_mm(profile: Profile, mm_per_pixel: Pitch | None) -> float:
    """Return the radius of 99.99 % of every channel's energy on the grid [mm].

    With 99.9 %, the usual support, skin1's cascade has 1.4 times the Delta E at .3 mm. Where the
    rest would go beyond 320 pixels it is left out, down to the usual support.
    """
    cumulative = profile.cumulative
    kept = (cumulative >= _KEPT * cumulative[-1]).all(axis=1)
    reach_mm = float(profile.r_edges_mm[int(np.argmax(kept))])
    most_mm = max(_MOST_PIXELS * pitch_of(profile, mm_per_pixel), support_of(profile))
    return min(reach_mm, most_mm)


def structure_for(
    fetches: float | None,
    stages: str | None,
    passes: int | None,
    width: float,
    *,
    full_resolution: bool = False,
) -> tuple[Shape, ...]:
    """Return the structure asked for, or the best known one for kernels so many pixels wide.

    Raises
    ------
    FitError
        The budget is too small, the structure is invalid or goes beyond the budget.
    """
    budget = FETCHES if fetches is None and stages is None else fetches
    if budget is not None and not (is_number(budget) and budget >= FEWEST):
        raise FitError(
            f"fetches = {shown(budget)}; expected a number from {FEWEST} up: a stage of one pair "
            "takes 6, and one more to add the irradiance."
        )
    if not isinstance(passes, Real | None):
        raise FitError(f"passes = {shown(passes)}; expected a whole number from 1 up.")
    most = np.inf if budget is None else budget + 1e-9
    if stages is not None:
        shapes = _parsed(stages)
        cost = cost_of_chain(shapes)
        if cost.fetches > most or (passes is not None and cost.passes > passes):
            raise FitError(
                f"the stages {stages} take {counted(cost.fetches, 'fetch', '.4g')} and "
                f"{counted(cost.passes, 'pass')}; "
                "allow more, or use fewer or smaller stages."
            )
        return shapes
    best = best_structure(width, most, passes, full_resolution=full_resolution)
    if best is None:
        raise FitError(
            f"no known cascade has at most {_limits(budget, passes)}; allow more of either."
        )
    return parse(best)


def _limits(budget: float | None, passes: int | None) -> str:
    """Return the limits that were given, in words."""
    given = [] if budget is None else [counted(budget, "fetch", ".6g")]
    return " and ".join([*given, *([] if passes is None else [counted(passes, "pass")])])


def _parsed(stages: str) -> tuple[Shape, ...]:
    try:
        return parse(stages)
    except KernelError as error:
        raise FitError(str(error)) from None


def _aliasing(pictures: Pictures, *, still: bool) -> float:
    """Return the weight of the squared images in the misfit."""
    own = _IMAGES if isinstance(pictures, Scene) else ALIASING
    return own * _TIMES if still else own


def _effort(shapes: Sequence[Shape]) -> int:
    """Return how many times as many starts a search takes; without halvings each takes a third.

    Of three seeds for skin1 with 1-1-1-2-2-2 one reached a Delta E of .35 with 16 starts, the
    others .60; five of five reached .38 or less with 32.
    """
    return 1 if shapes[-1].level else 2


def searched(
    few: Searched,
    many: Searched,
    seed: int,
    starts: Sequence[FloatArray] = (),
    *,
    effort: int = 1,
) -> tuple[FloatArray, int]:
    """Return the best parameters of a search, and evaluations.

    The misfit is smooth between texels only, so it has local optima. A search makes many cheap
    descents, continues the best of them, and hops from the best of those. All of them weigh
    aliasing in: without it three of four seeds left .6 and more of skin1 with 1|1|1-1|1-1|1-1,
    with it six of six leave .30 to .38.

    Parameters
    ----------
    few, many : Searched
        A chain, or fewer parameters that it follows, on the frequencies of the search and on those
        of its last descent.
    seed : int
        Seed of the random starts.
    starts : sequence of array
        Others, all of which are followed.
    effort : int
        Multiplies the number of random starts.
    """
    check_seed(seed)
    rng = np.random.default_rng([seed])
    rough = [_rough(few, few.start(rng)) for _ in range(effort * _STARTS)]
    kept = [each.x for each in sorted(rough, key=lambda each: each.fun)[: effort * _KEPT_STARTS]]
    found = [descent(few, x, 25) for x in (*kept, *starts)]
    best = min(found, key=lambda each: each.fun)
    best = descent(few, best.x, 60)
    for width in _HOPS:
        x = best.x.copy()
        x[few.step_parameters] += rng.normal(0.0, width, few.step_parameters.size)
        found.append(descent(few, x, 40))
        best = min(best, found[-1], key=lambda each: each.fun)
    best = descent(many, best.x, 200, gain=1e-5)
    return best.x, sum(each.nfev for each in (*rough, *found, best))


def _of_one_shape(chain: Chain, seed: int) -> list[FloatArray]:
    """Return the optimum of stages of one shape, where all have as many taps and some are halved.

    Searches for its few parameters hardly miss it, and halved pictures do less to it: from it
    1|1|1|1|1|1 leaves .41 of skin1 and .33 of ketchup.
    """
    first, last = chain.shapes[0], chain.shapes[-1]
    if last.level == 0 or {(each.pairs, each.is_upright) for each in chain.shapes} != {
        (first.pairs, True)
    }:
        return []
    tied, rng = one_shape(chain, is_fitted=True), np.random.default_rng([seed])
    starts = [_rough(tied, tied.start(rng)).x for _ in range(_SHAPES)]
    ends = [descent(tied, each, 60) for each in starts]
    return [tied.full(min(ends, key=lambda each: each.fun).x)]


def _rough(chain: Searched, x: FloatArray) -> optimize.OptimizeResult:
    """Come near an optimum in many cheap steps."""
    return optimize.minimize(
        chain.value_and_gradient,
        x,
        jac=True,
        method="L-BFGS-B",
        options={"maxiter": _ROUGH_STEPS, "maxcor": 20},
    )


def descent(
    chain: Searched, x: FloatArray, most: int, gain: float = 3e-3
) -> optimize.OptimizeResult:
    """Minimise from a point by a trust region with the Gauss-Newton matrix.

    It ends when ten steps together gain less than ``gain`` of the value.
    """
    values: list[float] = []

    def check(intermediate_result: optimize.OptimizeResult) -> None:
        values.append(intermediate_result.fun)
        if len(values) > 10 and values[-11] - values[-1] < gain * values[-1]:
            raise StopIteration

    return optimize.minimize(
        chain.value_and_gradient,
        x,
        jac=True,
        hess=chain.hessian,
        method="trust-ncg",
        callback=check,
        options={"maxiter": most, "gtol": 1e-14},
    )


def numbers_of(taps: Taps, lit: list[int], mm_per_pixel: float) -> Numbers:
    """Return a cascade's numbers for the lit channels on pixels of a size, as a chain has them."""
    return Numbers(
        [each.offsets_mm / (mm_per_pixel * 2.0**each.level) for each in taps.stages],
        [each.weights[:, lit] for each in taps.stages],
        taps.blend[:, lit],
    )


def table_of(
    method: str, target: Target, chain: Chain, x: FloatArray, settings: Mapping[str, object]
) -> Taps:
    """Return the table of taps; channels without light take the first one's weights.

    Parameters
    ----------
    method : str
    target : Target
    chain : Chain
        The chain of the target's lit channels; its energies may be shares.
    x : array
        The chain's parameters.
    settings : mapping
        For provenance.
    """
    numbers, lit = chain.numbers(x), lit_channels(target)
    with one_blas_thread():
        error = chain.target.error(chain.spectrum(x))
    channels = target.profile.n_channels
    source = [lit.index(c) if c in lit else 0 for c in range(channels)]
    stages = [
        Stage(
            shape.level,
            shape.kind,
            offsets * target.mm_per_pixel * 2.0**shape.level,
            weights[:, source],
            shape.angle_degrees,
        )
        for shape, offsets, weights in zip(
            chain.shapes, numbers.offsets, numbers.weights, strict=True
        )
    ]
    blend, spectral = np.zeros((len(stages) + 1, channels)), np.zeros(channels)
    total = target.total
    blend[:, lit] = numbers.blend * (total[lit] / chain.target.energy)
    spectral[lit] = error
    energy = np.where(total > 0.0, blend.sum(axis=0) / np.where(total > 0.0, total, 1.0) - 1.0, 0.0)
    return Taps(
        method=method,
        mm_per_pixel=target.mm_per_pixel,
        channels=target.profile.channels,
        chained=True,
        stages=tuple(stages),
        blend=blend,
        errors={"spectral": spectral, "energy": energy},
        meta=provenance(target, settings),
    )
