"""The colour that a surface has in daylight, from its reflectance over wavelengths.

CIE 15:2018, equation 7.1: sums over 1 nm of reflectance, illuminant D65 and the colour matching
functions of the CIE 1931 standard observer (2 degrees), as colour-science tabulates them.
"""

import functools

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import ArgumentError
from sssfit.measure.delta_e import load_colour

_LEAST_SHARE = 0.95  # of a white's luminance; 450 to 650 nm have 97 %


def xyz_weights(wavelengths_nm: FloatArray) -> FloatArray:
    """Return weights (n, 3) that make X, Y, Z of reflectances (n,): 1 at all of them has Y = 1.

    Reflectance is linear between its wavelengths, and constant beyond the first and last one.

    Parameters
    ----------
    wavelengths_nm : array (n,) [nm]
        In any order, all different.

    Raises
    ------
    ArgumentError
        There are less than two, or less than 95 % of a white's luminance lie between them.
    """
    if len(wavelengths_nm) < 2:
        raise ArgumentError("there is one wavelength; a colour needs two or more.")
    order = np.argsort(wavelengths_nm)
    known = np.asarray(wavelengths_nm, dtype=np.float64)[order]
    nm, light = _observed_daylight()
    share = float(light[(nm >= known[0]) & (nm <= known[-1]), 1].sum())
    if share < _LEAST_SHARE:
        raise ArgumentError(
            f"{100.0 * share:.3g} % of a white's luminance lie between the wavelengths "
            f"{known[0]:g} and {known[-1]:g} nm; expected 95 % or more, such as 400 to 700 nm."
        )
    before = np.clip(np.searchsorted(known, nm, "right") - 1, 0, len(known) - 2)
    behind = np.clip((nm - known[before]) / (known[before + 1] - known[before]), 0.0, 1.0)[:, None]
    sums = np.zeros((len(known), 3))
    np.add.at(sums, before, (1.0 - behind) * light)
    np.add.at(sums, before + 1, behind * light)
    weights = np.empty_like(sums)
    weights[order] = sums
    return weights


def srgb_of_xyz(xyz: FloatArray) -> FloatArray:
    """Return sRGB codes (..., 3) of X, Y, Z (..., 3), where white has Y = 1 and the codes 1.

    Codes below 0 or above 1 are of colours that sRGB does not have.
    """
    colour = load_colour()
    codes: FloatArray = np.asarray(colour.XYZ_to_sRGB(xyz))
    return codes


@functools.cache
def _observed_daylight() -> tuple[FloatArray, FloatArray]:
    """Return each nm (k,), and there D65 times the matching functions (k, 3); Y sums to 1."""
    colour = load_colour()
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    daylight = colour.SDS_ILLUMINANTS["D65"]  # each 5 nm, between which CIE has it linear
    nm = np.asarray(observer.wavelengths)
    power = np.interp(nm, daylight.wavelengths, daylight.values)
    light = power[:, None] * np.asarray(observer.values)
    return nm, light / light[:, 1].sum()
