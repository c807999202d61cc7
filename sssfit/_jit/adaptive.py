"""Monte Carlo sampling of a kernel at every pixel, as many samples as the pixel asks for.

A sample takes one random word, a function of a key (of seed and frame), the pixel and the number of
the sample: so a picture has the same bits on any number of threads, and every frame fresh numbers.
The lower 32 bits draw an annulus by Walker's alias table; the upper 32 bits are the place in it, 16
of the squared radius and 16 of the angle, each at the middle of one of 65 536 equal steps.
"""

import numpy as np
import numpy.typing as npt

from sssfit._jit import jit
from sssfit._jit.sampling import cos_sin_turn, splitmix64

MOST_SAMPLES = 64  # of a pixel in a frame: words of neighbours do not overlap

FloatArray = npt.NDArray[np.float32]
DoubleArray = npt.NDArray[np.float64]
IndexArray = npt.NDArray[np.intp]
CountArray = npt.NDArray[np.int32]
WordArray = npt.NDArray[np.uint32]

_F32, _U64 = np.float32, np.uint64
_GOLDEN = _U64(0x9E3779B97F4A7C15)
_LOW, _SHORT = _U64(0xFFFFFFFF), _U64(0xFFFF)
_HALF, _STEP = _F32(0.5), _F32(2.0**-16)


@jit
def frame_key(seed: int, frame: int) -> np.uint64:
    """Return what the words of a frame begin with."""
    return splitmix64(_U64(splitmix64(_U64(seed)) + _U64(frame) * _GOLDEN))


@jit
def sample_rows(
    light: FloatArray,
    far: FloatArray,
    rows: IndexArray,
    columns: IndexArray,
    half: int,
    cut: WordArray,
    other: IndexArray,
    squares: FloatArray,
    weights: FloatArray,
    counts: CountArray,
    scale: FloatArray,
    key: np.uint64,
    out: DoubleArray,
    first: int,
    last: int,
) -> None:
    """Write rows first to last - 1 of out (H, W, C): means of weight times irradiance.

    Parameters
    ----------
    light : array (H+1, W+1, S)
        Irradiance, the last row and column black, S = 1 or C.
    far : array (S,)
        Irradiance beyond ``half`` pixels along either axis.
    rows, columns : array
        Sources of the picture continued by ``half`` pixels.
    cut, other : array (N,)
        The alias table: annulus k stays for fractions below cut / 2^32, else it is other.
    squares : array (N, 2) [pixels^2]
        Squared inner radius of an annulus, and how much larger that of the outer one is.
    weights : array (N, C)
        Energy of an annulus over its probability.
    counts : array (H, W)
        Samples of each pixel, 1 to 64.
    scale : array (H, W)
        Factor of each pixel's radii.
    key : uint64
        From `frame_key`.
    """
    width, channels = out.shape[1:]
    sources = light.shape[2]
    annuli = _U64(cut.size)
    total = np.zeros(channels)
    for y in range(first, last):
        for x in range(width):
            total[:] = 0.0
            n = counts[y, x]
            begin = key + _U64(y * width + x) * _U64(MOST_SAMPLES) * _GOLDEN
            for k in range(n):
                word = splitmix64(_U64(begin + _U64(k) * _GOLDEN))
                product = _U64((word & _LOW) * annuli)
                a = np.intp(product >> _U64(32))
                if (product & _LOW) >= _U64(cut[a]):
                    a = other[a]
                inside = (_F32(np.int32((word >> _U64(32)) & _SHORT)) + _HALF) * _STEP
                turn = (_F32(np.int32(word >> _U64(48))) + _HALF) * _STEP
                radius = scale[y, x] * np.sqrt(squares[a, 0] + inside * squares[a, 1])
                cosine, sine = cos_sin_turn(turn)
                down = np.intp(np.floor(radius * sine + _HALF))
                right = np.intp(np.floor(radius * cosine + _HALF))
                if abs(down) > half or abs(right) > half:
                    for c in range(channels):
                        total[c] += weights[a, c] * far[min(c, sources - 1)]
                    continue
                row, column = rows[half + y + down], columns[half + x + right]
                if sources == 1:
                    seen = light[row, column, 0]
                    for c in range(channels):
                        total[c] += weights[a, c] * seen
                else:
                    for c in range(channels):
                        total[c] += weights[a, c] * light[row, column, c]
            for c in range(channels):
                out[y, x, c] = total[c] / n
