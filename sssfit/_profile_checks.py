"""What a profile's fields must be, whoever made them: shapes, numbers, provenance."""

import json
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit._profile_io import FORMAT, OPTIONAL
from sssfit.errors import ProfileError

FloatArray = npt.NDArray[np.float64]


def checked(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a `sssfit.profile.Profile` as it keeps them, or raise ProfileError."""
    fields: dict[str, Any] = {
        name: None if value is None and name in OPTIONAL else _read_only(name, value)
        for name, value in given.items()
        if name != "meta"
    }
    energy = fields["annulus_energy"]
    if energy.ndim != 2 or 0 in energy.shape:
        raise ProfileError(f"annulus_energy has shape {energy.shape}; expected (annuli, channels).")
    _check_edges(fields["r_edges_mm"], len(energy))
    for name, shape in _expected_shapes(fields).items():
        if fields[name] is not None:
            _check_values(name, fields[name], shape)
    if fields["annulus_transmittance"] is None:
        for name in OPTIONAL:
            if fields[name] is not None:
                raise ProfileError(f"{name} is given without annulus_transmittance.")
    fields["specular_reflectance"] = float(fields["specular_reflectance"])
    fields["meta"] = _read_only_meta(given["meta"])
    _check_meta(fields["meta"], energy.shape[1])
    return fields


def _expected_shapes(fields: Mapping[str, FloatArray]) -> dict[str, tuple[int, ...]]:
    per_annulus = fields["annulus_energy"].shape
    per_channel = per_annulus[1:]
    layers = fields["absorbed"].shape[:1] or (1,)
    return {
        "annulus_energy": per_annulus,
        "annulus_energy_stderr": per_annulus,
        "annulus_transmittance": per_annulus,
        "annulus_transmittance_stderr": per_annulus,
        "beyond_grid": per_channel,
        "beyond_grid_stderr": per_channel,
        "beyond_grid_transmittance": per_channel,
        "beyond_grid_transmittance_stderr": per_channel,
        "unfinished": per_channel,
        "absorbed": layers + per_channel,
        "specular_reflectance": (),
    }


def _read_only(name: str, value: npt.ArrayLike) -> FloatArray:
    """Copy to float64 and lock: a frozen record alone does not guard its arrays' contents."""
    try:
        array = np.array(value, dtype=np.float64, order="C")
    except (TypeError, ValueError):
        raise ProfileError(f"{name} is not an array of numbers.") from None
    array.flags.writeable = False
    return array


def _read_only_meta(meta: Mapping[str, Any]) -> Mapping[str, Any]:
    """Copy through JSON, which is what a file will hold of it: a tuple becomes a list here."""
    try:
        copy = json.loads(json.dumps(dict(meta), allow_nan=False))
    except (TypeError, ValueError, RecursionError) as error:
        raise ProfileError(f"meta cannot be kept as JSON: {error}.") from None
    return MappingProxyType(copy)


def _check_values(name: str, value: FloatArray, shape: tuple[int, ...]) -> None:
    if value.shape != shape:
        raise ProfileError(f"{name} has shape {value.shape}; expected {shape}.")
    if name.endswith("_stderr"):
        bad, wanted = (value < 0) | np.isinf(value), "a non-negative number, or NaN for none"
    else:
        bad, wanted = ~np.isfinite(value), "a finite number"
    if bad.any():
        raise ProfileError(f"{name} holds {value[bad].flat[0]}; expected {wanted}.")


def _check_edges(r_edges_mm: FloatArray, n_annuli: int) -> None:
    if r_edges_mm.shape != (n_annuli + 1,):
        raise ProfileError(
            f"r_edges_mm has shape {r_edges_mm.shape}; expected ({n_annuli + 1},), "
            "one edge more than annuli."
        )
    if not np.isfinite(r_edges_mm).all() or (np.diff(r_edges_mm) <= 0).any():
        raise ProfileError("r_edges_mm is not strictly increasing; expected finite, rising radii.")
    if r_edges_mm[0] != 0:
        raise ProfileError(f"r_edges_mm starts at {r_edges_mm[0]}; expected 0.")


def _check_meta(meta: Mapping[str, Any], n_channels: int) -> None:
    if meta.get("format") != FORMAT:
        raise ProfileError(f"meta has format {meta.get('format')!r}; expected {FORMAT!r}.")
    names = meta.get("channels")
    if (
        not isinstance(names, list)
        or len(names) != n_channels
        or not all(isinstance(name, str) for name in names)
    ):
        raise ProfileError(f"meta names channels {names!r}; expected a list of {n_channels} names.")
    photons = meta.get("photons")
    if photons is not None and (type(photons) is not int or photons < 1):
        raise ProfileError(f"meta has photons {photons!r}; expected a positive integer or null.")
