"""Which of several choices are worth their cost: the Pareto front."""

import numpy as np
import numpy.typing as npt

from sssfit.errors import RenderError


def pareto_front(cost: npt.ArrayLike, error: npt.ArrayLike) -> npt.NDArray[np.bool_]:
    """Tell which points no other point beats.

    A point is beaten by another that is no worse in both and better in one; of points that are
    equal in both the first is kept. NaN and infinite points are on no front.

    Parameters
    ----------
    cost, error : array (n,)
        Less is better, of both.

    Returns
    -------
    array of bool (n,)
        Along the front cost rises and error falls, both strictly.

    Raises
    ------
    RenderError
        Not two lists of the same length.

    Examples
    --------
    >>> pareto_front([2, 2, 4, 6], [0.5, 0.3, 0.4, 0.1]).tolist()
    [False, True, False, True]
    """
    costs, errors = np.asarray(cost, dtype=np.float64), np.asarray(error, dtype=np.float64)
    if costs.ndim != 1 or costs.shape != errors.shape:
        raise RenderError(
            f"cost of shape {costs.shape}, error {errors.shape}; expected two lists of one length."
        )
    usable = np.isfinite(costs) & np.isfinite(errors)
    front = np.zeros(costs.size, dtype=np.bool_)
    least = np.inf
    for i in np.lexsort((errors, costs)):  # stable: of equals the first comes first
        if usable[i] and errors[i] < least:
            front[i], least = True, errors[i]
    return front
