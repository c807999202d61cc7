"""Builds a kernel with its errors from the fits of the channels."""

import math
import time
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit import __version__
from sssfit.arrays import FloatArray, plain, true_or_false
from sssfit.errors import FitError, SssfitWarning
from sssfit.fit._target import Target
from sssfit.kernel import SeparableKernel, Taps
from sssfit.messages import shown
from sssfit.process import one_blas_thread

ENERGIES = ("rescale", "keep")


def rescales_energy(energy: str) -> bool:
    """Return True for "rescale" and False for "keep"; any other word raises FitError."""
    if not isinstance(energy, str) or energy not in ENERGIES:
        raise FitError(f"energy = {shown(energy)}; expected {' or '.join(map(repr, ENERGIES))}.")
    return energy == "rescale"


def energy_factor(
    wanted: float, target: Target, channel: int, signs: FloatArray, half: FloatArray
) -> float:
    """Return the factor that brings the energy of a channel's terms to ``wanted``.

    ``signs`` (T,) and ``half`` (T, h+1) are the terms within the support. Raises FitError if these,
    or the wanted energy, add up to nothing, as terms of both signs may.
    """
    within = float(signs @ (half @ target.copies) ** 2)
    if min(within, wanted) <= 0.0:
        raise FitError(
            f"channel {target.profile.channels[channel]}: the terms have the energy {within:.3g} "
            f"within the support, which cannot be scaled to {wanted:.3g}; use "
            '`energy = "keep"`, another number of terms or a larger support.'
        )
    return wanted / within


# Share of a channel's energy. Default fits of the eleven materials are off by up to 2.7 %.
_MAX_ENERGY_ERROR = 0.1


def check_finite(what: str, method: str, *errors: FloatArray) -> None:
    """Raise FitError for a fit whose errors (C,) are not finite."""
    if not np.isfinite(errors).all():
        raise FitError(
            f"{what}: the errors of the {method} kernel are not finite; try a larger support or "
            "another method."
        )


def warn_of_misfit(what: str, kernel: SeparableKernel, *, keeps_energy: bool) -> None:
    """Warn of channels with a relative error above 1 or with lost energy.

    ``keeps_energy`` is False if the settings ask for another energy than the profile's. Only
    `fit_channels` may call this: the warning points at the caller of the fit.
    """
    errors, energies = kernel.relative_frobenius_error, kernel.energy_error
    problems = []
    if (worse := errors > 1.0).any():
        problems.append(
            f"is farther from the profile than no kernel at all ({_listed(kernel, errors, worse)})"
        )
    if keeps_energy and (off := np.abs(energies) > _MAX_ENERGY_ERROR).any():
        listed = _listed(kernel, energies, off, "+")
        problems.append(f"does not preserve the profile's energy ({listed})")
    if problems:
        warnings.warn(
            f"{what}: the {kernel.method} kernel {' and '.join(problems)}: try a larger support, "
            "more terms or another method.",
            SssfitWarning,
            stacklevel=4,
        )


def _listed(
    kernel: SeparableKernel, values: FloatArray, which: npt.NDArray[np.bool_], sign: str = ""
) -> str:
    """Return text with up to four channels and their values in percent."""
    found = np.flatnonzero(which)
    texts = [f"{kernel.channels[c]} {100.0 * values[c]:{sign}.3g} %" for c in found[:4]]
    return ", ".join(texts) + (f" and {len(found) - 4} more" if len(found) > 4 else "")


