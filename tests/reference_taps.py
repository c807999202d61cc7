"""A slow renderer of tables of taps, fetch by fetch, from the definition alone."""

import math

import numpy as np


def texel(picture, row, column, border):
    """A texel of (H, W), continued past its border."""
    place = []
    for k, size in ((row, picture.shape[0]), (column, picture.shape[1])):
        if border == "mirror":
            k %= 2 * size
            k = min(k, 2 * size - 1 - k)
        elif border == "clamp":
            k = min(max(k, 0), size - 1)
        elif not 0 <= k < size:
            return 0.0
        place.append(k)
    return picture[tuple(place)]


def fetch(picture, y, x, border):
    """A bilinear fetch; texel k has its centre at k."""
    row, column = math.floor(y), math.floor(x)
    v, u = y - row, x - column
    return (
        (1 - v) * (1 - u) * texel(picture, row, column, border)
        + (1 - v) * u * texel(picture, row, column + 1, border)
        + v * (1 - u) * texel(picture, row + 1, column, border)
        + v * u * texel(picture, row + 1, column + 1, border)
    )


def gathered(picture, fetches, border, cover=None):
    """Sum of weight times fetch at (dy, dx) around each texel, divided by that of coverage."""
    out = np.zeros(picture.shape)
    for row, column in np.ndindex(*picture.shape):
        light = sum(w * fetch(picture, row + dy, column + dx, border) for w, dy, dx in fetches)
        if cover is not None:
            lit = picture * cover
            light = sum(w * fetch(lit, row + dy, column + dx, border) for w, dy, dx in fetches)
            part = sum(w * fetch(cover, row + dy, column + dx, border) for w, dy, dx in fetches)
            light = light / part if part > 0.0 else 0.0
        out[row, column] = light
    return out


def passes_of(stage, channel, pitch):
    """The fetches (weight, dy, dx) of each pass of a stage."""
    offsets, weights = stage.offsets_mm / pitch, stage.weights[:, channel]
    if stage.kind == "star":
        (d, a), (w0, w1, w2) = offsets, weights
        corners = [(w1, dy, dx) for dy in (-d, d) for dx in (-d, d)]
        beside = [(w2, 0.0, -a), (w2, 0.0, a), (w2, -a, 0.0), (w2, a, 0.0)]
        return [[(w0, 0.0, 0.0), *corners, *beside]]
    line = [(weights[0], 0.0)]
    for offset, weight in zip(offsets, weights[1:], strict=True):
        line += [(weight, -offset), (weight, offset)]
    return [[(w, 0.0, o) for w, o in line], [(w, o, 0.0) for w, o in line]]


def halved(picture, border):
    """The fetch at the corner of 2 x 2 texels, for each texel of the smaller picture."""
    rows, columns = (math.ceil(size / 2) for size in picture.shape)
    places = np.ndindex(rows, columns)
    values = [fetch(picture, 2 * r + 0.5, 2 * c + 0.5, border) for r, c in places]
    return np.array(values).reshape(rows, columns)


def doubled(picture, size, border):
    """The fetch of each pixel of the larger picture."""
    places = np.ndindex(*size)
    values = [fetch(picture, r / 2 - 0.25, c / 2 - 0.25, border) for r, c in places]
    return np.array(values).reshape(size)


def divided(over, picture, cover):
    """A change of size of light times coverage, divided by that of coverage."""
    if cover is None:
        return over(picture)
    light, part = over(picture * cover), over(cover)
    return np.where(part > 0.0, light / np.where(part > 0.0, part, 1.0), 0.0)


def rendered(picture, taps, channel, pitch, border="mirror", cover=None):
    """The sum of the stages' pictures (H, W) of one channel."""
    covers, sums, current = [cover], [picture * taps.blend[0, channel]], picture
    for stage, row in zip(taps.stages, taps.blend[1:], strict=True):
        while len(sums) <= stage.level:
            current = divided(lambda each: halved(each, border), current, covers[-1])
            covers.append(None if cover is None else halved(covers[-1], border))
            sums.append(np.zeros_like(current))
        source = current if taps.chained else picture
        for fetches in passes_of(stage, channel, pitch * 2**stage.level):
            source = gathered(source, fetches, border, covers[-1])
        current = source
        sums[-1] = sums[-1] + row[channel] * current
    for level in range(len(sums) - 2, -1, -1):
        size = sums[level].shape

        def up(each, size=size):
            return doubled(each, size, border)

        sums[level] = sums[level] + divided(up, sums[level + 1], covers[level + 1])
    return sums[0] if cover is None else np.where(cover > 0.0, sums[0], 0.0)
