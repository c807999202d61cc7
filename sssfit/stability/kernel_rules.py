"""Rules of a kernel alone: few terms or taps, its guide, and light that crawls."""

import math

from sssfit.kernel import Taps
from sssfit.messages import counted
from sssfit.stability.facts import Facts

_ROUND_PIXELS = 4  # from which circle on asymmetry is told from the squareness of pixels


def not_round(facts: Facts, limit: float) -> str:
    """Name few terms, which make a cross of a point."""
    kernel = facts.kernel
    if isinstance(kernel, Taps) or kernel.method != "svd" or kernel.rank >= limit:
        return ""
    if kernel.half_pixels < _ROUND_PIXELS:  # a few pixels are square in any case
        return ""
    return (
        f"a point of light becomes a cross or a diamond by {counted(kernel.rank, 'term')}, with "
        f"over a tenth of asymmetry; {limit:.0f} terms or a cascade show a disk"
    )


def guide_b(facts: Facts, limit: float) -> str:
    """Name a guide far from the usual one."""
    b = facts.settings.get("b")
    if facts.kernel.method != "guided" or not isinstance(b, int | float):
        return ""
    if abs(math.log2(b / 50.0)) <= limit:
        return ""
    return (
        f"b = {b:g} changes points of light by more than a Delta E of 1 from b = 50, as nearly a "
        "factor of 2 does; keep b near 50"
    )


def crawling(facts: Facts, limit: float) -> str:
    """Name pictures that are halved after one stage."""
    kernel = facts.kernel
    if not isinstance(kernel, Taps) or not kernel.chained or facts.settings.get("still"):
        return ""
    before = sum(each.level == 0 for each in kernel.stages)
    if before >= limit or kernel.stages[-1].level == 0:
        return ""
    fitted = ", and a fit with `still` reduces it" if kernel.method == "cascade" else ""
    return (
        f"light may crawl as the camera moves, with {counted(before, 'stage')} before the first "
        f"halving; {limit:.0f} stages do not show it{fitted}"
    )


def few_taps(facts: Facts, limit: float) -> str:
    """Name passes of few taps."""
    kernel = facts.kernel
    if not isinstance(kernel, Taps) or kernel.chained or kernel.is_disk:
        return ""
    fetches = min(2 * len(each.offsets_mm) + 1 for each in kernel.stages)
    if fetches >= limit:
        return ""
    return (
        f"{fetches} taps a pass take points of light apart for every method; take {limit:.0f} or "
        "more, or a cascade of as many fetches"
    )
