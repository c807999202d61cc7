"""The kernel of separable-sss, which several engines take: width, strength and falloff.

Jimenez' listing (``calculateKernel``; `sssfit.kernel.listing.listing`) evaluates the red channel
of d'Eon's skin, without its narrowest Gaussian, for which the strength stands, at a few offsets o,
which grow as the square up to 3, or to 2 with 20 taps or fewer:

    w(o) ~ area(o) p(o / (0.001 + f)),    p(r) = sum_i w_i exp(-r^2 / 2 v_i) / (2 pi v_i),

and mixes with the unblurred light by the strength t. Two passes of it blur a picture. p is a cross
section of a profile in the plane, used as a kernel on a line. As a line's kernel its Gaussians have
the weights w_i / sqrt(v_i), those of another, narrower profile: 0.87 mm instead of 1.34 mm of
standard deviation along an axis, at falloff 1. `sssfit.export.presets.separable_fit` therefore
fits what the taps do to a picture, not p.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from sssfit import __version__
from sssfit.arrays import FloatArray
from sssfit.errors import KernelError
from sssfit.export.presets.fields import Values
from sssfit.export.presets.record import Parameters
from sssfit.grid import grid_of_lengths
from sssfit.kernel import Stage, Taps
from sssfit.kernel.listing import LISTED, listing
from sssfit.profile import Profile
from sssfit.shapes import gaussian_beyond
from sssfit.simulate.closed_form import closed_form_profile

STRENGTH, FALLOFF = (0.48, 0.41, 0.28), (1.0, 0.37, 0.3)  # those of the published skin
KERNEL_RANGE = 3.0  # units of the offsets that an engine's width stands for
HALF_SCREEN = 2.0  # texture coordinates span 2 of the units in which the shaders move
MODEL = "two passes of taps from one stretched Gaussian mixture (Jimenez et al. 2012)"
LOST = "the 1/r peak of the profile, its round shape, and all but two numbers a channel."
CHANNELS = ("R", "G", "B")
COUNTS = (11, 17, 25)
_BIAS = 0.001  # of the falloff
_WEIGHTS, _VARIANCES = (np.array(each) for each in zip(*LISTED, strict=True))
# As a kernel on a line each Gaussian has the energy w / sqrt(v).
_ON_LINE = _WEIGHTS / np.sqrt(_VARIANCES) / float((_WEIGHTS / np.sqrt(_VARIANCES)).sum())
PIXEL_MM = 0.3  # frequencies up to those of such pixels count
LEAST_FALLOFF = 0.02
_SAME = 1e-6  # of taps that are to be those of a falloff
_CLEAR = 1e-4  # of the largest weight: smaller ones of a printed table have lost digits
_RINGS, _MOST_RINGS, _SIGMAS = 8.0, 4000.0, 6.0  # of the narrowest and the widest Gaussian


def unit_of(width_mm: float) -> float:
    """Return the length of one unit of the offsets [mm], for a width of these shaders [mm]."""
    return HALF_SCREEN * width_mm / KERNEL_RANGE


def width_of(unit_mm: float) -> float:
    """Return the width [mm] that gives the unit, the inverse of `unit_of`."""
    return unit_mm * KERNEL_RANGE / HALF_SCREEN


class Separable(NamedTuple):
    """Parameters of the kernel: one unit of offsets [mm], strength and falloff by channel (3,)."""

    unit_mm: float
    strength: FloatArray
    falloff: FloatArray


class Words(NamedTuple):
    """What an engine calls the kernel's parameters, and what they are worth.

    ``albedo``, ``strength`` and ``falloff`` are names of its fields; ``unit_mm`` is the length of
    one unit of the offsets [mm], ``taps`` the number of taps, of its parameters.
    """

    albedo: str
    strength: str
    falloff: str
    unit_mm: Callable[[Parameters], float]
    taps: Callable[[Parameters], int]

    def values(self, found: Separable, albedo: FloatArray) -> Values:
        """Return the values of the three fields."""
        return {
            self.albedo: tuple(albedo.tolist()),
            self.strength: tuple(found.strength.tolist()),
            self.falloff: tuple(found.falloff.tolist()),
        }

    def read(self, parameters: Parameters) -> Separable:
        """Return the kernel's parameters."""
        strength, falloff = (
            np.array(parameters.colour(each)) for each in (self.strength, self.falloff)
        )
        return Separable(self.unit_mm(parameters), strength, falloff)

    def profile(self, parameters: Parameters) -> Profile:
        """Return the radial profile of the kernel with any number of taps."""
        albedo = np.array(parameters.colour(self.albedo))
        name = parameters.preset.name
        return separable_profile(parameters.title, name, albedo, self.read(parameters))

    def look(self, parameters: Parameters) -> Taps:
        """Return the table of taps."""
        albedo = np.array(parameters.colour(self.albedo))
        name, taps = parameters.preset.name, self.taps(parameters)
        return separable_taps(parameters.title, name, albedo, self.read(parameters), taps)


