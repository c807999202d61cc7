"""Borders of a picture: one table of source pixels for all flat renderers."""

import numpy as np
import numpy.typing as npt

from sssfit.errors import RenderError

# mirror repeats the pixel at the rim and then its neighbours (numpy.pad's "symmetric"), so that no
# light is lost; clamp repeats only the pixel at the rim ("edge"); zero is black.
BORDERS = ("mirror", "clamp", "zero")


def source_indices(size: int, beyond: int, border: str) -> npt.NDArray[np.intp]:
    """Return the source pixel at each place of a line that continues past both its ends.

    Parameters
    ----------
    size : int
        Number of pixels of the line, n.
    beyond : int
        Places needed on either side; more than n are mirrored repeatedly.
    border : str
        One of `BORDERS`.

    Returns
    -------
    array (beyond + size + beyond,)
        0 to n - 1; n itself means outside, black.

    Raises
    ------
    RenderError
        The border is unknown.
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
