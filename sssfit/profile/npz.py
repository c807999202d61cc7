"""The ``.profile.npz`` container: named arrays and a JSON text in an archive without pickle.

The same content gives the same bytes: members are stored in a fixed order, uncompressed (zlib
builds differ in their output) and with a fixed date. Reading does not trust the file: sizes are
checked before anything is allocated, and every exception caused by a damaged file becomes one line
that names the file.
"""

import errno
import io
import json
import math
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.errors import ProfileError
from sssfit.files import is_marked, read_at_most, reason, source_of
from sssfit.kinds import KINDS
from sssfit.messages import shown

FORMAT = "sssfit.profile/1"
FORMAT_OF_DIRECTIONS = "sssfit.profile/2"  # of a file with any of the arrays of ``DIRECTED``
REQUIRED = (
    "r_edges_mm",
    "annulus_energy",
    "annulus_energy_stderr",
    "beyond_grid",
    "beyond_grid_stderr",
    "specular_reflectance",
    "absorbed",
    "unfinished",
)
OPTIONAL = (
    "annulus_transmittance",
    "beyond_grid_transmittance",
    "annulus_transmittance_stderr",
    "beyond_grid_transmittance_stderr",
)
DIRECTED = (
    "exit_angle_edges_rad",
    "angle_reflected",
    "angle_reflected_stderr",
    "angle_transmitted",
    "angle_transmitted_stderr",
    "outside_aperture",
)

# The largest profile of the paper's materials is 0.3 MB, the largest possible one (64 channels of
# 100 000 annuli, all arrays) 410 MB; a larger file is a zip bomb or not ours.
_LARGEST_FILE_BYTES = 500_000_000
_LARGEST_META_BYTES = 16_000_000  # numpy's text has 4 bytes a character
_REMEDY = "write it again, or name another .profile.npz file"
_FOREIGN = "name a .profile.npz file, as sssfit writes it"


def pack(arrays: Mapping[str, npt.ArrayLike | None], meta: Mapping[str, Any]) -> bytes:
    """Return the whole file as bytes; the same content gives the same bytes everywhere."""
    members: dict[str, npt.NDArray[Any]] = {
        name: np.ascontiguousarray(value, dtype="<f8")
        for name, value in arrays.items()
        if value is not None
    }
    # ascontiguousarray turns a scalar into one dimension.
    members["specular_reflectance"] = members["specular_reflectance"].reshape(())
    members["meta"] = np.array(json.dumps(dict(meta), sort_keys=True))
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        for name, array in members.items():
            member = zipfile.ZipInfo(f"{name}.npy", date_time=(1980, 1, 1, 0, 0, 0))
            member.create_system = 3  # otherwise Windows writes another byte
            member.external_attr = 0o644 << 16
            archive.writestr(member, _npy_bytes(array))
    return buffer.getvalue()


def unpack(
    source: str | Path | BinaryIO, origin: str
) -> tuple[dict[str, FloatArray], dict[str, Any]]:
    """Return the arrays by name and the meta of a file or stream; ``origin`` names it in errors.

    Raises
    ------
    ProfileError
        The file is missing, unreadable, damaged, foreign, too large, or of another format version.
    """
    source = source_of(source, ProfileError)
    try:
        if isinstance(source, Path):
            _check_regular_file(source)
            with source.open("rb") as stream:
                return _unpack_known(stream)
        # A pipe cannot seek, but an archive's directory is at its end.
        return _unpack_known(io.BytesIO(read_at_most(source, _LARGEST_FILE_BYTES)))
    except ProfileError as error:
        is_other = str(error).startswith(("is not ", "is a folder"))
        remedy = _FOREIGN if is_other else _REMEDY
        raise ProfileError(f"{origin} {error}; {remedy}.") from None
    except OSError as error:
        raise ProfileError(f"{origin} cannot be read: {reason(error)}.") from error


def is_profile_file(path: Path) -> bool:
    """Return whether ``path`` is a profile of any format version; reads its meta only."""
    try:
        with zipfile.ZipFile(path) as archive:
            return _file_format(_read_meta(archive)).startswith("sssfit.profile/")
    except Exception:  # see unpack: damaged bytes raise almost any error, and are not a profile
        return False


