"""A profile or a kernel as a texture: linear floats in EXR or DDS, or a PNG to look at.

radial
    N x 1, R_d [1/mm^2]: texel i holds the mean over the annulus from i to i + 1 times the pitch, so
    a lookup at u = r / radius is linear between the annuli's middles.
line
    (2h + 1) x 1, the energy that leaves in strips one pixel wide, the middle one on the axis: the
    response to a line of light, and the weights of a pre-integrated pass.
kernel
    (2h + 1) x (2h + 1), the energy that leaves in each pixel around the one that is lit.

Lines and kernels have no unit, and over all texels they add up to the energy within the radius.
"""

import io
import math
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import KernelError
from sssfit.files import has_mark
from sssfit.formats.pictures import is_image_file, save_image
from sssfit.kernel import Kernel, SeparableKernel, Taps
from sssfit.messages import note, of_material, printable, shown
from sssfit.profile import Profile
from sssfit.profile.pixels import full_kernel

TABLES = ("radial", "line", "kernel")
ENDINGS = (".exr", ".dds", ".png")
_MOST_TEXELS = 16384  # on a side, the largest texture of current graphics cards
_TEXELS, _PITCH_MM = 256, 0.3
_SETTINGS = {  # of a profile's tables
    "radial": ("texels", "radius"),
    "line": ("radius", "mm_per_pixel"),
    "kernel": ("radius", "mm_per_pixel"),
}
_MARKED = {"texels": "`texels`", "radius": "`radius_mm`", "mm_per_pixel": "`mm_per_pixel`"}
_SHARE = 0.999  # of each channel's light on the grid, within the radius unless one is given
_PREVIEW_ROWS = 64  # of a PNG of one row, which nobody would see
_MARK = b"sssfit.lut/1"  # in a DDS, among the words that its header leaves free
_DXGI = {1: 41, 2: 16, 4: 2}  # R32_FLOAT, R32G32_FLOAT, R32G32B32A32_FLOAT


def lut_bytes(
    sources: Sequence[Profile | Kernel],
    *,
    ending: str = ".exr",
    table: str = "radial",
    texels: int | None = None,
    radius_mm: float | None = None,
    mm_per_pixel: float | None = None,
) -> tuple[bytes, dict[str, Any]]:
    """Return the file of a texture, and its figures.

    Parameters
    ----------
    sources : sequence of Profile, SeparableKernel or Taps
        Exactly one. A kernel has the tables "line" and "kernel", on its own pixels.
    ending : ".exr", ".dds" or ".png"
        EXR has float32 and the pitch in its header; DDS float32, with three channels as four, the
        last one 1; PNG 16-bit sRGB of the values over the largest, to look at.
    table : "radial", "line" or "kernel"
    texels : int, optional
        Texels of the radial table, by default 256.
    radius_mm : float, optional [mm]
        How far a profile's table reaches, by default as far as 99.9 % of every channel's light.
    mm_per_pixel : float, optional [mm]
        Pitch of a profile's line or kernel, by default 0.3.

    Returns
    -------
    bytes, dict

    Raises
    ------
    KernelError
        There are several, the ending or the table is unknown, the texture would be too large, a
        kernel has no such table, or the table has no such setting.
    """
    if len(sources) != 1:
        raise KernelError("a texture holds one profile or kernel; write the others one by one.")
    if not isinstance(ending, str) or ending not in ENDINGS:
        said = printable(str(ending)) or "no ending"
        raise KernelError(f"{said}: textures are written as {', '.join(ENDINGS)}.")
    source = sources[0]
    _check_table(table)
    given = {"texels": texels, "radius": radius_mm, "mm_per_pixel": mm_per_pixel}
    _check_given(source, table, [key for key, value in given.items() if value is not None])
    if isinstance(source, Profile):
        texels = _TEXELS if texels is None else texels
        pitch_mm = _PITCH_MM if mm_per_pixel is None else mm_per_pixel
        values, pitch_mm = _of_profile(source, table, texels, radius_mm, pitch_mm)
    else:
        values, pitch_mm = _of_kernel(source, table), source.mm_per_pixel
    figures = {
        "table": table,
        "channels": list(source.channels),
        "texels": [values.shape[1], values.shape[0]],
        "mm_per_texel": pitch_mm,
        "unit": "1/mm^2" if table == "radial" else "1",
        "largest": values.max(axis=(0, 1)).tolist(),
    }
    return _packed(values, pitch_mm, source.channels, ending), figures


