"""Noise with the spectrum of natural pictures."""

import numpy as np

from sssfit.render._made_checks import check_seed, check_size
from sssfit.render.scene import Scene


def noise(*, height: int, width: int, mm_per_pixel: float, seed: int = 1) -> Scene:
    """Random light from 0 to 1 whose amplitudes fall as 1/f; its mean is 1/2.

    White noise is filtered in the Fourier domain (Field 1987, "Relations between the statistics of
    natural images and the response properties of cortical cells": 1/f in amplitude), so it is
    periodic across the borders; then scaled so that its farthest value from 1/2 is 0 or 1.
    """
    from scipy.fft import irfft2, rfft2

    check_size("noise", height, width, mm_per_pixel)
    check_seed("noise", seed)
    white = np.random.default_rng(seed).standard_normal((height, width))
    down = np.fft.fftfreq(height)[:, None]
    across = np.fft.rfftfreq(width)[None, :]
    frequency = np.hypot(down, across)
    frequency[0, 0] = np.inf  # the mean is set below
    pink = irfft2(rfft2(white) / frequency, s=(height, width))
    farthest = float(np.abs(pink).max()) or 1.0
    return Scene("noise", np.clip(0.5 + 0.5 * pink / farthest, 0.0, 1.0)[..., None], mm_per_pixel)
