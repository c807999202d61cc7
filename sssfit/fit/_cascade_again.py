"""A cascade's optimum followed to another profile, where no search is wanted."""

from sssfit.fit._chain_pairs import PairChain
from sssfit.fit._chain_stars import StarChain
from sssfit.fit._spectrum import search_target
from sssfit.fit.cascade import ALIASING, descent, numbers_of, table_of, whole_target
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
        chain = kind(search_target(target, lit, "natural"), shapes, ALIASING)
        start = chain.start_from(numbers_of(taps, lit, taps.mm_per_pixel))
        found = descent(chain, start, _STEPS)
    return table_of("cascade", target, chain, found.x, {**taps.meta["settings"]})
