"""A cascade's optimum followed to another profile, where no search is wanted."""

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.fit._chain import Chain
from sssfit.fit._chain_pairs import PairChain
from sssfit.fit._chain_stars import StarChain
from sssfit.fit._spectrum import spectral_target
from sssfit.fit.cascade import ALIASING, descent, table_of, whole_target
from sssfit.kernel.structure import parse
from sssfit.kernel.taps import Taps
from sssfit.process import one_blas_thread
from sssfit.profile import Profile

_STEPS = 40  # as after a hop of a search


def followed(taps: Taps, profile: Profile) -> Taps:
    """Return the cascade for natural pictures at which a descent from another one ends.

    Parameters
    ----------
    taps : Taps
        A cascade of a profile that is nearly the same, with the same lit channels.
    profile : Profile
        The one to fit, on the pixels of the table.

    Raises
    ------
    FitError, ProfileError
        The profile does not fit on those pixels.
    """
    shapes = parse(taps.structure)
    target, lit = whole_target(profile, taps.mm_per_pixel, None)
    kind = PairChain if all(each.is_upright for each in shapes) else StarChain
    with one_blas_thread():
        chain = kind(spectral_target(target, lit, "natural"), shapes, ALIASING)
        found = descent(chain, _parameters(chain, taps, lit), _STEPS)
    return table_of("cascade", target, chain, found.x, {**taps.meta["settings"]})


def _parameters(chain: Chain, taps: Taps, lit: list[int]) -> FloatArray:
    """Return the parameters for which a chain has the numbers of a table."""
    x = np.empty(chain.size)
    blend = taps.blend[:, lit] / taps.blend[:, lit].sum(axis=0)
    x[: blend.size] = np.log(blend).ravel()
    for k, stage in enumerate(taps.stages):
        texels = stage.offsets_mm / (taps.mm_per_pixel * 2.0**stage.level)
        steps, weights = chain.places(k)
        x[steps] = np.log(texels if stage.kind == "star" else np.diff(texels, prepend=0.0))
        x[weights] = np.log(stage.weights[:, lit].T)
    return x
