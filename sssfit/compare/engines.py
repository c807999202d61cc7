"""The samplers of engines as they ship, in one frame on a flat picture.

Each entry names its source, a file and function as its public repository had them in 2026. Disk
samplers know one shape, normalised diffusion, so `sssfit.fit.fit_burley` fits it to the profile, s
by channel; the iryoku layout takes width, strength and falloff from `sssfit.fit.fit_falloff`. All
return blurred irradiance times the profile's diffuse reflectance, which is an engine's albedo.

Common to all: the whole picture is one lit surface without depth, mirrored at its border, so that
what shaders do at outlines, in the dark and far away is left out, as is every filter over time.
"""

import functools
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.fit import fit_burley, fit_falloff
from sssfit.fit.falloff import scale_of
from sssfit.kernel import Stage, Taps
from sssfit.kernel.listing import listing
from sssfit.profile import Profile
from sssfit.render.borders import scene_for, source_indices
from sssfit.render.disk import turns
from sssfit.render.taps import render_taps
from sssfit.scene.record import Scene
from sssfit.shapes import diffusion_cdf, diffusion_radius

AnyFloats = npt.NDArray[np.floating[Any]]
Places = Iterable[tuple[npt.ArrayLike, npt.ArrayLike]]

_GOLDEN = (1.0 + math.sqrt(5.0)) / 2.0
_HDRP = (
    "Unity-Technologies/Graphics, com.unity.render-pipelines.high-definition/Runtime/Material/"
    "SubsurfaceScattering/SubsurfaceScattering.compute, EvaluateSample"
)
_BABYLON = (
    "BabylonJS/Babylon.js, packages/dev/core/src/Shaders/subSurfaceScattering.fragment.fx, "
    "EvaluateSample"
)
_EEVEE = (
    "blender/blender, source/blender/draw/engines/eevee_next/eevee_subsurface.cc, "
    "precompute_samples_location, and shaders/eevee_subsurface_convolve_comp.glsl"
)
_O3DE = (
    "o3de/o3de, Gems/Atom/Feature/Common/Assets/Shaders/PostProcessing/"
    "ScreenSpaceSubsurfaceScatteringCS.azsl, MainCS, and DiffuseSpecularMerge.azsl"
)
_IRYOKU = (
    "iryoku/separable-sss, Demo/Code/SeparableSSS.cpp, calculateKernel, and SeparableSSS.h, "
    "SSSSBlurPS"
)
_COMMUNITY = (
    "community-shaders/skyrim-community-shaders, features/Subsurface Scattering/Shaders/"
    "SubsurfaceScattering/SeparableSSS.hlsli, SSSSBlurCS"
)

_NARROWEST = 0.233  # the share that the listing leaves out: its strength has it


@dataclass(frozen=True, slots=True)
class Engine:
    """A sampler as an engine ships it.

    Parameters
    ----------
    label : str
    fetches : float
        Fetches of light, a pixel and frame; depth and masks are read as often.
    passes : int
    source : str
        Repository, file and function.
    method : str
        How it samples, in a sentence.
    picture : function
        Takes a scene and a profile, and returns the picture.
    """

    label: str
    fetches: float
    passes: int
    source: str
    method: str
    picture: Callable[[Scene, Profile], FloatArray]

    def render(self, scene: Scene, profile: Profile) -> FloatArray:
        """Return the radiant exitance (H, W, C) of a flat picture.

        Raises
        ------
        RenderError, FitError
            The picture has other channels, or the profile cannot be fitted.
        """
        return self.picture(scene_for(scene, profile.channels), profile)


def engines() -> tuple[Engine, ...]:
    """Return all of them, by engine and budget."""
    golden = (
        "golden-angle spiral, radii by the inverse cumulative energy of the widest channel, whole "
        "texels, divided by the sum of weights by channel"
    )
    listing = "two passes of bilinear taps at offsets that grow as the square, weights of points"
    return (
        *(
            Engine(
                f"HDRP {budget}",
                budget,
                1,
                _HDRP,
                f"{golden}; turned at random at each pixel",
                functools.partial(_golden, budget=budget, is_turned=True),
            )
            for budget in (20, 40, 80)
        ),
        Engine(
            "Babylon.js 40",
            40,
            1,
            _BABYLON,
            f"{golden}; not turned",
            functools.partial(_golden, budget=40, is_turned=False),
        ),
        Engine(
            "EEVEE 16",
            16,
            1,
            _EEVEE,
            "golden-angle spiral for the largest radius at white albedo, the first at the pixel, "
            "whole texels, divided by the sum of weights; turned by interleaved gradient noise",
            _eevee,
        ),
        *(
            Engine(
                f"O3DE {budget}",
                budget + 4,
                2,
                _O3DE,
                "radii by the van der Corput sequence and the inverse cumulative energy of the "
                "widest channel, whole texels, divided by the sum of weights; quarter turns in "
                "blocks of 2 x 2, and a mean of 2 x 2 texels afterwards (four fetches)",
                functools.partial(_o3de, budget=budget),
            )
            for budget in (80, 200)
        ),
        *(
            Engine(
                f"iryoku {taps}",
                2 * taps,
                2,
                _IRYOKU,
                listing,
                functools.partial(_iryoku, taps=taps),
            )
            for taps in (11, 17, 25)
        ),
        Engine(
            "community-shaders 21",
            42,
            2,
            _COMMUNITY,
            f"{listing}, at whole texels",
            _community,
        ),
    )


