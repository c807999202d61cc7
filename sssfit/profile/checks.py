"""Checks of a profile's fields: shapes, numbers, provenance."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray, check_names, check_provenance, json_object, number_array
from sssfit.errors import MaterialError, ProfileError
from sssfit.material import Material
from sssfit.messages import counted, shown
from sssfit.profile.directions import check_directions, directed_shapes
from sssfit.profile.npz import DIRECTED, FORMAT, FORMAT_OF_DIRECTIONS, OPTIONAL

# Limits of shares of light and of mm, beyond any grid or table; squares stay far from overflow.
_MAX = 1e12
_MIN_MM = 1e-12
# Least width of an annulus as a share of its radius, so that the 64 parts used for pixels stay
# distinct in double precision. 100 000 annuli, the maximum, have 1e-5 at the rim.
_NARROWEST = 1e-9
BALANCE_ROUNDING = 1e-12  # below this an energy balance is rounding, not roulette
# Of all light on a side: in ``meta`` where they do not follow from those of annuli (`under_beam`).
TOTAL_ERRORS = ("diffuse_reflectance_stderr", "transmittance_stderr")


def checked(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a `sssfit.profile.Profile` as stored, or raise ProfileError."""
    fields: dict[str, Any] = {
        name: None
        if value is None and name in (*OPTIONAL, *DIRECTED)
        else number_array(name, value, ProfileError)
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
    check_directions(fields)
    fields["specular_reflectance"] = float(fields["specular_reflectance"])
    if not 0.0 <= fields["specular_reflectance"] <= 1.0:
        raise ProfileError(
            f"specular_reflectance = {fields['specular_reflectance']}; expected 0 to 1."
        )
    fields["meta"] = json_object("meta", given["meta"], ProfileError)
    _check_meta(fields["meta"], energy.shape[1])
    given_directions = [name for name in DIRECTED if fields[name] is not None]
    if given_directions and fields["meta"]["format"] == FORMAT:
        raise ProfileError(
            f"{given_directions[0]} is given, which format {FORMAT!r} does not have; expected "
            f"{FORMAT_OF_DIRECTIONS!r}."
        )
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
        "outside_aperture": per_channel,
    } | directed_shapes(fields)


def _check_values(name: str, value: FloatArray, shape: tuple[int, ...]) -> None:
    if value.shape != shape:
        raise ProfileError(f"{name} has shape {value.shape}; expected {shape}.")
    if name.endswith("_stderr"):
        bad = (value < 0.0) | (value > _MAX)
        wanted = f"a number from 0 to {_MAX:g}, or NaN for none"
    else:
        bad, wanted = ~(np.abs(value) <= _MAX), f"a finite number, at most {_MAX:g}"
    if bad.any():
        at = f" at {np.argwhere(bad)[0].tolist()}" if shape else ""
        raise ProfileError(f"{name} holds {value[bad].flat[0]}{at}; expected {wanted}.")


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
    if r_edges_mm[1] < _MIN_MM or r_edges_mm[-1] > _MAX:
        raise ProfileError(
            f"r_edges_mm reaches from {r_edges_mm[1]:g} to {r_edges_mm[-1]:g} mm; expected radii "
            f"from {_MIN_MM:g} to {_MAX:g} mm."
        )
    narrow = np.flatnonzero(np.diff(r_edges_mm) < _NARROWEST * r_edges_mm[1:])
    if narrow.size:
        k = int(narrow[0])
        raise ProfileError(
            f"r_edges_mm[{k}] and [{k + 1}] are {r_edges_mm[k + 1] - r_edges_mm[k]:.2g} mm apart "
            f"at {r_edges_mm[k + 1]:.4g} mm, too narrow an annulus; join it with the next."
        )


def _check_meta(meta: Mapping[str, Any], n_channels: int) -> None:
    if meta.get("format") not in (FORMAT, FORMAT_OF_DIRECTIONS):
        raise ProfileError(
            f"meta has format {shown(meta.get('format'))}; expected {FORMAT!r} or "
            f"{FORMAT_OF_DIRECTIONS!r}."
        )
    names = meta.get("channels")
    if not isinstance(names, list) or len(names) != n_channels:
        raise ProfileError(
            f"meta names channels {shown(names)}; expected a list of {n_channels} names."
        )
    check_names(names, ProfileError)
    check_provenance(meta, ProfileError)
    error = meta.get("relative_error")
    if error is not None and not _is_error(error):
        raise ProfileError(f"meta.relative_error = {shown(error)}; expected 0 or more, or null.")
    for name in ("energy_balance_stderr", *TOTAL_ERRORS):
        _check_errors(name, meta.get(name), n_channels)
    _check_material(meta)


def _check_errors(name: str, errors: object, n_channels: int) -> None:
    if errors is not None and not (
        isinstance(errors, list) and len(errors) == n_channels and all(map(_is_error, errors))
    ):
        raise ProfileError(
            f"meta.{name} = {shown(errors)}; expected a number from 0 up for each "
            f"of {counted(n_channels, 'channel')}, or null."
        )


def _is_error(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and value >= 0


def _check_material(meta: Mapping[str, Any]) -> None:
    """Raise an error if coefficients and fingerprint disagree, because one was edited."""
    record, fingerprint = meta.get("material"), meta.get("material_sha256")
    if record is not None and not isinstance(record, Mapping):
        raise ProfileError(f"meta.material = {shown(record)}; expected a mapping or null.")
    if record is None or fingerprint is None:
        return
    try:
        material = Material.from_dict(record)
    except MaterialError as fault:
        raise ProfileError(f"meta.material is not a material: {fault}") from None
    if material.sha256 != fingerprint:
        raise ProfileError(
            f"meta.material_sha256 is not that of meta.material ({material.sha256[:16]}...): one "
            "of the two was changed; simulate the material again."
        )
    if list(material.channels) != meta["channels"]:
        raise ProfileError(
            f"meta.channels = {shown(meta['channels'])}, but meta.material has "
            f"{shown(list(material.channels))}."
        )
