"""The control variate of a frame: the irradiance around every pixel, without noise.

A shader has it from a small mipmap; here it is the mean over a square, by running sums. It is the
same for the same picture, so that under still light it does not change by a bit.
"""

from collections.abc import Mapping
from typing import Literal

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.profile import Profile
from sssfit.scene.record import Scene

# The square should reach as far as the light does: beside an edge, pixels that see light only from
# outside of it would have no variate, and their light would count as noise.
_SHARE = 0.99
_MODES: Mapping[str, Literal["reflect", "nearest", "constant"]] = {
    "mirror": "reflect",
    "clamp": "nearest",
    "zero": "constant",
}


def brightest_channel(scene: Scene, profile: Profile) -> int:
    """Return the channel that shows the most light on the whole.

    Its noise stands for that of the colours. Luminance hides noise of colour: a sample's weights of
    skin1's channels add up to nearly the same luminance, and its red then varied by a third where
    the luminance varied by a tenth.
    """
    light = np.broadcast_to(scene.irradiance.mean(axis=(0, 1)), profile.n_channels)
    reflected = profile.diffuse_reflectance * (light if light.any() else 1.0)
    return int(np.argmax(reflected))


def half_width(profile: Profile, channel: int, mm_per_pixel: float) -> int:
    """Return the radius of 99 % of a channel's light [pixels]."""
    radius_mm = float(profile.energy_radii_mm([_SHARE])[0, channel])
    return int(np.ceil(radius_mm / mm_per_pixel)) if np.isfinite(radius_mm) else 0


def local_irradiance(scene: Scene, channel: int, half_pixels: int, border: str) -> FloatArray:
    """Return the mean irradiance (H, W) of a channel in a square of 2 h + 1 pixels a side."""
    from scipy.ndimage import uniform_filter  # 0.1 s

    plane = scene.irradiance[..., min(channel, scene.channels - 1)]
    mean: FloatArray = uniform_filter(plane, 2 * half_pixels + 1, mode=_MODES[border], cval=0.0)
    return np.maximum(mean, 0.0)  # running sums leave -1e-17 where light ends
