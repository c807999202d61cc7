"""Screen space as in a shader: two passes per term, with a kernel in mm seen in perspective.

At depth d, with a vertical field of view fov, a plane has

    pixels per mm = (H / 2) / (d tan(fov / 2)) = distance_mm / (d mm_per_pixel)

so that sample i of the kernel lies i kernel.mm_per_pixel pixels_per_mm(d) scale pixels from the
middle, d and scale those of the middle pixel. Two factors are easily missed. The half: normalised
device coordinates run over 2, from -1 to 1, and texture coordinates over 1, so an offset in the
latter is dv = X / (2 d tan(fov / 2)). The aspect ratio: along a row du = dv H / W; in square pixels
it cancels, du W = dv H. The listing of Jimenez, Jarabo, Gutierrez 2012, "Separable subsurface
scattering" (appendix A), which this module follows otherwise, has neither: its kernels are twice as
high in world units as specified, and 2 W / H times as wide.

`sssfit._jit.screen` has the pass, ``_view`` the step and the buffers; docs/screen-space.md
compares the ways to follow a surface.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import numpy.typing as npt

from sssfit._jit import screen as compiled
from sssfit._jit import thread_pool
from sssfit.arrays import FloatArray, check_record, read_only
from sssfit.errors import RenderError
from sssfit.formats.colours import as_light
from sssfit.kernel import SeparableKernel
from sssfit.messages import counted, shown
from sssfit.process import thread_count
from sssfit.render.transmittance import transmitted
from sssfit.scene.record import Scene

FOLLOW = {"none": compiled.FLAT, "lerp": compiled.LERP, "gaussian": compiled.GAUSSIAN}
LOST = {"none": compiled.NOWHERE, "middle": compiled.MIDDLE, "mean": compiled.MEAN}
BORDER = {"mirror": compiled.MIRROR, "clamp": compiled.CLAMP, "zero": compiled.ZERO}

# End of the lerp in standard deviations of the kernel; docs/screen-space.md derives it.
LERP_SIGMAS = 3.8
FARTHEST = 1e9  # largest distance of a sample in pixels; far below the overflow of indices


def make_view(
    scene: Scene,
    kernel: SeparableKernel,
    *,
    follow: str,
    lost: str | None,
    depth_variance_mm2: float | Sequence[float] | None,
    falloff_per_mm: float | None,
    scale: npt.ArrayLike | None,
    border: str,
) -> compiled.View:
    """Return the buffers of a pass; arguments are those of `render_screen`.

    Raises
    ------
    RenderError
        The scene has no depth, or a setting is invalid.
    """
    for word, name, known in (
        ("follow", follow, FOLLOW),
        ("border", border, BORDER),
        ("lost", "mean" if lost is None else lost, LOST),
    ):
        if name not in known:
            raise RenderError(f"{word} = {shown(name)}; expected one of {', '.join(known)}.")
    mask = object_mask(scene)
    depth_mm = depths(scene, mask)
    sizes = _sizes(scale, mask.shape)
    rate, stretch = _factor(kernel, follow, depth_variance_mm2, falloff_per_mm, sizes)
    chosen = ("middle" if follow == "lerp" else "mean") if lost is None else lost
    return compiled.View(
        depth_mm=depth_mm.ravel(),
        mask=mask.ravel(),
        step=_steps(scene, kernel, depth_mm, sizes).ravel(),
        stretch=stretch.ravel(),
        rate=rate,
        width=scene.width,
        height=scene.height,
        follow=FOLLOW[follow],
        lost=LOST[chosen],
        border=BORDER[border],
    )


def _factor(
    kernel: SeparableKernel,
    follow: str,
    depth_variance_mm2: float | Sequence[float] | None,
    falloff_per_mm: float | None,
    sizes: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return the rates (C,) at which light is lost with depth, and the depth scale (H, W)."""
    rate, stretch = np.zeros(len(kernel.channels)), np.ones(sizes.shape)
    if follow == "gaussian":
        rate = 0.5 / depth_variances(kernel, depth_variance_mm2)
        # A kernel of half the size has a quarter of the variance.
        stretch = np.divide(1.0, sizes, out=np.zeros(sizes.shape), where=sizes > 0.0)
    elif follow == "lerp":
        rate[:] = lerp_falloff(kernel) if falloff_per_mm is None else falloff_per_mm
        if not (rate >= 0.0).all():
            raise RenderError(f"falloff_per_mm = {falloff_per_mm}; expected a number from 0 up.")
    return rate, stretch


