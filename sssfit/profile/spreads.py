"""How far a beam spreads light: the share that returns within radii, of each annulus's light.

Annuli are flat, their light spread evenly. A new kind of beam is one function and one line of
``SPREADS``, and its reach in ``beam``.
"""

from collections.abc import Callable, Iterator

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.optics import gauss_legendre

IndexArray = npt.NDArray[np.intp]

_FAR = 9.0  # standard deviations of a Gaussian beam that hold all of it, but for 3e-18
_PIECE = 2.0  # largest piece of an integral over the beam, in standard deviations
# Nodes of Gauss and Legendre in a piece by its width, of which the beam's integral is right to
# 1e-11; the widest pieces have _MOST_NODES.
_NODES = ((0.02, 2), (0.1, 3), (0.4, 4), (1.0, 6))
_MOST_NODES = 8
_AT_ONCE = 2_000_000  # numbers of an array
_ACROSS = 4  # nodes across an annulus


def within_gaussian(radii: FloatArray, edges: FloatArray, radius_mm: float) -> FloatArray:
    """Return the share (m, n) of flat annuli within radii, which lie at edges or beyond all.

    Light at s lands at r with the density r exp(-(r^2 + s^2) / 2) I0(r s), Rice's distribution, in
    standard deviations of the beam, w / 2. It is integrated between neighbouring radii, where the
    beam around s reaches them, and over the annulus, s ds.

    Rice 1945, "Mathematical analysis of random noise", Bell System Technical Journal 24, equation
    3.10-11.
    """
    ends = np.append(radii, np.inf) * (2.0 / radius_mm)
    found = np.zeros((len(ends), len(edges) - 1))
    for source, share, annulus in _sources(edges * (2.0 / radius_mm)):
        first, last = (np.searchsorted(ends, source + far) for far in (-_FAR, _FAR))
        whole = first == last  # all of it lands between the same two radii
        np.add.at(found, (first[whole], annulus[whole]), share[whole])
        parts = [each[~whole] for each in (source, share, annulus, first, last)]
        _add_landing(found, ends, *parts)
    return np.cumsum(found[:-1], axis=0)


def _sources(edges: FloatArray) -> Iterator[tuple[FloatArray, FloatArray, IndexArray]]:
    """Yield places in annuli, the share of the annulus's light at each, and its number.

    Of annuli that are much wider than the beam the parts at the edges are resolved, and one place
    stands for the light that stays between them.
    """
    low, high = edges[:-1], edges[1:]
    area = high**2 - low**2
    wide = np.flatnonzero(high - low > 2.0 * _FAR)
    narrow = np.flatnonzero(high - low <= 2.0 * _FAR)
    parts = [(narrow, low[narrow], high[narrow])]
    if len(wide):
        inner, outer = low[wide] + _FAR, high[wide] - _FAR
        yield 0.5 * (inner + outer), (outer**2 - inner**2) / area[wide], wide
        parts += [(wide, low[wide], inner), (wide, outer, high[wide])]
    for annulus, begin, end in parts:
        if len(annulus) == 0:
            continue
        nodes, weights = _rule(float((end - begin).max()), 0.5 * _PIECE)
        source = begin[:, None] + (end - begin)[:, None] * nodes
        share = 2.0 * source * weights * ((end - begin) / area[annulus])[:, None]
        yield source.ravel(), share.ravel(), np.repeat(annulus, len(nodes))


def _add_landing(
    found: FloatArray,
    ends: FloatArray,
    source: FloatArray,
    share: FloatArray,
    annulus: IndexArray,
    first: IndexArray,
    last: IndexArray,
) -> None:
    """Add the light of each source to the intervals ``first`` to ``last`` between radii."""
    from scipy.special import i0e

    widths = np.diff(ends[:-1], prepend=0.0)
    nodes, weights = _rule(min(float(widths.max()), 2.0 * _FAR), _PIECE)
    step = max(1, _AT_ONCE // len(nodes))
    most = int((last - first).max(initial=-1)) + 1
    for begin in range(0, len(source), step):
        part = slice(begin, begin + step)
        for ahead in range(most):
            interval = first[part] + ahead
            on = interval <= last[part]
            interval, s = interval[on], source[part][on]
            low = np.maximum(np.where(interval > 0, ends[interval - 1], 0.0), s - _FAR)
            high = np.minimum(ends[interval], s + _FAR)
            r, centre = low[:, None] + (high - low)[:, None] * nodes, s[:, None]
            landing = (r * np.exp(-0.5 * (r - centre) ** 2) * i0e(r * centre)) @ weights
            place = interval, annulus[part][on]
            np.add.at(found, place, share[part][on] * (high - low) * landing)


def _rule(width: float, most: float) -> tuple[FloatArray, FloatArray]:
    """Return nodes and weights on [0, 1] for so many standard deviations, ``most`` in a piece."""
    pieces = max(1, int(np.ceil(width / most)))
    counts = [count for limit, count in _NODES if width <= limit * pieces]
    nodes, weights = gauss_legendre(min(counts, default=_MOST_NODES))
    places = (np.arange(pieces)[:, None] + nodes) / pieces
    return places.ravel(), np.tile(weights / pieces, pieces)


def within_disk(radii: FloatArray, edges: FloatArray, radius_mm: float) -> FloatArray:
    """Return the share (m, n) of flat annuli within radii: of light at s, a disk around it.

    Of an annulus s^2 is distributed evenly; four nodes of Gauss and Legendre in it stand for it.
    """
    nodes, weight = gauss_legendre(_ACROSS)
    square = edges**2
    found = np.zeros((len(radii), len(edges) - 1))
    for node, share in zip(nodes, weight, strict=True):
        s = np.sqrt(square[:-1] + node * np.diff(square))
        found += share * lens_area(radii[:, None], radius_mm, s)
    return found / (np.pi * radius_mm**2)


def lens_area(one: FloatArray, other: float, apart: FloatArray) -> FloatArray:
    """Return the area that two disks share, whose centres are so far apart.

    Weisstein, "Circle-Circle Intersection", equation 14.
    """
    one, apart = np.broadcast_arrays(one, apart)
    found: FloatArray = np.where(
        apart <= np.abs(one - other), np.pi * np.minimum(one, other) ** 2, 0.0
    )
    # With edges to 9 mm and a beam of 1 mm, four pairs in five lie one inside the other, or apart.
    cross = (apart > np.abs(one - other)) & (apart < one + other)
    found[cross] = _lens_of_crossing(one[cross], other, apart[cross])
    return found


def _lens_of_crossing(one: FloatArray, other: float, apart: FloatArray) -> FloatArray:
    to_one = (apart**2 + one**2 - other**2) / (2.0 * apart * one)
    to_other = (apart**2 + other**2 - one**2) / (2.0 * apart * other)
    kite = (other + one - apart) * (apart + one - other) * (apart - one + other)
    kite = kite * (apart + one + other)
    angles = one**2 * np.arccos(np.clip(to_one, -1.0, 1.0))
    angles = angles + other**2 * np.arccos(np.clip(to_other, -1.0, 1.0))
    area: FloatArray = angles - 0.5 * np.sqrt(np.maximum(kite, 0.0))
    return area


SPREADS: dict[str, Callable[[FloatArray, FloatArray, float], FloatArray]] = {
    "gaussian": within_gaussian,
    "flat": within_disk,
}
