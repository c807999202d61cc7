"""Albedo and refractive index: where the grid ends too soon, and where models and fits give way.

Half spaces of one mean free path of 1 mm, by the exact solver. Where the albedo nears 1 light
spreads without bounds; where it nears 0 only 1/r is left, which no sum of Gaussians has.
"""

import functools
from collections.abc import Sequence

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.fit import FitResult, fit_gaussians
from sssfit.material import Layer, Material
from sssfit.methods import OF_HALF_SPACES
from sssfit.profile import Profile
from sssfit.simulate import simulate
from sssfit.simulate.exact import simulate_exact_many
from sssfit.stability.curve import Axis, Curve
from sssfit.stability.panel import Panel
from sssfit.stability.subject import Subject

BEYOND_LIMIT, MODEL_LIMIT, TERMS_LIMIT = 1e-3, 0.1, 6
_LEAST_SHARE = 1e-9  # for logarithmic axes
CONDITION_LIMIT = 1e8  # half of double precision's digits
ALBEDOS = (0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.97, 0.99, 0.997, 0.999, 0.9999, 0.99999)
_INDICES = (1.0, 1.3, 1.5, 2.0)
_OWN_INDEX = 1.4
_WIDE = "an exact or walked profile with a larger radius"


def stress(subject: Subject) -> list[Panel]:
    """Solve for albedos of .01 to .99999 and indices of 1 to 2."""
    axis = Axis("1 - albedo", mild=0.1)
    profiles = _profiles(_OWN_INDEX, subject.threads)
    sums = subject.each(_sums, profiles)
    terms, condition = (_ascending(each) for each in zip(*sums, strict=True))
    bright = Axis("1 - albedo", mild=1.0 - ALBEDOS[-1])
    return [
        Panel(
            stress="optics",
            axis=axis,
            title="energy beyond a grid of 32 mean free paths",
            y_label="share of the reflectance",
            limit=BEYOND_LIMIT,
            curves=[_beyond(subject, eta) for eta in _INDICES],
            fails="the grid ends before the light does",
            floor=_LEAST_SHARE,
        ),
        Panel(
            stress="optics",
            axis=bright,
            title="diffusion models beside the exact profile",
            y_label="share in the wrong annulus",
            limit=MODEL_LIMIT,
            curves=[_model(subject, name) for name in OF_HALF_SPACES],
            fails="diffusion does not hold near the beam",
        ),
        Panel(
            stress="optics",
            axis=axis,
            title="Gaussians for an error of 1 %",
            y_label="terms",
            limit=TERMS_LIMIT,
            curves=[Curve("gaussians", _lost(ALBEDOS), terms, advice="another method")],
            fails="six Gaussians are not enough",
            is_log=False,
        ),
        Panel(
            stress="optics",
            axis=axis,
            title="condition of six Gaussians' normal matrix",
            y_label="condition number",
            limit=CONDITION_LIMIT,
            curves=[Curve("gaussians 6", _lost(ALBEDOS), condition, advice="fewer Gaussians")],
            fails="weights are lost in rounding",
        ),
    ]


def _lost(albedos: Sequence[float]) -> FloatArray:
    """Return 1 - albedo, ascending with `_ascending`."""
    return 1.0 - np.array(albedos)[::-1]


def _ascending(values: Sequence[float]) -> FloatArray:
    return np.array(values, dtype=np.float64)[::-1]


def _material(albedo: float, eta: float) -> Material:
    lost, kept = np.array([1.0 - albedo]), np.array([albedo])
    layer = Layer(eta=eta, g=np.zeros(1), sigma_a_per_mm=lost, sigma_s_per_mm=kept)
    return Material(name=f"albedo{albedo}", source="stress", channels=("Y",), layers=(layer,))


@functools.lru_cache(maxsize=8)
def _profiles(eta: float, threads: int | None) -> Sequence[Profile]:
    """Return the exact profile of every albedo; they share the solver's work."""
    return tuple(simulate_exact_many([_material(each, eta) for each in ALBEDOS], threads=threads))


def _beyond(subject: Subject, eta: float) -> Curve:
    profiles = _profiles(eta, subject.threads)
    shares = [float((each.beyond_grid / each.diffuse_reflectance)[0]) for each in profiles]
    floor = np.maximum(_ascending(shares), _LEAST_SHARE)
    return Curve(
        f"index {eta:g}",
        _lost(ALBEDOS),
        floor,
        advice='a larger radius, or `radius_mm = "auto"` of a walk',
    )


def _model(subject: Subject, name: str) -> Curve:
    """Return half the sum of differences of all annuli's energy: the share in the wrong place."""
    errors = []
    for albedo, exact in zip(ALBEDOS, _profiles(_OWN_INDEX, subject.threads), strict=True):
        dr_mm, radius_mm = float(exact.r_edges_mm[1]), float(exact.r_edges_mm[-1])
        material = _material(albedo, _OWN_INDEX)
        model = simulate(material, name, dr_mm=dr_mm, radius_mm=radius_mm)
        apart = np.abs(model.annulus_energy - exact.annulus_energy).sum()
        apart += np.abs(model.beyond_grid - exact.beyond_grid).sum()
        errors.append(0.5 * float(apart) / float(exact.diffuse_reflectance[0]))
    return Curve(name, _lost(ALBEDOS), _ascending(errors), advice=_WIDE)


_MOST_TERMS, _ENOUGH, _PITCH_MM = 10, 0.01, 0.5


def _sums(_: Subject, profile: Profile) -> tuple[float, float]:
    """Return the Gaussians that are needed, and the condition number of six."""
    return _terms_needed(profile), _condition_of(profile)


def _terms_needed(profile: Profile) -> float:
    """Return the Gaussians that are needed, 11 where ten do not do."""
    for terms in range(1, _MOST_TERMS + 1):
        own = _gaussians(profile, terms).kernel.parameters["Y"]
        if own["relative_error"] <= _ENOUGH:
            return float(terms)
    return _MOST_TERMS + 1.0


def _gaussians(profile: Profile, terms: int) -> FitResult:
    return fit_gaussians(profile, terms=terms, mm_per_pixel=_PITCH_MM)


def _condition_of(profile: Profile) -> float:
    kernel = _gaussians(profile, 6).kernel
    variances = kernel.parameters["Y"]["variances_mm2"]
    return condition_number(np.array(variances))


def condition_number(variances: FloatArray) -> float:
    """Return that of the normal matrix of Gaussians of the plane, each scaled to norm 1.

    <g_i, g_j> = 1 / (2 pi (v_i + v_j)), over sqrt of <g_i, g_i> <g_j, g_j> = 1 / (4 pi sqrt(v_i
    v_j)): 2 sqrt(v_i v_j) / (v_i + v_j).
    """
    root = np.sqrt(variances)
    matrix = 2.0 * root[:, None] * root / (variances[:, None] + variances)
    return float(np.linalg.cond(matrix))
