"""A slow renderer of tables of taps, fetch by fetch, from the definition alone."""

import functools
import math
import struct
from fractions import Fraction

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
        out[row, column] = around(picture, row, column, fetches, border, cover)
    return out


def around(picture, row, column, fetches, border, cover):
    """The sum of one texel."""
    if cover is None:
        return sum(w * fetch(picture, row + dy, column + dx, border) for w, dy, dx in fetches)
    lit = picture * cover
    light = sum(w * fetch(lit, row + dy, column + dx, border) for w, dy, dx in fetches)
    part = sum(w * fetch(cover, row + dy, column + dx, border) for w, dy, dx in fetches)
    return light / part if part > 0.0 else 0.0


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
    turns = (0, 90) if stage.kind == "pair" else (0,)
    angles = [math.radians(stage.angle_degrees + turn) for turn in turns]
    return [[(w, o * math.sin(angle), o * math.cos(angle)) for w, o in line] for angle in angles]


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


def as_half(value):
    """A half, by the standard library."""
    return struct.unpack("e", struct.pack("e", value))[0]


def as_small_float(value, mantissa):
    """The nearest unsigned float of 5 bits of exponent, by all that there are; ties to even."""
    codes = _codes(mantissa)
    above = int(np.searchsorted(codes, value))
    if above < len(codes) and codes[above] == value:
        return value
    if above == len(codes):
        raise OverflowError(value)
    low, high = Fraction(codes[above - 1]), Fraction(codes[above])
    middle, exact = (low + high) / 2, Fraction(value)
    if exact == middle:
        return codes[above] if above % 2 == 0 else codes[above - 1]
    return codes[above] if exact > middle else codes[above - 1]


@functools.cache
def _codes(mantissa):
    """All finite numbers of the format in the order of their bits."""
    values = []
    for exponent in range(31):
        for bits in range(2**mantissa):
            if exponent == 0:
                values.append(bits * 2.0 ** (-14 - mantissa))
            else:
                values.append((2**mantissa + bits) * 2.0 ** (exponent - 15 - mantissa))
    return values


def as_code(light):
    """The sRGB code of light (IEC 61966-2-1)."""
    return 12.92 * light if light <= 0.0031308 else 1.055 * light ** (1 / 2.4) - 0.055


def as_light(code):
    """The light of an sRGB code."""
    return code / 12.92 if code <= 0.04045 else ((code + 0.055) / 1.055) ** 2.4


def stored_as(name, channel):
    """What a texel of a channel becomes in a format, for whole pictures."""
    store = {
        None: lambda value: value,
        "float32": lambda value: struct.unpack("f", struct.pack("f", value))[0],
        "half": as_half,
        "r11g11b10": lambda value: as_small_float(value, (6, 6, 5)[channel]),
        "rgba8": lambda value: round(255 * value) / 255,
        "srgb8": lambda value: as_light(round(255 * as_code(value)) / 255),
    }[name]
    return np.vectorize(store, otypes=[float])


def rendered(picture, taps, channel, pitch, border="mirror", cover=None, intermediate=None):
    """The sum of the stages' pictures (H, W) of one channel."""
    store = stored_as(intermediate, channel)
    covers, sums, current = [cover], [picture * taps.blend[0, channel]], picture
    for stage, row in zip(taps.stages, taps.blend[1:], strict=True):
        while len(sums) <= stage.level:
            current = store(divided(lambda each: halved(each, border), current, covers[-1]))
            covers.append(None if cover is None else halved(covers[-1], border))
            sums.append(np.zeros_like(current))
        source = current if taps.chained else picture
        passes = passes_of(stage, channel, pitch * 2**stage.level)
        for fetches in passes[:-1]:
            source = store(gathered(source, fetches, border, covers[-1]))
        current = gathered(source, passes[-1], border, covers[-1])
        if taps.chained and stage is not taps.stages[-1]:  # those of terms are added up as made
            current = store(current)
        sums[-1] = sums[-1] + row[channel] * current
    for level in range(len(sums) - 2, -1, -1):
        size = sums[level].shape

        def up(each, size=size):
            return doubled(each, size, border)

        sums[level] = sums[level] + divided(up, store(sums[level + 1]), covers[level + 1])
    return sums[0] if cover is None else np.where(cover > 0.0, sums[0], 0.0)


def turn_of(x, y, frame):
    """The angle of a pixel in a frame: pcg2d of its place, on words of 32 bits."""
    x, y = ((each * 1664525 + 1013904223) % 2**32 for each in (x, y))
    for _ in range(2):
        x = (x + y * 1664525) % 2**32
        y = (y + x * 1664525) % 2**32
        x, y = x ^ (x >> 16), y ^ (y >> 16)
    return 2 * math.pi * ((x + frame * 2654435769) % 2**32) / 2**32


def disk_fetches(stage, channel, pitch, turn):
    """The fetches (weight, dy, dx) of a disk that is turned."""
    golden = (1 + math.sqrt(5)) / 2
    fetches = [(stage.weights[0, channel], 0.0, 0.0)]
    for k, (radius, row) in enumerate(zip(stage.offsets_mm, stage.weights[1:], strict=True)):
        angle = turn + 2 * math.pi * k / golden
        r = radius / pitch
        fetches.append((row[channel], r * math.sin(angle), r * math.cos(angle)))
    return fetches


def rendered_disk(picture, taps, channel, pitch, border="mirror", cover=None, frame=0):
    """A disk's picture (H, W) of one channel, each pixel turned by its own angle."""
    out, (row0, row1) = np.zeros(picture.shape), taps.blend[:, channel]
    for row, column in np.ndindex(*picture.shape):
        turn = turn_of(column, row, frame)
        fetches = disk_fetches(taps.stages[0], channel, pitch, turn)
        out[row, column] = around(picture, row, column, fetches, border, cover)
    out = row0 * picture + row1 * out
    return out if cover is None else np.where(cover > 0.0, out, 0.0)
