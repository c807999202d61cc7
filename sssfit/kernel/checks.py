"""Checks of a kernel's fields: shapes, numbers, names, provenance."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from sssfit.arrays import (
    FloatArray,
    check_label,
    check_names,
    check_provenance,
    json_object,
    number_array,
)
from sssfit.errors import KernelError
from sssfit.messages import counted, shown

# Limit of weights and scales: their squares are finite in single precision, as in shaders.
MOST = 1e18
MIN_MM, MAX_MM = 1e-12, 1e12
_ARRAYS = ("signs", "weights", "relative_frobenius_error", "energy_error", "scale")


def checked(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a `sssfit.kernel.SeparableKernel` as stored, or raise KernelError."""
    fields: dict[str, Any] = {
        name: number_array(name, given[name], KernelError) for name in _ARRAYS
    }
    pitch_mm = checked_pitch(given["mm_per_pixel"])
    check_label("method", given["method"], KernelError)
    names = given["channels"]
    if not isinstance(names, (list, tuple)):
        raise KernelError(f"channels = {shown(names)}; expected a list of names.")
    _check_shapes(fields, len(names))
    check_names(names, KernelError)
    _check_numbers(fields)
    fields |= {"method": given["method"], "mm_per_pixel": pitch_mm, "channels": tuple(names)}
    for name in ("parameters", "meta"):
        fields[name] = json_object(name, given[name], KernelError)
    for name, found in fields["parameters"].items():
        _check_parameters(f"parameters.{name}", found)
    _check_meta(fields["meta"])
    return fields


def checked_pitch(given: object) -> float:
    """Return the size of a pixel [mm], or raise KernelError."""
    pitch = number_array("mm_per_pixel", given, KernelError)
    if pitch.shape != () or not MIN_MM <= pitch <= MAX_MM:
        raise KernelError(
            f"mm_per_pixel = {shown(given)}; expected a length above 0, from {MIN_MM:g} to "
            f"{MAX_MM:g} mm."
        )
    return float(pitch)


def _check_shapes(fields: Mapping[str, FloatArray], n_names: int) -> None:
    shape = fields["weights"].shape
    if len(shape) != 3 or 0 in shape or shape[1] % 2 == 0:
        raise KernelError(
            f"weights have shape {shape}; expected (terms, pixels, channels) with an odd number "
            "of pixels."
        )
    terms, _, channels = shape
    if n_names != channels:
        raise KernelError(f"{counted(n_names, 'channel name')} for {counted(channels, 'channel')}.")
    for name in _ARRAYS:
        expected = {"weights": shape, "signs": (terms, channels)}.get(name, (channels,))
        if fields[name].shape != expected:
            raise KernelError(f"{name} has shape {fields[name].shape}; expected {expected}.")


def _check_numbers(fields: Mapping[str, FloatArray]) -> None:
    """Check that numbers are finite in single precision and in range."""
    weights, signs, scale = fields["weights"], fields["signs"], fields["scale"]
    _check_range("weights", weights, -MOST)
    _check_range("scale", scale, 0.0)
    frobenius, energy = fields["relative_frobenius_error"], fields["energy_error"]
    _check_range("relative_frobenius_error", frobenius, 0.0, or_unknown=True)
    _check_range("energy_error", energy, -(MOST**2), or_unknown=True)
    if not np.isin(signs, (-1.0, 1.0)).all():
        raise KernelError("signs must be +1 or -1.")
    if not np.array_equal(weights, weights[:, ::-1]):
        raise KernelError("weights are not symmetric about the middle pixel.")
    sums = np.abs(weights).sum(axis=1)
    largest = float((np.square(sums).sum(axis=0) * np.maximum(scale, 1.0)).max())
    if not largest <= float(np.finfo(np.float32).max):
        raise KernelError(
            f"weights add up to {largest:.3g}, beyond single precision, in which shaders compute; "
            "expected shares of the light that enters."
        )


def _check_range(name: str, values: FloatArray, least: float, *, or_unknown: bool = False) -> None:
    """Check for numbers of at least ``least``, and below the limit; NaN if unknown."""
    most = max(MOST, -least)
    bad = ~((values >= least) & (values <= most)) & ~(or_unknown & np.isnan(values))
    if bad.any():
        raise KernelError(
            f"{name} holds {values[bad].flat[0]} at {np.argwhere(bad)[0].tolist()}; expected "
            f"numbers from {least:g} to {most:g}{', or NaN for unknown' if or_unknown else ''}."
        )


def _check_meta(meta: Mapping[str, Any]) -> None:
    check_provenance(meta, KernelError)
    if meta.get("material") is not None:
        check_label("meta.material", meta["material"], KernelError)


# The parameters of methods that rendering reads: lists of numbers and single numbers.
_LISTS = ("variances_mm2", "weights")
_NUMBERS = ("near_mm2", "far_mm2", "weight", "depth_variance_mm2")


def _check_parameters(path: str, found: object) -> None:
    """Check the parameters that a method found for a channel, as far as other rooms read them."""
    if not isinstance(found, Mapping):
        raise KernelError(f"{path} = {shown(found)}; expected a mapping.")
    for name in {*_LISTS, *_NUMBERS} & found.keys():
        values = number_array(f"{path}.{name}", found[name], KernelError)
        if values.ndim != (name in _LISTS) or not (np.abs(values) <= MOST).all():
            raise KernelError(
                f"{path}.{name} = {shown(found[name])}; expected "
                f"{'a list of numbers' if name in _LISTS else 'a number'} up to {MOST:g}."
            )
        if name.endswith("_mm2") and not (values > 0.0).all():
            raise KernelError(f"{path}.{name} = {shown(found[name])}; expected variances above 0.")
    lists = [found[name] for name in _LISTS if name in found]
    if len(set(map(len, lists))) > 1:
        raise KernelError(f"{path}: variances_mm2 and weights differ in number.")
