"""``sssfit chart --models``: one material by every method, drawn and put into figures."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ._compiling import say_if_compiling
from ._deon_skin import DEON_SKIN
from ._figure import chart_output
from ._memory import check_memory
from ._options import Common
from ._report import finish, table

if TYPE_CHECKING:
    from sssfit.compare import ModelComparison, ModelCurve
    from sssfit.material import Material
    from sssfit.profile import Profile

_ERRORS = ("total_error", "cumulative_error", "l2_error")


def chart_models(
    name: str, output: str | None, photons: int | None, common: Common, *, force: bool
) -> None:
    """Draw a material by every method; a profile of a photon walk stands for material and walk."""
    check_memory("figures", common.threads)
    material, walk = _read(name)
    if walk is not None and photons is not None:
        raise click.UsageError("--photons is for a walk that is yet to be; leave it out.")
    asked = f"{material.name}.models.png" if output is None else output
    path = None if asked == "-" else Path(asked)
    with chart_output(path, inputs=[name], force=force) as save:
        comparison = _compared(material, walk, photons, common)

        from sssfit.chart.models import models_figure

        save(models_figure(comparison))
    figures = {"command": "chart", "output": [str(path or "-")], **_figures(comparison)}
    text = f"{_text(figures)}\nWrote {path or 'a PNG to stdout'}"
    finish(common, figures, text, to_stderr=path is None)


def _read(name: str) -> tuple[Material, Profile | None]:
    """Return a material and, where it was a profile of a walk that was named, the walk."""
    from sssfit.errors import ProfileError
    from sssfit.material import load_material
    from sssfit.profile import Profile
    from sssfit.profile.bins import material_of

    if name == DEON_SKIN:
        raise ProfileError(f"{name} has no coefficients for other methods; name a material.")
    if not name.endswith(".npz"):
        return load_material(name), None
    profile = Profile.load(name)
    material = material_of(profile)
    is_walk = profile.meta.get("method") == "montecarlo" and profile.photons is not None
    if material is None or not is_walk or profile.channels != material.channels:
        raise ProfileError(
            f"{name} is no photon walk of a known material; name a material, or a profile by "
            "`sssfit simulate`."
        )
    return material, profile


def _compared(
    material: Material, walk: Profile | None, photons: int | None, common: Common
) -> ModelComparison:
    """Compute every method, with a progress bar for the walk."""
    from sssfit.compare import compare_models

    from ._progress import walk_progress

    say_if_compiling(common, walk=None if walk else material, solver=True)
    with walk_progress(material.name, quiet=common.quiet or walk is not None) as show:
        return compare_models(
            material,
            walk=walk,
            photons=photons,
            seed=common.seed,
            threads=common.threads,
            progress=show,
        )


def _figures(comparison: ModelComparison) -> dict[str, Any]:
    """Figures of the comparison, as ``--json`` prints them."""
    walk = comparison.walk.profile
    return {
        "material": comparison.material.name,
        "channels": comparison.material.channels,
        "photons": walk.photons,
        "seed": walk.meta.get("seed"),
        "annuli": walk.n_annuli,
        "dr_mm": float(walk.r_edges_mm[1]),
        "radius_mm": float(walk.r_edges_mm[-1]),
        "rows": [_row(curve) for curve in comparison.curves],
    }


def _row(curve: ModelCurve) -> dict[str, Any]:
    """Figures of one method; errors are shares, against the exact solution."""
    return {
        "method": curve.method,
        "diffuse_reflectance": curve.profile.diffuse_reflectance,
        "diffuse_reflectance_stderr": curve.profile.diffuse_reflectance_stderr,
        **{key: getattr(curve, key) for key in _ERRORS},
    }


def _text(figures: dict[str, Any]) -> str:
    """Write the same for people: one line a method and channel."""
    heads = ["method, channel", "diffuse reflectance", "error", "largest of F(r)", "L2 of R_d"]
    rows = [
        [
            f"{row['method']} {name}",
            f"{row['diffuse_reflectance'][c]:.6f}",
            *("-" if row["method"] == "exact" else _percent(row[key][c]) for key in _ERRORS),
        ]
        for row in figures["rows"]
        for c, name in enumerate(figures["channels"])
    ]
    return (
        f"{figures['material']}: errors against the exact solution; {figures['photons']:,} photons "
        f"on {figures['annuli']} annuli of {figures['dr_mm']:.4g} mm\n{table(heads, rows)}"
    )


def _percent(share: float) -> str:
    """Write a share in percent; a dash where there is none."""
    return "-" if math.isnan(share) else f"{100.0 * share:.3f} %"
