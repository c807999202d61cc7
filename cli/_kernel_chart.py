"""``sssfit chart`` of a kernel: beside the profile it was fitted to, if that is here."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._figure import chart_output
from ._memory import check_memory
from ._options import Common
from ._report import finish, percent, table
from ._truth import true_profile

if TYPE_CHECKING:
    from sssfit.compare import KernelView
    from sssfit.kernel import SeparableKernel


def chart_kernel(
    name: str,
    kernel: SeparableKernel,
    path: Path | None,
    given: str | None,
    channel: str | None,
    common: Common,
    *,
    force: bool,
) -> None:
    """Draw a kernel and put it into figures; ``given`` is its profile's file, no path is stdout."""
    check_memory("kernel chart", common.threads)
    profile, source = true_profile(kernel, name, given, common)
    with chart_output(path, inputs=[name, source], force=force) as save:
        from sssfit.compare import view_kernel

        view = view_kernel(kernel, profile, channels=None if channel is None else [channel])

        from sssfit.chart.kernel import kernel_figure

        save(kernel_figure(view))
    figures = {
        "command": "chart",
        "output": ["-" if path is None else str(path)],
        "kind": "kernel",
        "file": name,
        "profile": source,
        **_figures(view),
    }
    text = f"{_text(figures)}\nWrote {path or 'a PNG to stdout'}"
    finish(common, figures, text, to_stderr=path is None)


def _figures(view: KernelView) -> dict[str, Any]:
    """Figures of the kernel, as ``--json`` prints them: a value for each channel that is drawn."""
    kernel = view.kernel
    return {
        "material": kernel.meta.get("material"),
        "method": kernel.method,
        "rank": kernel.rank,
        "pixels": kernel.pixels,
        "mm_per_pixel": kernel.mm_per_pixel,
        "channels": [kernel.channels[c] for c in view.channels],
        "energy": view.energy,
        "energy_error": view.energy_error,
        "relative_frobenius_error": view.relative_frobenius_error,
        "misplaced": view.misplaced,
    }


def _text(figures: Mapping[str, Any]) -> str:
    """Write the same for people: one line a channel."""
    heads = ["channel", "energy", "energy error", "Frobenius error"]
    columns = [
        [f"{each:.6f}" for each in figures["energy"]],
        [_share(each, "+.2g") for each in figures["energy_error"]],
        [_share(each, ".3g") for each in figures["relative_frobenius_error"]],
    ]
    if figures["misplaced"] is not None:
        heads.append("misplaced")
        columns.append([_share(each, ".3g") for each in figures["misplaced"]])
    rows = [list(row) for row in zip(figures["channels"], *columns, strict=True)]
    against = (
        "errors as the fit recorded them"
        if figures["profile"] is None
        else f"against {figures['profile']}"
    )
    return (
        f"{figures['method']}, rank {figures['rank']}, {figures['pixels']} x {figures['pixels']} "
        f"pixels of {figures['mm_per_pixel']:.4g} mm; {against}\n{table(heads, rows)}"
    )


def _share(value: float, digits: str) -> str:
    return "unknown" if value != value else percent(value, digits)  # NaN: not recorded
