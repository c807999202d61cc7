"""Energy that a fit leaves out, restored by one factor or left out on request.

What lies outside the support, and what optimal terms do not reach, would be missing from a surface
in even light: ||a_p||_1 = ||R_d||_1 (Jimenez et al. 2015, "Separable Subsurface Scattering",
supplement, section B and eq. S.6).
"""

from sssfit.errors import FitError
from sssfit.fit._target import FloatArray, Target

ENERGIES = ("rescale", "keep")


def restores(energy: str) -> bool:
    """Whether "rescale" was asked for and not "keep"; any other word raises FitError."""
    if energy not in ENERGIES:
        raise FitError(f"energy = {energy!r}; expected {' or '.join(map(repr, ENERGIES))}.")
    return energy == "rescale"


def factor_to(
    wanted: float, target: Target, channel: int, signs: FloatArray, half: FloatArray
) -> float:
    """Return what the energy of a channel's terms has to be multiplied with to be ``wanted``.

    ``signs`` (T,) and ``half`` (T, h+1) are the terms within the support. Raises FitError where
    these, or what is wanted, add up to no energy: terms of both signs may.
    """
    within = float(signs @ (half @ target.copies) ** 2)
    if min(within, wanted) <= 0.0:
        raise FitError(
            f"channel {target.profile.channels[channel]}: the terms have the energy {within:.3g} "
            f"within the support, which cannot be scaled to {wanted:.3g}; use energy = "
            '"keep", another number of terms or a larger support.'
        )
    return wanted / within
