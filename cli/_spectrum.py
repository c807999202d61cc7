"""``sssfit chart --spectrum``: how much of a kernel each of its separable terms holds."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._figure import chart_output
from ._memory import check_memory
from ._options import Common
from ._report import finish, table

if TYPE_CHECKING:
    from sssfit.compare import Spectrum
    from sssfit.fit import Pitch
    from sssfit.profile import Profile

_MOST = 12  # terms in figures; the chart shows as many


def chart_spectrum(
    name: str,
    profile: Profile,
    path: Path | None,
    mm_per_pixel: Pitch | None,
    common: Common,
    *,
    force: bool,
) -> None:
    """Draw the spectrum of a profile's kernel and put it into figures; no path is stdout."""
    check_memory("figures", common.threads)
    with chart_output(path, inputs=[name], force=force) as save:
        from sssfit.compare import compute_spectrum

        spectrum = compute_spectrum(profile, mm_per_pixel=mm_per_pixel)

        from sssfit.chart.spectrum import spectrum_figure

        save(spectrum_figure(spectrum))
    output = "-" if path is None else str(path)
    figures = {"command": "chart", "output": [output], "profile": name, **_figures(spectrum)}
    text = f"{_text(spectrum)}\nWrote {path or 'a PNG to stdout'}"
    finish(common, figures, text, to_stderr=path is None)


def _figures(spectrum: Spectrum) -> dict[str, Any]:
    """Figures of the spectrum, as ``--json`` prints them: terms by channels."""
    return {
        "channels": spectrum.profile.channels,
        "mm_per_pixel": spectrum.mm_per_pixel,
        "pixels": spectrum.pixels,
        "eigenvalues": spectrum.values[:_MOST],
        "squared_share": spectrum.squared_share[:_MOST],
        "absolute_share": spectrum.absolute_share[:_MOST],
        "rank_for_1_percent": [
            spectrum.rank_for(0.01, c) for c in range(spectrum.profile.n_channels)
        ],
    }


def _text(spectrum: Spectrum) -> str:
    """Write the same for people: one line a channel."""
    heads = ["channel", "first, squared", "first, absolute", "terms for an error of 1 %"]
    rows = [
        [
            channel,
            f"{100.0 * spectrum.squared_share[0, c]:.2f} %",
            f"{100.0 * spectrum.absolute_share[0, c]:.2f} %",
            str(spectrum.rank_for(0.01, c)),
        ]
        for c, channel in enumerate(spectrum.profile.channels)
    ]
    return (
        f"Share of the first singular value; {spectrum.pixels} x {spectrum.pixels} pixels of "
        f"{spectrum.mm_per_pixel:.4g} mm\n{table(heads, rows)}"
    )
