"""The exact profile of a half space that scatters isotropically, the faster of two solvers.

The model is isotropic scattering in a homogeneous medium without a bottom, lit by a pencil beam
along the normal. Single scattering has a closed form; the rest is solved for each wavenumber along
the surface (``_depth``) and transformed back to radii as a mixture of Bessel functions
(``_mixture``, which also has single scattering). This gives F(r) at the edges of any grid. Channels
and materials of one refractive index share wavenumbers and kernel matrices: in mean free paths only
the albedo tells them apart.

The error estimate is the largest difference between two resolutions, each about ten times finer
than the one before. It belongs to the coarser of the two, and the finer one is returned.

Where it is asked for, scattering with g other than 0 is replaced by isotropic scattering of the
reduced coefficient sigma_s' = (1 - g) sigma_s (similarity relation; van de Hulst 1980, chapter 14):
an approximation. Other materials are the task of ``sssfit.simulate.stack``, and
``sssfit.simulate.exact`` chooses between the two.
"""

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from sssfit._jit.depth_matrix import ENTRY
from sssfit.arrays import FloatArray
from sssfit.errors import SimulationError, StoppedError
from sssfit.grid import RadialGrid
from sssfit.material import Material
from sssfit.messages import shown
from sssfit.optics import entering_of_diffuse, normal_transmittance
from sssfit.process import one_blas_thread
from sssfit.profile import Profile
from sssfit.simulate._depth import (
    Resolution,
    Response,
    decay_rate,
    respond,
    respond_to_diffuse_light,
)
from sssfit.simulate._deterministic import computed_profile, energies_from_beyond
from sssfit.simulate._mixture import (
    mixture_of,
    single_scattering_beyond,
    single_scattering_of_diffuse_light,
)
from sssfit.simulate._walks import note_compiling, relative_eta

Light = Literal["normal", "diffuse"]
LIGHTS: tuple[Light, ...] = get_args(Light)

_LARGEST_ETA = 4.0
_BEST_GAIN = 100.0  # a level's error relative to the one before; 2 to 50 were seen
_ROUNDING = 1e-14  # error of the energy balance, whose terms are near 1 for any albedo
_LARGEST_FLOOR = 1e-2  # of the rates, for grids within one mean free path


@dataclass(frozen=True, slots=True)
class _Level:
    """One resolution of the depth equation, of the wavenumbers and of single scattering."""

    depth: Resolution
    largest: float  # wavenumber [1/MFP]
    density: float  # wavenumbers per unit of asinh(k / k0)
    single_step: float


_LEVELS = (
    _Level(Resolution(6, 1e-3, 4.0, 12, 0.06, 40, 40.0), 30.0, 3.0, 0.1),
    _Level(Resolution(8, 1e-4, 3.0, 12, 0.03, 64, 60.0), 60.0, 4.5, 0.05),
    _Level(Resolution(10, 1e-5, 2.5, 16, 0.02, 96, 90.0), 100.0, 6.5, 0.05),
    _Level(Resolution(12, 1e-5, 2.5, 20, 0.01, 144, 140.0), 200.0, 9.0, 0.04),
    _Level(Resolution(14, 1e-6, 2.0, 24, 0.006, 256, 250.0), 400.0, 13.0, 0.04),
)


def covers(material: Material, *, similarity: bool = False) -> bool:
    """Return whether this solver has the material's profile: a half space with g = 0, or reduced.

    Its index must be 1 to 4 times that of the medium above.
    """
    is_isotropic = similarity or not np.any(material.layers[0].g)
    is_within = 1.0 <= relative_eta(material) <= _LARGEST_ETA
    return material.is_semi_infinite and is_isotropic and is_within


def solve_half_spaces(
    materials: Sequence[Material],
    grids: Sequence[RadialGrid],
    tolerance: float,
    pool: ThreadPoolExecutor,
    stop: Callable[[], bool] | None = None,
) -> list[Profile]:
    """Solve for materials that `covers`; those with the same relative refractive index share work.

    g other than 0 is reduced. See `sssfit.simulate.exact.simulate_exact` for parameters and errors.
    """
    if materials:
        note_compiling("solver", 3, is_solver_compiled())
    groups: dict[float, list[int]] = {}
    for k, material in enumerate(materials):
        groups.setdefault(relative_eta(material), []).append(k)
    profiles: dict[int, Profile] = {}
    for eta, group in groups.items():
        own = [materials[k] for k in group], [grids[k] for k in group]
        found = _solve_group(eta, *own, tolerance, _Workers(pool, stop))
        profiles |= zip(group, found, strict=True)
    return [profiles[k] for k in range(len(materials))]


def is_solver_compiled() -> bool:
    """Return whether the solver can start at once; otherwise it first compiles, about 3 s."""
    return ENTRY.is_ready()


