"""The files that every approved invocation begins with, the same to the last bit everywhere.

Profiles and kernels are made of plain arithmetic, so that what is computed from them can be
compared on any machine. Nothing in them is usual: channels in another order, unequal scales and
pixels, names beyond ASCII.
"""

import atexit
import functools
import math
import os
import shutil
import struct
import tempfile
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO
from angled import angled
from meshes import obj_text, sphere
from PIL import Image

from sssfit.formats.pictures import save_image
from sssfit.kernel import SeparableKernel, Stage, Taps
from sssfit.material import Material, parse_material
from sssfit.profile import FORMAT, Profile

DATA = Path(__file__).parent / "data"

WAX = """\
name = "wax"
source = "a candle"
eta = 1.3
g = 0
sigma_a_per_mm = [0.03, 0.2, 0.6]
sigma_s_per_mm = [0.7, 0.8, 0.9]
"""
PLATE = """\
name = "plate"
channels = ["B", "G", "R"]
eta_above = 1.1
eta_below = 1.2

[[layers]]
eta = 1.4
g = 0.5
sigma_a_per_mm = [0.1, 0.2, 0.3]
sigma_s_per_mm = [4.0, 5.0, 6.0]
thickness_mm = 0.5

[[layers]]
eta = 1.35
g = [0.1, 0.2, 0.3]
sigma_a_per_mm = [0.2, 0.4, 0.5]
sigma_s_per_mm = [1.0, 1.5, 1.25]
thickness_mm = 1.5
"""
LEAF = """\
name = "leaf"
source = "ein Blatt, grün"
channels = ["grün", "λ 700"]
eta = 1.45
g = 0.25
sigma_a_per_mm = [0.4, 0.05]
sigma_s_per_mm = [3.0, 2.0]
"""
CLEAR = """\
name = "varnish"
channels = ["Y"]
[[layers]]
eta = 1.5
g = 0
sigma_a_per_mm = [0]
sigma_s_per_mm = [0]
thickness_mm = 0.1
[[layers]]
eta = 1.4
g = 0.8
sigma_a_per_mm = [0.5]
sigma_s_per_mm = [20]
"""
TWO_RUNS = """\
1.0
2  # runs
first.mco A
2000
0.05 0.02
4 8 3
2
1.0
1.4 1 100 0.9 0.1
1.4 2.5 10 0 0.2
1.5
second.mco A
3000
0.05 0.03
4 6 3
1
1.1
1.3 0.5 7.4 0.2 1E8
1.0
"""


# Profiles


def _energies(totals: Sequence[float], spreads: Sequence[float], annuli: int) -> list[list[float]]:
    """Energy by annulus and channel, with the noise of a walk."""
    shape = [[1.0 / ((k + 1.0) * (k + 1.0 + spread)) for spread in spreads] for k in range(annuli)]
    sums = [sum(row[c] for row in shape) for c in range(len(totals))]
    noise = [1.0 + 0.02 * ((7 * k) % 5 - 2.0) for k in range(annuli)]
    return [
        [round(totals[c] * row[c] / sums[c] * noise[k], 9) for c in range(len(totals))]
        for k, row in enumerate(shape)
    ]


def _profile(
    edges_mm: Sequence[float],
    totals: Sequence[float],
    spreads: Sequence[float],
    *,
    meta: dict[str, Any],
    layers: int = 1,
    transmitted: Sequence[float] | None = None,
    has_errors: bool = True,
    specular: float = 0.017,
) -> Profile:
    energy = _energies(totals, spreads, len(edges_mm) - 1)
    beyond = [round(0.01 * (c + 1) * total, 9) for c, total in enumerate(totals)]
    below = None
    if transmitted is not None:
        below = np.array(_energies(transmitted, spreads[::-1], len(edges_mm) - 1))
    lit = [sum(row[c] for row in energy) + beyond[c] for c in range(len(totals))]
    through = [0.0] * len(totals) if below is None else [sum(each) + 0.002 for each in below.T]
    rest = [1.0 - specular - a - b for a, b in zip(lit, through, strict=True)]
    shares = [0.75, 0.25][:layers] if layers > 1 else [1.0] * layers
    # As of a walk whose photons carry most of their weight to the end.
    scale = 0.9 / math.sqrt(meta["photons"] or 10_000) if has_errors else math.nan
    return Profile(
        r_edges_mm=np.array(edges_mm),
        annulus_energy=np.array(energy),
        annulus_energy_stderr=scale * np.sqrt(energy),
        beyond_grid=np.array(beyond),
        beyond_grid_stderr=scale * np.sqrt(beyond),
        specular_reflectance=specular,
        absorbed=np.array([[round(part * each, 9) for each in rest] for part in shares]).reshape(
            layers, len(totals)
        ),
        unfinished=np.array([1e-6 * c for c in range(len(totals))]),
        annulus_transmittance=below,
        beyond_grid_transmittance=None if below is None else np.full(len(totals), 0.002),
        annulus_transmittance_stderr=None if below is None else scale * np.sqrt(below),
        beyond_grid_transmittance_stderr=None if below is None else np.full(len(totals), 1e-4),
        meta={"format": FORMAT, "version": "9.8.7"} | meta,
    )


