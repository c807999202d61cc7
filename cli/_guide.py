"""``sssfit chart --guide``: where the guided fit looks, and what it leaves."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._figure import chart_output
from ._memory import check_memory
from ._options import Common
from ._report import finish, table

if TYPE_CHECKING:
    from sssfit.compare import Guide
    from sssfit.profile import Profile


def chart_guide(
    name: str,
    profile: Profile,
    path: Path | None,
    settings: Mapping[str, Any],
    common: Common,
    *,
    force: bool,
) -> None:
    """Draw guided fits of a channel and put them into figures; no path is stdout.

    ``settings`` are keywords of `compute_guide`; None is its default.
    """
    check_memory("figures", common.threads)
    with chart_output(path, inputs=[name], force=force) as save:
        from sssfit.compare import compute_guide

        given = {key: value for key, value in settings.items() if value is not None}
        guide = compute_guide(profile, **given)

        from sssfit.chart.guide import guide_figure

        save(guide_figure(guide))
    output = "-" if path is None else str(path)
    figures = {"command": "chart", "output": [output], "profile": name, **_figures(guide)}
    text = f"{_text(guide)}\nWrote {path or 'a PNG to stdout'}"
    finish(common, figures, text, to_stderr=path is None)


def _figures(guide: Guide) -> dict[str, Any]:
    """Figures of the fits, as ``--json`` prints them: a value for each k."""
    return {
        "channel": guide.profile.channels[guide.channel],
        "mm_per_pixel": guide.mm_per_pixel,
        "pixels": guide.pixels,
        "k": guide.ks,
        "centre_share": guide.centre_share,
        "preintegrated_centre_share": guide.preintegrated[0],
        "misplaced": guide.misplaced,
        "relative_frobenius_error": guide.relative_frobenius_error,
        "weighted_residual": guide.weighted_residual,
        "preintegrated_misplaced": guide.preintegrated_misplaced,
        "preintegrated_frobenius_error": guide.preintegrated_errors[0],
        "preintegrated_weighted_residual": guide.preintegrated_errors[1],
    }


def _text(guide: Guide) -> str:
    """Write the same for people: one line a k."""
    heads = ["k", "middle pixel", "misplaced", "Frobenius error", "weighted misfit"]
    columns = (
        guide.centre_share,
        guide.misplaced,
        guide.relative_frobenius_error,
        guide.weighted_residual,
    )
    rows = [
        [f"{k:g}", *(f"{100.0 * each[i]:.2f} %" for each in columns)]
        for i, k in enumerate(guide.ks)
    ]
    line = (guide.preintegrated[0], guide.preintegrated_misplaced, *guide.preintegrated_errors)
    rows.append(["pre-integrated", *(f"{100.0 * each:.2f} %" for each in line)])
    return (
        f"Channel {guide.profile.channels[guide.channel]}; {guide.pixels} x {guide.pixels} pixels "
        f"of {guide.mm_per_pixel:.4g} mm\n{table(heads, rows)}"
    )