def diffuse_reflectance(
    albedo: npt.ArrayLike, eta: float, *, light: Light = "normal"
) -> FloatArray:
    """Return the total diffuse reflectance of a half space.

    Parameters
    ----------
    albedo : array (N,)
        Albedos, 0 to 1.
    eta : float
        Relative refractive index, 1 to 4.
    light : "normal" or "diffuse"
        The incident light: a beam along the normal, or equal radiance from all directions above.

    Returns
    -------
    (N,) array
        Share of the incident light, good to 1e-8 (5e-8 for indices from 1 to 1.001), without
        specular reflection: albedo 1 gives `entering_light`.

    Raises
    ------
    SimulationError
        An albedo or index is out of range, or the light is unknown.
    """
    albedos = np.atleast_1d(np.asarray(albedo, dtype=np.float64))
    if not ((albedos >= 0.0) & (albedos <= 1.0)).all():
        raise SimulationError(f"albedo = {shown(albedo)}; expected numbers from 0 to 1.")
    _check_light(eta, light)
    eta, level = float(eta), _LEVELS[3]
    with one_blas_thread():
        if light == "diffuse":
            once = single_scattering_of_diffuse_light(eta)
            response = respond_to_diffuse_light(eta, albedos, level.depth)
        else:
            once = float(single_scattering_beyond(np.zeros(1), eta, level.single_step)[0])
            response = respond(0.0, eta, albedos, level.depth)
    total: FloatArray = albedos * once + response.multiple
    return total


def entering_light(eta: float, light: Light = "normal") -> float:
    """Return 1 - R_sp, the share of the incident light that enters.

    Parameters and errors are those of `diffuse_reflectance`. R_sp is ((eta - 1)/(eta + 1))^2 for
    normal light; for diffuse light 2 int_0^1 R_F(mu) mu dmu seen from outside (Duntley 1942).
    """
    _check_light(eta, light)
    return entering_of_diffuse(eta) if light == "diffuse" else normal_transmittance(eta)


@dataclass(frozen=True, slots=True)
class _Workers:
    """Threads, and the condition that stops them."""

    pool: ThreadPoolExecutor
    stop: Callable[[], bool] | None

    def respond(
        self, wavenumbers: FloatArray, eta: float, albedos: FloatArray, resolution: Resolution
    ) -> list[Response]:
        """Solve the depth equation for each wavenumber; StoppedError when ``stop`` returns true."""

        def one(k: float) -> Response:
            if self.stop is not None and self.stop():
                raise StoppedError("stopped before the equation was solved.")
            return respond(k, eta, albedos, resolution)

        return list(self.pool.map(one, wavenumbers.tolist()))


@dataclass(frozen=True, slots=True, eq=False)
class _Channel:
    """The problem for one channel of one material, in mean free paths."""

    albedo: float
    radii_mfp: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class _Solution:
    """Energy beyond each radius (n+1,), absorbed energy, and the known part of the error."""

    beyond: FloatArray
    absorbed: float
    error: float


def _solve_group(
    eta: float,
    materials: Sequence[Material],
    grids: Sequence[RadialGrid],
    tolerance: float,
    workers: _Workers,
) -> list[Profile]:
    """Refine until two resolutions agree for every channel; return the finer profiles."""
    channels = [
        _Channel(albedo, grid.r_edges_mm * sigma_t)
        for material, grid in zip(materials, grids, strict=True)
        for albedo, sigma_t in zip(*_reduced(material), strict=True)
    ]
    coarse = _solve(eta, channels, _LEVELS[0], workers)
    for number, level in enumerate(_LEVELS[1:], start=2):
        fine = _solve(eta, channels, level, workers)
        errors = [_errors(*pair) for pair in zip(fine, coarse, strict=True)]
        worst = max(_share(*pair) for pair in zip(errors, fine, strict=True))
        if worst <= tolerance:
            return _profiles(materials, grids, fine, coarse, errors, tolerance)
        if worst > tolerance * _BEST_GAIN ** (len(_LEVELS) - number):
            break
        coarse = fine
    raise SimulationError(
        f"the tolerance of {tolerance:g} cannot be met: resolutions {number - 1} and {number} of "
        f"{len(_LEVELS)} differ by {worst:.2g} of the total; give `tolerance = "
        f"{_rounded_up(worst):g}` or more."
    )


