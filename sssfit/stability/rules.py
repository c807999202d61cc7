"""Rules that warn of fits beyond where they are safe, each with the stress that found its limit.

`doubts` applies them to a kernel and its profile. A rule looks at `Facts` and returns what is
beyond its limit, in words, or nothing; what is unknown warns of nothing.
"""

import warnings
from collections.abc import Callable
from dataclasses import dataclass

from sssfit.errors import FitError, SssfitWarning
from sssfit.kernel import Kernel
from sssfit.profile import Profile
from sssfit.stability.facts import Facts
from sssfit.stability.kernel_rules import crawling, few_taps, guide_b, not_round
from sssfit.stability.profile_rules import (
    coarse_annuli,
    gaps,
    light_beyond,
    rank_in_noise,
    too_few_photons,
)


@dataclass(frozen=True, slots=True)
class Rule:
    """A limit of a method.

    Parameters
    ----------
    name : str
    stress : str
        The one that found the limit: a name of ``sssfit.methods.STRESSES``.
    limit : float
    look : callable
        Takes the facts and the limit; returns what is wrong and what to do, or "".
    """

    name: str
    stress: str
    limit: float
    look: Callable[[Facts, float], str]


def doubts(kernel: Kernel, profile: Profile | None = None) -> list[str]:
    """Return a sentence for each rule that a kernel breaks.

    Parameters
    ----------
    kernel : SeparableKernel or Taps
    profile : Profile, optional
        What it was fitted to; without it only rules of the kernel alone are looked at.
    """
    facts = Facts(kernel, profile)
    found = ((each, each.look(facts, each.limit)) for each in RULES)
    return [f"{words} (stress {rule.stress})." for rule, words in found if words]


def warn_of_doubts(
    kernel: Kernel | Profile, profile: Profile | None = None, *, strict: bool = False
) -> None:
    """Warn of every rule that a kernel breaks, or with ``strict`` raise an error that names them.

    A profile alone breaks none.

    Raises
    ------
    FitError
        ``strict`` is set, and there is a doubt.

    Warns
    -----
    SssfitWarning
        One for each doubt.
    """
    found = [] if isinstance(kernel, Profile) else doubts(kernel, profile)
    if strict and found:
        raise FitError(f"{' '.join(found)} Without `strict` the kernel is written all the same.")
    for each in found:
        warnings.warn(f"{each[:1].upper()}{each[1:]}", SssfitWarning, stacklevel=2)


RULES = (
    Rule("rank-in-noise", "noise", 1.0, rank_in_noise),
    Rule("few-photons", "noise", 1.0, too_few_photons),
    Rule("light-beyond", "optics", 1e-3, light_beyond),
    Rule("gaps", "imports", 0.03, gaps),
    Rule("coarse-annuli", "grid", 0.4, coarse_annuli),
    Rule("not-round", "hard-light", 3.0, not_round),
    Rule("guide-b", "guided", 0.9, guide_b),
    Rule("crawling", "motion", 2.0, crawling),
    Rule("few-taps", "taps", 17.0, few_taps),
)