def _unpack_known(stream: BinaryIO) -> tuple[dict[str, FloatArray], dict[str, Any]]:
    """Read every member; a file without our mark is called foreign, not damaged."""
    try:
        return _unpack_stream(stream)
    except ProfileError:
        raise
    except Exception as error:
        # A damaged directory may make zipfile seek to before the beginning of the file.
        if isinstance(error, OSError) and error.errno != errno.EINVAL:
            raise
        # zipfile, zlib, struct, numpy's header parser and json raise a dozen unrelated types on
        # damaged bytes (RuntimeError for a flipped encryption bit, MemoryError, RecursionError).
        if not is_marked(stream, KINDS["profile"].marks):
            raise ProfileError("is not a profile") from None
        raise ProfileError("is damaged") from error


def _unpack_stream(stream: BinaryIO) -> tuple[dict[str, FloatArray], dict[str, Any]]:
    """Read every member; ProfileError messages here continue a sentence that names the file."""
    with zipfile.ZipFile(stream) as archive:
        declared = sum(member.file_size for member in archive.infolist())
        if declared > _LARGEST_FILE_BYTES:
            raise ProfileError(
                f"declares {declared / 1e9:.3g} GB, more than the {_LARGEST_FILE_BYTES / 1e9:.3g} "
                "GB a profile may have"
            )
        names = [name.removesuffix(".npy") for name in archive.namelist()]
        if "meta" not in names:
            raise ProfileError(f"is not a profile: it holds {_listed(names)}")
        meta = _read_meta(archive)
        if (found := _file_format(meta)) not in (FORMAT, FORMAT_OF_DIRECTIONS):
            other = "has" if found.startswith("sssfit.profile/") else "is not a profile: it has"
            raise ProfileError(
                f"{other} format {shown(found)} where {FORMAT!r} or its /2 was expected"
            )
        if missing := [name for name in REQUIRED if name not in names]:
            raise ProfileError(f"lacks {', '.join(missing)}")
        if len(set(names)) < len(names) or set(names) - {*REQUIRED, *OPTIONAL, *DIRECTED, "meta"}:
            raise ProfileError("holds arrays that a profile does not have")
        arrays = {name: _read_float(archive, name) for name in names if name != "meta"}
    return arrays, meta


def _check_regular_file(path: Path) -> None:
    """Raise an error for devices and pipes: reading a zip starts at its end, which they lack."""
    if path.is_dir():
        raise ProfileError("is a folder")
    if path.exists() and not path.is_file():
        raise ProfileError("is not an ordinary file")


def _listed(names: Sequence[str]) -> str:
    """Return text with the names of a few members of an archive."""
    return shown(", ".join(names)) if names else "nothing"


def _file_format(meta: Mapping[str, Any]) -> str:
    return str(meta.get("format", "none"))


def _read_meta(archive: zipfile.ZipFile) -> dict[str, Any]:
    meta = json.loads(str(read_npy(archive, "meta", "U", _LARGEST_META_BYTES)))
    if not isinstance(meta, dict):
        raise ProfileError("is not a profile: its 'meta' is not a JSON object")
    return meta


def _read_float(archive: zipfile.ZipFile, name: str) -> FloatArray:
    return read_npy(archive, name, "f", _LARGEST_FILE_BYTES).astype(np.float64, order="C")


def read_npy(archive: zipfile.ZipFile, name: str, kind: str, most_bytes: int) -> npt.NDArray[Any]:
    """Read one .npy member after checking that its header agrees with its length.

    ``kind`` is "f" for float64 or "U" for text. A ProfileError continues a sentence that names the
    file; other damage raises anything that zipfile, zlib and numpy's header parser raise.
    """
    member = archive.getinfo(f"{name}.npy")
    if member.file_size > most_bytes:
        raise ProfileError(
            f"declares {member.file_size:,} bytes of {name}, more than {most_bytes:,}"
        )
    with archive.open(member) as stream:
        if np.lib.format.read_magic(stream) != (1, 0):
            raise ProfileError(f"holds {name} in an unknown .npy version")
        shape, fortran_order, dtype = np.lib.format.read_array_header_1_0(stream)
        if dtype.kind != kind or (kind == "f" and dtype.itemsize != 8):
            wanted = "float64" if kind == "f" else "text"
            raise ProfileError(f"holds {name} as {dtype} where {wanted} was expected")
        length = member.file_size - stream.tell()
        if min(shape, default=0) < 0 or math.prod(shape) * dtype.itemsize != length:
            raise ProfileError(f"holds {length} bytes of {name} where its header says {shape}")
        content = stream.read()
    return np.ndarray(shape, dtype, content, order="F" if fortran_order else "C")


def _npy_bytes(array: npt.NDArray[Any]) -> bytes:
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, array, version=(1, 0), allow_pickle=False)
    return buffer.getvalue()