def _solve(
    eta: float, channels: Sequence[_Channel], level: _Level, workers: _Workers
) -> list[_Solution]:
    """Solve all channels at one resolution."""
    albedos, places = np.unique([each.albedo for each in channels], return_inverse=True)
    rates = [decay_rate(albedo) for albedo in albedos]
    # A hundred times the grid's radius counts as infinity: wavenumbers need not resolve it, and
    # rates under a thousandth of theirs differ only in the light that leaves there.
    floor = min(0.01 / max(float(each.radii_mfp[-1]) for each in channels), _LARGEST_FLOOR)
    slowest = np.maximum(rates, 1e-3 * floor)
    wavenumbers = _wavenumbers(max(float(slowest.min()), floor), level)
    responses = workers.respond(wavenumbers, eta, albedos, level.depth)
    transforms = np.array([each.multiple for each in responses])
    answers = []
    for channel, place in zip(channels, places, strict=True):
        mixture = mixture_of(wavenumbers, transforms[:, place], float(slowest[place]))
        once = single_scattering_beyond(channel.radii_mfp, eta, level.single_step)
        beyond = channel.albedo * once + mixture.beyond(channel.radii_mfp)
        absorbed = float(responses[0].absorbed[place])
        balance = abs(float(beyond[0]) + absorbed - normal_transmittance(eta)) - _ROUNDING
        answers.append(_Solution(beyond, absorbed, max(balance, mixture.misfit)))
    return answers


def _wavenumbers(slowest: float, level: _Level) -> FloatArray:
    """Return wavenumbers from 0 to the largest, even in asinh(k / slowest)."""
    last = math.asinh(level.largest / slowest)
    places = np.linspace(0.0, last, math.ceil(level.density * last) + 1)
    wavenumbers: FloatArray = slowest * np.sinh(places)
    return wavenumbers


def _errors(fine: _Solution, coarse: _Solution) -> FloatArray:
    """Return the error of F at all edges except the first (r = 0), and of the total; (n+1,)."""
    difference = fine.beyond - coarse.beyond
    of_cumulative = np.abs(difference[0] - difference[1:])
    errors = np.append(of_cumulative, abs(float(difference[0])))
    least: FloatArray = np.maximum(errors, fine.error)
    return least


def _share(errors: FloatArray, answer: _Solution) -> float:
    """Return the largest error as a share of the total; 0 without scattering."""
    total = float(answer.beyond[0])
    return float(np.max(errors)) / total if total > 0.0 else 0.0


def _stderr(fine: _Solution, coarse: _Solution, errors: FloatArray) -> FloatArray:
    """Return errors of the annuli and beyond the grid, (n+1,), whose squares add up to those of F.

    Each is at least the annulus's own difference, and the sum up to any edge at least F's error
    there.
    """
    largest = np.maximum.accumulate(errors)
    steps = np.diff(np.concatenate(([0.0], largest**2)))
    own = np.abs(np.diff(np.append(fine.beyond - coarse.beyond, 0.0)))
    stderr: FloatArray = np.sqrt(np.maximum(steps, own**2))
    return stderr


def _profiles(
    materials: Sequence[Material],
    grids: Sequence[RadialGrid],
    fine: Sequence[_Solution],
    coarse: Sequence[_Solution],
    errors: Sequence[FloatArray],
    tolerance: float,
) -> list[Profile]:
    """Assemble the solutions of the channels into profiles."""
    profiles, first = [], 0
    for material, grid in zip(materials, grids, strict=True):
        own = slice(first, first + material.n_channels)
        first = own.stop
        beyond = np.stack([each.beyond for each in fine[own]], axis=1)
        stderr = [_stderr(*each) for each in zip(fine[own], coarse[own], errors[own], strict=True)]
        worst = max(_share(*pair) for pair in zip(errors[own], fine[own], strict=True))
        profiles.append(
            computed_profile(
                material,
                "exact",
                grid,
                energies_from_beyond(beyond),
                stderr=np.stack(stderr, axis=1),
                absorbed=np.array([[each.absorbed for each in fine[own]]]),
                relative_error=worst,
                settings={
                    "tolerance": tolerance,
                    "similarity": bool(material.layers[0].g.any()),
                    "solver": "half-space",
                },
                energy_balance_stderr=[each.error for each in fine[own]],
            )
        )
    return profiles


def _reduced(material: Material) -> tuple[list[float], list[float]]:
    """Return albedo and extinction [1/mm] of each channel under the similarity relation."""
    layer = material.layers[0]
    sigma_t = layer.reduced_sigma_t_per_mm
    albedo = np.divide(
        layer.reduced_sigma_s_per_mm, sigma_t, out=np.zeros_like(sigma_t), where=sigma_t > 0.0
    )
    return albedo.tolist(), sigma_t.tolist()


def _check_light(eta: float, light: str) -> None:
    """Check the index and the light."""
    if not 1.0 <= eta <= _LARGEST_ETA:
        raise SimulationError(f"eta = {eta:g}; expected a relative refractive index from 1 to 4.")
    if light not in LIGHTS:
        raise SimulationError(f"light = {shown(light)}; expected {' or '.join(LIGHTS)}.")


def _rounded_up(value: float) -> float:
    """Round up to one digit."""
    scale = 10.0 ** math.floor(math.log10(value))
    return math.ceil(value / scale) * scale
