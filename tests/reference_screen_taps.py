"""A slow renderer of tables of taps in screen space, fetch by fetch, for tiny pictures.

A picture is a dict from (row, column) of what an object covers to a texel: its coverage, its depth
and its light.
"""

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np
from reference_screen import pixels_per_mm, wrapped
from reference_taps import passes_of


@dataclass
class Texel:
    cover: float
    depth: float
    light: float


@dataclass
class View:
    """What all fetches of a resolution share."""

    size: tuple
    border: str
    per_mm: object  # texels per mm at a depth


def texel(texels, view, row, column, own_depth):
    """A texel of the continued picture; dark and covered beyond a dark border, None beside it."""
    place = tuple(wrapped(k, n, view.border) for k, n in zip((row, column), view.size, strict=True))
    return Texel(1.0, own_depth, 0.0) if None in place else texels.get(place)


def seen(texels, view, y, x, own_depth):
    """What a bilinear fetch sees: its coverage, and the means of light and depth over it."""
    found = []
    for row, column in itertools.product((0, 1), (0, 1)):
        part = abs(1 - row - (y - math.floor(y))) * abs(1 - column - (x - math.floor(x)))
        each = texel(texels, view, math.floor(y) + row, math.floor(x) + column, own_depth)
        if each is not None and part > 0:
            found.append((part * each.cover, each))
    cover = sum(part for part, _ in found)
    if cover == 0:
        return 0.0, 0.0, 0.0
    light = sum(part * each.light for part, each in found) / cover
    return cover, light, sum(part * each.depth for part, each in found) / cover


def passed(texels, view, fetches, variance):
    """One pass: fetches (weight, dy, dx) in mm."""
    out = {}
    for (row, column), own in texels.items():
        scale = view.per_mm(own.depth)
        light = total = 0.0
        for weight, dy, dx in fetches:
            y, x = row + dy * scale, column + dx * scale
            cover, shown, depth = seen(texels, view, y, x, own.depth)
            near = math.exp(-((depth - own.depth) ** 2) / (2 * variance))
            light += weight * cover * near * shown
            total += weight * cover * near
        out[row, column] = replace(own, light=light / total if total > 0 else own.light)
    return out


def smaller(texels, view, variance):
    """Half the size: of 2 x 2 texels what is covered, as far as it is near the nearest in depth."""
    out = {}
    for row, column in np.ndindex(*(math.ceil(n / 2) for n in view.size)):
        four = []
        for r, c in itertools.product((0, 1), (0, 1)):
            y, x = 2 * row + r, 2 * column + c
            # An odd last texel continues in coverage and depth; beyond a dark border it is black.
            inside = min(y, view.size[0] - 1), min(x, view.size[1] - 1)
            each = texels.get(inside)
            if each is not None:
                dark = view.border == "zero" and inside != (y, x)
                four.append(replace(each, light=0.0) if dark else each)
        if four:
            nearest = min(each.depth for each in four)
            parts = [
                each.cover * math.exp(-((each.depth - nearest) ** 2) / (2 * variance))
                for each in four
            ]
            light, depth = (
                sum(part * getattr(each, name) for part, each in zip(parts, four, strict=True))
                / sum(parts)
                for name in ("light", "depth")
            )
            out[row, column] = Texel(sum(parts) / 4, depth, light)
    return out


def larger(coarse, coarse_view, fine, variance):
    """What each texel of ``fine`` sees of a picture of half the size."""
    out = {}
    for (row, column), own in fine.items():
        light = total = 0.0
        for r, c in itertools.product((0, 1), (0, 1)):
            y = row // 2 + r * (1 if row % 2 else -1)
            x = column // 2 + c * (1 if column % 2 else -1)
            each = texel(coarse, coarse_view, y, x, own.depth)
            if each is None:
                continue
            part = (0.25 if r else 0.75) * (0.25 if c else 0.75) * each.cover
            part *= math.exp(-((each.depth - own.depth) ** 2) / (2 * variance))
            light, total = light + part * each.light, total + part
        out[row, column] = light / total
    return out


def variance_of(stage, channel):
    """Of where the fetches of a pass move along an axis; a stage of two passes has its own each."""
    fetches = passes_of(stage, channel, 1.0)[0]
    return sum(weight * dx**2 for weight, _, dx in fetches)


def screened(scene, taps, channel, *, border="mirror", variance=None):
    """Radiant exitance (H, W) of a channel, without specular light.

    ``variance`` is that of the depth factor of all stages, by default each stage's own.
    """
    mask = np.ones((scene.height, scene.width), int) if scene.mask is None else scene.mask
    light = scene.irradiance[..., min(channel, scene.channels - 1)]
    out = np.array(light)
    for number in set(mask[mask > 0].tolist()):
        own = {tuple(p): Texel(1.0, scene.depth_mm[tuple(p)], light[tuple(p)])
               for p in np.argwhere(mask == number)}  # fmt: skip
        for place, value in _object(scene, taps, channel, own, border, variance).items():
            out[place] = value
    return out


def _object(scene, taps, channel, own, border, variance):
    views, shown, current, firsts = [], [], own, []
    size = scene.height, scene.width
    for stage, row in zip(taps.stages, taps.blend[1:], strict=True):
        v = variance_of(stage, channel) if variance is None else variance
        while len(views) <= stage.level:
            level = len(views)
            if level:
                widest = max(variance_of(stage, c) for c in range(len(taps.channels)))
                current = smaller(current, views[-1], widest)
                size = tuple(math.ceil(n / 2) for n in size)
            views.append(
                View(size, border, lambda depth, s=2**level: pixels_per_mm(scene, depth) / s)
            )
            first = taps.blend[0, channel] if level == 0 else 0.0
            shown.append({place: first * each.light for place, each in current.items()})
            shown_texels = current
            firsts.append((shown_texels, v))
        source = current if taps.chained else own
        for fetches in passes_of(stage, channel, 1.0):
            source = passed(source, views[-1], fetches, v)
        current = source
        for place, each in current.items():
            shown[-1][place] += row[channel] * each.light
    for level in range(len(views) - 2, -1, -1):
        texels, v = firsts[level + 1]
        coarse = {
            place: replace(each, light=shown[level + 1][place]) for place, each in texels.items()
        }
        for place, value in larger(coarse, views[level + 1], firsts[level][0], v).items():
            shown[level][place] += value
    return shown[0]
