"""The stages of one level of a cascade, run through together so that their pictures stay in cache.

Row by row each stage blurs along x into a ring of rows, and along y out of it into another, as far
behind the stage before as its own reach; a row is added up when the last stage has blurred it. Only
the picture is read, and the sum and the half-sized picture are written: 2048 x 2048 RGB of two
stages move 113 MB in place of 600.

The picture and its sum lie as the caller's do, the channels of a pixel side by side; all else lies
in planes, a row's channels one after another. So a pass has one weight for all numbers of a line,
and means and doublings step by 2: 1-1|2-2|2-2 on 2048 x 2048 RGB takes 44 ms on one thread. Pixels
throughout took 65 ms: a pass read rows of weights, and the compiler gathered single numbers.

The picture is mirrored at its borders. A mirrored picture blurred by an even pass is mirrored, bit
for bit, so rows past a border or a block are computed like any others and blocks do not matter.

All rows that a block works on are in one array, ``values``; places in it are unsigned, because a
signed index may count from the end, a question at every number that keeps loops from vectors.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit._jit import jit

FloatArray = npt.NDArray[np.floating[Any]]  # float32 or float64, one of them throughout a call
IndexArray = npt.NDArray[np.intp]
PlaceArray = npt.NDArray[np.uintp]
Weight = Any  # a number of the picture's precision


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


@jit
def blur(
    values: FloatArray,
    out: np.uintp,
    middle: np.uintp,
    before: PlaceArray,
    after: PlaceArray,
    weights: FloatArray,
    s: int,
    pairs: int,
    plane: int,
    n: np.uintp,
) -> None:
    """Blur a row of C lines of n numbers, ``plane`` apart, by the pass of stage ``s``.

    The first line's middle and its pairs are at ``middle``, ``before`` (K) and ``after`` (K).
    """
    for c in range(weights.shape[2]):
        line = np.uintp(c * plane)
        to, a1, b1 = out + line, before[0] + line, after[0] + line
        w0, w1 = weights[s, 0, c], weights[s, 1, c]
        if pairs == 1:
            one_pair(values, to, middle + line, a1, b1, w0, w1, n)
        else:
            a2, b2, w2 = before[1] + line, after[1] + line, weights[s, 2, c]
            two_pairs(values, to, middle + line, a1, b1, a2, b2, w0, w1, w2, n)
        for k in range(2, pairs, 2):
            a1, b1, w1 = before[k] + line, after[k] + line, weights[s, k + 1, c]
            if k + 1 == pairs:
                one_more(values, to, a1, b1, w1, n)
            else:
                a2, b2, w2 = before[k + 1] + line, after[k + 1] + line, weights[s, k + 2, c]
                two_more(values, to, a1, b1, a2, b2, w1, w2, n)


@jit
def begin_sum(
    values: FloatArray,
    total: np.uintp,
    line: np.uintp,
    blurred: np.uintp,
    share: Weight,
    next_share: Weight,
    n: np.uintp,
) -> None:
    """Write the sum of a line and of the stage after it, each times its share."""
    for x in range(n):
        values[total + x] = share * values[line + x] + next_share * values[blurred + x]


@jit
def gather(values: FloatArray, total: np.uintp, line: np.uintp, share: Weight, n: np.uintp) -> None:
    """Add a share of a line to a sum."""
    for x in range(n):
        values[total + x] += share * values[line + x]


@jit
def add_up(
    values: FloatArray, out: int, places: IndexArray, shares: FloatArray, plane: int, n: np.uintp
) -> None:
    """Write the sum of the rows at S + 1 places, each times its share (S + 1, C)."""
    for c in range(shares.shape[1]):
        shift = c * plane
        total, first = np.uintp(out + shift), np.uintp(places[0] + shift)
        begin_sum(values, total, first, np.uintp(places[1] + shift), shares[0, c], shares[1, c], n)
        for s in range(2, places.size):
            gather(values, total, np.uintp(places[s] + shift), shares[s, c], n)


@jit
def mirror_ends(
    values: FloatArray, row: int, plane: int, columns: IndexArray, width: int, channels: int
) -> None:
    """Continue the C lines of a row on both sides from the source columns (B + W + B)."""
    beyond = (columns.size - width) // 2
    for c in range(channels):
        line = row + c * plane
        for k in range(beyond):
            values[line - beyond + k] = values[line + columns[k]]
            values[line + width + k] = values[line + columns[beyond + width + k]]


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


@jit
def read_row(
    values: FloatArray,
    to: int,
    plane: int,
    picture: FloatArray,
    row: int,
    channels: int,
    is_packed: bool,
) -> None:
    """Read row ``row`` of a picture (H, W C) into C lines; packed are channels side by side."""
    n = picture.shape[1] // channels
    if is_packed and channels == 3:
        read_three(values, np.uintp(to), np.uintp(plane), picture, row, np.uintp(n))
    else:
        for c in range(channels):
            place, step = (c, channels) if is_packed else (c * n, 1)
            line = np.uintp(to + c * plane)
            read_line(values, line, picture, row, np.uintp(place), np.uintp(step), np.uintp(n))


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


@jit
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
        for c in range(channels):
            place, step = (c, channels) if is_packed else (c * n, 1)
            first = np.uintp(line + c * plane)
            write_line(out, row, np.uintp(place), np.uintp(step), values, first, np.uintp(n))


@jit
def mean_texels(out: FloatArray, upper: FloatArray, lower: FloatArray) -> None:
    """Write the means of 2 x 2 texels of two lines."""
    quarter = out.dtype.type(0.25)
    for x in range(out.size):
        p, q = 2 * x, 2 * x + 1
        out[x] = quarter * ((upper[p] + upper[q]) + (lower[p] + lower[q]))


@jit
def halve_rows(
    half: FloatArray,
    row: int,
    values: FloatArray,
    upper: int,
    lower: int,
    plane: int,
    channels: int,
) -> None:
    """Write row ``row`` of the half-sized picture; lines go on past an odd width."""
    n = half.shape[1] // channels
    for c in range(channels):
        a, b, place = upper + c * plane, lower + c * plane, c * n
        texels = half[row][place : place + n]
        mean_texels(texels, values[a : a + 2 * n], values[b : b + 2 * n])


@jit
def run_level(
    picture: FloatArray,
    total: FloatArray,
    half: FloatArray,
    rows: IndexArray,
    columns: IndexArray,
    reach: IndexArray,
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
        Source rows and columns, beyond each border as far as all stages reach, and one more.
    reach, many : array (S)
        Of each stage: how far it reaches [texels], and its number of pairs of texels.
    at : array (S, K)
    weights : array (S, 1 + K, C)
    shares : array (S + 1, C)
        Of the picture and each stage in the sum.
    is_packed : bool
        Whether picture and sum have the channels of a pixel side by side, or planes.
    """
    stages, channels = reach.size, shares.shape[1]
    width, far = picture.shape[1] // channels, reach.sum()
    above, beyond = (rows.size - len(picture)) // 2, (columns.size - width) // 2
    plane = width + 2 * beyond
    size, n = channels * plane, np.uintp(width)
    # Rings of rows: of the sum, one; of what each stage blurs, and of the last picture, until they
    # are summed up; of what has been blurred along x. A row lies in its ring by its number.
    behind = np.append(0, np.cumsum(reach))  # how far each picture's newest row is, from the first
    kept, spread = np.maximum(far - behind + 1, 2), 2 * reach + 1
    lines = beyond + size * (1 + np.cumsum(kept) - kept)
    rings = lines[-1] + size * (2 + np.cumsum(spread) - spread)
    values = np.empty(rings[-1] + size * spread[-1], picture.dtype)
    before, after = np.empty(at.shape[1], np.uintp), np.empty(at.shape[1], np.uintp)
    end = last + (last - first) % 2 if half.size > 0 else last  # an odd last row has a partner
    for t in range(first - 2 * far, end):
        row = t + far
        line = lines[0] + row % kept[0] * size
        read_row(values, line, plane, picture, rows[above + row], channels, is_packed)
        mirror_ends(values, line, plane, columns, width, channels)
        for s in range(stages):
            for k in range(many[s]):
                before[k], after[k] = line - at[s, k], line + at[s, k]
            into = np.uintp(rings[s] + row % spread[s] * size)
            blur(values, into, np.uintp(line), before, after, weights, s, many[s], plane, n)
            row -= reach[s]
            if t < first - 2 * (far - behind[s + 1]):
                break  # the rows around it are not there yet
            for k in range(many[s]):
                before[k] = rings[s] + (row - at[s, k]) % spread[s] * size
                after[k] = rings[s] + (row + at[s, k]) % spread[s] * size
            middle = np.uintp(rings[s] + row % spread[s] * size)
            line = lines[s + 1] + row % kept[s + 1] * size
            blur(values, np.uintp(line), middle, before, after, weights, s, many[s], plane, n)
            mirror_ends(values, line, plane, columns, width, channels)
        if first <= t < last:
            places = lines + t % kept * size
            add_up(values, beyond, places, shares, plane, n)
            write_row(total, t, values, beyond, plane, channels, is_packed)
        if t >= first and half.size > 0 and t % 2 == 1:
            halve_rows(half, t // 2, values, lines[-1], lines[-1] + size, plane, channels)


@jit
def enlarge(out: FloatArray, line: FloatArray) -> None:
    """Write a line of texels at twice the width; it has one more at each end."""
    near, far = out.dtype.type(0.75), out.dtype.type(0.25)
    for x in range(line.size - 2):
        middle = near * line[x + 1]
        out[2 * x] = middle + far * line[x]
        out[2 * x + 1] = middle + far * line[x + 2]


@jit
def add_three(
    total: FloatArray,
    row: int,
    wide: FloatArray,
    u: np.uintp,
    v: np.uintp,
    plane: np.uintp,
    n: np.uintp,
) -> None:
    """Add a row between two of lines, at u and the farther v, to one of three channels."""
    near, far = wide.dtype.type(0.75), wide.dtype.type(0.25)
    u1, v1, u2, v2 = u + plane, v + plane, u + plane + plane, v + plane + plane
    for x in range(n):
        p = np.uintp(3) * x
        q, r = p + np.uintp(1), p + np.uintp(2)
        total[row, p] += near * wide[u + x] + far * wide[v + x]
        total[row, q] += near * wide[u1 + x] + far * wide[v1 + x]
        total[row, r] += near * wide[u2 + x] + far * wide[v2 + x]


@jit
def add_line(
    total: FloatArray,
    row: int,
    place: np.uintp,
    step: np.uintp,
    wide: FloatArray,
    u: np.uintp,
    v: np.uintp,
    n: np.uintp,
) -> None:
    """Add a line between two to a channel of a row."""
    near, far = wide.dtype.type(0.75), wide.dtype.type(0.25)
    for x in range(n):
        total[row, place] += near * wide[u + x] + far * wide[v + x]
        place += step


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
    width, narrow = total.shape[1] // channels, coarse.shape[1] // channels
    n, plane, padded = np.uintp(width), 2 * narrow, narrow + 2
    size = channels * plane
    lines = np.empty(channels * padded, total.dtype)
    wide = np.empty(3 * size, total.dtype)  # rows k - 1, k, k + 1 in turn
    for k in range(first // 2 - 1, (last - 1) // 2 + 2):
        read_row(lines, 1, padded, coarse, rows[1 + k], channels, False)
        mirror_ends(lines, 1, padded, columns, narrow, channels)
        for c in range(channels):
            line, out = c * padded, k % 3 * size + c * plane
            enlarge(wide[out : out + plane], lines[line : line + padded])
        for y in (2 * k - 1, 2 * k):  # between rows k - 1 and k
            if not first <= y < last:
                continue
            u, v = (k - 1) % 3 * size, k % 3 * size
            if y == 2 * k:
                u, v = v, u  # the nearer one
            if is_packed and channels == 3:
                add_three(total, y, wide, np.uintp(u), np.uintp(v), np.uintp(plane), n)
                continue
            for c in range(channels):
                place, step = (c, channels) if is_packed else (c * width, 1)
                uc, vc = np.uintp(u + c * plane), np.uintp(v + c * plane)
                add_line(total, y, np.uintp(place), np.uintp(step), wide, uc, vc, n)
