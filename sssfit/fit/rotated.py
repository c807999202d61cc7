"""A chain of single passes in three or four directions, of which only the last picture is shown.

A separable kernel of one term has its two passes along x and y, and is no rounder than their
product. Three passes at 0, 60 and 120 degrees (hexagonal), or four at 0, 45, 90 and 135
(octagonal), each on the one before, have the spectrum

    K^ = m_0 + m_1 prod_j b_j(wx, wy),

with b_j that of a line of mirrored bilinear fetches (``_chain_stars``) and the irradiance's own
share m_0. Mirror images have the same numbers: the line at 0 degrees has its own and those at 60
and 120 share theirs; so do 0 and 90, and 45 and 135. Fitted under the objective of
`sssfit.fit.cascade`.
"""

import operator
import time

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import FitError
from sssfit.fit._chain import Chain
from sssfit.fit._chain_stars import StarChain
from sssfit.fit._result import TapsFit
from sssfit.fit._spectrum import search_target
from sssfit.fit._target import Pitch
from sssfit.fit._tied_chain import TiedChain
from sssfit.fit.cascade import searched, table_of, whole_target
from sssfit.kernel.structure import MOST_PAIRS, Shape
from sssfit.messages import shown
from sssfit.process import one_blas_thread
from sssfit.profile import Profile

DIRECTIONS, TAPS = 4, 9
# Angles of the lines, and which of them share their numbers.
_ANGLES = {2: (0.0, 90.0), 3: (0.0, 60.0, 120.0), 4: (0.0, 45.0, 90.0, 135.0)}
_SHARED = {2: (0, 0), 3: (0, 1, 1), 4: (0, 1, 0, 1)}
_NOTHING = -1e3  # logarithm of the share of a picture that is not shown


def fit_rotated(
    profile: Profile,
    *,
    directions: int = DIRECTIONS,
    taps: int = TAPS,
    seed: int = 1,
    mm_per_pixel: Pitch | None = None,
    support_mm: float | None = None,
) -> TapsFit:
    """Fit a chain of passes in several directions to a profile.

    Parameters
    ----------
    profile : Profile
        The profile to fit.
    directions : int
        Passes: 4 (octagonal), 3 (hexagonal), or 2, the single pair beside which they stand.
    taps : int
        Fetches of a pass, odd, 3 to 129, by default 9.
    seed : int
        Seed of the random starts; the same seed gives the same bits.
    mm_per_pixel, support_mm : float, optional [mm]
        As in `sssfit.fit.cascade.fit_cascade`.

    Returns
    -------
    TapsFit
        Lines, chained; ``blend`` is 0 but for the irradiance and the last.

    Raises
    ------
    FitError, ProfileError
        A setting, the profile, pixel size or support is invalid.
    """
    begun = time.perf_counter()
    shapes = _checked(directions, taps)
    target, lit = whole_target(profile, mm_per_pixel, support_mm)
    with one_blas_thread():
        wanted = search_target(target, lit, "natural")  # few frequencies miss a long line's waves
        tied = last_shown(StarChain(wanted, shapes), _SHARED[len(shapes)])
        p, evaluations = searched(tied, tied, seed)
    settings = {"directions": directions, "taps": taps, "fit_seed": seed}
    table = table_of("rotated", target, tied.chain, tied.full(p), settings)
    return TapsFit(table, evaluations, time.perf_counter() - begun)


def _checked(directions: object, taps: object) -> tuple[Shape, ...]:
    """Return the lines, or raise FitError."""
    numbers = []
    for each in (directions, taps):
        try:
            numbers.append(operator.index(each))  # type: ignore[arg-type]
        except TypeError:
            numbers.append(0)
    if numbers[0] not in _ANGLES:
        raise FitError(f"directions = {shown(directions)}; expected 2, 3 or 4.")
    most = 2 * MOST_PAIRS + 1
    if not (3 <= numbers[1] <= most and numbers[1] % 2):
        raise FitError(
            f"taps = {shown(taps)}; expected an odd number from 3 to {most}: the middle and "
            "mirrored pairs."
        )
    return tuple(Shape("line", numbers[1] // 2, 0, angle) for angle in _ANGLES[numbers[0]])


def last_shown(chain: Chain, shared: tuple[int, ...]) -> TiedChain:
    """Return a chain of lines of which those with the same number in ``shared`` are alike.

    The parameters are the logits of the irradiance and of the last picture (2, C), then for each
    kind of line the logarithms of its offset steps (n,) and of its weights (C, n+1).
    """
    channels, pairs = chain.channels, chain.counts[0]
    own, kinds = pairs + channels * (pairs + 1), max(shared) + 1
    base, ties = np.zeros(chain.size), np.zeros((chain.size, 2 * channels + kinds * own))
    rows = np.arange(channels * (len(shared) + 1)).reshape(-1, channels)
    base[rows[1:-1]] = _NOTHING
    ties[rows[[0, -1]].ravel(), np.arange(2 * channels)] = 1.0
    for k, kind in enumerate(shared):
        steps, weights = chain.places(k)
        at = 2 * channels + kind * own
        ties[np.concatenate((steps, weights.ravel())), at + np.arange(own)] = 1.0

    def begin(rng: np.random.Generator) -> FloatArray:
        parts = [rng.normal(0.0, 0.3, 2 * channels)]
        n = np.arange(1, pairs + 1)
        for _ in range(kinds):
            # Offsets that grow as a power, up to a few times where a Gaussian would end.
            last, power = rng.uniform(0.3, 0.9) * chain.target.half_pixels, rng.uniform(1.2, 2.2)
            steps = np.diff(last * (n / pairs) ** power, prepend=0.0)
            heavy = -rng.uniform(2.0, 4.0) * np.concatenate(([0.0], n)) / pairs
            parts += [np.log(steps), np.tile(heavy, channels)]
        return np.concatenate(parts)

    steps_of = 2 * channels + own * np.arange(kinds)[:, None] + np.arange(pairs)
    return TiedChain(chain, base, ties, steps_of.ravel(), begin)