def _walked(material: Material, **own: Any) -> dict[str, Any]:
    """Provenance of a walk."""
    return {
        "method": "montecarlo",
        "material": material.to_dict(),
        "material_sha256": material.sha256,
        "channels": list(material.channels),
        "photons": 12_000,
        "seed": 7,
    } | own


def even(annuli: int, dr_mm: float) -> list[float]:
    return [round(dr_mm * k, 9) for k in range(annuli + 1)]


@functools.cache
def wax() -> Profile:
    material = parse_material(WAX, "wax.toml")
    return _profile(even(24, 0.25), (0.42, 0.21, 0.09), (6.0, 2.0, 0.5), meta=_walked(material))


@functools.cache
def plate() -> Profile:
    """Of a slab of two layers, its channels in another order."""
    material = parse_material(PLATE, "plate.toml")
    return _profile(
        even(16, 0.2),
        (0.12, 0.25, 0.31),
        (1.0, 3.0, 5.0),
        meta=_walked(material, photons=5000, seed=3),
        layers=2,
        transmitted=(0.02, 0.05, 0.11),
        specular=0.0144,
    )


@functools.cache
def leaf() -> Profile:
    """Two channels, beyond ASCII, computed and not walked."""
    material = parse_material(LEAF, "leaf.toml")
    meta = _walked(material, photons=None, seed=None, method="dipole")
    meta |= {"channels": ["grün", "λ 700"]}
    return _profile(even(20, 0.15), (0.05, 0.55), (1.0, 4.0), meta=meta, has_errors=False)


@functools.cache
def four() -> Profile:
    """Four channels of unknown material on unequal annuli; one returns no light."""
    edges = [0.0, 0.1, 0.3, 0.6, 1.0, 1.6, 2.4, 3.5, 5.0]
    meta = {
        "method": "imported",
        "material": None,
        "channels": ["N", "R", "E", "D"],
        "photons": None,
        "seed": None,
        "source": "vier.csv",
        "settings": {"quantity": "energy"},
    }
    return _profile(
        edges, (0.5, 0.3, 0.0, 0.1), (4.0, 2.0, 1.0, 0.5), meta=meta, layers=0, specular=0.0
    )


@functools.cache
def mono() -> Profile:
    meta = {
        "method": "exact",
        "material": None,
        "channels": ["mono"],
        "photons": None,
        "seed": None,
        "relative_error": 3e-5,
    }
    return _profile(even(12, 0.4), (0.35,), (3.0,), meta=meta, layers=0, has_errors=False)


# Kernels


def _kernel(
    method: str,
    channels: Sequence[str],
    half: int,
    terms: int,
    mm_per_pixel: float,
    *,
    energies: Sequence[float],
    parameters: dict[str, Any],
    meta: dict[str, Any],
    negative: bool = True,
    known: bool = True,
) -> SeparableKernel:
    """Weights that fall off at another rate in every term and channel; some signs are negative."""
    count = len(channels)
    shapes = [
        [
            [(0.4 / (t + 1.0)) / (1.0 + (c + 1.0) * abs(k) + t * k * k / 3.0) for c in range(count)]
            for k in range(-half, half + 1)
        ]
        for t in range(terms)
    ]
    # The first term alone has about the energy of the profile, its square's square root.
    sums = [sum(row[c] for row in shapes[0]) for c in range(count)]
    factors = [math.sqrt(energies[c]) / sums[c] for c in range(count)]
    weights = [
        [[round(factors[c] * row[c], 13) for c in range(count)] for row in term] for term in shapes
    ]
    signs = np.ones((terms, count))
    if negative and terms > 1:
        signs[-1, ::2] = -1.0
    errors = np.array([round(0.011 * (c + 1.5), 6) for c in range(count)])
    drifts = np.array([round(0.0031 * (c - 0.7), 7) for c in range(count)])
    unknown = np.full(count, np.nan)
    return SeparableKernel(
        method=method,
        mm_per_pixel=mm_per_pixel,
        channels=tuple(channels),
        signs=signs,
        weights=np.array(weights),
        relative_frobenius_error=errors if known else unknown,
        energy_error=drifts if known else unknown,
        scale=np.array([round(0.9 - 0.17 * c, 6) for c in range(count)]),
        parameters=parameters,
        meta=meta,
    )


def _fitted_to(profile: Profile, **settings: Any) -> dict[str, Any]:
    """Provenance of a kernel."""
    meta = profile.meta
    return {
        "material": profile.material_name,
        "material_sha256": meta.get("material_sha256"),
        "profile_sha256": profile.sha256,
        "profile_method": meta["method"],
        "photons": meta["photons"],
        "seed": meta["seed"],
        "version": "9.8.7",
        "settings": settings,
    }


