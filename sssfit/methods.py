"""Every method of ``sssfit simulate`` and ``sssfit fit``: what it does, its function, its settings.

A new method is one file with its function and one entry here: help, ``--method``, the documentation
and the tests of options are made from the entries. Nothing of the library is imported before a
function is asked for, so that help answers at once.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from operator import attrgetter
from typing import Any


def imported(where: str) -> Callable[..., Any]:
    """Import a function or a method of a class: "module:name" or "module:class.name"."""
    module, names = where.split(":")
    found: Callable[..., Any] = attrgetter(names)(import_module(module))
    return found


@dataclass(frozen=True, slots=True)
class Setting:
    """A keyword of a method's function, and the option that asks for it.

    Parameters
    ----------
    name : str
        Of the option, with underscores.
    kind : str
        "number", "numbers" (one, or one a channel), "length", "share", "seconds", "whole", "count"
        (a whole number, 1e7 is understood), "choice" or "flag".
    help : str
        What it does; the names of the methods that have it are put before.
    metavar : str
        What stands for the value in the help.
    among : tuple
        The choices, or the smallest and the largest whole number.
    default : str or float, optional
        What the function is given where nothing is asked for; shown in the help.
    words : str
        How the help describes a default that the function has itself.
    keyword : str
        Of the function, where it is not the option's name: with a unit.
    """

    name: str
    kind: str
    help: str
    metavar: str = ""
    among: tuple[Any, ...] = ()
    default: str | float | None = None
    words: str = ""
    keyword: str = ""


@dataclass(frozen=True, slots=True)
class Method:
    """One way from a material to a profile, from a profile to a kernel, or to a made picture.

    Parameters
    ----------
    function : str
        "module:name"; `load` imports it.
    summary : str
        On one line.
    settings : tuple of Setting
    counted : str
        The setting whose value becomes part of the kernel's file name (svd3), by ``words`` where it
        is not given.
    shares : bool
        The function takes a list of materials, works once for what they have in common, and knows
        ``threads`` and ``stop``; the others take one material.
    makes : str, optional
        The name of the one profile it makes, without a material; that name needs no ``--method``.
    """

    function: str
    summary: str
    settings: tuple[Setting, ...] = ()
    counted: str = ""
    shares: bool = False
    makes: str | None = None

    def load(self) -> Callable[..., Any]:
        """Import the method's function."""
        return imported(self.function)


SIMULATIONS: Mapping[str, Method] = {
    "montecarlo": Method(
        "sssfit.simulate:simulate_montecarlo_many",
        "walks photons, through layers and slabs too; with standard errors",
        (
            Setting(
                "photons",
                "count",
                "photons to trace; every photon serves all channels.",
                "N",
                (2, 10**12),
                words="1e7; with --target-error no limit",
            ),
            Setting(
                "target_error",
                "share",
                "stop when every channel's F(r) has a standard error below this share of F at the "
                "last edge, such as 0.5%.",
                "SHARE",
            ),
            Setting(
                "checkpoint_every",
                "seconds",
                "time between saves of FILE.checkpoint, from which --resume continues.",
                "SECONDS",
                default=30.0,
            ),
            Setting("resume", "flag", "continue a killed or interrupted run from its checkpoint."),
        ),
        shares=True,
    ),
    "exact": Method(
        "sssfit.simulate:simulate_exact_many",
        "solves the transport equation: no noise; one half space",
        (
            Setting(
                "tolerance",
                "share",
                "largest error of F(r), as a share of the total.",
                "SHARE",
                default="0.01%",
            ),
        ),
        shares=True,
    ),
    "dipole": Method(
        "sssfit.simulate:simulate_dipole", "diffusion, Jensen et al. 2001; one half space"
    ),
    "dipole-grosjean": Method(
        "sssfit.simulate:simulate_dipole_grosjean",
        "the same with Grosjean's diffusion coefficient",
    ),
    "multipole": Method(
        "sssfit.simulate:simulate_multipole",
        "diffusion, Donner and Jensen 2005; slabs and layers too",
    ),
    "burley": Method(
        "sssfit.simulate:simulate_burley",
        "normalised diffusion, Christensen and Burley 2015; one half space",
        (
            Setting(
                "mapping",
                "choice",
                "which published fit gives s: perpendicular (light from straight above), diffuse "
                "(from everywhere), or diffuse-mfp (from the diffuse mean free path).",
                "FIT",
                ("perpendicular", "diffuse", "diffuse-mfp"),
                default="perpendicular",
            ),
        ),
    ),
    "gaussians": Method(
        "sssfit.simulate:simulate_deon_skin",
        "skin as the six Gaussians of d'Eon et al. 2007; deon-skin only",
        makes="deon-skin",
    ),
}

