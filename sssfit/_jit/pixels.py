"""Energy of a stack of flat annuli in pixels and lines: closed forms, no sampling.

A pixel's energy is sum_j d_j (A_j - A_j-1): d_j the density between the radii R_j-1 and R_j, A_j
the area that the disk of radius R_j shares with the pixel. Disks that cover the pixel share all of
it and smaller ones none, so only the edges that cut it (one to three at p = dr) need the closed
form. Differences of areas that rounding makes negative become zero, so that a profile without
negative energies gives a kernel without negative weights.

Every pixel here lies in the first quadrant. A pixel on an axis is cut in half there and doubled,
the centre pixel quartered and taken four times.
"""

import math

import numpy as np
import numpy.typing as npt
from numba import carray  # type: ignore[attr-defined]

from sssfit._jit import Address, jit

FloatArray = npt.NDArray[np.float64]


@jit
def circular_segment(radius: float, share: float) -> float:
    """Area between a chord and its minor arc: R^2 (asin s - s sqrt(1 - s^2)), s = chord / 2R."""
    s2 = share * share
    if s2 > 0.0025:
        s = min(share, 1.0)
        return radius * radius * (math.asin(s) - s * math.sqrt(1.0 - s * s))
    # Both terms cancel: at s = 1.25e-4 (a pixel 4000 pixels out) they keep 7 digits, at s = 0.05
    # they lose 3. The series keeps all of them up to there (next term: 1e-16 of the sum), and takes
    # a tenth of the time.
    series = 3.0 / 28.0 + s2 * (5.0 / 72.0 + s2 * (35.0 / 704.0 + s2 * (63.0 / 1664.0)))
    return radius * radius * share * s2 * (2.0 / 3.0 + s2 * (0.2 + s2 * series))


@jit
def area_under_arc(radius: float, xa: float, ya: float, xb: float, yb: float, y0: float) -> float:
    """Integral of sqrt(R^2 - x^2) - y0 over [xa, xb]: a trapezoid and the segment above it."""
    along, down = (xb - xa) / (2.0 * radius), (ya - yb) / (2.0 * radius)
    trapezoid = (xb - xa) * (0.5 * ((ya - y0) + (yb - y0)))
    return trapezoid + circular_segment(radius, math.sqrt(along * along + down * down))


@jit
def half_chord(radius: float, x: float) -> float:
    """Half the chord at distance x: sqrt(R^2 - x^2), factored so that x near R keeps its digits."""
    return math.sqrt(max((radius - x) * (radius + x), 0.0))


@jit
def disk_pixel_area(radius: float, x0: float, x1: float, y0: float, y1: float) -> float:
    """Return the disk's area inside [x0, x1] x [y0, y1], 0 <= x0, 0 <= y0, if its edge cuts it."""
    if half_chord(radius, y0) <= x0 or radius <= y0:
        return 0.0
    if half_chord(radius, x0) > y1 and radius > y1:
        xa = min(half_chord(radius, y1), x1)
        ya = y1
    else:
        xa = x0
        ya = half_chord(radius, x0)
    if half_chord(radius, x1) > y0 and radius > x1:
        xb = x1
        yb = half_chord(radius, x1)
    else:
        xb = half_chord(radius, y0)
        yb = y0
    if xb <= xa:
        return (min(xa, x1) - x0) * (y1 - y0)
    return (xa - x0) * (y1 - y0) + area_under_arc(radius, xa, ya, xb, yb, y0)


@jit
def disk_strip_area(radius: float, x0: float, x1: float) -> float:
    """Return the disk's area inside [x0, x1] x (-inf, inf), 0 <= x0 < R."""
    xb = min(x1, radius)
    return 2.0 * area_under_arc(radius, x0, half_chord(radius, x0), xb, half_chord(radius, xb), 0.0)


@jit
def span(k: int, pitch: float) -> tuple[float, float, float]:
    """Return the part of pixel k at x >= 0, [(k-1/2)p, (k+1/2)p], and the number of such parts."""
    if k == 0:
        return 0.0, 0.5 * pitch, 2.0
    return (k - 0.5) * pitch, (k + 0.5) * pitch, 1.0


@jit
def fill_line(line: FloatArray, radii: FloatArray, densities: FloatArray, pitch: float) -> None:
    """Add to ``line`` (h+1, C) the energy in strips of one pixel's width at x >= 0."""
    first = 0
    for k in range(line.shape[0]):
        x0, x1, copies = span(k, pitch)
        while first < radii.size and radii[first] <= x0:
            first += 1
        inner = 0.0
        for j in range(first, radii.size):
            area = disk_strip_area(radii[j], x0, x1)
            add_share(line[k], densities[j], copies * (area - inner))
            inner = area


@jit
def fill_quadrant(
    quadrant: FloatArray, radii: FloatArray, densities: FloatArray, pitch: float
) -> None:
    """Add to ``quadrant`` (h+1, h+1, C) the energy in its pixels.

    A pixel and its mirror in the diagonal are equal, so half of them are computed.
    """
    n = quadrant.shape[0]
    first_on_diagonal = 0
    for k in range(n):
        first_on_diagonal = first_beyond(radii, first_on_diagonal, k, k, pitch)
        first = first_on_diagonal
        for i in range(k, n):
            first = first_beyond(radii, first, i, k, pitch)
            if first == radii.size:
                break
            add_pixel(quadrant[i, k], radii, densities, first, i, k, pitch)
            # Channel by channel: the assignment of a row takes 3 s to compile.
            for c in range(quadrant.shape[2]):
                quadrant[k, i, c] = quadrant[i, k, c]


@jit
def first_beyond(radii: FloatArray, start: int, i: int, k: int, pitch: float) -> int:
    """Return the first edge from ``start`` on that reaches into pixel (i, k)."""
    nearest = math.hypot(span(i, pitch)[0], span(k, pitch)[0])
    while start < radii.size and radii[start] <= nearest:
        start += 1
    return start


@jit
def add_pixel(
    pixel: FloatArray,
    radii: FloatArray,
    densities: FloatArray,
    first: int,
    i: int,
    k: int,
    pitch: float,
) -> None:
    """Add to ``pixel`` (C) the energy of the annuli from ``first`` on in pixel (i, k)."""
    x0, x1, x_copies = span(k, pitch)
    y0, y1, y_copies = span(i, pitch)
    copies = x_copies * y_copies
    farthest = math.hypot(x1, y1)
    inner = 0.0
    for j in range(first, radii.size):
        if radii[j] >= farthest:
            add_share(pixel, densities[j], copies * ((x1 - x0) * (y1 - y0) - inner))
            return
        area = disk_pixel_area(radii[j], x0, x1, y0, y1)
        add_share(pixel, densities[j], copies * (area - inner))
        inner = area


@jit
def add_share(energy: FloatArray, density: FloatArray, area: float) -> None:
    """Add density times area, channel by channel."""
    for c in range(energy.size):
        energy[c] += density[c] * max(area, 0.0)


def enter(
    is_plane: int,
    edges: int,
    channels: int,
    half_pixels: int,
    pitch: float,
    radii: Address,
    densities: Address,
    energies: Address,
) -> int:
    """Call the functions above with arrays at the addresses that ``pixel_energy.ENTRY`` passes."""
    n = half_pixels + 1
    outer = carray(radii, (edges,), np.float64)
    inside = carray(densities, (edges, channels), np.float64)
    if is_plane != 0:
        fill_quadrant(carray(energies, (n, n, channels), np.float64), outer, inside, pitch)
    else:
        fill_line(carray(energies, (n, channels), np.float64), outer, inside, pitch)
    return 0
