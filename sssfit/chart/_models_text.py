"""The text of the figure of profile models."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from sssfit.chart.text import count, grid, shortened

if TYPE_CHECKING:
    from sssfit.compare.models import ModelComparison, ModelCurve

MINUS = "\N{MINUS SIGN}"


def models_title(comparison: ModelComparison) -> str:
    """Name the material and the reference of the models."""
    truth = "isotropic scattering" if is_similar(comparison) else "the exact solution"
    return f"{shortened(comparison.material.name, 20)}: models against {truth}"


def is_similar(comparison: ModelComparison) -> bool:
    """Whether the exact solution is that of the similar isotropic medium: g is not 0."""
    return bool(comparison.exact.profile.meta["settings"].get("similarity"))


def models_subtitle(comparison: ModelComparison) -> str:
    """Say how the two profiles that need it were made, and on what grid."""
    exact, walk = comparison.exact.profile, comparison.walk.profile
    reached = 100.0 * float(exact.meta["relative_error"] or 0.0)
    what = "Isotropic" if is_similar(comparison) else "Exact"
    return (
        f"{what} to {reached:.1g} % of the total · {count(walk.photons or 0)} photons, seed "
        f"{walk.meta.get('seed', 'unknown')} · {grid(walk)} · sssfit {exact.meta['version']}"
    )


def channel_name(comparison: ModelComparison, channel: int) -> str:
    """Name a channel."""
    return shortened(comparison.material.channels[channel])


def panel_titles(comparison: ModelComparison, channel: int) -> list[str]:
    """Name a channel, with albedo and mean free path, or why nothing is drawn; longest first."""
    name = channel_name(comparison, channel)
    if comparison.edges_mm[channel].size < 2:
        return [f"{name} · too few photons to draw", f"{name} · too few photons"]
    layer = comparison.material.layers[0]
    with_albedo = f"{name} · albedo {layer.albedo[channel]:.4g}"
    return [f"{with_albedo} · MFP {layer.mean_free_path_mm[channel]:#.3g} mm", with_albedo, name]


def total_with_error(curve: ModelCurve, channel: int) -> list[str]:
    """Total diffuse reflectance, and how far it is from the exact one; longest first."""
    total = float(curve.profile.diffuse_reflectance[channel])
    error = 100.0 * float(curve.total_error[channel])
    if curve.method == "exact" or math.isnan(error):
        return [f"{total:#.4g}"]
    if curve.method == "burley":
        return [f"{total:#.4g} (given)"]
    signed = f"{error:+.{2 if abs(error) < 1.0 else 1}f}".replace("-", MINUS)
    if curve.profile.photons is not None:
        stderr = float(curve.profile.diffuse_reflectance_stderr[channel])
        signed += f" ± {100.0 * stderr / total:.2f}"
    return [f"{total:#.4g} ({signed} %)", f"{total:#.4g}"]


def model_notes(comparison: ModelComparison, shown: Sequence[int]) -> list[str]:
    """Say what the curves are means over, what the band is, and what is left out."""
    notes = [
        "Means over annuli merged until the walk has 100 effective photons in each; curves end "
        "where it has too few. Band: ±1 standard error of the walk. Errors: linear within ±10 % "
        "(grey), logarithmic beyond, above +1000 % not drawn. MFP: mean free path.",
    ]
    if is_similar(comparison):
        notes.append(
            "g is not 0: the black curve solves for isotropic scattering of (1 - g) sigma_s, which "
            "is an approximation. The walk follows g itself: where the two differ, trust the walk."
        )
    left = comparison.material.n_channels - len(shown)
    if left:
        notes.append(f"{left} channels between these are not drawn.")
    return notes
