"""Slow, literal convolution, with a border arithmetic of its own; kernels to try it on."""

import numpy as np

from sssfit.kernel import SeparableKernel


def place(i, n, border):
    """Where the value at place i of a line of n pixels comes from; None for black."""
    if border == "zero":
        return i if 0 <= i < n else None
    if border == "clamp":
        return min(max(i, 0), n - 1)
    while not 0 <= i < n:  # mirrors stand on the outer sides of the pixels at the rim
        i = -1 - i if i < 0 else 2 * n - 1 - i
    return i


def convolve_directly(picture, kernel, border):
    """sum_ij kernel[i, j] picture[y - i, x - j], one product after the other.

    Picture (H, W, 1 or C), kernel (P, P, C), P odd.
    """
    height, width, given = picture.shape
    pixels, _, channels = kernel.shape
    half = pixels // 2
    out = np.zeros((height, width, channels))
    for c in range(channels):
        plane = picture[:, :, c if given > 1 else 0]
        for y in range(height):
            for x in range(width):
                for i in range(-half, half + 1):
                    row = place(y - i, height, border)
                    for j in range(-half, half + 1):
                        column = place(x - j, width, border)
                        if row is not None and column is not None:
                            out[y, x, c] += kernel[half + i, half + j, c] * plane[row, column]
    return out


def random_quadrant(half, channels, seed):
    """A quadrant of an even kernel that is not symmetric in x and y, of either sign."""
    return np.random.default_rng(seed).normal(size=(half + 1, half + 1, channels))


def random_kernel(terms, half, channels, seed, **changes):
    """A separable kernel of random passes and signs, on pixels of 0.5 mm."""
    rng = np.random.default_rng(seed)
    side = rng.normal(size=(terms, half + 1, channels)) / (half + 1)
    fields = {
        "method": "test",
        "mm_per_pixel": 0.5,
        "channels": tuple(f"c{i}" for i in range(channels)),
        "signs": rng.choice([-1.0, 1.0], size=(terms, channels)),
        "weights": np.concatenate((side[:, :0:-1], side), axis=1),
        "relative_frobenius_error": np.full(channels, np.nan),
        "energy_error": np.full(channels, np.nan),
        "scale": np.ones(channels),
        "parameters": {},
        "meta": {},
    }
    return SeparableKernel(**(fields | changes))