def _of_profile(
    profile: Profile, table: str, texels: int, radius_mm: float | None, pitch_mm: float
) -> tuple[FloatArray, float]:
    """Return the texels (H, W, C) of a profile, and their pitch [mm]."""
    if radius_mm is None:
        radii_mm = profile.energy_radii_mm([_SHARE])
        if np.isnan(radii_mm).all():
            raise KernelError("no light leaves within the profile's grid; there is no texture.")
        radius_mm = float(np.nanmax(radii_mm))
    if not (math.isfinite(radius_mm) and 0.0 < radius_mm <= profile.r_edges_mm[-1]):
        raise KernelError(
            f"`radius = {radius_mm:.6g}`; expected one above 0 mm and up to the profile's "
            f"{profile.r_edges_mm[-1]:.6g} mm."
        )
    if table == "radial":
        _check_size(texels)
        edges_mm: FloatArray = np.linspace(0.0, radius_mm, texels + 1)
        areas = math.pi * np.diff(edges_mm) * (edges_mm[1:] + edges_mm[:-1])
        means: FloatArray = np.diff(profile.cumulative_at(edges_mm), axis=0) / areas[:, None]
        return means[None], radius_mm / texels
    if not (math.isfinite(pitch_mm) and pitch_mm > 0.0):
        raise KernelError(f"`mm_per_pixel = {pitch_mm:.6g}`; expected a length above 0.")
    half = math.ceil(min(radius_mm / pitch_mm, _MOST_TEXELS))
    _check_size(2 * half + 1)
    if table == "line":
        return profile.line_kernel(pitch_mm, half)[None], pitch_mm
    return full_kernel(profile.quadrant_kernel(pitch_mm, half)), pitch_mm


def _of_kernel(kernel: Kernel, table: str) -> FloatArray:
    """Return the texels (H, W, C) of a kernel, its ``scale`` included."""
    if table == "radial":
        raise KernelError(
            f"{of_material(kernel.meta.get('material'))}: a kernel's pixels have no radial table; "
            "ask for line or kernel, or export the profile."
        )
    found = kernel.separable_kernel() if isinstance(kernel, Taps) else kernel
    if table == "line":
        return _scaled(found, found.line[None])
    _check_size(found.pixels)
    channels = range(len(found.channels))
    return _scaled(found, np.stack([found.full(c) for c in channels], axis=-1))


def _scaled(kernel: SeparableKernel, values: FloatArray) -> FloatArray:
    scaled: FloatArray = values * kernel.scale
    return scaled


def _check_table(table: str) -> None:
    if table not in TABLES:
        raise KernelError(f"`table = {shown(table)}`; expected one of {', '.join(TABLES)}.")


def _check_given(source: Profile | Kernel, table: str, given: Sequence[str]) -> None:
    """Refuse settings that another table has."""
    known = _SETTINGS[table] if isinstance(source, Profile) else ()
    for each in given:
        if each not in known:
            owners = " or ".join(name for name, own in _SETTINGS.items() if each in own)
            what = f"a profile's {table} table" if known else "a table of a kernel's own pixels"
            raise KernelError(
                f"{_MARKED[each]} is for a profile's {owners} table, and this is {what}; leave it "
                "out."
            )


def _check_size(texels: int) -> None:
    if not 2 <= texels <= _MOST_TEXELS:
        raise KernelError(
            f"the texture would have {texels:,} texels on a side; expected 2 to {_MOST_TEXELS:,}. "
            "Choose larger pixels, fewer texels or a smaller radius."
        )


def _packed(values: FloatArray, pitch_mm: float, channels: Sequence[str], ending: str) -> bytes:
    """Return the file of texels (H, W, C)."""
    if ending == ".dds":
        return _dds(values.astype(np.float32))
    stream = io.BytesIO()
    if ending == ".exr":
        save_image(stream, values, format="exr", channels=_names(channels), mm_per_pixel=pitch_mm)
        return stream.getvalue()
    largest = float(values.max())
    if len(values) == 1:
        values = np.repeat(values, _PREVIEW_ROWS, axis=0)
    note(f"The PNG is for looking: its white is {largest:.6g}. Shaders take EXR or DDS.")
    save_image(stream, values, format="png", exposure=1.0 / largest if largest > 0.0 else 1.0)
    return stream.getvalue()


def _names(channels: Sequence[str]) -> Sequence[str] | None:
    """Return names for an EXR; one and three channels have those of its convention."""
    return None if len(channels) in (1, 3) else tuple(channels)


def _dds(texels: np.ndarray[Any, np.dtype[np.float32]]) -> bytes:
    """Return a DDS of one texture without mipmaps, with the header that Direct3D 10 brought.

    Raises
    ------
    KernelError
        There are more than four channels.
    """
    height, width, count = texels.shape
    if count > 4:
        raise KernelError(f"a DDS has at most 4 channels, and this has {count}; write an EXR.")
    if count == 3:  # few graphics cards filter textures of three floats
        texels = np.concatenate((texels, np.ones((height, width, 1), np.float32)), axis=2)
    stored = texels.shape[2]
    row_bytes = 4 * stored * width
    caps, has_four_characters, is_texture, is_2d = 0x100F, 0x4, 0x1000, 3
    header = struct.pack("<4s7I44s", b"DDS ", 124, caps, height, width, row_bytes, 0, 1, _MARK)
    header += struct.pack("<2I4s20x", 32, has_four_characters, b"DX10")
    header += struct.pack("<I16x", is_texture)
    header += struct.pack("<5I", _DXGI[stored], is_2d, 0, 1, 0)
    return header + texels.astype("<f4").tobytes()


def is_our_texture(path: Path) -> bool:
    """Return whether a file is a texture or picture that we wrote."""
    return is_image_file(path) or has_mark(path, {b"DDS ": _MARK})
