"""Slow, literal oracles for moving estimates and for sampling, sharing no code with the library.

Weights and two-pass formulas are those of Xie and Olano 2021, "Supplementary: Real-time Subsurface
Control Variates", equations 1, 2, 6 and 18; sums are exact (``math.fsum``).
"""

import math

MASK = 2**64 - 1


def weights(last, blend):
    """Weights of the frames 0 to ``last`` (equation 18): they add up to 1."""
    later = [blend * (1.0 - blend) ** (last - i) for i in range(1, last + 1)]
    return [(1.0 - blend) ** last, *later]


def weighted_mean(values, blend):
    """Equation 1."""
    shares = weights(len(values) - 1, blend)
    return math.fsum(w * x for w, x in zip(shares, values, strict=True)) / math.fsum(shares)


def weighted_covariance(x, y, blend):
    """E((x - mu)(y - nu)) in two passes (before equation 6)."""
    shares = weights(len(x) - 1, blend)
    mu, nu = weighted_mean(x, blend), weighted_mean(y, blend)
    terms = (w * (a - mu) * (b - nu) for w, a, b in zip(shares, x, y, strict=True))
    return math.fsum(terms) / math.fsum(shares)


def ewma_covariance(x, y, blend):
    """Equation 23: deviations from the means before each frame, all other terms left out."""
    total = 0.0
    for n in range(1, len(x)):
        dx = x[n] - weighted_mean(x[:n], blend)
        dy = y[n] - weighted_mean(y[:n], blend)
        total += blend * (1.0 - blend) ** (len(x) - 1 - n) * dx * dy
    return total


def splitmix64(z):
    """The finaliser in Python integers."""
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
    return z ^ (z >> 31)


def sample_word(seed, frame, pixel, sample):
    """The random word of a sample."""
    golden = 0x9E3779B97F4A7C15
    key = splitmix64((splitmix64(seed) + frame * golden) & MASK)
    return splitmix64((key + (pixel * 64 + sample) * golden) & MASK)


def sampled_pixel(light, sampler, half, y, x, samples, seed, frame):
    """Mean of weight times irradiance (C,) of a pixel of a mirrored grey picture.

    In double precision: the library's single precision may see another pixel in one of 1e5 samples.
    """
    height, width = light.shape
    annuli, channels = sampler.weights.shape
    total = [0.0] * channels
    for k in range(samples):
        word = sample_word(seed, frame, y * width + x, k)
        product = (word & 0xFFFFFFFF) * annuli
        a = product >> 32
        if (product & 0xFFFFFFFF) >= int(sampler.cut[a]):
            a = int(sampler.other[a])
        inside = ((word >> 32 & 0xFFFF) + 0.5) / 65536.0
        turn = 2.0 * math.pi * ((word >> 48) + 0.5) / 65536.0 - math.pi
        first, more = (float(each) for each in sampler.squares[a])
        radius = math.sqrt(first + inside * more)
        down = math.floor(radius * math.sin(turn) + 0.5)
        right = math.floor(radius * math.cos(turn) + 0.5)
        if max(abs(down), abs(right)) > half:
            seen = float(light.mean())
        else:
            seen = light[mirrored(y + down, height), mirrored(x + right, width)]
        for c in range(channels):
            total[c] += float(sampler.weights[a, c]) * seen
    return [each / samples for each in total]


def mirrored(place, size):
    """The pixel that a place beyond the border repeats."""
    place %= 2 * size
    return min(place, 2 * size - 1 - place)
