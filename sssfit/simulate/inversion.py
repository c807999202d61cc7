"""Albedo inversion: from a diffuse reflectance to a material that has it.

The total diffuse reflectance R of a homogeneous half space depends on its albedo a, its refractive
index and the incident light. The input is R under normally incident light, as in the profile of a
pencil beam, or a base colour: the share of the entering diffuse light that comes back, R_d / (1 -
R_sp), as a renderer shows it in a white furnace. The exact solver gives R(a) to 1e-8, and a root
finder inverts it. As a function of s = sqrt(1 - a), R is smooth and nearly linear down to s = 0,
where its slope by a is infinite. For comparison, the module has the formulas that renderers use,
which are right for diffuse light without a surface. Next: ``sssfit.simulate.half_space``.

Not imported with the other methods: scipy.optimize takes 0.2 s to load.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.optimize.elementwise import find_root

from sssfit import __version__
from sssfit.arrays import FloatArray, check_names, plain
from sssfit.errors import ArgumentError, MaterialError, RenderError, SimulationError
from sssfit.formats.colours import linear_from_hex, reflectance_of_codes
from sssfit.material import Layer, Material
from sssfit.material.checks import check_texts, number
from sssfit.messages import Columns, counted, report, shown
from sssfit.optics import normal_transmittance
from sssfit.simulate._walks import note_compiling
from sssfit.simulate.half_space import (
    LIGHTS,
    Light,
    diffuse_reflectance,
    entering_light,
    is_solver_compiled,
)

SKIN_ETA = 1.4  # d'Eon and Luebke 2007, GPU Gems 3, chapter 14: .028 at normal incidence
_CLOSE = 1e-8  # in reflectance; the precision of the exact solver
_DIM = 1e-4  # a reflectance below which errors are relative
_DARK = 1e-9  # a reflectance that no relative error is given for: the fits were not made for it
_PUBLISHED = {"chiang2016": "Chiang et al. 2016", "van_de_hulst": "van de Hulst"}
_ASKED = {"normal": "diffuse reflectance", "diffuse": "base colour under diffuse light"}


@dataclass(frozen=True, slots=True, eq=False)
class Inversion:
    """Albedos (C,) found for diffuse reflectances, and the reflectances that they really have.

    ``reflectance`` (C,) is that of the exact solver, under the same light; for the exact inversion
    it equals the input.
    """

    albedo: FloatArray
    reflectance: FloatArray


def reflectance_of(albedo: npt.ArrayLike, eta: float, light: Light = "normal") -> FloatArray:
    """Return the reflectance that an inversion takes, by the exact solver.

    Parameters
    ----------
    albedo : (C,)
        Albedos, 0 to 1, with g = 0.
    eta : float
        Refractive index relative to what is above.
    light : "normal" or "diffuse"
        "normal": the total diffuse reflectance R_d under light along the normal, a share of the
        incident light. "diffuse": the base colour R_d / (1 - R_sp), R_d and R_sp under equal
        radiance from all directions above; a share of the light that enters.

    Returns
    -------
    (C,) array

    Raises
    ------
    SimulationError
        An argument is out of range.
    """
    total = diffuse_reflectance(albedo, eta, light=light)
    return total / entering_light(float(eta), light) if light == "diffuse" else total


def largest_reflectance(eta: float, light: Light = "normal") -> float:
    """Return `reflectance_of` albedo 1, where all light that enters comes back.

    Under normal light this is 1 less the specular reflectance; under diffuse light it is 1.
    """
    return 1.0 if light == "diffuse" else normal_transmittance(eta)


def invert_reflectance(
    reflectance: npt.ArrayLike, eta: float, *, light: Light = "normal"
) -> Inversion:
    """Find the albedos for total diffuse reflectances, g = 0, with the exact solver.

    Solves R(1 - s^2) = reflectance for s in [0, 1], all channels at once, to 1e-8 in R, and to 1e-4
    of R above 1e-12.

    Parameters
    ----------
    reflectance : (C,) [1]
        Reflectances as in `reflectance_of`, from 0 to `largest_reflectance`.
    eta : float
        Refractive index relative to what is above.
    light : "normal" or "diffuse"
        The incident light of the reflectance; base colours are defined for diffuse light, OpenPBR's
        ``subsurface_color`` for normal light.

    Returns
    -------
    Inversion

    Raises
    ------
    MaterialError
        No albedo gives the reflectance; the message names the largest possible one. Or the light is
        unknown.

    Examples
    --------
    >>> invert_reflectance([0.44], 1.3).albedo.round(4)
    array([0.9605])
    >>> invert_reflectance([0.44], 1.3, light="diffuse").albedo.round(4)
    array([0.954])
    """
    asked, eta = _reachable(reflectance, eta, light), float(eta)
    darkest, brightest = reflectance_of(np.array([0.0, 1.0]), eta, light)
    # Rounding may place the solver's end values slightly inside; the root is then that end.
    aim = np.clip(asked, darkest, brightest)
    # To 1e-8 of all light, a reflectance of 1e-8 would be 0 as well.
    scale = np.maximum(1.0, _DIM / np.maximum(aim, np.finfo(np.float64).tiny))

    def excess(s: FloatArray, /, wanted: FloatArray, scale: FloatArray) -> FloatArray:
        return (reflectance_of(1.0 - s**2, eta, light) - wanted) * scale

    ends = np.zeros_like(aim), np.ones_like(aim)
    found = find_root(excess, ends, args=(aim, scale), tolerances={"fatol": _CLOSE})
    if not np.all(found.success):
        raise SimulationError(f"no albedo found for reflectances {asked.tolist()} at eta = {eta}.")
    return Inversion(1.0 - np.asarray(found.x) ** 2, aim + np.asarray(found.f_x) / scale)


def published_inversions(
    reflectance: npt.ArrayLike, eta: float, *, light: Light = "normal"
) -> dict[str, Inversion]:
    """Return the albedos of the approximate inversions of renderers, and their true reflectances.

    Parameters and errors are those of `invert_reflectance`; keys are "chiang2016" and
    "van_de_hulst". The latter takes the share of the light that enters.
    """
    asked = _reachable(reflectance, eta, light)
    found = {
        "chiang2016": chiang_albedo(asked),
        "van_de_hulst": van_de_hulst_albedo(asked / largest_reflectance(eta, light)),
    }
    real = reflectance_of(np.concatenate(list(found.values())), eta, light)
    return {
        key: Inversion(albedo, reflectance)
        for (key, albedo), reflectance in zip(
            found.items(), real.reshape(len(found), -1), strict=True
        )
    }


def chiang_albedo(reflectance: FloatArray) -> FloatArray:
    """Return the albedo for a surface reflectance A (C,), a fit to simulations without an index.

    a = 1 - exp(-5.09406 A + 2.61188 A^2 - 4.31805 A^3): Chiang, Kutz and Burley 2016, "Practical
    and controllable subsurface scattering for production path tracing", SIGGRAPH talks.
    """
    a = reflectance
    albedo: FloatArray = -np.expm1(a * (-5.09406 + a * (2.61188 - a * 4.31805)))
    return albedo


def van_de_hulst_albedo(colour: FloatArray, g: float = 0.0) -> FloatArray:
    """Return the albedo for a multiple-scattering albedo C (C,), index-matched.

    s = 4.09712 + 4.20863 C - sqrt(9.59217 + 41.6808 C + 17.7126 C^2), a = (1 - s^2) / (1 - g s^2):
    van de Hulst's C = (1 - s)(1 - 0.139 s) / (1 + 1.17 s) inverted by Kulla and Conty 2017, as in
    the OpenPBR specification 1.1, where C is the share of the light that *enters*.
    """
    root = np.sqrt(9.59217 + colour * (41.6808 + colour * 17.7126))
    # Rounded coefficients: s is 0.999997 at C = 0 and -5e-6 at C = 1.
    s_squared = np.clip(4.09712 + 4.20863 * colour - root, 0.0, 1.0) ** 2
    albedo: FloatArray = (1.0 - s_squared) / (1.0 - g * s_squared)
    return albedo


def material_from_reflectance(
    reflectance: npt.ArrayLike | str,
    mean_free_path_mm: npt.ArrayLike,
    eta: float = SKIN_ETA,
    *,
    name: str,
    channels: Sequence[str] = ("R", "G", "B"),
    light: Light | None = None,
) -> Material:
    """Make the half space, g = 0, that has a given total diffuse reflectance.

    Parameters
    ----------
    reflectance : (C,) [1] or str
        Reflectances as in `invert_reflectance`, or an sRGB colour in hex, "#c58c6b", which is
        decoded.
    mean_free_path_mm : (C,) or float [mm]
        1 / (sigma_a + sigma_s), by channel or one for all.
    eta : float
        By default 1.4, that of skin and most living tissue.
    name : str
    channels : sequence of str
        Names of the C channels.
    light : "normal" or "diffuse", optional
        As in `invert_reflectance`; by default "diffuse" for a colour in hex, else "normal".

    Returns
    -------
    Material
        Its ``source`` names the given reflectance and its light.

    Raises
    ------
    MaterialError
        As `invert_reflectance`; or lists differ in length, or a value is invalid for a material.
    """
    check_texts(name, "")  # raises all errors before seconds of work
    check_names(channels)
    meant = f"sRGB {reflectance.strip()}, " if isinstance(reflectance, str) else ""
    light = light or ("diffuse" if meant else "normal")
    asked = _reachable(_linear(reflectance), eta, light)
    paths_mm = np.atleast_1d(np.asarray(mean_free_path_mm, dtype=np.float64))
    if paths_mm.size not in (1, asked.size) or paths_mm.ndim > 1:
        raise MaterialError(
            f"{counted(paths_mm.size, 'mean free path')} for "
            f"{counted(asked.size, 'reflectance')}; give as many, or one for all."
        )
    if not ((paths_mm >= 1e-9) & (paths_mm <= 1e9)).all():  # limit of coefficients of a material
        raise MaterialError(
            f"mean free paths {paths_mm.tolist()}; expected lengths from 1e-9 to 1e9 mm."
        )
    note_compiling("solver", 3, is_solver_compiled())
    albedo = invert_reflectance(asked, eta, light=light).albedo
    words = ", ".join(f"{each:g}" for each in asked)
    return Material(
        name,
        tuple(channels),
        (Layer(eta, np.zeros_like(albedo), (1.0 - albedo) / paths_mm, albedo / paths_mm),),
        source=f"{meant}{_ASKED[light]} {words} by exact albedo inversion, sssfit {__version__}",
    )


def asked_for(
    reflectance: list[float] | str, *, srgb: bool = False, light: Light | None = None
) -> tuple[list[float] | str, Light]:
    """Return the reflectance or colour that is meant, and its light.

    Parameters
    ----------
    reflectance : list of float or str
        Shares, or a colour in hex.
    srgb : bool
        The numbers are 8-bit sRGB codes.
    light : "normal" or "diffuse", optional
        By default that of the colours, "diffuse", else "normal".
    """
    is_colour = srgb or isinstance(reflectance, str)
    asked = reflectance_of_codes(reflectance) if srgb else reflectance
    return asked, light or ("diffuse" if is_colour else "normal")


def channel_names(given: str | None, reflectance: list[float] | str) -> list[str]:
    """Return names with commas between them, one for each reflectance; R, G, B for three.

    Raises
    ------
    ArgumentError
        They are missing, or not as many.
    """
    count = 3 if isinstance(reflectance, str) else len(reflectance)
    if given is None and count != 3:
        raise ArgumentError(
            f"`from_reflectance` has {counted(count, 'value')}; name "
            f"{'its channel' if count == 1 else 'their channels'} with `channels`."
        )
    names = [each.strip() for each in (given or "R,G,B").split(",")]
    if len(names) != count:
        raise ArgumentError(
            f"`channels` has {counted(len(names), 'name')} for {counted(count, 'reflectance')}."
        )
    return names


def inversion_figures(
    material: Material, reflectance: npt.ArrayLike | str, light: Light
) -> dict[str, Any]:
    """Return the figures of a material by `material_from_reflectance`, made with these arguments.

    Those of the published approximations stand beside it; lists and numbers, as JSON holds them.
    """
    layer, asked = material.layers[0], np.atleast_1d(_linear(reflectance))
    published = published_inversions(asked, layer.eta, light=light)
    return plain(
        {
            "name": material.name,
            "channels": material.channels,
            "light": light,
            "eta": layer.eta,
            "mean_free_path_mm": layer.mean_free_path_mm,
            "reflectance_asked": asked,
            "reflectance": reflectance_of(layer.albedo, layer.eta, light),
            "reflectance_normal": reflectance_of(layer.albedo, layer.eta, "normal"),
            "largest_reflectance": largest_reflectance(layer.eta, light),
            "albedo": layer.albedo,
            "sigma_a_per_mm": layer.sigma_a_per_mm,
            "sigma_s_per_mm": layer.sigma_s_per_mm,
            "approximations": {
                key: {"albedo": each.albedo, "reflectance": each.reflectance}
                for key, each in published.items()
            },
        }
    )


def summary(figures: Mapping[str, Any]) -> str:
    """Write `inversion_figures` for people."""
    is_diffuse = figures["light"] == "diffuse"
    what = "base colour" if is_diffuse else "diffuse reflectance"
    found = (
        (what, "reflectance", ".6f"),
        *((("normal reflectance", "reflectance_normal", ".6f"),) if is_diffuse else ()),
        ("albedo", "albedo", ".6f"),
        ("sigma_a, 1/mm", "sigma_a_per_mm", ".6g"),
        ("sigma_s, 1/mm", "sigma_s_per_mm", ".6g"),
    )
    published = tuple((f"{title}, gives", key, "") for key, title in _PUBLISHED.items())
    asked = figures["reflectance_asked"]
    told = {
        **figures,
        "most": math.floor(1e6 * figures["largest_reflectance"]) / 1e6,
        **{
            key: list(map(_given, made["albedo"], made["reflectance"], asked))
            for key, made in figures["approximations"].items()
        },
    }
    parts = (
        "{name}: eta {eta:g}, could reflect up to {most:g} under {light} light",
        Columns("channel", "channels", found),
        f"approximate albedos, the {what} they really have, and its error:",
        Columns("channel", "channels", published),
    )
    return report(parts, told)


def _given(albedo: float, gives: float, asked: float) -> str:
    """Albedo, reflectance and its relative error."""
    error = "" if asked < _DARK else f" ({100.0 * (gives / asked - 1.0):+#.3g} %)"
    return f"{albedo:.6f}, {gives:.6f}{error}"


def _linear(reflectance: npt.ArrayLike | str) -> npt.ArrayLike:
    """Decode a colour in hex; anything else is linear."""
    if not isinstance(reflectance, str):
        return reflectance
    try:
        return linear_from_hex(reflectance)
    except RenderError as error:
        raise MaterialError(str(error)) from None


def _reachable(reflectance: npt.ArrayLike, eta: float, light: str) -> FloatArray:
    """Return the reflectances as an array (C,); raises for those that no albedo gives."""
    try:
        asked = np.atleast_1d(np.asarray(reflectance, dtype=np.float64))
    except (TypeError, ValueError):
        raise MaterialError(
            f"reflectance = {shown(reflectance)}; expected one number a channel."
        ) from None
    if asked.ndim > 1 or asked.size == 0:
        raise MaterialError(f"reflectance has shape {asked.shape}; expected one number a channel.")
    if light not in LIGHTS:
        raise MaterialError(f"light = {shown(light)}; expected {' or '.join(LIGHTS)}.")
    # A material may have less, but the exact solver does not accept less.
    if number("eta", eta) < 1.0:
        raise MaterialError(f"eta = {eta:g}; expected a relative refractive index from 1 to 4.")
    most = largest_reflectance(eta, light)
    where = "under diffuse light" if light == "diffuse" else f"at eta = {eta:g}"
    for k in np.flatnonzero(~((asked >= 0.0) & (asked <= most))):
        raise MaterialError(
            f"reflectance[{k}] = {asked[k]:g} cannot be reached; {where} the largest is "
            f"{math.floor(1e6 * most) / 1e6:g}, where nothing is absorbed, and the smallest 0."
        )
    return asked
