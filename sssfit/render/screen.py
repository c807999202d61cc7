"""What a shader does in screen space: two passes a term, a kernel in mm seen in perspective.

Seen at depth d with a vertical field of view fov, a plane shows

    pixels per mm = (H / 2) / (d tan(fov / 2)) = distance_mm / (d mm_per_pixel)

so that sample i of the kernel lies i kernel.mm_per_pixel pixels_per_mm(d) scale pixels from the
middle, d and scale those of the middle pixel. Two factors hide in it. The half: normalised device
coordinates run over 2, from -1 to 1, and texture coordinates over 1, so an offset in the latter
is dv = X / (2 d tan(fov / 2)). The aspect ratio: along a row du = dv H / W; in square pixels it
cancels, du W = dv H. The listing of Jimenez, Jarabo, Gutierrez 2012, "Separable subsurface
scattering" (appendix A), which this follows otherwise, has neither: its kernels are twice as high
in world units as they say, and 2 W / H times as wide.

`sssfit._jit.screen` has the pass, ``_view`` the step and the buffers; docs/screen-space.md
compares the ways to follow a surface.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import numpy.typing as npt

from sssfit._jit import screen as compiled
from sssfit._jit import thread_pool
from sssfit.errors import RenderError
from sssfit.kernel import SeparableKernel
from sssfit.render._checks import thread_count
from sssfit.render._view import make_view
from sssfit.render.scene import Scene
from sssfit.render.transmittance import transmitted

__all__ = ["render_screen"]

FloatArray = npt.NDArray[np.float64]

_BLOCK = 16_384  # pixels a thread takes at a time: some 10 ms, and no wait at the end


def render_screen(
    scene: Scene,
    kernel: SeparableKernel,
    *,
    follow: str = "gaussian",
    lost: str | None = None,
    depth_variance_mm2: float | Sequence[float] | None = None,
    falloff_per_mm: float | None = None,
    scale: npt.ArrayLike | None = None,
    border: str = "mirror",
    threads: int | None = None,
) -> FloatArray:
    """Return the radiant exitance of a scene in perspective, specular light included.

    Pixels of mask 0, or of infinite depth, are no translucent object: their irradiance comes back
    as it is, as a stencil leaves it. Light of one object never reaches another: for the share of a
    sample that lies on another object's pixel the middle stands in. Light through the object joins
    the irradiance before the blur; specular light is added after it, unblurred.

    Parameters
    ----------
    scene : Scene
        With ``depth_mm`` and ``distance_mm``.
    kernel : SeparableKernel
        Of any pitch: its samples are ``kernel.mm_per_pixel`` apart on the surface. Where that is
        many pixels of the screen, samples lie as sparse as a shader's.
    follow : str
        What a difference of depth dz to the middle leaves of a sample. "gaussian":
        exp(-dz^2 / (2 v)) (Jimenez et al. 2015, "Separable Subsurface Scattering", supplement E).
        "lerp": 1 - saturate(falloff |dz|) (2012, appendix A). "none": all of it.
    lost : str, optional
        What replaces the rest: "mean", the weighted mean of what the pass did see; "middle", the
        middle pixel; "none", nothing, as the supplement's equation stands. The default is "mean"
        for "gaussian" and, as in the listing, "middle" for "lerp".
    depth_variance_mm2 : float or one per channel, optional [mm^2]
        v of "gaussian". By default the larger variance of the artist's kernel; for other kernels
        their second moment. Where ``scale`` is s, v s^2 is used.
    falloff_per_mm : float, optional [1/mm]
        Of "lerp". By default complete at 3.8 standard deviations of the widest channel.
    scale : float or array (H, W), optional
        Size of the kernel: 0 leaves a pixel unblurred.
    border : str
        Beyond the picture: "mirror", "clamp", or "zero" (dark, at the middle's depth).
    threads : int, optional
        By default one for each core. The result does not depend on them.

    Returns
    -------
    array (H, W, C)
        Irradiance blurred, times the kernel's energy and its ``scale``, plus specular light.

    Raises
    ------
    RenderError
        No depth, other channels than the kernel's, or a setting of no use.
    """
    channels = len(kernel.channels)
    for field in ("irradiance", "specular", "back_irradiance"):
        _check_channels(scene, field, channels)
    workers = thread_count(threads)
    view = make_view(
        scene,
        kernel,
        follow=follow,
        lost=lost,
        depth_variance_mm2=depth_variance_mm2,
        falloff_per_mm=falloff_per_mm,
        scale=scale,
        border=border,
    )
    lit = scene.irradiance
    through = transmitted(scene, kernel)
    lit = np.broadcast_to(lit if through is None else lit + through, (*lit.shape[:2], channels))
    blurred = _blurred(lit, kernel, view, workers)
    inside = view.mask.reshape(lit.shape[:2])[..., None] > 0
    picture = np.where(inside, blurred.reshape(lit.shape), scene.irradiance)
    return picture if scene.specular is None else picture + scene.specular


def _check_channels(scene: Scene, field: str, channels: int) -> None:
    """Refuse a buffer that does not have the kernel's channels."""
    buffer = getattr(scene, field)
    if buffer is not None and (buffer.ndim != 3 or buffer.shape[2] not in (1, channels)):
        raise RenderError(
            f"{scene.name}: {field} of shape {buffer.shape} for a kernel of {channels} channels; "
            f"expected 1 or {channels} channels."
        )


def _blurred(
    lit: FloatArray, kernel: SeparableKernel, view: compiled.View, threads: int
) -> FloatArray:
    """Return the sum of the kernel's terms (N, C), each a horizontal and a vertical pass."""
    picture = np.ascontiguousarray(lit.reshape(-1, lit.shape[2]))
    total = np.zeros_like(picture)
    with thread_pool(threads) as pool:
        for signs, weights in zip(kernel.signs, kernel.weights, strict=True):
            across = _pass(pool, picture, weights, view, vertical=False)
            total += signs * _pass(pool, across, weights, view, vertical=True)
    return total * kernel.scale


def _pass(
    pool: ThreadPoolExecutor,
    picture: FloatArray,
    weights: FloatArray,
    view: compiled.View,
    *,
    vertical: bool,
) -> FloatArray:
    """Return one pass over the whole picture (N, C), block by block."""
    out = np.zeros_like(picture)

    def block(first: int) -> None:
        last = min(first + _BLOCK, len(out))
        compiled.blur(out, picture, weights, view, vertical, first, last)

    list(pool.map(block, range(0, len(out), _BLOCK)))
    return out
