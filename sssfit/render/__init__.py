"""Kernels applied to irradiance: radiant exitance of a lit, translucent surface.

`sssfit.scene` has the lit scenes. `reference` convolves with the true 2D kernel, `separable` with a
fitted one, `taps` as a table of taps says; `screen` works like a shader in screen space, and
`transmittance` adds light through thin slabs.

The package can also be called like the function `render`: ``sssfit.render(image, kernel)``.
"""

import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.arrays import check_settings
from sssfit.errors import RenderError
from sssfit.formats.colours import as_light
from sssfit.formats.pictures import Image, load_image
from sssfit.kernel import Kernel, SeparableKernel, Taps, read_kernel
from sssfit.messages import shown
from sssfit.render.separable import render_separable
from sssfit.render.taps import render_taps
from sssfit.scene.record import Scene

__all__ = ["render"]

FloatArray = npt.NDArray[np.floating[Any]]  # in the requested precision
Irradiance = Scene | Image | npt.ArrayLike | str | Path


def render(image: Irradiance, kernel: Kernel | str | Path, **settings: Any) -> FloatArray:
    """Apply a kernel to a flat picture of irradiance.

    Parameters
    ----------
    image : array (H, W) or (H, W, C), Scene, Image, str or Path
        Linear light, or the path of a picture file. An array or file takes the kernel's pixel size;
        a scene has its own. A two-dimensional array has one channel, light without colour; like C =
        1 it fits kernels with any number of channels.
    kernel : SeparableKernel, Taps, str or Path
        The record, or the path of a ``.kernel.json`` or ``.taps.json`` file.
    **settings
        Keyword arguments of `sssfit.render.separable.render_separable` and
        `sssfit.render.taps.render_taps`: ``border``, ``threads``, ``dtype``.

    Returns
    -------
    array (H, W, C)
        Radiant exitance in the picture's unit, with the C channels of the kernel: a grey picture is
        returned in the colours of the material.

    Raises
    ------
    RenderError
        The picture is invalid, or does not fit the kernel.
    ArgumentError
        The kernel has no such setting.
    KernelError, FileError
        A file cannot be read.
    """
    if isinstance(kernel, str | Path):
        kernel = read_kernel(kernel)
    if not isinstance(kernel, SeparableKernel | Taps):
        raise RenderError(
            f"kernel = {shown(kernel)}; expected a SeparableKernel, Taps, or the path of a file of "
            "either."
        )
    if isinstance(kernel, Taps):
        check_settings(render_taps, settings, "a table of taps")
        return render_taps(_scene(image, kernel.mm_per_pixel), kernel, **settings)
    check_settings(render_separable, settings, "a separable kernel")
    return render_separable(_scene(image, kernel.mm_per_pixel), kernel, **settings)


def _scene(image: Irradiance, mm_per_pixel: float) -> Scene:
    """Return the picture as a scene, which takes the kernel's pixel size if it has none."""
    if isinstance(image, Scene):
        return image
    if isinstance(image, str | Path):
        image = load_image(image)
    if isinstance(image, Image):
        return Scene.from_image(image, image.mm_per_pixel or mm_per_pixel)
    pixels = as_light(image, "the picture")
    return Scene("the picture", pixels[..., None] if pixels.ndim == 2 else pixels, mm_per_pixel)


class _CallableRoom(ModuleType):
    """Makes the package callable, as `import sssfit.render` binds it to the function's name."""

    def __call__(
        self, image: Irradiance, kernel: Kernel | str | Path, **settings: Any
    ) -> FloatArray:
        return render(image, kernel, **settings)

    __call__.__doc__ = render.__doc__


sys.modules[__name__].__class__ = _CallableRoom
