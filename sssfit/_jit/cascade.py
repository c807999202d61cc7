"""The stages of one level of a cascade, run through together so that their pictures stay in cache.

Rows are (W C), the channels of a pixel side by side, so that every sum runs over neighbouring
numbers with a row of weights that repeats the channels. Row by row each stage blurs along x into a
ring of rows, and along y out of it, as far behind the stage before as its own reach; the sum of the
level is gathered in a ring of its own. Only the picture is read, and the sum and the half-sized
picture are written: 2048 x 2048 RGB of two stages move 113 MB in place of 600.

The picture is mirrored at its borders. A mirrored picture blurred by an even pass is mirrored, bit
for bit, so rows past a border or a block are computed like any others and blocks do not matter.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit._jit import jit

FloatArray = npt.NDArray[np.floating[Any]]  # float32 or float64, one of them throughout a call
IndexArray = npt.NDArray[np.intp]


@jit
def one_pair(
    total: FloatArray,
    w0: FloatArray,
    w1: FloatArray,
    middle: FloatArray,
    a1: FloatArray,
    b1: FloatArray,
) -> None:
    """Write the middle and a pair: w_0 middle + w_1 (a_1 + b_1)."""
    for x in range(total.size):
        total[x] = w0[x] * middle[x] + w1[x] * (a1[x] + b1[x])


@jit
def one_more(total: FloatArray, w1: FloatArray, a1: FloatArray, b1: FloatArray) -> None:
    """Add a pair."""
    for x in range(total.size):
        total[x] += w1[x] * (a1[x] + b1[x])


@jit
def two_more(
    total: FloatArray,
    w1: FloatArray,
    w2: FloatArray,
    a1: FloatArray,
    b1: FloatArray,
    a2: FloatArray,
    b2: FloatArray,
) -> None:
    """Add two pairs."""
    for x in range(total.size):
        total[x] += w1[x] * (a1[x] + b1[x]) + w2[x] * (a2[x] + b2[x])


@jit
def across(
    out: FloatArray, line: FloatArray, pad: int, channels: int, at: IndexArray, weights: FloatArray
) -> None:
    """Blur a row (W C) that lies ``pad`` numbers into ``line``, which continues it on both sides.

    ``at`` (K) has the pairs' distances in texels, ``weights`` (1 + K, chunk) are those of a chunk
    of whole texels.
    """
    chunk = weights.shape[1]
    for first in range(0, out.size, chunk):
        n = min(chunk, out.size - first)
        x, o, total = pad + first, at[0] * channels, out[first : first + n]
        a, b = line[x - o : x - o + n], line[x + o : x + o + n]
        one_pair(total, weights[0, :n], weights[1, :n], line[x : x + n], a, b)
        for k in range(1, at.size, 2):
            o = at[k] * channels
            a, b, w = line[x - o : x - o + n], line[x + o : x + o + n], weights[k + 1, :n]
            if k + 1 == at.size:
                one_more(total, w, a, b)
            else:
                o = at[k + 1] * channels
                far, beyond = line[x - o : x - o + n], line[x + o : x + o + n]
                two_more(total, w, weights[k + 2, :n], a, b, far, beyond)


@jit
def down(out: FloatArray, ring: FloatArray, row: int, at: IndexArray, weights: FloatArray) -> None:
    """Blur along y: row ``row`` (W C) of a ring (n, W C) that holds the rows around it."""
    # A slice of rows and columns at once would not be contiguous, and sums not vectorised.
    chunk, rows = weights.shape[1], ring.shape[0]
    for first in range(0, out.size, chunk):
        last = min(first + chunk, out.size)
        n, total, middle = last - first, out[first:last], ring[row % rows][first:last]
        a, b = ring[(row - at[0]) % rows][first:last], ring[(row + at[0]) % rows][first:last]
        one_pair(total, weights[0, :n], weights[1, :n], middle, a, b)
        for k in range(1, at.size, 2):
            a, b = ring[(row - at[k]) % rows][first:last], ring[(row + at[k]) % rows][first:last]
            w = weights[k + 1, :n]
            if k + 1 == at.size:
                one_more(total, w, a, b)
            else:
                before, after = (row - at[k + 1]) % rows, (row + at[k + 1]) % rows
                far, beyond = ring[before][first:last], ring[after][first:last]
                two_more(total, w, weights[k + 2, :n], a, b, far, beyond)


@jit
def begin_sum(line: FloatArray, total: FloatArray, row: FloatArray, share: FloatArray) -> None:
    """Copy a row into a line, and begin a sum with it times its share by channel."""
    chunk = share.size
    for first in range(0, row.size, chunk):
        last = min(first + chunk, row.size)
        into, t, r = line[first:last], total[first:last], row[first:last]
        for x in range(last - first):
            into[x] = r[x]
            t[x] = share[x] * r[x]


@jit
def add_share(out: FloatArray, total: FloatArray, row: FloatArray, share: FloatArray) -> None:
    """Write a sum of another place plus a row times its share by channel."""
    chunk = share.size
    for first in range(0, row.size, chunk):
        last = min(first + chunk, row.size)
        o, t, r = out[first:last], total[first:last], row[first:last]
        for x in range(last - first):
            o[x] = t[x] + share[x] * r[x]


@jit
def gather_share(total: FloatArray, row: FloatArray, share: FloatArray) -> None:
    """Add a row times its share by channel to a sum."""
    chunk = share.size
    for first in range(0, row.size, chunk):
        last = min(first + chunk, row.size)
        t, r = total[first:last], row[first:last]
        for x in range(last - first):
            t[x] += share[x] * r[x]


@jit
def mirror_ends(line: FloatArray, pad: int, channels: int, columns: IndexArray) -> None:
    """Continue a row on both sides from the source columns (pad / C + W + pad / C)."""
    beyond, width = pad // channels, (line.size - 2 * pad) // channels
    for k in range(beyond):
        left, right = pad + columns[k] * channels, pad + columns[beyond + width + k] * channels
        after = pad + (width + k) * channels
        for c in range(channels):
            line[k * channels + c] = line[left + c]
            line[after + c] = line[right + c]


@jit
def mean_rows(out: FloatArray, upper: FloatArray, lower: FloatArray, channels: int) -> None:
    """Write the means of 2 x 2 texels of two rows; the rows go on past an odd width."""
    quarter = out.dtype.type(0.25)
    for x in range(out.size // channels):
        p = 2 * x * channels
        for c in range(channels):
            i, j = p + c, p + channels + c
            out[x * channels + c] = quarter * ((upper[i] + upper[j]) + (lower[i] + lower[j]))


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
    channels: int,
    first: int,
    last: int,
) -> None:
    """Run rows ``first`` to ``last`` (even but at the end) through the S stages of a level.

    Parameters
    ----------
    picture, total : array (H, W C)
        What the first stage reads, and the level's sum.
    half : array (ceil(H / 2), ceil(W / 2) C) or (0, 0)
        The last stage's picture at half the size; empty at the last level.
    rows, columns : array
        Source rows and columns, beyond each border as far as all stages reach, and one more.
    reach, many : array (S)
        Of each stage: how far it reaches [texels], and its number of pairs of texels.
    at : array (S, K)
    weights : array (S, 1 + K, chunk)
    shares : array (S + 1, chunk)
        Of the picture and each stage in the sum.
    """
    stages, width = reach.size, picture.shape[1]
    far = reach.sum()
    above, pad = (rows.size - len(picture)) // 2, channels * (columns.size - width // channels) // 2
    kind = picture.dtype
    lines = np.zeros((stages + 2, width + 2 * pad), kind)  # the last one takes turns with the next
    rings = np.zeros((stages, 2 * reach.max() + 1, width), kind)
    sums = np.zeros((far + 1, width), kind)
    end = last + (last - first) % 2 if half.size > 0 else last  # an odd last row has a partner
    for t in range(first - 2 * far, end):
        row, ahead = t + far, far
        gathered = sums[row % (far + 1)]
        begin_sum(lines[0, pad : pad + width], gathered, picture[rows[above + row]], shares[0])
        mirror_ends(lines[0], pad, channels, columns)
        for s in range(stages):
            ring = rings[s, : 2 * reach[s] + 1]
            own, own_weights = at[s, : many[s]], weights[s, : many[s] + 1]
            across(ring[row % ring.shape[0]], lines[s], pad, channels, own, own_weights)
            row -= reach[s]
            ahead -= reach[s]
            if t < first - 2 * ahead:
                break  # the rows around it are not there yet
            line = lines[s + 1 + (s == stages - 1 and t % 2 == 1)]
            blurred = line[pad : pad + width]
            down(blurred, ring, row, own, own_weights)
            mirror_ends(line, pad, channels, columns)
            gathered = sums[row % (far + 1)]
            if s < stages - 1 and row >= first:
                gather_share(gathered, blurred, shares[s + 1])
            elif s == stages - 1 and row < last:
                add_share(total[row], gathered, blurred, shares[s + 1])
        if t >= first and half.size > 0 and t % 2 == 1:
            mean_rows(half[t // 2], lines[stages, pad:], lines[stages + 1, pad:], channels)


@jit
def enlarge_row(out: FloatArray, line: FloatArray, channels: int) -> None:
    """Write a row of texels of half the width at full width; the line has one more at each end."""
    near, far = out.dtype.type(0.75), out.dtype.type(0.25)
    for x in range(out.size // (2 * channels)):
        p, q = 2 * x * channels, (x + 1) * channels
        for c in range(channels):
            middle = near * line[q + c]
            out[p + c] = middle + far * line[q - channels + c]
            out[p + channels + c] = middle + far * line[q + channels + c]


@jit
def add_doubled(
    total: FloatArray,
    coarse: FloatArray,
    rows: IndexArray,
    columns: IndexArray,
    channels: int,
    first: int,
    last: int,
) -> None:
    """Add a picture (h, w C) of half the size to rows ``first``, even, to ``last`` of ``total``.

    ``rows`` and ``columns`` are its source rows and columns, with one beyond each border.
    """
    width = total.shape[1]
    near, far = total.dtype.type(0.75), total.dtype.type(0.25)
    line = np.zeros(coarse.shape[1] + 2 * channels, total.dtype)
    wide = np.zeros((3, 2 * coarse.shape[1]), total.dtype)  # rows k - 1, k, k + 1 in turn
    for k in range(first // 2 - 1, (last - 1) // 2 + 2):
        line[channels : channels + coarse.shape[1]] = coarse[rows[1 + k]]
        mirror_ends(line, channels, channels, columns)
        enlarge_row(wide[k % 3], line, channels)
        for y in (2 * k - 1, 2 * k):  # between rows k - 1 and k
            if first <= y < last:
                out = total[y]
                upper, lower = wide[(k - 1) % 3, :width], wide[k % 3, :width]
                if y == 2 * k:
                    upper, lower = lower, upper  # the nearer one
                for x in range(width):
                    out[x] += near * upper[x] + far * lower[x]
