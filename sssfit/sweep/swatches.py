"""Reads the spectra of a sweep's store as swatches: `read_swatches`."""

from pathlib import Path
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.compare.swatches import Swatches
from sssfit.errors import ArgumentError, FileError, SweepError
from sssfit.files import path_of, reason
from sssfit.messages import printable
from sssfit.sweep.needed import needed
from sssfit.sweep.store import is_store
from sssfit.sweep.variables import FINGERPRINT

_REFLECTANCE, _ERROR = "diffuse_reflectance", "diffuse_reflectance_stderr"


def read_swatches(path: str | Path) -> Swatches:
    """Read the diffuse reflectance over wavelengths from a sweep's store.

    Parameters
    ----------
    path : str or Path
        A store with an axis in nm and one channel.

    Returns
    -------
    Swatches

    Raises
    ------
    SweepError
        The sweep has no axis in nm, several channels, or too few wavelengths for a colour.
    FileError
        The folder is no store of a sweep, or is damaged.
    """
    path = path_of(path)
    shown = printable(str(path))
    if not is_store(path):
        raise FileError(f"{shown} is a folder; name a file in it, or the store of a sweep.")
    zarr = needed("zarr", "sweep")
    try:
        found = _swatches(zarr.open_group(str(path), mode="r", zarr_format=2), shown)
        _ = found.xyz
    except ArgumentError as error:
        raise SweepError(f"{shown}: {error}") from None
    except OSError as error:
        raise FileError(f"{shown} cannot be read: {reason(error)}.") from error
    except (KeyError, ValueError, TypeError, IndexError, RuntimeError) as error:
        if isinstance(error, SweepError):
            raise
        raise FileError(f"{shown} is damaged ({type(error).__name__}); make it again.") from error
    return found


def _swatches(root: Any, shown: str) -> Swatches:
    plan = root.attrs["plan"]
    names = root[FINGERPRINT.name].attrs["_ARRAY_DIMENSIONS"]
    units = {name: str(root[name].attrs.get("units", "1")) for name in names}
    spectral = [name for name in names if units[name] == "nm"]
    if len(spectral) != 1:
        raise SweepError(
            f"{shown} has {len(spectral)} axes in nm; colours need one, such as a table whose "
            "first column is wavelength_nm."
        )
    channels = root["channel"].shape[0]
    if channels != 1:
        raise SweepError(
            f"{shown} has {channels} channels at each wavelength; expected a material of one."
        )
    (wavelength,) = spectral
    at = names.index(wavelength)
    is_done = root[FINGERPRINT.name][:] != 0

    def over_wavelengths(name: str) -> FloatArray:
        values = np.where(is_done, root[name][..., 0], np.nan)
        return np.moveaxis(values, at, -1)

    others = [name for name in names if name != wavelength]
    return Swatches(
        name=str(plan["material"]["name"]),
        method=str(plan["method"]),
        wavelengths_nm=np.asarray(root[wavelength][:], dtype=np.float64),
        axes={name: np.asarray(root[name][:]) for name in others},
        units={name: units[name] for name in others},
        reflectance=over_wavelengths(_REFLECTANCE),
        stderr=over_wavelengths(_ERROR),
    )