@functools.cache
def kernels() -> dict[str, SeparableKernel]:
    """By their files' names."""
    near = {"near_mm2": 0.0123456789, "far_mm2": 1.5, "weight": 0.25}
    return {
        "wax.svd2": _kernel(
            *("svd", ("R", "G", "B"), 4, 2, 0.25),
            energies=(0.43, 0.2, 0.1),
            parameters={},
            meta=_fitted_to(wax(), rank=2, energy="keep"),
        ),
        "plate.artist": _kernel(
            *("artist", ("B", "G", "R"), 3, 1, 0.2125),
            energies=(0.12, 0.27, 0.3),
            parameters=dict.fromkeys(("B", "G", "R"), near),
            meta=_fitted_to(plate(), target="kernel", seed=0),
        ),
        "wax.gaussians3": _kernel(
            *("gaussians", ("R", "G", "B"), 3, 3, 4.0),
            energies=(0.3, 0.15, 0.07),
            parameters={
                name: {"variances_mm2": [2.0, 30.0 + c, 250.0], "weights": [0.2, 0.15, 0.02 * c]}
                for c, name in enumerate("RGB")
            },
            meta=_fitted_to(wax(), terms=3),
            negative=False,
        ),
        "grau": _kernel(
            *("guided", ("Y",), 2, 1, 1.0 / 3.0),
            energies=(0.6,),
            parameters={"Y": {"k": 4.0}},
            meta={},
            known=False,
        ),
        "leaf.burley": _kernel(
            *("burley", ("grün", "λ 700"), 2, 3, 0.15),
            energies=(0.05, 0.5),
            parameters={"grün": {"s": 3.5, "note": "nah"}, "λ 700": {"s": 0.000123456}},
            meta=_fitted_to(leaf()),
        ),
        "vier.gaussians4": _kernel(
            *("gaussians", ("N", "R", "E", "D"), 3, 4, 0.3),
            energies=(0.4, 0.25, 0.02, 0.1),
            parameters={},
            meta=_fitted_to(four(), terms=4, signed=True),
        ),
        "five": _kernel(
            *("svd", ("a", "b", "c", "d", "e"), 1, 2, 2.0),
            energies=(0.5, 0.4, 0.3, 0.2, 0.1),
            parameters={},
            meta={"material": "fünf", "seed": 0, "photons": 1_234_567},
        ),
    }


# Pictures


def light(height: int, width: int, count: int) -> np.ndarray:
    """Numbers that differ in every place, multiples of 1/4096."""
    places = np.arange(height * width * count).reshape(height, width, count)
    return ((places * 2654435761) % 4096 / 4096.0).astype(np.float32)


def _write(path: Path, pixels: np.ndarray, channels: Sequence[str] = (), **attributes: Any) -> None:
    """A picture as other programs write it."""
    height, width, count = pixels.shape
    kind = {"float32": "float", "float16": "half", "uint32": "uint"}.get(
        pixels.dtype.name, pixels.dtype.name
    )
    spec = OpenImageIO.ImageSpec(width, height, count, kind)
    if channels:
        spec.channelnames = tuple(channels)
    for name, value in attributes.items():
        if isinstance(value, tuple):
            form = OpenImageIO.TypeDesc(f"float[{len(value)}]")
            spec.attribute(name.replace("__", ":"), form, value)
        else:
            spec.attribute(name.replace("__", ":"), value)
    writer = OpenImageIO.ImageOutput.create(str(path))
    assert writer.open(str(path), spec), writer.geterror()
    assert writer.write_image(np.ascontiguousarray(pixels)), writer.geterror()
    writer.close()


def _codes(kind: type, height: int, width: int, count: int) -> np.ndarray:
    return (np.iinfo(kind).max * light(height, width, count)).astype(kind)


