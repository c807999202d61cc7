"""The figures of ``sssfit chart``: each is computed, drawn, and put into figures and words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeAlias

from sssfit.messages import columns, number, table
from sssfit.methods import DEON_SKIN

from ._options import Common
from ._output import say
from ._progress import say_if_compiling, walk_progress

if TYPE_CHECKING:
    from sssfit.fit import Pitch
    from sssfit.kernel import SeparableKernel
    from sssfit.material import Material
    from sssfit.profile import Profile
    from sssfit.simulate import SoFar

    # A matplotlib Figure, its figures for --json, and the same for people.
    Drawn: TypeAlias = tuple[Any, dict[str, Any], str]

_ERRORS = ("total_error", "cumulative_error", "l2_error")


def draw_whole(name: str, kind: str, shown: Profile | Material) -> Drawn:
    """Draw a profile, or a material."""
    from sssfit.chart.material import material_figure
    from sssfit.chart.profile import profile_figure
    from sssfit.material import Material

    figures = {
        "kind": kind,
        "file": name,
        "profile": name if kind == "profile" else None,
        "material": shown.name if isinstance(shown, Material) else shown.material_name,
        "channels": shown.channels,
    }
    figure = material_figure(shown) if isinstance(shown, Material) else profile_figure(shown)
    return figure, figures, ""


def first_of(found: SoFar, common: Common) -> Profile:
    """Return the profile so far of a walk's first material, saying if there are more."""
    first, count = found.profiles[0], len(found.profiles)
    if count > 1:
        say(common, f"Drawing {first.material_name}, the first of the walk's {count} materials.")
    return first


def draw_kernel(
    name: str,
    kernel: SeparableKernel,
    profile: Profile | None,
    source: str | None,
    channel: str | None,
) -> Drawn:
    """Draw a kernel, beside its profile where that is known; ``source`` is the profile's file."""
    from sssfit.chart.kernel import kernel_figure
    from sssfit.compare import view_kernel

    view = view_kernel(kernel, profile, channels=None if channel is None else [channel])
    figures = {"kind": "kernel", "file": name, "profile": source, **view.to_dict()}
    against = "errors as the fit recorded them" if source is None else f"against {source}"
    text = (
        f"{figures['method']}, rank {figures['rank']}, {figures['pixels']} x {figures['pixels']} "
        f"pixels of {figures['mm_per_pixel']:.4g} mm; {against}\n"
    )
    return (
        kernel_figure(view),
        figures,
        text
        + columns(
            "channel",
            figures["channels"],
            ("energy", figures["energy"], ".6f"),
            ("energy error", figures["energy_error"], "+.2g%|unknown"),
            ("Frobenius error", figures["relative_frobenius_error"], ".3g%|unknown"),
            ("misplaced", figures["misplaced"], ".3g%"),
        ),
    )


def draw_spectrum(name: str, profile: Profile, mm_per_pixel: Pitch | None) -> Drawn:
    """Draw the spectrum of a profile's kernel."""
    from sssfit.chart.spectrum import spectrum_figure
    from sssfit.compare import compute_spectrum

    spectrum = compute_spectrum(profile, mm_per_pixel=mm_per_pixel)
    figures = {"profile": name, **spectrum.to_dict()}
    text = (
        f"Share of the first singular value; {spectrum.pixels} x {spectrum.pixels} pixels of "
        f"{spectrum.mm_per_pixel:.4g} mm\n"
    )
    return (
        spectrum_figure(spectrum),
        figures,
        text
        + columns(
            "channel",
            figures["channels"],
            ("first, squared", figures["squared_share"][0], ".2f%"),
            ("first, absolute", figures["absolute_share"][0], ".2f%"),
            ("terms for an error of 1 %", figures["rank_for_1_percent"], ""),
        ),
    )


def draw_guide(name: str, profile: Profile, settings: Mapping[str, Any]) -> Drawn:
    """Draw guided fits of a channel; ``settings`` are of `compute_guide`, None its defaults."""
    from sssfit.chart.guide import guide_figure
    from sssfit.compare import compute_guide

    guide = compute_guide(profile, **{k: each for k, each in settings.items() if each is not None})
    told = guide.to_dict()
    text = (
        f"Channel {told['channel']}; {guide.pixels} x {guide.pixels} pixels of "
        f"{guide.mm_per_pixel:.4g} mm\n"
    )
    names = [*(f"{k:g}" for k in guide.ks), "pre-integrated"]
    parts = {
        "middle pixel": ("centre_share", "preintegrated_centre_share"),
        "misplaced": ("misplaced", "preintegrated_misplaced"),
        "Frobenius error": ("relative_frobenius_error", "preintegrated_frobenius_error"),
        "weighted misfit": ("weighted_residual", "preintegrated_weighted_residual"),
    }
    shown = [(head, [*told[k], told[last]], ".2f%") for head, (k, last) in parts.items()]
    return guide_figure(guide), {"profile": name, **told}, text + columns("k", names, *shown)


def draw_models(
    material: Material, walk: Profile | None, photons: int | None, common: Common
) -> Drawn:
    """Draw a material by every method, with a progress bar for the walk if there is none yet."""
    from sssfit.chart.models import models_figure
    from sssfit.compare import compare_models

    say_if_compiling(common, walk=None if walk else material, solver=True)
    with walk_progress(material.name, quiet=common.quiet or walk is not None) as show:
        comparison = compare_models(
            material,
            walk=walk,
            photons=photons,
            seed=common.seed,
            threads=common.threads,
            progress=show,
        )
    figures = comparison.to_dict()
    heads = ["method, channel", "diffuse reflectance", "error", "largest of F(r)", "L2 of R_d"]
    rows = [
        [
            f"{row['method']} {name}",
            number(row["diffuse_reflectance"][c], ".6f"),
            *("-" if row["method"] == "exact" else number(row[key][c], ".3f%") for key in _ERRORS),
        ]
        for row in figures["rows"]
        for c, name in enumerate(figures["channels"])
    ]
    text = (
        f"{figures['material']}: errors against the exact solution; {figures['photons']:,} photons "
        f"on {figures['annuli']} annuli of {figures['dr_mm']:.4g} mm\n{table(heads, rows)}"
    )
    return models_figure(comparison), figures, text


def read_models(name: str) -> tuple[Material, Profile | None]:
    """Return a material and, where it was a profile of a walk that was named, the walk."""
    from sssfit.errors import ProfileError
    from sssfit.material import load_material
    from sssfit.profile import Profile

    if name == DEON_SKIN:
        raise ProfileError(f"{name} has no coefficients for other methods; name a material.")
    if not name.endswith(".npz"):
        return load_material(name), None
    profile = Profile.load(name)
    material = profile.material
    is_walk = profile.meta.get("method") == "montecarlo" and profile.photons is not None
    if material is None or not is_walk or profile.channels != material.channels:
        raise ProfileError(
            f"{name} is not a photon walk of a known material; name a material, or a profile by "
            "`sssfit simulate`."
        )
    return material, profile