def _golden(scene: Scene, profile: Profile, *, budget: int, is_turned: bool) -> FloatArray:
    """Fetch at the middles of equal shares of the widest channel's energy.

    There are fewer than the budget where the disk of 99.7 % of the energy has fewer than four
    pixels a fetch; below one fetch the picture is not blurred. The random turn is
    `sssfit.render.disk.turns`, where HDRP hashes the pixel and its depth.
    """
    s = _shapes(profile)
    filter_pixels = float(diffusion_radius(0.997, s.min())) / scene.mm_per_pixel
    count = min(int(math.pi * filter_pixels**2 / 4.0), budget)
    if count < 1:
        return _lit(scene, profile)
    k = np.arange(count)
    radii_mm = diffusion_radius((k + 0.5) / count, s.min())
    turn = turns(scene.height, scene.width, 0) if is_turned else np.zeros((1, 1))
    places = _turned(radii_mm / scene.mm_per_pixel, 2.0 * math.pi * (k / _GOLDEN % 1.0), turn)
    return _gathered(scene, profile, places, _likelihood(radii_mm, s))


def _eevee(scene: Scene, profile: Profile) -> FloatArray:
    """Sixteen fetches for the largest radius; the two random numbers of a frame are .5."""
    count, whole = 16, float(diffusion_cdf(16.0, 1.0))
    s, albedo = _shapes(profile), profile.diffuse_reflectance / profile.diffuse_reflectance.max()
    # d = l / s(A) with l = radius / (4 pi): radii such that each channel gets its own shape, and
    # positions from the largest at A = 1.
    radius_mm = 4.0 * math.pi * _eevee_s(albedo) / s
    d_mm = float(radius_mm.max()) / (4.0 * math.pi * float(_eevee_s(np.ones(1))[0]))
    k = np.arange(count)
    radii_mm = diffusion_radius(whole * (1.0 + 0.5 / count) * k / count, 1.0 / d_mm)
    angles = math.pi * (3.0 - math.sqrt(5.0)) * k + math.pi
    x, y = np.meshgrid(np.arange(scene.width), np.arange(scene.height))
    noise = 52.9829189 * ((0.06711056 * x + 0.00583715 * y) % 1.0) % 1.0
    turn = noise * math.pi * (3.0 - math.sqrt(5.0))
    weights = np.where(radii_mm[:, None] * s < 16.0, _likelihood(radii_mm, s, 1.0 / d_mm), 0.0)
    return _gathered(scene, profile, _turned(radii_mm / scene.mm_per_pixel, angles, turn), weights)


def _eevee_s(albedo: FloatArray) -> FloatArray:
    """Christensen and Burley 2015, eq. 6."""
    return np.asarray(1.9 - albedo + 3.5 * (albedo - 0.8) ** 2)


