"""Parameters that somebody sets instead of fitting them."""

from collections.abc import Mapping, Sequence

import numpy as np

from sssfit.errors import FitError
from sssfit.fit._target import FloatArray


def per_channel(
    given: Mapping[str, float | Sequence[float] | None], channels: tuple[str, ...]
) -> FloatArray | None:
    """Return parameters by channel (parameters, C), or None where none is given.

    Raises
    ------
    FitError
        Some are missing, some are not finite, or there are neither one nor C of them.
    """
    missing = [name for name, value in given.items() if value is None]
    if len(missing) == len(given):
        return None
    if missing:
        raise FitError(
            f"{' and '.join(missing)} missing: set {', '.join(given)} all by hand, or none to have "
            "them fitted."
        )
    rows = []
    for name, value in given.items():
        row = np.atleast_1d(np.asarray(value, dtype=np.float64))
        if row.shape not in ((1,), (len(channels),)) or not np.isfinite(row).all():
            raise FitError(
                f"{name} = {value}; expected one finite number, or one for each of "
                f"{', '.join(channels)}."
            )
        rows.append(np.broadcast_to(row, (len(channels),)))
    return np.array(rows)