def object_mask(scene: Scene) -> npt.NDArray[np.int32]:
    """Return the mask (H, W): 1 everywhere if there is none, and 0 on the background."""
    mask = np.ones((scene.height, scene.width), np.int32) if scene.mask is None else scene.mask
    there = True if scene.depth_mm is None else np.isfinite(scene.depth_mm)
    return np.where(there, mask, 0).astype(np.int32)


def depths(scene: Scene, mask: npt.NDArray[np.int32]) -> FloatArray:
    """Return the depth (H, W) [mm] of all objects; 1 on the background, where it is not read."""
    if scene.depth_mm is None or scene.distance_mm is None:
        missing = "depth_mm" if scene.depth_mm is None else "distance_mm"
        raise RenderError(
            f"{scene.name}: rendering in screen space needs {missing}, and the scene has none; "
            "use the scene head or one that has depth_mm and distance_mm, or render it flat."
        )
    depth_mm: FloatArray = np.where(mask > 0, scene.depth_mm, 1.0)
    if (depth_mm <= 0.0).any():
        raise RenderError(
            f"{scene.name}: depth_mm is 0 in {counted(int((depth_mm <= 0.0).sum()), 'pixel')} of "
            "objects; "
            "expected distances from the eye above 0, or mask 0 where nothing is."
        )
    return depth_mm


def depth_variances(
    kernel: SeparableKernel, given_mm2: float | Sequence[float] | None
) -> FloatArray:
    """Return the variances (C,) [mm^2] of the depth factor.

    The given ones, or the kernel's ``depth_variance_mm2`` (the artist's larger Gaussian), or the
    kernel's second moment per axis, which is the same for a single Gaussian.
    """
    if given_mm2 is not None:
        values = as_light(given_mm2, "depth_variance_mm2")
        if values.shape not in ((), (len(kernel.channels),)) or not (values > 0.0).all():
            raise RenderError(
                f"depth_variance_mm2 = {shown(given_mm2)}; expected a variance above 0, one or "
                f"{len(kernel.channels)}."
            )
        return np.broadcast_to(values, (len(kernel.channels),))
    moments = second_moments(kernel)
    for c, name in enumerate(kernel.channels):
        moments[c] = kernel.parameters.get(name, {}).get("depth_variance_mm2", moments[c])
    return moments


def second_moments(kernel: SeparableKernel) -> FloatArray:
    """Return the 2D kernel's variance along an axis (C,) [mm^2], with absolute weights.

    Terms of negative sign could make it negative. It is at least that of a pixel, p^2 / 12.
    """
    x = kernel.mm_per_pixel * np.arange(-kernel.half_pixels, kernel.half_pixels + 1)
    line = np.abs(kernel.line)
    energy = line.sum(axis=0)
    moment = np.divide(x**2 @ line, energy, out=np.zeros_like(energy), where=energy > 0.0)
    at_least: FloatArray = np.maximum(moment, kernel.mm_per_pixel**2 / 12.0)
    return at_least


def lerp_falloff(kernel: SeparableKernel) -> float:
    """Return the lerp's falloff [1/mm], which ends at `LERP_SIGMAS` of the widest channel."""
    return float(1.0 / (LERP_SIGMAS * np.sqrt(second_moments(kernel).max())))


def _sizes(scale: npt.ArrayLike | None, shape: tuple[int, ...]) -> FloatArray:
    """Return the map of kernel sizes (H, W)."""
    if scale is None:
        return np.ones(shape)
    sizes = as_light(scale, "scale")
    if sizes.shape not in ((), shape):
        raise RenderError(f"scale has shape {sizes.shape}; expected a number or {shape}.")
    if not (np.isfinite(sizes) & (sizes >= 0.0)).all():
        raise RenderError("scale has values that are negative, infinite or NaN; expected 0 and up.")
    return np.broadcast_to(sizes, shape)


