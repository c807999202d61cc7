"""The stages of one level of a cascade, run through together so that their pictures stay in cache.

Two rows at a time each stage blurs along y, out of a ring of rows into one line, and that line
along x into the next ring, as far behind the stage before as its own reach; a row is added up when
the last stage has blurred it. Only the picture is read, and the sum and the half-sized picture are
written: 2048 x 2048 RGB of two stages move 113 MB in place of 600. Of the 24 ms that the first two
stages of 1-1|2-2|2-2 take (AVX2, one thread), 10 are the passes, 10 reading and writing, the rest
sums and means. Strips of 512 or 1024 columns and sums of three lines at a time gained nothing.

The picture and its sum lie as the caller's do, the channels of a pixel side by side; all else lies
in planes, a row's channels one after another. So a pass has one weight for all numbers of a line,
and means and doublings step by 2. Pixels throughout took half as long again: a pass read rows of
weights, and the compiler gathered single numbers. Lines are aligned, so that along y no vector
lies across two cache lines. What chooses among the loops over a line is inlined: a call counts
references to each array that it is given.

The picture is mirrored at its borders. A mirrored picture blurred by an even pass is mirrored, bit
for bit, so rows past a border or a block are computed like any others and blocks do not matter.

All rows that a block works on are in one array, ``values``; places in it are unsigned, because a
signed index may count from the end, a question at every number that keeps loops from vectors.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit._jit import jit, jit_inline

FloatArray = npt.NDArray[np.floating[Any]]  # float32 or float64, one of them throughout a call
IndexArray = npt.NDArray[np.intp]
PlaceArray = npt.NDArray[np.uintp]
Weight = Any  # a number of the picture's precision

_ALIGNED = 16  # numbers


@jit
def one_pair(
    values: FloatArray,
    out: np.uintp,
    middle: np.uintp,
    a1: np.uintp,
    b1: np.uintp,
    w0: Weight,
    w1: Weight,
    n: np.uintp,
) -> None:
    """Write the middle and a pair of n numbers: w_0 middle + w_1 (a_1 + b_1)."""
    for x in range(n):
        values[out + x] = w0 * values[middle + x] + w1 * (values[a1 + x] + values[b1 + x])


@jit
def two_pairs(
    values: FloatArray,
    out: np.uintp,
    middle: np.uintp,
    a1: np.uintp,
    b1: np.uintp,
    a2: np.uintp,
    b2: np.uintp,
    w0: Weight,
    w1: Weight,
    w2: Weight,
    n: np.uintp,
) -> None:
    """Write the middle and two pairs."""
    for x in range(n):
        near = w0 * values[middle + x] + w1 * (values[a1 + x] + values[b1 + x])
        values[out + x] = near + w2 * (values[a2 + x] + values[b2 + x])


@jit
def one_more(
    values: FloatArray, out: np.uintp, a1: np.uintp, b1: np.uintp, w1: Weight, n: np.uintp
) -> None:
    """Add a pair."""
    for x in range(n):
        values[out + x] += w1 * (values[a1 + x] + values[b1 + x])


@jit
def two_more(
    values: FloatArray,
    out: np.uintp,
    a1: np.uintp,
    b1: np.uintp,
    a2: np.uintp,
    b2: np.uintp,
    w1: Weight,
    w2: Weight,
    n: np.uintp,
) -> None:
    """Add two pairs."""
    for x in range(n):
        near = w1 * (values[a1 + x] + values[b1 + x])
        values[out + x] += near + w2 * (values[a2 + x] + values[b2 + x])


@jit_inline
def blur(
    values: FloatArray,
    out: np.uintp,
    middle: np.uintp,
    before: PlaceArray,
    after: PlaceArray,
    weights: FloatArray,
    s: int,
    c: int,
    pairs: int,
    n: np.uintp,
) -> None:
    """Blur n numbers by the pass of stage ``s`` and channel ``c``.

    The first number's middle and its pairs are at ``middle``, ``before`` (K) and ``after`` (K).
    """
    a1, b1, w0, w1 = before[0], after[0], weights[s, c, 0], weights[s, c, 1]
    if pairs == 1:
        one_pair(values, out, middle, a1, b1, w0, w1, n)
    else:
        a2, b2, w2 = before[1], after[1], weights[s, c, 2]
        two_pairs(values, out, middle, a1, b1, a2, b2, w0, w1, w2, n)
    for k in range(2, pairs, 2):
        a1, b1, w1 = before[k], after[k], weights[s, c, k + 1]
        if k + 1 == pairs:
            one_more(values, out, a1, b1, w1, n)
        else:
            a2, b2, w2 = before[k + 1], after[k + 1], weights[s, c, k + 2]
            two_more(values, out, a1, b1, a2, b2, w1, w2, n)


@jit
def begin_sum(
    values: FloatArray, total: np.uintp, places: PlaceArray, shares: FloatArray, c: int, n: np.uintp
) -> None:
    """Write the sum of two lines, each times its share."""
    p, q, w0, w1 = places[0], places[1], shares[c, 0], shares[c, 1]
    for x in range(n):
        values[total + x] = w0 * values[p + x] + w1 * values[q + x]


@jit
def gather(values: FloatArray, total: np.uintp, line: np.uintp, share: Weight, n: np.uintp) -> None:
    """Add a share of a line to a sum."""
    for x in range(n):
        values[total + x] += share * values[line + x]


@jit_inline
def add_up(
    values: FloatArray, total: np.uintp, places: PlaceArray, shares: FloatArray, c: int, n: np.uintp
) -> None:
    """Write the sum of n numbers at S + 1 places, each times its share (S + 1)."""
    begin_sum(values, total, places, shares, c, n)
    for s in range(2, places.size):
        gather(values, total, places[s], shares[c, s], n)


@jit
def read_three(
    values: FloatArray, to: np.uintp, plane: np.uintp, picture: FloatArray, row: int, n: np.uintp
) -> None:
    """Read a row of three channels side by side: as fast as a copy, in vectors."""
    second, third = to + plane, to + plane + plane
    for x in range(n):
        p = np.uintp(3) * x
        values[to + x] = picture[row, p]
        values[second + x] = picture[row, p + np.uintp(1)]
        values[third + x] = picture[row, p + np.uintp(2)]


@jit
def read_line(
    values: FloatArray,
    to: np.uintp,
    picture: FloatArray,
    row: int,
    place: np.uintp,
    step: np.uintp,
    n: np.uintp,
) -> None:
    """Read a channel of a row; in vectors for a step of 1."""
    for x in range(n):
        values[to + x] = picture[row, place]
        place += step


@jit_inline
def read_row(
    values: FloatArray,
    to: int,
    plane: int,
    picture: FloatArray,
    row: int,
    columns: IndexArray,
    margin: int,
    channels: int,
    is_packed: bool,
) -> None:
    """Read row ``row`` of a picture (H, W C) into C lines; packed are channels side by side.

    A line begins ``margin`` before the picture and goes on past its borders by ``columns``.
    """
    n = picture.shape[1] // channels
    step, apart = (channels, 1) if is_packed else (1, n)
    is_rgb = is_packed and channels == 3
    if is_rgb:
        read_three(values, np.uintp(to + margin), np.uintp(plane), picture, row, np.uintp(n))
    for c in range(channels):
        line, first = to + c * plane, c * apart
        if not is_rgb:
            into = np.uintp(line + margin)
            read_line(values, into, picture, row, np.uintp(first), np.uintp(step), np.uintp(n))
        for k in range(margin):
            values[line + k] = picture[row, first + columns[k] * step]
        for k in range(margin + n, columns.size):
            values[line + k] = picture[row, first + columns[k] * step]


@jit
def write_three(
    out: FloatArray, row: int, values: FloatArray, line: np.uintp, plane: np.uintp, n: np.uintp
) -> None:
    """Write a row of three channels side by side."""
    second, third = line + plane, line + plane + plane
    for x in range(n):
        p = np.uintp(3) * x
        out[row, p] = values[line + x]
        out[row, p + np.uintp(1)] = values[second + x]
        out[row, p + np.uintp(2)] = values[third + x]


@jit
def write_line(
    out: FloatArray,
    row: int,
    place: np.uintp,
    step: np.uintp,
    values: FloatArray,
    line: np.uintp,
    n: np.uintp,
) -> None:
    """Write a channel of a row."""
    for x in range(n):
        out[row, place] = values[line + x]
        place += step


@jit_inline
def write_row(
    out: FloatArray,
    row: int,
    values: FloatArray,
    line: int,
    plane: int,
    channels: int,
    is_packed: bool,
) -> None:
    """Write C lines to row ``row`` of a picture (H, W C)."""
    n = out.shape[1] // channels
    if is_packed and channels == 3:
        write_three(out, row, values, np.uintp(line), np.uintp(plane), np.uintp(n))
    else:
        step, apart = (channels, 1) if is_packed else (1, n)
        for c in range(channels):
            place, first = np.uintp(c * apart), np.uintp(line + c * plane)
            write_line(out, row, place, np.uintp(step), values, first, np.uintp(n))


@jit_inline
def halve_rows(
    half: FloatArray,
    row: int,
    values: FloatArray,
    upper: int,
    lower: int,
    plane: int,
    channels: int,
) -> None:
    """Write row ``row`` of the half-sized picture: means of 2 x 2 texels of two rows."""
    n, quarter = half.shape[1] // channels, values.dtype.type(0.25)
    for c in range(channels):
        place, a, b = np.uintp(c * n), np.uintp(upper + c * plane), np.uintp(lower + c * plane)
        for x in range(np.uintp(n)):
            p, q = np.uintp(2) * x, np.uintp(2) * x + np.uintp(1)
            near = values[a + p] + values[a + q]
            half[row, place + x] = quarter * (near + (values[b + p] + values[b + q]))


@jit
def run_level(
    picture: FloatArray,
    total: FloatArray,
    half: FloatArray,
    rows: IndexArray,
    columns: IndexArray,
    reach: IndexArray,
    margin: IndexArray,
    kept: IndexArray,
    many: IndexArray,
    at: IndexArray,
    weights: FloatArray,
    shares: FloatArray,
    is_packed: bool,
    first: int,
    last: int,
) -> None:
    """Run rows ``first`` to ``last`` (even but at the end) through the S stages of a level.

    Parameters
    ----------
    picture, total : array (H, W C)
        What the first stage reads, and the level's sum.
    half : array (ceil(H / 2), C ceil(W / 2)) or (0, 0)
        The last stage's picture at half the size, in planes; empty at the last level.
    rows, columns : array
        Source rows and columns, beyond each border as far as all stages reach, and another where
        the size is odd.
    reach, many : array (S)
        For each stage, how far it reaches [texels], and its number of pairs of texels.
    margin, kept : array (S + 1)
        Of the picture and what each stage makes of it: how far past its borders the later stages
        need it (its lines begin there), and the rows that are kept of it.
    at : array (S, K)
    weights : array (S, C, 1 + K)
    shares : array (C, S + 1)
        Shares of the picture and of each stage in the sum.
    is_packed : bool
        Whether picture and sum have the channels of a pixel side by side, or planes.
    """
    stages, channels = reach.size, len(shares)
    width, end = columns.size - 2 * margin[0], last + (last - first) % 2
    plane = -(-columns.size // _ALIGNED) * _ALIGNED
    size = channels * plane
    # First a row for what is blurred along y and for the sum, then a ring of rows for the picture
    # and for what each stage makes of it, until the next has read them and they are summed up. A
    # row lies in its ring by its number.
    rings = np.empty(stages + 1, np.intp)
    rings[0] = size
    for s in range(stages):
        rings[s + 1] = rings[s] + size * kept[s]
    values = np.empty(rings[-1] + size * kept[-1], picture.dtype)
    before, after = np.empty(at.shape[1], np.uintp), np.empty(at.shape[1], np.uintp)
    places = np.empty(stages + 1, np.uintp)
    for t in range(first - 2 * margin[0], end, 2):
        for row in (t + margin[0], t + margin[0] + 1):
            line, source = rings[0] + row % kept[0] * size, rows[margin[0] + row]
            read_row(values, line, plane, picture, source, columns, margin[0], channels, is_packed)
        for s in range(stages):
            m = margin[s + 1]
            n, less = np.uintp(width + 2 * margin[s]), np.uintp(width + 2 * m)
            for c in range(channels):
                blurred, ring, into = c * plane, rings[s] + c * plane, rings[s + 1] + c * plane
                for row in range(max(first - m, t + m), t + m + 2):
                    for k in range(many[s]):
                        before[k] = ring + (row - at[s, k]) % kept[s] * size
                        after[k] = ring + (row + at[s, k]) % kept[s] * size
                    to, middle = np.uintp(blurred), np.uintp(ring + row % kept[s] * size)
                    blur(values, to, middle, before, after, weights, s, c, many[s], n)
                    line = blurred + reach[s]
                    for k in range(many[s]):
                        before[k], after[k] = line - at[s, k], line + at[s, k]
                    to = np.uintp(into + row % kept[s + 1] * size)
                    blur(values, to, np.uintp(line), before, after, weights, s, c, many[s], less)
        if t < first:
            continue
        for row in range(t, min(t + 2, last)):
            for c in range(channels):
                for s in range(stages + 1):
                    places[s] = rings[s] + row % kept[s] * size + c * plane + margin[s]
                add_up(values, np.uintp(c * plane), places, shares, c, np.uintp(width))
            write_row(total, row, values, 0, plane, channels, is_packed)
        if half.size > 0:
            upper = rings[-1]
            halve_rows(half, t // 2, values, upper, upper + size, plane, channels)


@jit
def enlarge(out: FloatArray, line: FloatArray) -> None:
    """Write a line of texels at twice the width; it has one more at each end."""
    near, far = out.dtype.type(0.75), out.dtype.type(0.25)
    for x in range(line.size - 2):
        middle = near * line[x + 1]
        out[2 * x] = middle + far * line[x]
        out[2 * x + 1] = middle + far * line[x + 2]


@jit
def add_between(total: FloatArray, near: FloatArray, far: FloatArray) -> None:
    """Add a line between two others."""
    most, rest = total.dtype.type(0.75), total.dtype.type(0.25)
    for x in range(total.size):
        total[x] += most * near[x] + rest * far[x]


@jit
def add_doubled(
    total: FloatArray,
    coarse: FloatArray,
    rows: IndexArray,
    columns: IndexArray,
    channels: int,
    is_packed: bool,
    first: int,
    last: int,
) -> None:
    """Add a picture (h, C w) of half the size to rows ``first``, even, to ``last`` of ``total``.

    ``rows`` and ``columns`` are its source rows and columns, with one beyond each border.
    """
    padded = columns.size
    plane, doubled = 2 * (padded - 2), channels * padded
    values = np.empty(doubled + channels * plane, total.dtype)
    wide = np.empty((3, total.shape[1]), total.dtype)  # rows k - 1, k, k + 1 in turn
    for k in range(first // 2 - 1, (last - 1) // 2 + 2):
        read_row(values, 0, padded, coarse, rows[1 + k], columns, 1, channels, False)
        for c in range(channels):
            line, out = c * padded, doubled + c * plane
            enlarge(values[out : out + plane], values[line : line + padded])
        write_row(wide, k % 3, values, doubled, plane, channels, is_packed)
        if first <= 2 * k - 1 < last:
            add_between(total[2 * k - 1], wide[(k - 1) % 3], wide[k % 3])
        if first <= 2 * k < last:
            add_between(total[2 * k], wide[k % 3], wide[(k - 1) % 3])
