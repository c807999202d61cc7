"""Reprojection: histories of pixels that move with the picture, by whole pixels a frame."""

from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

Shift = tuple[int, int]
_Kind = TypeVar("_Kind", bound=np.generic)


def reprojected(history: npt.NDArray[_Kind], shift: Shift, fill: Any) -> npt.NDArray[_Kind]:
    """Move the last two axes of an array by whole pixels down and right.

    Parameters
    ----------
    history : array (..., H, W)
        Anything that pixels remember; of fewer dimensions it is returned as it is.
    shift : (int, int) [pixels]
        Down and right; what was at (y, x) goes to (y + down, x + right).
    fill : number
        What pixels have that come into the picture.

    Returns
    -------
    array (..., H, W)

    Examples
    --------
    >>> reprojected(np.array([[1, 2], [3, 4]]), (0, 1), 0).tolist()
    [[0, 1], [0, 3]]
    """
    if history.ndim < 2 or shift == (0, 0):
        return history
    moved = np.full_like(history, fill)
    (to_rows, from_rows), (to_columns, from_columns) = (
        (slice(max(k, 0), n + min(k, 0)), slice(max(-k, 0), n - max(k, 0)))
        if abs(k) < n
        else (slice(0), slice(0))
        for k, n in zip(shift, history.shape[-2:], strict=True)
    )
    moved[..., to_rows, to_columns] = history[..., from_rows, from_columns]
    return moved