def _o3de(scene: Scene, profile: Profile, *, budget: int) -> FloatArray:
    """Radii by the van der Corput sequence; fewer where 90 % of the energy is within 4 pixels.

    The shader skips black texels, which it takes for the background; here all are the surface.
    """
    s = _shapes(profile)
    footprint = int(float(diffusion_radius(0.9, s.min())) / scene.mm_per_pixel)
    part = 0.3 if footprint <= 1 else 0.6 if footprint <= 4 else 1.0
    k = np.arange(1, int(budget * part))  # the first has the radius 0, and no weight
    radii_mm = diffusion_radius(np.array([_van_der_corput(each) for each in k.tolist()]), s.min())
    angles = 4.0 * math.pi * k / (1.0 + math.sqrt(5.0))
    quarters = 0.5 * math.pi * np.array([[0.0, 2.0], [1.0, 3.0]])
    tiles = -(-scene.height // 2), -(-scene.width // 2)
    turn = np.tile(quarters, tiles)[: scene.height, : scene.width]
    places = _turned(radii_mm / scene.mm_per_pixel, angles, turn)
    picture = _gathered(scene, profile, places, _likelihood(radii_mm, s))
    padded = np.pad(picture, ((1, 0), (1, 0), (0, 0)), mode="edge")
    mean = 0.25 * (padded[1:, 1:] + padded[:-1, 1:] + padded[1:, :-1] + padded[:-1, :-1])
    return np.asarray(mean)


def _van_der_corput(k: int) -> float:
    """Return the bits of k behind the point, in reverse."""
    return int(f"{k:032b}"[::-1], 2) / 2.0**32


def _iryoku(scene: Scene, profile: Profile, *, taps: int) -> FloatArray:
    """Two passes of bilinear taps."""
    offsets_mm, weights = _listing_of(profile, scene, taps)
    stage = Stage(0, "pair", offsets_mm, weights)
    total = profile.diffuse_reflectance
    table = Taps(
        method="iryoku",
        mm_per_pixel=scene.mm_per_pixel,
        channels=profile.channels,
        chained=False,
        stages=(stage,),
        blend=np.stack((0.0 * total, total)),
        errors={name: np.full(total.size, np.nan) for name in ("spectral", "energy")},
        meta={},
    )
    return np.asarray(render_taps(scene, table), dtype=np.float64)


def _community(scene: Scene, profile: Profile) -> FloatArray:
    """Two passes at whole texels: int(offset + .5), which rounds towards 0 and not down."""
    offsets_mm, weights = _listing_of(profile, scene, 21)
    pixels = np.concatenate(([0.0], offsets_mm, -offsets_mm)) / scene.mm_per_pixel
    steps = np.trunc(pixels + 0.5)
    rows = np.concatenate((weights, weights[1:]))
    across = _gathered(scene, None, [(0, each) for each in steps], rows)
    half_blurred = Scene(scene.name, across, scene.mm_per_pixel)
    return _gathered(half_blurred, profile, [(each, 0) for each in steps], rows)


def _listing_of(profile: Profile, scene: Scene, taps: int) -> tuple[FloatArray, FloatArray]:
    """Return offsets (n,) [mm] and weights (n+1, C) with the parameters that fit the profile."""
    found = fit_falloff(profile, mm_per_pixel=scene.mm_per_pixel).kernel.parameters
    lit = [found.get(name) for name in profile.channels]
    known = next(each for each in lit if each)
    numbers = {
        key: np.array([(each or known)[key] for each in lit]) for key in ("strength", "falloff")
    }
    strength = numbers["strength"] * (1.0 - _NARROWEST)
    offsets, weights = listing(taps, strength, numbers["falloff"])
    # A unit of the listing is the width of a channel whose falloff is .999.
    return offsets * scale_of(known["width"], 0.999), weights


@functools.lru_cache(maxsize=8)
def _shapes(profile: Profile) -> FloatArray:
    """Return the s of each channel (C,) [1/mm]; a channel without light takes the widest."""
    found = fit_burley(profile).kernel.parameters
    known = [float(each["s_per_mm"]) for each in found.values() if each]
    lit = [found.get(name) for name in profile.channels]
    return np.array([float(each["s_per_mm"]) if each else min(known) for each in lit])


def _likelihood(radii_mm: FloatArray, s: FloatArray, sampled: float | None = None) -> FloatArray:
    """Return density over sampled density (N, C), of the smallest s unless another is given."""
    t, least = radii_mm[:, None], s.min() if sampled is None else sampled

    def density(s: FloatArray | float) -> FloatArray:  # without 1 / r, which cancels
        return np.asarray(s * (np.exp(-s * t) + np.exp(-s * t / 3.0)))

    return np.asarray(density(s) / density(least))


def _turned(radii: AnyFloats, angles: AnyFloats, turn: AnyFloats) -> Places:
    """Yield whole steps down and right (H, W) of each fetch, turned at each pixel."""
    for radius, angle in zip(radii, angles, strict=True):
        yield np.rint(radius * np.sin(angle + turn)), np.rint(radius * np.cos(angle + turn))


def _gathered(
    scene: Scene, profile: Profile | None, places: Places, weights: FloatArray
) -> FloatArray:
    """Return the weighted mean of whole texels, times the reflectance of a profile if given.

    ``places`` are steps down and right, of each pixel (H, W) or of all; ``weights`` (N, C).
    """
    y, x = np.indices((scene.height, scene.width), sparse=True)
    total: Any = 0.0
    for (down, right), weight in zip(places, weights, strict=True):
        row = _mirrored(y + np.asarray(down, dtype=np.intp), scene.height)
        column = _mirrored(x + np.asarray(right, dtype=np.intp), scene.width)
        total = total + weight * scene.irradiance[row, column]
    picture = total / weights.sum(axis=0)
    return np.asarray(picture if profile is None else picture * profile.diffuse_reflectance)


def _mirrored(place: npt.NDArray[np.intp], size: int) -> npt.NDArray[np.intp]:
    """Return places inside a line of a size, mirrored at its ends."""
    return source_indices(size, size, "mirror")[size:][place % (2 * size)]


def _lit(scene: Scene, profile: Profile) -> FloatArray:
    return np.asarray(scene.irradiance * profile.diffuse_reflectance)