@dataclass(frozen=True, slots=True, eq=False)
class ChannelFit:
    """The terms of one channel: ``signs`` (T,) and ``half`` (T, h+1), passes from the middle on.

    ``parameters`` holds what the method found, for JSON; ``stop_reason`` says in words why it
    ended. A method that has the target's quadrant at hand gives `frobenius_error` as
    ``relative_frobenius_error``; otherwise the quadrant is computed again for it.
    """

    signs: FloatArray
    half: FloatArray
    stop_reason: str
    evaluations: int = 0
    parameters: Mapping[str, Any] | None = None
    relative_frobenius_error: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class FitResult:
    """A kernel and how it was found; tuples and arrays (C,) have one value per channel."""

    kernel: SeparableKernel
    evaluations: tuple[int, ...]
    stop_reasons: tuple[str, ...]
    seconds: float

    @property
    def relative_frobenius_error(self) -> FloatArray:
        """||K - target|| / ||target|| over the support (C,)."""
        return self.kernel.relative_frobenius_error

    @property
    def energy_error(self) -> FloatArray:
        """Relative difference of the kernel's energy from the diffuse reflectance (C,)."""
        return self.kernel.energy_error

    def to_dict(self) -> dict[str, Any]:
        """Return the figures that ``sssfit fit --json`` prints, as lists and numbers."""
        kernel = self.kernel
        return plain(
            {
                "material": kernel.meta["material"],
                "channels": kernel.channels,
                "method": kernel.method,
                "rank": kernel.rank,
                "mm_per_pixel": kernel.mm_per_pixel,
                "support_mm": kernel.support_mm,
                "pixels": kernel.pixels,
                "taps": None,
                "relative_frobenius_error": self.relative_frobenius_error,
                "energy_error": self.energy_error,
                "energy": kernel.energy,
                "scale": kernel.scale,
                "evaluations": self.evaluations,
                "stop_reason": self.stop_reasons,
                "seconds": self.seconds,
                "parameters": kernel.parameters,
            }
        )


@dataclass(frozen=True, slots=True, eq=False)
class TapsFit:
    """A table of taps and how it was found."""

    kernel: Taps
    evaluations: int
    seconds: float

    def to_dict(self) -> dict[str, Any]:
        """Return the figures that ``sssfit fit --json`` prints, as lists and numbers."""
        figures = self.kernel.figures()
        names = (
            *("channels", "method", "structure", "mm_per_pixel", "fetches", "passes"),
            *("all_passes", "bytes_per_pixel", "spectral_error", "energy_error", "energy"),
        )
        return plain(
            {
                "material": self.kernel.meta.get("material"),
                **{name: figures[name] for name in names},
                "evaluations": self.evaluations,
                "seconds": self.seconds,
            }
        )


def fit_channels(
    target: Target,
    method: str,
    fit_channel: Callable[[int], ChannelFit],
    *,
    settings: Mapping[str, Any],
    normalize: bool = False,
    is_fitted: bool = True,
    keeps_energy: bool = True,
) -> FitResult:
    """Fit channel by channel and collect the terms in one kernel.

    Parameters
    ----------
    target : Target
        The profile and its pixels.
    method : str
        Its name on the command line.
    fit_channel : callable
        Takes a channel's index and returns its terms. It is not called for channels that return no
        light, whose weights are 0. Channels may have fewer terms than others: the rest are 0.
    settings : mapping
        The method's own settings, for provenance.
    normalize : bool
        Scale every channel to unit energy, and keep its energy in ``kernel.scale``.
    is_fitted : bool
        False for kernels set by hand, which may differ from the profile.
    keeps_energy : bool
        False if the settings ask for another energy than the profile's.

    Raises
    ------
    FitError
        The fit is not finite, has no energy that could be normalised, or terms that are not those
        of a `ChannelFit`.

    Warns
    -----
    SssfitWarning
        The relative error of the fit is above 1, or it lost energy.
    """
    begun = time.perf_counter()
    empty = target.is_empty
    channels = range(target.profile.n_channels)
    # One thread: BLAS waits for its threads, up to ten times longer if another process holds a
    # core.
    with one_blas_thread():
        fits = [_zero_fit(target) if empty[c] else fit_channel(c) for c in channels]
        for c in channels:
            _check_terms(target, c, method, fits[c])
        errors = _frobenius_errors(target, fits)
    signs, half = _stacked(fits)
    name = target.name
    if not np.isfinite(half).all():
        raise FitError(f"{name}: the {method} fit is not finite; try fewer terms.")
    energy = _energy(signs, half, target.copies)
    scale = np.ones(len(fits))
    if true_or_false("normalize", normalize, FitError):
        if (energy[~empty] <= 0.0).any():
            raise FitError(f"{name}: the {method} kernel has no energy that could be made 1.")
        scale = np.where(empty, 1.0, energy)
    energy_error = np.where(empty, 0.0, energy / np.where(empty, 1.0, target.total) - 1.0)
    check_finite(name, method, errors, energy_error)
    kernel = SeparableKernel(
        method=method,
        mm_per_pixel=target.mm_per_pixel,
        channels=target.profile.channels,
        signs=signs,
        weights=np.concatenate((half[:, :0:-1], half), axis=1) / np.sqrt(scale),
        relative_frobenius_error=errors,
        energy_error=energy_error,
        scale=scale,
        parameters=_parameters(fits, target.profile.channels),
        meta=provenance(target, {**settings, "normalize": normalize}),
    )
    if is_fitted:
        warn_of_misfit(name, kernel, keeps_energy=keeps_energy)
    return FitResult(
        kernel,
        tuple(each.evaluations for each in fits),
        tuple(each.stop_reason for each in fits),
        time.perf_counter() - begun,
    )


