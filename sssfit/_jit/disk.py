"""Single bilinear fetches around every pixel, turned by an angle of the pixel's own."""

from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit._jit import jit

FloatArray = npt.NDArray[np.floating[Any]]
IndexArray = npt.NDArray[np.intp]


@jit
def gather(
    pixels: FloatArray,
    rows: IndexArray,
    columns: IndexArray,
    places: FloatArray,
    weights: FloatArray,
    turns: FloatArray,
    out: FloatArray,
    first: int,
    last: int,
) -> None:
    """Write rows first to last - 1 of out (H, W, C): the sum of weight times fetch.

    ``pixels`` (H+1, W+1, S), the last row and column black, S = 1 or C. ``rows`` and ``columns``
    hold the source of each place of the picture continued past its border. ``places`` (N, 2) are
    offsets down and right [pixels], ``weights`` (N, C), ``turns`` (2, H, W) cosine and sine.
    """
    width, channels = out.shape[1:]
    sources = pixels.shape[2]
    before_rows = (len(rows) - len(pixels) + 1) // 2
    before_columns = (len(columns) - pixels.shape[1] + 1) // 2
    total = np.zeros(channels, out.dtype)
    for y in range(first, last):
        for x in range(width):
            cosine, sine = turns[0, y, x], turns[1, y, x]
            total[:] = 0.0
            for k in range(len(places)):
                down = cosine * places[k, 0] + sine * places[k, 1]
                right = cosine * places[k, 1] - sine * places[k, 0]
                row, column = int(np.floor(down)), int(np.floor(right))
                v, u = down - row, right - column
                above = rows[before_rows + y + row]
                below = rows[before_rows + y + row + 1]
                left = columns[before_columns + x + column]
                beside = columns[before_columns + x + column + 1]
                for c in range(channels):
                    s = min(c, sources - 1)
                    upper = (1.0 - u) * pixels[above, left, s] + u * pixels[above, beside, s]
                    lower = (1.0 - u) * pixels[below, left, s] + u * pixels[below, beside, s]
                    total[c] += weights[k, c] * ((1.0 - v) * upper + v * lower)
            for c in range(channels):
                out[y, x, c] = total[c]
