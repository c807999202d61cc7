"""A chain of Gaussians: each blurs the one before, and all of them are added up.

After d'Eon and Luebke 2007, "Advanced techniques for realistic real-time skin rendering" (GPU Gems
3, chapter 14): a sum of N Gaussians with the variances v_1 < .. < v_N, the same in all channels,
and weights by channel. Gaussians of variances a and b one after the other are one of a + b, so

    stage k blurs stage k - 1 by a Gaussian of the variance v_k - v_(k-1),   v_0 = 0,

in two passes of seven taps one standard deviation apart, weighted with the Gaussian's share of the
interval around each. The blend has the weights. On texels the taps lie so far apart that the
variance is met with the bilinear fetches.

``blur`` says how much of it is fitted under the objective of `sssfit.fit.cascade`, aliasing
included: nothing, where the Gaussians are those of the profile by r-weighted least squares, as
published; the widths and the blend; or, too, the one shape that all stages have in place of a
Gaussian's. Where something is fitted the irradiance has a share, too. Cascades differ in that each
stage has weights of its own in each channel.
"""

import time

import numpy as np
from scipy import optimize

from sssfit.arrays import FloatArray
from sssfit.errors import FitError
from sssfit.fit._chain_pairs import PairChain
from sssfit.fit._gaussians_objective import SharedAnnuli, make_annuli
from sssfit.fit._gaussians_search import fitted_annuli, search
from sssfit.fit._result import TapsFit
from sssfit.fit._spectrum import search_targets
from sssfit.fit._target import Pitch, Target
from sssfit.fit._tied_chain import equal_pairs, gaussian_weights, one_shape
from sssfit.fit.cascade import ALIASING, searched, table_of, whole_target
from sssfit.kernel.structure import Shape
from sssfit.messages import shown
from sssfit.process import one_blas_thread
from sssfit.profile import Profile

STAGES = "3-3-3-3-3-3"  # six Gaussians, seven taps a pass
BLURS = ("published", "widths", "shape")
_NOTHING = -1e3  # logarithm of a share of the blend that is 0


def fit_gaussian_chain(
    profile: Profile,
    *,
    stages: str = STAGES,
    blur: str = BLURS[-1],
    seed: int = 1,
    mm_per_pixel: Pitch | None = None,
    support_mm: float | None = None,
) -> TapsFit:
    """Fit a chain of Gaussians to a profile.

    Parameters
    ----------
    profile : Profile
        The profile to fit.
    stages : str
        The structure: the same number of tap pairs in each stage, by default "3-3-3-3-3-3", six
        Gaussians of seven taps a pass (`sssfit.kernel.structure`).
    blur : {"shape", "widths", "published"}
        What of the stages is fitted as pictures see it: their widths and one common shape, their
        widths alone, or nothing.
    seed : int
        Seed of the random starts; the same seed gives the same bits.
    mm_per_pixel, support_mm : float, optional [mm]
        As in `sssfit.fit.cascade.fit_cascade`.

    Returns
    -------
    TapsFit
        With "published" fewer stages than were asked for, if fewer Gaussians fit the profile as
        well.

    Raises
    ------
    FitError, ProfileError
        A setting is invalid, among them halved pictures with "published"; or the profile, pixel
        size or support is.
    """
    begun = time.perf_counter()
    shapes = _checked(stages, blur)
    target, lit = whole_target(profile, mm_per_pixel, support_mm)
    settings = {"stages": stages, "blur": blur, "fit_seed": seed}
    if blur == "published":
        variances_mm2, weights, evaluations = shared_gaussians(target, lit, len(shapes))
        shapes = shapes[: len(variances_mm2)]
    with one_blas_thread():
        few, tied = (
            one_shape(PairChain(each, shapes, ALIASING), is_fitted=blur == "shape")
            for each in search_targets(target, lit, "natural")
        )
        if blur == "published":
            p = _parameters(variances_mm2 / target.mm_per_pixel**2, weights, shapes[0].pairs)
        else:
            p, evaluations = searched(few, tied, seed)
    taps = table_of("gaussian-chain", target, tied.chain, tied.full(p), settings)
    return TapsFit(taps, evaluations, time.perf_counter() - begun)


def _checked(stages: str, blur: str) -> tuple[Shape, ...]:
    """Return the stages, or raise FitError."""
    if blur not in BLURS:
        raise FitError(f"blur = {shown(blur)}; expected {' or '.join(map(repr, BLURS))}.")
    shapes = equal_pairs(stages)
    if blur == "published" and shapes[-1].level > 0:
        raise FitError(
            f"stages = {shown(stages)}: the published chain has no halved pictures; leave out "
            "the |, or let the widths be fitted."
        )
    return shapes


def shared_gaussians(
    target: Target, lit: list[int], count: int
) -> tuple[FloatArray, FloatArray, int]:
    """Return the sum of Gaussians with the same variances in all channels.

    Parameters
    ----------
    target : Target
    lit : list of int
        The C channels that return light.
    count : int
        Most Gaussians.

    Returns
    -------
    variances (N,) [mm^2], ascending; weights (N, C), which add up to the energy; evaluations
    """
    parts, on_grid, edges_mm = [], [], []
    for channel in lit:
        edges, energy = fitted_annuli(target, channel)
        on_grid.append(float(energy.sum()))
        edges_mm.append((float(edges[1]), float(edges[-1])))
        total = float(target.total[channel]) / on_grid[-1]
        parts.append(make_annuli(edges, energy, total, signed=False))
    annuli = SharedAnnuli(tuple(parts))
    narrowest_mm, widest_mm = (0.25 * min(edges_mm)[0], max(edge for _, edge in edges_mm))
    found = search(annuli, count, narrowest_mm**2, widest_mm**2)
    weights = annuli.weights(np.log(found.variances_mm2)) * on_grid
    return found.variances_mm2, weights, found.evaluations


def _parameters(variances: FloatArray, weights: FloatArray, pairs: int) -> FloatArray:
    """Return the parameters of `one_shape` for Gaussians of variances (N,) in texels squared."""
    own = gaussian_weights(pairs)
    spacings = [_spacing(each, own) for each in np.diff(variances, prepend=0.0)]
    shares = np.full((len(variances) + 1, weights.shape[1]), _NOTHING)
    np.log(weights, out=shares[1:], where=weights > 0.0)
    return np.concatenate((shares.ravel(), np.log(spacings)))


def _spacing(variance: float, weights: FloatArray) -> float:
    """Return how far apart bilinear taps with these weights have a variance [texels].

    A fetch at o = i + f has the second moment (1 - f) i^2 + f (i + 1)^2.
    """
    k = np.arange(1, len(weights))

    def excess(spacing: float) -> float:
        whole = np.floor(k * spacing)
        moments = whole**2 + (k * spacing - whole) * (2.0 * whole + 1.0)
        return 2.0 * float(moments @ weights[1:]) - variance

    most = 1.0
    while excess(most) < 0.0:
        most *= 2.0
    return float(optimize.brentq(excess, 0.0, most, xtol=1e-14, rtol=1e-14))