def _steps(
    scene: Scene, kernel: SeparableKernel, depth_mm: FloatArray, sizes: FloatArray
) -> FloatArray:
    """Return the pixels from one sample to the next (H, W)."""
    assert scene.distance_mm is not None  # checked by `depths`
    # Multiply first, so that a plane at distance_mm has steps of exactly 1.
    with np.errstate(over="ignore"):  # checked below
        nearer = kernel.mm_per_pixel * scene.distance_mm / (depth_mm * scene.mm_per_pixel)
        steps: FloatArray = nearer * sizes
    if not (steps.max() * kernel.half_pixels < FARTHEST):
        raise RenderError(
            f"{scene.name}: at depth {depth_mm.min():g} mm the kernel would reach "
            f"{steps.max() * kernel.half_pixels:.3g} pixels; expected mm in depth_mm and scale."
        )
    return steps


__all__ = ["render_screen"]


_BLOCK = 16_384  # pixels a thread takes at a time: about 10 ms, so no thread waits long at the end


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

    Pixels of mask 0, or of infinite depth, are not translucent: their irradiance is returned
    unchanged, as with a stencil. Light of one object never reaches another: the middle pixel
    replaces the share of a sample that lies on another object. Light through the object is added to
    the irradiance before the blur; specular light is added after it, unblurred.

    Parameters
    ----------
    scene : Scene
        A scene with ``depth_mm`` and ``distance_mm``.
    kernel : SeparableKernel
        A kernel of any pixel size: its samples are ``kernel.mm_per_pixel`` apart on the surface.
        Where that is many pixels of the screen, the samples are as sparse as a shader's.
    follow : str
        How a depth difference dz from the middle pixel reduces the weight of a sample. "gaussian":
        exp(-dz^2 / (2 v)) (Jimenez et al. 2015, "Separable Subsurface Scattering", supplement E).
        "lerp": 1 - saturate(falloff |dz|) (2012, appendix A). "none": not at all.
    lost : str, optional
        What replaces the lost weight: "mean", the weighted mean of the samples that the pass uses;
        "middle", the middle pixel; "none", nothing, as in the supplement's equation. The default is
        "mean" for "gaussian" and, as in the listing, "middle" for "lerp".
    depth_variance_mm2 : float or one per channel, optional [mm^2]
        v of "gaussian". By default the larger variance of the artist's kernel, and the second
        moment of other kernels. With ``scale`` s it is v s^2.
    falloff_per_mm : float, optional [1/mm]
        Falloff of "lerp". By default it ends at 3.8 standard deviations of the widest channel.
    scale : float or array (H, W), optional
        Relative size of the kernel; 0 leaves a pixel unblurred.
    border : str
        Beyond the picture: "mirror", "clamp", or "zero" (dark, at the middle's depth).
    threads : int, optional
        Threads to use, by default one per core. The result does not depend on them.

    Returns
    -------
    array (H, W, C)
        Blurred irradiance, times the kernel's energy and ``kernel.scale``, plus specular light.

    Raises
    ------
    RenderError
        The scene has no depth or other channels than the kernel, or a setting is invalid.
    """
    check_record("scene", scene, Scene, RenderError)
    check_record("kernel", kernel, SeparableKernel, RenderError)
    channels = len(kernel.channels)
    scene = scene.for_channels(kernel.channels)
    check_buffers(scene, channels)
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


def check_buffers(scene: Scene, channels: int) -> None:
    """Raise an error for light that does not have the kernel's channels."""
    for field in ("irradiance", "specular", "back_irradiance"):
        buffer = getattr(scene, field)
        if buffer is not None and (buffer.ndim != 3 or buffer.shape[2] not in (1, channels)):
            raise RenderError(
                f"{scene.name}: {field} of shape {buffer.shape} for a kernel of {channels} "
                f"channels; expected 1 or {channels} channels."
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
    out, read = np.zeros_like(picture), read_only(picture)

    def block(first: int) -> None:
        last = min(first + _BLOCK, len(out))
        compiled.blur(out, read, weights, view, vertical, first, last)

    list(pool.map(block, range(0, len(out), _BLOCK)))
    return out