def _pictures(folder: Path) -> None:
    save_image(folder / "mine.exr", light(10, 14, 3), mm_per_pixel=0.25)
    save_image(folder / "bare.exr", light(6, 9, 3))
    layered = light(7, 11, 7)
    layered[:3, :, 6] = 0.25
    names = [f"{layer}.{each}" for layer in ("near", "far") for each in "RGB"]
    _write(folder / "layers.exr", layered, [*names, "far.A"])
    depth = light(5, 8, 5)
    _write(folder / "depth.exr", depth, ["R", "G", "B", "Z", "id"], Orientation=6)
    _write(folder / "vier.exr", light(6, 9, 4), ["N", "R", "E", "D"])
    _write(folder / "two.exr", light(6, 9, 2), ["grün", "λ 700"])
    wide = (0.708, 0.292, 0.17, 0.797, 0.131, 0.046, 0.3127, 0.329)
    _write(folder / "wide.exr", light(6, 9, 3), ["R", "G", "B"], chromaticities=wide)
    near = (0.64, 0.33, 0.29, 0.6, 0.15, 0.06, 0.3127, 0.329)
    _write(folder / "ebu.exr", light(6, 9, 3), ["R", "G", "B"], chromaticities=near)
    negative = light(6, 9, 3)
    negative[4, 2, 1] = -0.25
    _write(folder / "negative.exr", negative, ["R", "G", "B"])
    _write(folder / "negative_wide.exr", negative, ["R", "G", "B"], chromaticities=wide)
    _write(folder / "rgb8.png", _codes(np.uint8, 8, 13, 3))
    _write(folder / "rgba16.png", _codes(np.uint16, 8, 13, 4), oiio__UnassociatedAlpha=1)
    _write(folder / "grey.png", _codes(np.uint8, 8, 13, 1), oiio__Gamma=1.8)
    _write(folder / "turned.tif", light(8, 13, 3), Orientation=3)
    _write(folder / "rgba8.tif", _codes(np.uint8, 8, 13, 4), oiio__UnassociatedAlpha=1)
    _write(folder / "photo.tga", _codes(np.uint8, 8, 13, 3))
    _compressed(folder)
    _unusual(folder)
    _named(folder)
    _radiance(folder)
    _damaged(folder)
    smooth = np.broadcast_to(np.linspace(40, 200, 16)[:, None, None], (16, 24, 3))
    _write(folder / "photo.jpg", smooth.astype(np.uint8), Compression="jpeg:95")
    (folder / "old.hdr").write_bytes(
        b"#?RADIANCE\nEXPOSURE=2\nEXPOSURE=.5e1\nCOLORCORR=1 1.25 2\nFORMAT=32-bit_rle_rgbe\n\n"
        b"-Y 6 +X 9\n" + bytes((17 * k + 5) % 251 for k in range(6 * 9 * 3 * 4 // 3))[: 6 * 9 * 4]
    )
    (folder / "xyz.hdr").write_bytes(
        b"#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 2 +X 2\n" + struct.pack("16B", *range(16))
    )
    (folder / "cut.exr").write_bytes((folder / "mine.exr").read_bytes()[:400])
    (folder / "cut.png").write_bytes((folder / "rgb8.png").read_bytes()[:-30])


def _unusual(folder: Path) -> None:
    """What other programs write now and then."""
    for orientation in range(1, 9):
        _write(folder / f"o{orientation}.tif", light(2, 3, 1), Orientation=orientation)
    for name, x, y in (("inside", 2, 1), ("across", -1, 3)):
        spec = OpenImageIO.ImageSpec(4, 3, 3, "float")
        spec.x, spec.y, spec.full_width, spec.full_height = x, y, 9, 5
        writer = OpenImageIO.ImageOutput.create(str(folder / f"{name}.exr"))
        assert writer.open(str(folder / f"{name}.exr"), spec)
        assert writer.write_image(np.ascontiguousarray(light(3, 4, 3)))
        writer.close()
    _write(folder / "half.exr", light(3, 4, 3).astype(np.float16))
    _write(folder / "y.exr", light(3, 4, 2), ["Y", "A"])
    _write(folder / "place.exr", light(3, 4, 3), ["X", "Y", "Z"])
    _write(folder / "wide.tif", (1e6 * light(3, 4, 3)).astype(np.uint32))
    _write(folder / "associated.tif", _codes(np.uint16, 3, 4, 4))
    for kind, depth in ((1, 8), (2, 15), (2, 16), (2, 24), (2, 32), (2, 48), (3, 8), (4, 8)):
        head = struct.pack("<3B2HB4H2B", 0, 0, kind, 0, 0, 0, 0, 0, 2, 1, depth, 0x20)
        (folder / f"t{kind}_{depth}.tga").write_bytes(head + bytes(range(10, 10 + depth // 4)))
    palette = Image.fromarray(_codes(np.uint8, 3, 4, 1)[..., 0] % 4, "P")
    palette.putpalette([200, 30, 40, 50, 160, 70, 80, 90, 250, 110, 120, 130])
    palette.save(folder / "palette.png")
    plain = _without((folder / "rgb8.png").read_bytes(), b"cHRM")
    numbers = (31270, 32900, 68000, 32000, 26500, 69000, 15000, 6000)  # of DCI P3, white first
    content = b"cHRM" + struct.pack(">8I", *numbers)
    chunk = struct.pack(">I", 32) + content + struct.pack(">I", zlib.crc32(content))
    both = plain[:33] + chunk + plain[33:]
    (folder / "srgb_and_p3.png").write_bytes(both)
    (folder / "p3.png").write_bytes(_without(both, b"sRGB"))


def _named(folder: Path) -> None:
    """Channels, layers, parts and colour spaces by other names."""
    _write(folder / "flat.exr", np.full((5, 7, 3), 0.375, dtype=np.float32), ["R", "G", "B"])
    _write(folder / "only.exr", light(3, 4, 4), [*(f"only.{each}" for each in "RGB"), "Z"])
    _write(folder / "dotted.exr", light(3, 4, 2), ["x.N", "x.D"])
    _write(folder / "alpha.exr", light(3, 4, 4), ["R", "G", "B", "alpha"])
    _write(folder / "far.exr", light(3, 4, 4), [*(f"far.{each}" for each in "RGB"), "far.Alpha"])
    holed = light(3, 4, 4)
    holed[2, 1, 3] = np.nan
    _write(folder / "holed.exr", holed, ["R", "G", "B", "A"])
    holed[1, 3, 2] = np.inf
    _write(folder / "infinite.exr", holed, ["R", "G", "B", "A"])
    _write(folder / "red.exr", light(3, 4, 4), ["Red", "Green", "Blue", "A"])
    _write(folder / "aov.exr", light(3, 4, 12), [f"c{k}" for k in range(11)] + ["Y"])
    _write(folder / "greys.exr", light(3, 4, 2), ["b.Y", "a.Y"])
    _write(folder / "acescg.exr", light(3, 4, 3), ["R", "G", "B"], oiio__ColorSpace="ACEScg")
    ours = (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329)
    _write(folder / "same.exr", light(3, 4, 3), ["R", "G", "B"], chromaticities=ours)
    small = (0.55, 0.35, 0.31, 0.52, 0.18, 0.1, 0.34, 0.36)
    _write(folder / "small.exr", light(3, 4, 3), ["R", "G", "B"], chromaticities=small)
    _write(folder / "y_small.exr", light(3, 4, 1), ["Y"], chromaticities=small)
    _write(folder / "plain.png", _codes(np.uint8, 3, 4, 3))
    plain = _without(_without((folder / "plain.png").read_bytes(), b"sRGB"), b"gAMA")
    for gamma in (1.0, 1.8, 2.2):
        content = b"gAMA" + struct.pack(">I", round(1e5 / gamma))
        chunk = struct.pack(">I", 4) + content + struct.pack(">I", zlib.crc32(content))
        (folder / f"gamma{gamma:g}.png").write_bytes(plain[:33] + chunk + plain[33:])
    _write(folder / "scaled.exr", light(3, 4, 3), ["R", "G", "B"], sssfit__mm_per_pixel="-0.25")
    specs = []
    for name, width, more in (("first", 5, ()), ("second", 5, ("Z",))):
        spec = OpenImageIO.ImageSpec(width, 3, 3 + len(more), "float")
        spec.channelnames = ("R", "G", "B", *more)
        spec.attribute("oiio:subimagename", name)
        specs.append(spec)
    path = str(folder / "parts.exr")
    writer = OpenImageIO.ImageOutput.create(path)
    assert writer.open(path, tuple(specs)), writer.geterror()
    for k, spec in enumerate(specs):
        assert k == 0 or writer.open(path, spec, "AppendSubimage"), writer.geterror()
        assert writer.write_image(light(k + 3, 5, spec.nchannels)[k:])
    writer.close()


def _radiance(folder: Path) -> None:
    """Headers of Radiance files."""
    heads = {
        "primaries": "PRIMARIES=.708 .292 .17 .797 .131 .046 .3127 .329",
        "wrong_factors": "COLORCORR=1 1.5",
        "wrong_exposure": "EXPOSURE=bright",
        "negative": "COLORCORR=1 -1.5 2",
        "wrong_primaries": "PRIMARIES=.7 .3 .2 .7 .1 .05 .3",
        "far": "EXPOSURE=1e60",
        "twice": "COLORCORR=2 1 1\r\nCOLORCORR=1 4 .5\r\nEXPOSURE= 3",
    }
    for name, head in heads.items():
        (folder / f"{name}.hdr").write_bytes(
            f"#?RGBE\n{head}\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 3\n".encode()
            + bytes(90 + 7 * k % 41 for k in range(24))
        )


def _damaged(folder: Path) -> None:
    """Files that were cut or changed."""
    (folder / "cut.tif").write_bytes((folder / "rgba8.tif").read_bytes()[:-200])
    whole = (folder / "rgb8.png").read_bytes()
    at = whole.index(b"IDAT")
    (folder / "flipped.png").write_bytes(whole[: at + 8] + b"\0" + whole[at + 9 :])
    (folder / "unended.png").write_bytes(whole[:-12])
    (folder / "noise.jpg").write_bytes(b"\xff\xd8\xff\xe0" + bytes(range(200)))
    head = struct.pack("<3B2HB4H2B", 0, 0, 3, 0, 0, 0, 0, 0, 3, 2, 8, 0x20)
    body = bytes(range(40, 100, 10))
    mark = b"TRUEVISION-XFILE.\0"
    (folder / "grey.dat").write_bytes(head + body + bytes(8) + mark)
    (folder / "nearly.dat").write_bytes(head + body + bytes(8) + mark[:-2] + b"!\0")
    (folder / "short.tga").write_bytes(head[:17])
    (folder / "depth7.tga").write_bytes(head[:16] + b"\7" + head[17:] + body)
    (folder / "wide0.tga").write_bytes(head[:12] + b"\0\0" + head[14:] + body)


def _without(png: bytes, chunk: bytes) -> bytes:
    """Take out a chunk, if it is there."""
    at = png.find(chunk) - 4
    if at < 0:
        return png
    return png[:at] + png[at + 12 + struct.unpack(">I", png[at : at + 4])[0] :]


def _compressed(folder: Path) -> None:
    """TIFF files that say they are compressed in ways that readers may lack; they are not."""
    plain = (folder / "turned.tif").read_bytes()
    tag = struct.pack("<HHI", 259, 3, 1)  # compression, a short, one of them
    assert plain.count(tag) == 1
    for code in (34661, 34712, 34887, 34925, 50000, 50002, 52546, 40000):
        at = plain.index(tag) + len(tag)
        packed = plain[:at] + struct.pack("<H", code) + plain[at + 2 :]
        (folder / f"packed{code}.tif").write_bytes(packed)


# Tables and MCML's files


def _tables(folder: Path) -> None:
    texts = {
        "density.csv": "# quantity = density\nr_mm,R,G\n.5,.02,.015\n1.5,.01,.005\n2.5,.002,.001\n",
        "cm.csv": "r_cm,R,G,R_stderr\n.05,2,1.5,.1\n.15,1,.5,nan\n.25,.2,.1,.01\n",
        "plain.csv": "r,mono\n.5,.02\n1.5,.01\n2.5,.002\n",
        "energy.csv": "# quantity = energy\nr_um, B, G, R\n100,.1,.05,.01\n300,.05,.02,.01\n"
        "900,.01,.02,.03\ninf,.004,.003,.002\n",
        "gap.csv": "r_cm,red,blue\n.1,2,1\n.11,1,.75\n.13,.5,.25\n",
        "toomuch.csv": "r_um,R\n500,.02\n1500,.01\n2500,.002\n",
        "toomuch_plain.csv": "r,R\n5,.2\n15,.1\n25,.02\n",
        "energies_over.csv": "r_mm,R\n1,40\n2,20\n",
        "empty.csv": "# nothing\n",
        "numbers.csv": "1,2\n3,4\n",
        "onecolumn.csv": "r_mm;R;G\n1;2;3\n",
        "noname.csv": "r_mm,R,\n1,2,3\n",
        "twice.csv": "r_mm,R,R\n1,2,3\n",
        "noradius.csv": "radius,R,G\n1,2,3\n",
        "tworadii.csv": "r_mm,r_cm,G\n1,2,3\n",
        "stray_stderr.csv": "r_mm,R,G_stderr\n1,.2,.3\n2,.1,.1\n",
        "gaps.csv": "r_mm,R,G\n1,.2\n2,.1,.1\n",
        "afterinf.csv": "r_mm,R\n1,.2\ninf,.1\n3,.1\n",
        "oneline.csv": "r_mm,R\n1,.2\n",
        "head.csv": "r_mm,R\n",
        "unsorted.csv": "r_cm,R\n.3,.2\n.2,.1\n",
        "negative.csv": "r_mm,R\n1,.2\n2,-.1\n",
        "word.csv": "r_mm,R\n1,.2\n2,wax\n",
        "emptycell.csv": "r_mm,R\n1,.2\n2,\n",
        "zero.csv": "r_mm,R\n0,.2\n2,.1\n",
        "quoted.csv": 'r_mm,R\n1,".2\n2,.1\n',
        "said.csv": "# quantity = weight\nr_mm,R\n1,.2\n2,.1\n",
        "spaced.csv": '\n#quantity=density\n\n r_cm , "R", G \n\n# half-way\n .05, 2 , "1.5"\n'
        "  .15 ,.25,.125 \n\n",
        "shifted.csv": "R_stderr,G,r_um,R\n1e-9,2e-8,500,1e-8\nNaN,2e-9,1500,5e-9\n"
        "2e-10,1e-10,2500,2e-9\n",
        "narrow.csv": "r_mm,R\n1,.2\n1.0000000000001,.1\n",
        "tight.csv": "r_cm,R,G\n.050001,.02,.07\n.15,.01,.001\n",
        "exact.csv": "r_mm,R,G\n1,.5,.25\n2,.5000005,.25\n",
    }
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "latin1.csv").write_bytes("r_mm,grün\n.5,.02\n1.5,.01\n".encode("latin-1"))
    (folder / "utf16.csv").write_text("r_mm,R\n.5,.02\n1.5,.01\n", encoding="utf-16")
    (folder / "latin1-bad.csv").write_bytes("r_mm,grün\n.5,.02\n1.5,viel\n".encode("latin-1"))
    plain = "r_mm,R\n.5,.02\n1.5,.01\n"
    (folder / "utf16le.csv").write_bytes(plain.encode("utf-16-le"))
    (folder / "utf16be.csv").write_bytes(plain.encode("utf-16-be"))
    (folder / "windows.csv").write_bytes(
        b"\xef\xbb\xbfr_mm,R\r\n.5,.02\r\n.75,.25\r\ninf,.01\r\n\x1a"
    )
    (folder / "bom.csv").write_text("r_mm,R\n.5,.02\n1.5,.01\n", encoding="utf-8-sig")
    for name in ("cudamcml-inparam.mco", "mcml2.mco", "sample.mci", "latin1-comment.csv"):
        (folder / name).write_bytes((DATA / name).read_bytes())


_OUTPUT = """\
A1 # Version number of the file format.

InParm # Input parameters. cm is used.
{name} A # output file name, ASCII.
{photons} # No. of photons
0.05 {dr} # dz, dr [cm]
2 4 1 # No. of dz, dr, da.

{count} # Number of layers
#n mua mus g d # One line for each layer
{above} # n for medium above
{layers}
{below} # n for medium below

RAT #Reflectance, absorption, transmission.
{rat}
A_l #Absorption as a function of layer. [-]
{absorbed}
Rd_r #Rd[0], [1],..Rd[nr-1]. [1/cm2]
{reflected}
Tt_r #Tt[0], [1],..Tt[nr-1]. [1/cm2]
{through}
"""
_SLAB: dict[str, Any] = {
    "name": "r.mco",
    "photons": 5000,
    "dr": 0.02,
    "count": 2,
    "above": 1,
    "below": 1,
    "layers": "1.4 1 100 0.9 0.1\n1.4 2.5 10 0 0.2",
    "rat": "0.0277778\n0.3\n0.572222\n0.1",
    "absorbed": "0.4122\n0.16",
    # Energies of .1 .1 .06 .04 and .04 .03 .02 .01 over their areas.
    "reflected": "7.9577E+01\n2.6526E+01\n9.5493E+00\n4.5473E+00",
    "through": "3.1831E+01\n7.9577E+00\n3.1831E+00\n1.1368E+00",
}


def mco_text(**changes: Any) -> str:
    return _OUTPUT.format(**(_SLAB | changes))


def _mcml(folder: Path) -> None:
    (folder / "two.mci").write_text(TWO_RUNS)
    (folder / "short.mci").write_text("\n".join(TWO_RUNS.splitlines()[:9]) + "\n")
    (folder / "twice.mci").write_text(TWO_RUNS.replace("second", "FIRST"))
    (folder / "extra.mci").write_text(TWO_RUNS + "9 9\n")
    (folder / "bad_g.mci").write_text(TWO_RUNS.replace("0.9 0.1", "1.9 0.1"))
    (folder / "bad_photons.mci").write_text(TWO_RUNS.replace("2000", "2e3"))
    (folder / "words.mci").write_text(TWO_RUNS.replace("4 8 3", "4 8"))
    (folder / "thick.mci").write_text(TWO_RUNS.replace("0.9 0.1", "0.9 1e7"))
    other = {
        "name": "g.mco",
        "rat": "0.0277778\n0.15\n0.572222\n0.25",
        "reflected": "3.9789E+01\n1.3263E+01\n4.7746E+00\n2.2736E+00",
        "through": "7.9577E+01\n1.9894E+01\n7.9577E+00\n2.8421E+00",
    }
    lossy = {
        "name": "lossy.mco",
        "rat": "0.0277778\n0.3\n0.572222\n0.05",
        "through": "1.5915E+01\n3.9789E+00\n1.5915E+00\n5.6841E-01",
    }
    wider = {
        "dr": 0.03,
        "rat": "0.0277778\n0.675\n0.0722222\n0.225",
        "absorbed": "0.05\n0.02222",
    }
    deep = {"layers": "1.4 1 100 0.9 0.1\n1.4 2.5 10 0 1E8"}
    dark = {"through": "0\n0\n0\n0", "rat": "0.0277778\n0.3\n0.572222\n0"}
    texts = {
        "r.mco": mco_text(),
        "g.mco": mco_text(**other),
        "lossy.mco": mco_text(**lossy),
        "wrong_sum.mco": mco_text(rat="0.0277778\n0.4\n0.472222\n0.1"),
        "other_n.mco": mco_text(below=1.5),
        "other_grid.mco": mco_text(**wider),
        "short.mco": mco_text()[:-30],
        "negative.mco": mco_text(through="1.9\n-6.6\n1.5\n1.1"),
        "extra.mco": mco_text() + "Rd_r # again\n1\n",
        "binary.mco": "B1\n",
        "notail.mco": mco_text().partition("Tt_r #")[0],
        "deep.mco": mco_text(**deep, **dark),
        "through.mco": mco_text(**deep, name="through.mco"),
    }
    for name, text in texts.items():
        (folder / name).write_text(text)


# All


def _own(folder: Path) -> None:
    """Files of ours from earlier runs, which may be replaced."""
    for ending in ("exr", "tif", "png"):
        save_image(folder / f"own.{ending}", light(4, 5, 3))
    (folder / "own_chart.png").write_bytes(b"\x89PNG\r\n\x1a\n....tEXtSoftware\0sssfit chart")
    texts = {
        "own_chart.svg": "<?xml version='1.0'?>\n<dc:title>sssfit chart</dc:title>\n",
        "own_chart.pdf": "%PDF-1.4\n/Creator (sssfit chart)\n",
        "own.md": "<!-- sssfit.table/1 -->\n",
        "own_table.csv": "# sssfit.table/1\n",
        "own_table.json": '{"format": "sssfit.table/1"}\n',
        "own.hlsl": "// sssfit.hlsl/1\n",
        "own.csv": "# sssfit.profile.csv/1\n",
        "own.toml": "# Made by `sssfit materials --from-reflectance`, which may replace this file;",
    }
    for name, text in texts.items():
        (folder / name).write_text(text)


def taps() -> Taps:
    """A cascade by hand, on the pixels and with the energy of wax's profile, more or less."""
    own = wax()
    stages = (
        Stage(0, "pair", np.array([0.21]), np.array([[0.5, 0.4, 0.6], [0.25, 0.3, 0.2]])),
        Stage(
            1,
            "pair",
            np.array([0.55, 1.3]),
            np.array([[0.4, 0.5, 0.3], [0.2, 0.15, 0.3], [0.1, 0.1, 0.05]]),
        ),
        Stage(
            1,
            "star",
            np.array([0.9, 1.1]),
            np.array([[0.2, 0.4, 0.6], [0.15, 0.1, 0.07], [0.05, 0.05, 0.03]]),
        ),
    )
    shares = np.array([[0.1, 0.2, 0.05], [0.2, 0.1, 0.25], [0.3, 0.45, 0.4], [0.4, 0.25, 0.3]])
    return Taps(
        method="cascade",
        mm_per_pixel=0.3,
        channels=own.channels,
        chained=True,
        stages=stages,
        blend=shares * own.diffuse_reflectance,
        errors={"spectral": np.array([0.012, 0.0345, 0.0678]), "energy": np.zeros(3)},
        meta={
            "material": "wax",
            "profile_sha256": own.sha256,
            "profile_method": "dipole",
            "settings": {"fetches": 17.0, "stages": None, "spectrum": "natural"},
        },
    )


def _records(folder: Path) -> None:
    for name, text in (("wax", WAX), ("plate", PLATE), ("leaf", LEAF), ("varnish", CLEAR)):
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    (folder / "broken.toml").write_text('name = "broken"\neta = 1.3\nsigma_a_per_mm = [1, 2, 3]\n')
    (folder / "nottoml.toml").write_text("eta = = 1\n")
    for name, kernel in kernels().items():
        kernel.save(folder / f"{name}.kernel.json")
    taps().save(folder / "wax.hand.taps.json")
    text = (folder / "wax.hand.taps.json").read_text(encoding="utf-8")
    (folder / "damaged.taps.json").write_text(text.replace('"passes": 5', '"passes": 4'))
    for name, profile in (("four", four()), ("mono", mono()), ("leaf", leaf())):
        profile.save(folder / f"{name}.profile.npz")
    plate().save(folder / "Größe λ.profile.npz")
    angled(wax()).save(folder / "angles.profile.npz")
    wax().save(folder / "wax.profile.npz")
    (folder / "damaged.profile.npz").write_bytes((folder / "wax.profile.npz").read_bytes()[:2000])
    text = (folder / "wax.svd2.kernel.json").read_text(encoding="utf-8")
    (folder / "damaged.kernel.json").write_text(text.replace('"rank": 2', '"rank": 3'))
    (folder / "ball.obj").write_text(obj_text(sphere(rows=8, columns=16)))
    (folder / "bare.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    for ending in ("npz", "json", "exr", "png", "md", "csv", "toml", "hlsl", "checkpoint"):
        (folder / f"foreign.{ending}").write_text("mine\n")


@functools.cache
def files() -> Path:
    """The folder of all files; the newest profile is that of wax, the newest kernel wax.svd2."""
    folder = Path(tempfile.mkdtemp(prefix="sssfit-approval-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    _records(folder)
    _pictures(folder)
    _tables(folder)
    _mcml(folder)
    _own(folder)
    (folder / "out").mkdir()
    (folder / "empty").mkdir()
    newest = ("damaged.kernel.json", "wax.svd2.kernel.json", "wax.profile.npz")
    for path in folder.iterdir():
        seconds = 1_700_000_000 + 60 * (newest.index(path.name) + 1 if path.name in newest else 0)
        os.utime(path, (seconds, seconds))
    return folder
