"""Between sets of primaries: from those of a file to those of ITU-R BT.709, which sRGB has."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from sssfit.errors import RenderError

FloatArray = npt.NDArray[np.float64]

# x, y of red, green, blue and white (D65): ITU-R BT.709-6, also the default of OpenEXR.
BT709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
_ALIKE = 5e-4  # files round to three digits or four; no colour moves by over .2 % of white
# Cone responses of K. M. Lam's thesis (Bradford, 1985), as in CIE 15 and the ICC's profiles.
_BRADFORD = np.array(
    [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]]
)


def matrix_to_bt709(primaries: Sequence[float], origin: str) -> FloatArray | None:
    """Return the matrix (3, 3) from linear R, G, B of these primaries to those of BT.709.

    White stays white: it is adapted by Bradford's cone responses. None where nothing changes.

    Parameters
    ----------
    primaries : eight numbers
        CIE 1931 x and y of red, green, blue and white.
    origin : str
        The file, for messages.

    Raises
    ------
    RenderError
        The numbers span no colour space.
    """
    given = np.asarray(primaries, dtype=np.float64)
    if given.shape == (8,) and np.abs(given - BT709).max() <= _ALIKE:
        return None
    try:
        theirs, ours = _to_xyz(given), _to_xyz(np.array(BT709))
        # The columns' sums are the two whites.
        seen, wanted = _BRADFORD @ theirs.sum(axis=1), _BRADFORD @ ours.sum(axis=1)
        scaled = (wanted / seen)[:, None] * _BRADFORD
        adapted = np.linalg.solve(_BRADFORD, scaled)
        matrix: FloatArray = np.asarray(np.linalg.solve(ours, adapted @ theirs), np.float64)
    except (ValueError, FloatingPointError, np.linalg.LinAlgError):
        words = " ".join(f"{each:g}" for each in given.ravel()[:8])
        raise RenderError(
            f"{origin} has the chromaticities {words}, which span no colour space; expected x and "
            "y of red, green, blue and white."
        ) from None
    return matrix


def _to_xyz(primaries: FloatArray) -> FloatArray:
    """Return the matrix (3, 3) from linear R, G, B to CIE XYZ with white of Y = 1."""
    x, y = primaries.reshape(4, 2).T
    with np.errstate(all="raise"):
        columns = np.stack((x / y, np.ones(4), (1.0 - x - y) / y))
    if not np.isfinite(columns).all() or abs(np.linalg.det(columns[:, :3])) < 1e-6:
        raise FloatingPointError
    matrix: FloatArray = columns[:, :3] * np.linalg.solve(columns[:, :3], columns[:, 3])
    return matrix