def _check_terms(target: Target, channel: int, method: str, fit: ChannelFit) -> None:
    """Refuse terms of a channel that a method gives in other shapes, or that are not real."""
    signs, half = np.asarray(fit.signs), np.asarray(fit.half)
    wanted = (signs.size, target.half_pixels + 1)
    is_real = all(each.dtype.kind in "fiu" for each in (signs, half))
    if signs.ndim != 1 or not signs.size or half.shape != wanted or not is_real:
        raise FitError(
            f"channel {target.profile.channels[channel]}: the {method} fit gives signs of shape "
            f"{signs.shape} ({signs.dtype}) and half passes of shape {half.shape} ({half.dtype}); "
            f"expected real numbers of shapes (T,) and (T, {wanted[1]}) for T terms."
        )


def _zero_fit(target: Target) -> ChannelFit:
    return ChannelFit(
        np.ones(1), np.zeros((1, target.half_pixels + 1)), "the channel returns no light"
    )


def _stacked(fits: list[ChannelFit]) -> tuple[FloatArray, FloatArray]:
    """Return signs (T, C) and half passes (T, h+1, C); missing terms of a channel are 0."""
    terms, channels = max(len(each.signs) for each in fits), len(fits)
    signs = np.ones((terms, channels))
    half = np.zeros((terms, fits[0].half.shape[1], channels))
    for c, each in enumerate(fits):
        signs[: len(each.signs), c] = each.signs
        half[: len(each.signs), :, c] = each.half
    return signs, half


def _energy(signs: FloatArray, half: FloatArray, copies: FloatArray) -> FloatArray:
    """Return the sum of the 2D kernel (C,)."""
    sums = np.einsum("tpc,p->tc", half, copies)
    energy: FloatArray = np.sum(signs * sums**2, axis=0)
    return energy


def frobenius_error(
    target: Target, quadrant: FloatArray, signs: FloatArray, half: FloatArray
) -> float:
    """||K - target|| / ||target|| of a channel over its support.

    ``quadrant`` (h+1, h+1) is the target's, ``signs`` (T,) and ``half`` (T, h+1) are the terms.
    """
    apart = (half * signs[:, None]).T @ half
    apart -= quadrant
    return math.sqrt(_square(apart, target) / _square(quadrant, target))


def _frobenius_errors(target: Target, fits: list[ChannelFit]) -> FloatArray:
    """Return `frobenius_error` of each channel (C,); 0 for a channel that returns no light."""
    errors = np.zeros(len(fits))
    for c in np.flatnonzero(~target.is_empty):
        given, channel = fits[c].relative_frobenius_error, int(c)
        errors[c] = (
            frobenius_error(target, target.quadrant(channel), fits[c].signs, fits[c].half)
            if given is None
            else given
        )
    return errors


def _square(quadrant: FloatArray, target: Target) -> float:
    """Return the squared Frobenius norm of the whole kernel from its quadrant."""
    # einsum needs no array of squares: 124 MB and 0.3 s for 3932 pixels.
    return float(np.einsum("ik,ik,k->i", quadrant, quadrant, target.copies) @ target.copies)


def _parameters(fits: list[ChannelFit], channels: tuple[str, ...]) -> dict[str, Any]:
    """Return the parameters that each channel's fit found."""
    return {
        name: dict(each.parameters)
        for name, each in zip(channels, fits, strict=True)
        if each.parameters is not None
    }


def provenance(target: Target, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return the provenance of a kernel: its profile, and the settings of its fit.

    The profile of a kernel is the walk itself where it was smoothed for the fit.
    """
    meta = target.profile.meta
    walk = meta.get("smoothed_sha256")
    return {
        "material": target.name,
        "material_sha256": meta.get("material_sha256"),
        "profile_sha256": walk or target.profile.sha256,
        "profile_method": meta.get("method", "unknown"),
        "photons": meta.get("photons"),
        "seed": meta.get("seed"),
        "version": __version__,
        "settings": {**settings, **({"smooth": True} if walk else {})},
    }
