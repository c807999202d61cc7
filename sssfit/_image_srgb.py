"""The transfer curve of sRGB, IEC 61966-2-1: between linear light and the codes of a screen."""

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

# The standard's own rounded numbers. Its two pieces miss one another by 2e-8 at the joint, far
# below the 1.5e-5 of a 16-bit code.
_JOINT_LINEAR, _JOINT_CODE = 0.0031308, 0.04045
_SLOPE, _OFFSET, _POWER = 12.92, 0.055, 2.4


def srgb_encode(linear: npt.ArrayLike) -> FloatArray:
    """Return the sRGB code, 0 to 1, of linear light.

    Parameters
    ----------
    linear : array
        Linear light; below 0 and above 1 the two pieces of the curve go on.

    Returns
    -------
    array of the same shape
        12.92 L up to L = 0.0031308, 1.055 L^(1/2.4) - 0.055 above (IEC 61966-2-1).
    """
    light = np.asarray(linear, dtype=np.float64)
    above = np.maximum(light, _JOINT_LINEAR) ** (1.0 / _POWER)
    return np.where(light <= _JOINT_LINEAR, _SLOPE * light, (1.0 + _OFFSET) * above - _OFFSET)


def srgb_decode(code: npt.ArrayLike) -> FloatArray:
    """Return the linear light of an sRGB code, 0 to 1.

    Parameters
    ----------
    code : array
        V, the integer of a file over its largest (255 or 65535).

    Returns
    -------
    array of the same shape
        V / 12.92 up to V = 0.04045, ((V + 0.055) / 1.055)^2.4 above (IEC 61966-2-1).
    """
    value = np.asarray(code, dtype=np.float64)
    above = ((np.maximum(value, _JOINT_CODE) + _OFFSET) / (1.0 + _OFFSET)) ** _POWER
    return np.where(value <= _JOINT_CODE, value / _SLOPE, above)
