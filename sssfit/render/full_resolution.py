"""A table of taps with nothing halved: every pixel holds what small pictures hold at their texels.

The stages, and the filters that halve a picture and bring it back, then see light alike at every
place, so a mirrored picture's cosines w are only scaled,

    K^(wx, wy) = sum_l m_l U_l prod_{j <= l} D_j b_j(2^v wx, 2^v wy),    v the level of stage j,
    D = cos(2^v w / 2) along either axis for each halving,  U = 3/4 cos(2^v w / 2) + 1/4 cos(3 2^v w
    / 2) for each way back,

which is the mean of what the table shows of light over all places among the texels. What a rendered
picture has beyond it is aliasing: the cost of halving.
"""

import numpy as np
from scipy import fft

from sssfit.arrays import FloatArray
from sssfit.errors import RenderError
from sssfit.kernel.taps import Stage, Taps
from sssfit.render.borders import scene_for
from sssfit.scene.record import Scene


def render_full_resolution(scene: Scene, taps: Taps) -> FloatArray:
    """Blur irradiance by a chain of stages without halving it, mirrored at its borders.

    Parameters
    ----------
    scene : Scene
        A flat picture.
    taps : Taps
        A cascade: chained.

    Returns
    -------
    array (H, W, C)
        Radiant exitance.

    Raises
    ------
    RenderError
        The table is no chain or has turned stages, or its channels do not fit the picture.
    """
    if not taps.chained:
        raise RenderError("only a cascade has halved pictures; render other tables as they are.")
    if not all(each.kind == "star" or each.is_upright for each in taps.stages):
        raise RenderError(
            f"{taps.structure} has stages in other directions than the axes, which mix a picture's "
            "cosines; render it as it is."
        )
    scene = scene_for(scene, taps.channels)
    wy, wx = (np.pi * np.arange(n) / n for n in (scene.height, scene.width))
    spectrum = _spectrum(taps, scene.mm_per_pixel, wy, wx)
    waves = fft.dctn(scene.irradiance, axes=(0, 1), norm="ortho")
    shown: FloatArray = fft.idctn(waves * spectrum, axes=(0, 1), norm="ortho")
    return shown


def _spectrum(taps: Taps, mm_per_pixel: float, wy: FloatArray, wx: FloatArray) -> FloatArray:
    """Return the mean spectrum of a chain at frequencies [radians a pixel], (H, W, C)."""
    total = np.tile(taps.blend[0], (wy.size, wx.size, 1))
    chain, back, level = np.ones_like(total), np.ones((wy.size, wx.size, 1)), 0
    for stage, share in zip(taps.stages, taps.blend[1:], strict=True):
        for halved in range(level, stage.level):
            down, up = (
                [one(2.0**halved * w) for w in (wy, wx)] for one in (_halving, _coming_back)
            )
            chain *= np.multiply.outer(*down)[..., None]
            back = back * np.multiply.outer(*up)[..., None]
        level = stage.level
        scale = 2.0**level
        chain *= _blur(stage, mm_per_pixel * scale, scale * wy, scale * wx)
        total += share * chain * back
    return total


def _halving(w: FloatArray) -> FloatArray:
    found: FloatArray = np.cos(0.5 * w)
    return found


def _coming_back(w: FloatArray) -> FloatArray:
    found: FloatArray = 0.75 * np.cos(0.5 * w) + 0.25 * np.cos(1.5 * w)
    return found


def _blur(stage: Stage, mm_per_texel: float, wy: FloatArray, wx: FloatArray) -> FloatArray:
    """Return a stage's spectrum at frequencies [radians a texel], (H, W, C)."""
    if stage.kind == "pair":
        line = stage.pass_weights(mm_per_texel)
        y, x = (_waves(w, line) for w in (wy, wx))  # (n, C)
        return y[:, None] * x[None]
    (dy, ay), (dx, ax) = ([_fetch(stage, k, mm_per_texel, w) for k in (0, 1)] for w in (wy, wx))
    middle, diagonal, axis = stage.weights
    found: FloatArray = (
        middle
        + diagonal * np.multiply.outer(dy, dx)[..., None]
        + axis * np.add.outer(ay, ax)[..., None]
    )
    return found


def _fetch(stage: Stage, k: int, mm_per_texel: float, w: FloatArray) -> FloatArray:
    """Return the spectrum (n,) of a star's two fetches at either side, at its k-th offset."""
    return _waves(w, stage.line(stage.offsets_mm[k : k + 1], np.ones((1, 1)), mm_per_texel))[:, 0]


def _waves(w: FloatArray, line: FloatArray) -> FloatArray:
    """Return the spectrum (n, C) of an even line (2m+1, C)."""
    place = np.arange(len(line)) - len(line) // 2
    found: FloatArray = np.cos(np.outer(w, place)) @ line
    return found
