"""A convolution pyramid: one small filter on all levels.

After Farbman, Fattal and Lischinski 2011, "Convolution pyramids" (ACM TOG 30(6)). There a picture
is filtered by h1 and halved, level by level, and on the way back each level is filtered by g,
weighted, and added to the coarser sum, which is filtered by h2 as it is enlarged; h1, h2 and g are
the same on all levels, and for kernels of many widths each level has a weight w_l of its own.

A table of taps holds this with h1 = the mean of 2 x 2 texels after g, and h2 = the bilinear fetch
(1, 3, 3, 1) / 4 of enlarging, so that g alone is fitted: a pair of passes with the same offsets in
texels and the same weights on all levels and in all channels. The levels' weights are free in each
channel: the blend. A level takes the six fetches of a pair for g, which also make the next level's
picture. All are fitted under the objective of `sssfit.fit.cascade`, aliasing included.
"""

import time

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.fit._chain import Chain
from sssfit.fit._chain_pairs import PairChain
from sssfit.fit._result import TapsFit
from sssfit.fit._spectrum import search_targets
from sssfit.fit._target import Pitch
from sssfit.fit._tied_chain import TiedChain, equal_pairs
from sssfit.fit.cascade import ALIASING, searched, table_of, whole_target
from sssfit.process import one_blas_thread
from sssfit.profile import Profile

STAGES = "1|1|1|1|1"  # skin1 at .3 mm: the best of ten structures, with 12 fetches a pixel


def fit_pyramid(
    profile: Profile,
    *,
    stages: str = STAGES,
    spectrum: str = "natural",
    seed: int = 1,
    mm_per_pixel: Pitch | None = None,
    support_mm: float | None = None,
) -> TapsFit:
    """Fit a convolution pyramid to a profile.

    Parameters
    ----------
    profile : Profile
        The profile to fit.
    stages : str
        The structure: the same number of tap pairs in each stage, such as "1|1|1|1|1"
        (`sssfit.kernel.structure`).
    spectrum : {"natural", "white"}
        Spectrum of the pictures that the kernel is for.
    seed : int
        Seed of the random starts; the same seed gives the same bits.
    mm_per_pixel, support_mm : float, optional [mm]
        As in `sssfit.fit.cascade.fit_cascade`.

    Returns
    -------
    TapsFit

    Raises
    ------
    FitError, ProfileError
        The structure, profile, pixel size or support is invalid.
    """
    begun = time.perf_counter()
    shapes = equal_pairs(stages)
    target, lit = whole_target(profile, mm_per_pixel, support_mm)
    with one_blas_thread():
        few, tied = (
            one_filter(PairChain(each, shapes, ALIASING))
            for each in search_targets(target, lit, spectrum)
        )
        p, evaluations = searched(few, tied, seed)
    settings = {"stages": stages, "spectrum": spectrum, "fit_seed": seed}
    taps = table_of("pyramid", target, tied.chain, tied.full(p), settings)
    return TapsFit(taps, evaluations, time.perf_counter() - begun)


def one_filter(chain: Chain) -> TiedChain:
    """Return a chain whose stages are one filter: its n offset steps and n weights, of 1 + 2 n.

    The parameters are the blend's, then the logarithms of the steps, and of the weights beside the
    middle one.
    """
    blend, pairs = chain.channels * (len(chain.shapes) + 1), chain.counts[0]
    ties = np.zeros((chain.size, blend + 2 * pairs))
    ties[:blend, :blend] = np.eye(blend)
    for k in range(len(chain.shapes)):
        steps, weights = chain.places(k)
        for n in range(pairs):
            ties[steps[n], blend + n] = 1.0
            ties[weights[:, n + 1], blend + pairs + n] = 1.0

    def begin(rng: np.random.Generator) -> FloatArray:
        offsets = np.cumsum(rng.uniform(0.6, 1.6, pairs))
        bell = -0.5 * (offsets / (0.6 * pairs)) ** 2
        steps = np.log(np.diff(offsets, prepend=0.0))
        return np.concatenate((rng.normal(0.0, 0.3, blend), steps, bell))

    return TiedChain(chain, np.zeros(chain.size), ties, blend + np.arange(pairs), begin)