def separable_profile(title: str, preset: str, albedo: FloatArray, kernel: Separable) -> Profile:
    """Return the radial profile whose line integral is the kernel with any number of taps.

    A (t sum_i W_i G(v_i m^2) + (1 - t) delta), W_i ~ w_i / sqrt(v_i), m = unit (0.001 + f): the
    unblurred light lies in the first annulus.
    """
    scale_mm = kernel.unit_mm * (_BIAS + kernel.falloff)
    widest_mm = float(scale_mm.max()) * math.sqrt(float(_VARIANCES[-1]))
    narrowest_mm = float(scale_mm.min()) * math.sqrt(float(_VARIANCES[0]))
    dr_mm = max(narrowest_mm / _RINGS, widest_mm / _MOST_RINGS)
    grid = grid_of_lengths(dr_mm, _SIGMAS * widest_mm)
    edges = grid.r_edges_mm[:, None]
    shares = [gaussian_beyond(edges, _VARIANCES * m**2) @ _ON_LINE for m in scale_mm]
    beyond = albedo * kernel.strength * np.stack(shares, axis=1)
    beyond[0] = albedo
    settings = {
        "preset": preset,
        "unit_mm": kernel.unit_mm,
        "strength": kernel.strength.tolist(),
        "falloff": kernel.falloff.tolist(),
    }
    return closed_form_profile(
        title, "separable", grid, beyond, source=f"preset {preset}", settings=settings
    )


def separable_taps(
    title: str, preset: str, albedo: FloatArray, kernel: Separable, taps: int
) -> Taps:
    """Return the table that the shader runs: two passes of the listing's taps, times the albedo."""
    offsets, weights = listing(taps, kernel.strength, kernel.falloff)
    return Taps(
        method=preset,
        mm_per_pixel=PIXEL_MM,
        channels=CHANNELS,
        chained=False,
        stages=(Stage(0, "pair", offsets * kernel.unit_mm, weights),),
        blend=np.stack((0.0 * albedo, albedo)),
        errors={name: np.full(albedo.size, np.nan) for name in ("spectral", "energy")},
        meta={"material": title, "version": __version__},
    )


def kernel_rows(kernel: Separable, taps: int) -> list[tuple[float, ...]]:
    """Return rows r, g, b, offset of the table: the centre first, and then from left to right."""
    offsets, weights = listing(taps, kernel.strength, kernel.falloff)
    half = [(*row, offset) for row, offset in zip(weights[1:].tolist(), offsets, strict=True)]
    left = [(*row[:3], -row[3]) for row in reversed(half)]
    return [(*weights[0].tolist(), 0.0), *left, *half]


def separable_of_taps(table: Taps) -> tuple[Separable, int]:
    """Return the parameters of a table of taps that has the layout, and its number of taps.

    The inverse of `separable_taps`: the offsets give the unit, the ratios of weights the falloff,
    their sum the strength.

    Raises
    ------
    KernelError
        The table has other stages, offsets or weights.
    """
    stage, total = table.stages[0], table.blend[1]
    taps = 2 * len(stage.offsets_mm) + 1
    is_alike = len(table.stages) == 1 and stage.kind == "pair" and taps >= 5
    if not is_alike or table.blend[0].any() or not (total > 0.0).all():
        raise KernelError(
            f"taps {table.structure} are not the kernel of separable-sss: one pair of passes, "
            "without the unblurred picture."
        )
    offsets, _ = listing(taps, np.ones(1), np.ones(1))
    unit_mm = float(stage.offsets_mm[-1] / offsets[-1])
    found = [_channel_of(taps, each) for each in stage.weights.T]
    strength, falloff = (np.array(each) for each in zip(*found, strict=True))
    again = listing(taps, strength, falloff)
    if not (
        np.allclose(again[0] * unit_mm, stage.offsets_mm, rtol=_SAME, atol=0.0)
        and np.allclose(again[1], stage.weights, rtol=0.0, atol=_SAME)
    ):
        raise KernelError("these taps have offsets or weights that no strength and falloff give.")
    return Separable(unit_mm, strength, falloff), taps


def _channel_of(taps: int, weights: FloatArray) -> tuple[float, float]:
    """Return strength and falloff of a channel's weights (n+1,)."""

    @functools.cache
    def outer(f: float) -> FloatArray:
        return listing(taps, np.ones(1), np.array([f]))[1][1:, 0]

    own = weights[1:]
    if not (own[0] > 0.0 and (own >= 0.0).all()):
        return 0.0, 1.0
    # The weights of a steep falloff are 0 farther out, or all rounding.
    inner = own[: own.size // 2 + 2]
    clear = np.flatnonzero(inner > _CLEAR * own[0])
    place = int((clear if clear.size > 1 else np.flatnonzero(inner))[-1])
    if place == 0:  # many pairs have this weight
        return 0.0, 1.0

    def excess(f: float) -> float:
        near, far = outer(f)[[0, place]]
        return float(far * own[0] - own[place] * near)

    low, high = LEAST_FALLOFF, 1.0
    # At an end rounding decides the sign. The caller compares the weights, and refuses others.
    if excess(low) >= 0.0:
        f = low
    elif excess(high) <= 0.0:
        f = high
    else:
        f = float(brentq(excess, low, high, xtol=1e-15, rtol=1e-14))
    strength = float(own.sum() / outer(f).sum())
    return (strength, f) if strength <= 1.0 + _SAME else (0.0, 1.0)
