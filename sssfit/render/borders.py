"""What lies beyond the border of a picture: one table of source pixels for all flat renderers."""

import numpy as np
import numpy.typing as npt

from sssfit.errors import RenderError

# mirror: the pixel at the rim is repeated and then its neighbours, numpy.pad's "symmetric", so
# that no light is lost; clamp: only the pixel at the rim is, "edge"; zero: black.
BORDERS = ("mirror", "clamp", "zero")


def source_indices(size: int, beyond: int, border: str) -> npt.NDArray[np.intp]:
    """Return which pixel stands at each place of a line that goes on past both its ends.

    Parameters
    ----------
    size : int
        Pixels of the line, n.
    beyond : int
        Places wanted on either side; more than n mirror again and again.
    border : str
        One of `BORDERS`.

    Returns
    -------
    array (beyond + size + beyond,)
        0 to n - 1; n itself means outside, black.

    Raises
    ------
    RenderError
        No such border.
    """
    place = np.arange(-beyond, size + beyond)
    if border == "mirror":  # with the period 2 n
        place %= 2 * size
        return np.minimum(place, 2 * size - 1 - place)
    if border == "clamp":
        return np.clip(place, 0, size - 1)
    if border == "zero":
        return np.where((place >= 0) & (place < size), place, size)
    raise RenderError(f"border = {border!r}; expected {', '.join(BORDERS)}.")
