"""What a shader does in screen space, pixel by pixel and sample by sample, for tiny pictures."""

import functools
import math

import numpy as np


def pixels_per_mm(scene, depth_mm):
    """From the field of view, as the papers write it."""
    half_angle = math.radians(scene.fov_degrees) / 2
    return (scene.height / 2) / (depth_mm * math.tan(half_angle))


@functools.cache
def wrapped(j, n, border):
    """Index of pixel j by what numpy.pad does; None where it is dark."""
    reach = 40 * n
    if border == "zero":
        return j if 0 <= j < n else None
    mode = {"mirror": "symmetric", "clamp": "edge"}[border]
    return int(np.pad(np.arange(n), reach, mode=mode)[j + reach])


def slow_pass(scene, picture, weights, mask, options, *, vertical):
    """One pass of one channel (H, W); light that is lost goes where ``options`` says."""
    height, width = picture.shape
    half = len(weights) // 2
    out = np.zeros((height, width))
    for row in range(height):
        for column in range(width):
            own = mask[row, column]
            if own == 0:
                continue
            depth = scene.depth_mm[row, column]
            scale = options["scale"][row, column]
            step = pixels_per_mm(scene, depth) * options["pitch"] * scale
            seen, seen_weight, seen_light = 0.0, 0.0, 0.0
            lost = 0.0
            for k, weight in enumerate(weights):
                at = (row if vertical else column) + (k - half) * step
                floor = math.floor(at)
                found = []  # (share, light, depth) of the pixels that belong to the object
                for j, share in ((floor, floor + 1 - at), (floor + 1, at - floor)):
                    if share == 0:
                        continue
                    index = wrapped(j, height if vertical else width, options["border"])
                    if index is None:
                        found.append((share, 0.0, depth))
                        continue
                    q = (index, column) if vertical else (row, index)
                    if mask[q] == own:
                        found.append((share, picture[q], scene.depth_mm[q]))
                share = sum(each[0] for each in found)
                seen += weight * (1 - share) * picture[row, column]
                if not found:
                    continue
                light = sum(s * e for s, e, _ in found) / share
                dz = sum(s * d for s, _, d in found) / share - depth
                keep = options["keep"](dz, scale)
                seen += weight * share * keep * light
                lost += weight * share * (1 - keep)
                seen_weight += abs(weight) * share * keep
                seen_light += abs(weight) * share * keep * light
            mean = seen_light / seen_weight if seen_weight else picture[row, column]
            instead = {"none": 0.0, "middle": picture[row, column], "mean": mean}
            out[row, column] = seen + lost * instead[options["lost"]]
    return out


def slow_screen(scene, kernel, *, keep, lost, scale=None, border="mirror"):
    """Radiant exitance (H, W, C); ``keep(c)`` gives a channel's share from (dz, scale)."""
    height, width = scene.height, scene.width
    mask = np.ones((height, width), int) if scene.mask is None else scene.mask
    scale = np.broadcast_to(1.0 if scale is None else scale, (height, width))
    options = {"pitch": kernel.mm_per_pixel, "scale": scale, "lost": lost, "border": border}
    lit = np.broadcast_to(scene.irradiance, (height, width, len(kernel.channels)))
    out = np.zeros(lit.shape)
    for c in range(lit.shape[2]):
        options["keep"] = keep(c)
        for sign, weights in zip(kernel.signs[:, c], kernel.weights[:, :, c], strict=True):
            rows = slow_pass(scene, lit[..., c], weights, mask, options, vertical=False)
            both = slow_pass(scene, rows, weights, mask, options, vertical=True)
            out[..., c] += sign * both * kernel.scale[c]
    out = np.where(mask[..., None] == 0, lit, out)
    return out if scene.specular is None else out + scene.specular


def slow_flat(irradiance, kernel, border):
    """Flat convolution with the whole 2D kernel (H, W, C), by the double loop."""
    height, width, channels = irradiance.shape
    h = kernel.half_pixels
    out = np.zeros(irradiance.shape)
    for c in range(channels):
        full = kernel.full(c)
        for row in range(height):
            for column in range(width):
                for i in range(-h, h + 1):
                    for k in range(-h, h + 1):
                        y = wrapped(row + i, height, border)
                        x = wrapped(column + k, width, border)
                        light = 0.0 if x is None or y is None else irradiance[y, x, c]
                        out[row, column, c] += full[h + i, h + k] * light
    return out


def exact_pass(x_mm, dz_mm, near_mm2, far_mm2, weight):
    """Supplement E, first line: a_m(sqrt(x^2 + dz^2)), a Gaussian exp(-d^2 / 2v) / sqrt(2 pi v)."""
    d = np.hypot(x_mm, dz_mm)
    return sum(
        share * np.exp(-(d**2) / (2 * v)) / np.sqrt(2 * np.pi * v)
        for share, v in ((weight, near_mm2), (1 - weight, far_mm2))
    )
