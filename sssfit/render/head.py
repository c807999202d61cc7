"""x."""
import numpy as np
from sssfit.render._head_face import face
from sssfit.render._head_shape import FLOOR_MM
from sssfit.render._field import HeightField, Lamps, light_field
from sssfit.render.scene import Scene
import os
from concurrent.futures import ThreadPoolExecutor
BUST_MM = (230.0, -260.0, 136.0)

def _nodes(low, high, spacing):
    return spacing * np.arange(np.floor(low / spacing), np.ceil(high / spacing) + 1.0)

def head_field(x, y, spacing, threads, detail_mm=0.1):
    heights = np.empty((y.size, x.size)); inner = np.empty_like(heights)
    def strip(first):
        part = slice(first, first + 32)
        z, eyes = face(x[None, :], y[part, None])
        heights[part], inner[part] = np.maximum(z, FLOOR_MM - 10.0), eyes
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(strip, range(0, y.size, 32)))
    return HeightField(heights, x[0], y[0], spacing, inner)

def direction(side, up):
    a, h = np.radians([side, up])
    return (float(np.sin(a) * np.cos(h)), float(np.sin(h)), float(np.cos(a) * np.cos(h)))

def head_scene(*, height, width, mm_per_pixel, distance_mm=600.0, light_degrees=(-45.0, 35.0), detail_mm=0.1, smooth=True, threads=None):
    threads = threads or os.cpu_count() or 1
    spacing = min(max(0.75 * mm_per_pixel, 0.02), 0.4)
    grow = (distance_mm - FLOOR_MM) / distance_mm
    half_w = min(0.5 * width * mm_per_pixel * grow, BUST_MM[0]); half_h = 0.5 * height * mm_per_pixel * grow
    x = _nodes(-half_w, half_w, spacing); y = _nodes(max(-half_h, BUST_MM[1]), min(half_h, BUST_MM[2]), spacing)
    fine = head_field(x, y, spacing, threads, detail_mm)
    whole = half_w >= BUST_MM[0] and half_h >= -BUST_MM[1]
    coarse = None if whole else head_field(_nodes(-BUST_MM[0], BUST_MM[0], 0.8), _nodes(BUST_MM[1], BUST_MM[2], 0.8), 0.8, threads, 0.0)
    side, up = light_degrees
    lamps = Lamps(direction(side, up), direction(-0.8 * side, 0.3 * up), (1.0, 0.06, 0.05))
    b = light_field(fine, lamps, shape=(height, width), mm_per_pixel=mm_per_pixel, distance_mm=distance_mm, floor_mm=FLOOR_MM, coarse=coarse, smooth=smooth, threads=threads)
    return Scene("head", b.irradiance[..., None], mm_per_pixel, distance_mm, b.depth_mm, b.labels, b.specular[..., None])
