"""What makes a kernel doubtful: no fit returns a bad one without a word."""

import warnings

import numpy as np
import numpy.typing as npt

from sssfit.errors import FitError, SssfitWarning
from sssfit.fit._target import FloatArray
from sssfit.kernel import SeparableKernel

# Share of a channel's energy. Default fits of the eleven materials are off by up to 2.7 %.
_MOST_ENERGY_ERROR = 0.1


def check_finite(what: str, method: str, *errors: FloatArray) -> None:
    """Refuse a fit whose errors (C,) are not numbers."""
    if not np.isfinite(errors).all():
        raise FitError(
            f"{what}: the errors of the {method} kernel are not finite; try a larger support or "
            "another method."
        )


def warn_of_misfit(what: str, kernel: SeparableKernel, *, keeps_energy: bool) -> None:
    """Warn of channels that no kernel at all would be nearer to, or that lost their energy.

    ``keeps_energy`` is False where another energy than the profile's was asked for. To be called by
    `fit_channels`: the warning points at the caller of the fit.
    """
    errors, energies = kernel.relative_frobenius_error, kernel.energy_error
    doubts = []
    if (worse := errors > 1.0).any():
        doubts.append(
            f"is farther from the profile than no kernel at all ({_listed(kernel, errors, worse)})"
        )
    if keeps_energy and (off := np.abs(energies) > _MOST_ENERGY_ERROR).any():
        doubts.append(f"has not the profile's energy ({_listed(kernel, energies, off, '+')})")
    if doubts:
        warnings.warn(
            f"{what}: the {kernel.method} kernel {' and '.join(doubts)}: try a larger support, "
            "more terms or another method.",
            SssfitWarning,
            stacklevel=4,
        )


def _listed(
    kernel: SeparableKernel, values: FloatArray, which: npt.NDArray[np.bool_], sign: str = ""
) -> str:
    """Return up to four channels with their values in percent."""
    found = np.flatnonzero(which)
    texts = [f"{kernel.channels[c]} {100.0 * values[c]:{sign}.3g} %" for c in found[:4]]
    return ", ".join(texts) + (f" and {len(found) - 4} more" if len(found) > 4 else "")