_ENERGY = Setting(
    "energy",
    "choice",
    "scale the kernel to the diffuse reflectance, or keep the energy within the support (svd: the "
    "least error).",
    among=("rescale", "keep"),
    words="rescale",
)

FITS: Mapping[str, Method] = {
    "svd": Method(
        "sssfit.fit.svd:fit_svd",
        "rank N: the largest terms of the singular value decomposition; the smallest error",
        (Setting("rank", "whole", "number of terms.", "N", (1, 1000), words="3"), _ENERGY),
        counted="rank",
    ),
    "gaussians": Method(
        "sssfit.fit.gaussians:fit_gaussians",
        "1 to 10 passes: a sum of Gaussians, best for the profile, r-weighted",
        (
            Setting("terms", "whole", "number of Gaussians.", "N", (1, 10), words="4"),
            Setting("signed", "flag", "allow negative weights."),
            Setting("free_energy", "flag", "leave the sum of the weights free."),
            _ENERGY,
        ),
        counted="terms",
    ),
    "preintegrated": Method(
        "sssfit.fit.preintegrated:fit_preintegrated",
        "one pass: the profile integrated along lines; exact for axis edges",
        (_ENERGY,),
    ),
    "guided": Method(
        "sssfit.fit.guided:fit_guided",
        "one pass fitted under a guide function: near (k = 0) to far (k = 4) scattering",
        (
            Setting("k", "number", "0 for near, 4 for far scattering.", "0..4", words="1.55"),
            Setting(
                "b",
                "number",
                "narrowness of the axes that the guide function leaves out.",
                "NUMBER",
                words="50",
            ),
            Setting(
                "centre_bound",
                "number",
                "largest share of the pass in its middle pixel.",
                "SHARE",
                words="none",
            ),
        ),
    ),
    "artist": Method(
        "sssfit.fit.artist:fit_artist",
        "one pass of two Gaussians per channel, fitted or set by hand",
        (
            Setting(
                "target",
                "choice",
                "fit the line integral, the 2D kernel, or pictures of a disk, an edge and a head "
                "(about 5 s).",
                among=("line", "kernel", "picture"),
                words="line",
            ),
            Setting(
                "near",
                "numbers",
                "variance of the narrow Gaussian, one or one per channel.",
                "MM2,...",
                keyword="near_mm2",
            ),
            Setting(
                "far",
                "numbers",
                "variance of the wide Gaussian, one or one per channel.",
                "MM2,...",
                keyword="far_mm2",
            ),
            Setting(
                "weight",
                "numbers",
                "share of the narrow Gaussian, one or one per channel.",
                "SHARE,...",
            ),
        ),
    ),
    "falloff": Method(
        "sssfit.fit.falloff:fit_falloff",
        "one pass, red skin stretched: width, strength and falloff, fitted or by hand",
        (
            Setting("width", "number", "width, the same for all channels.", "W"),
            Setting(
                "strength",
                "numbers",
                "share that is blurred, one or one per channel.",
                "T,...",
            ),
            Setting(
                "falloff",
                "numbers",
                "relative width of a channel, one or one per channel.",
                "F,...",
            ),
        ),
    ),
    "burley": Method(
        "sssfit.fit.burley:fit_burley",
        "one pass: normalised diffusion, a shape per channel, as engines use it",
        (_ENERGY,),
    ),
}


def settings_of(methods: Mapping[str, Method]) -> dict[str, tuple[Setting, tuple[str, ...]]]:
    """Return every setting by its name, each once, with the names of the methods that have it."""
    found: dict[str, tuple[Setting, tuple[str, ...]]] = {}
    for name, method in methods.items():
        for each in method.settings:
            owners = found[each.name][1] if each.name in found else ()
            found[each.name] = each, (*owners, name)
    return found


def lines_of(methods: Mapping[str, Method]) -> str:
    """Return name and summary, a line each; the longest name and two spaces set the column."""
    width = max(map(len, methods)) + 2
    return "\n".join(f"  {name.ljust(width)}{each.summary}" for name, each in methods.items())
