"""The figures of ``sssfit render``, for people and for programs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ._report import percent, table

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from sssfit.compare.judge import Judgement
    from sssfit.kernel import SeparableKernel
    from sssfit.scene.record import Scene

    FloatArray = npt.NDArray[np.float64]

_SCORES = (
    *("rmse", "relative_l2", "maximum", "psnr_db", "energy_drift"),
    *("delta_e_2000_mean", "delta_e_2000_p95", "delta_e_2000_p99", "share_above_1"),
    *("exposure", "ssim", "flip"),
)


def figures_of(
    result: Judgement, scene: Scene, kernel: SeparableKernel, through: FloatArray | None
) -> dict[str, Any]:
    """Everything that is printed, as ``--json`` has it; null where nothing was measured.

    ``through`` (H, W, C) is what arrives through the object, where that was asked for.
    """
    cost = result.cost
    return {
        "material": kernel.meta.get("material"),
        "method": kernel.method,
        "rank": kernel.rank,
        "channels": list(kernel.channels),
        "irradiance": scene.name,
        "width": scene.width,
        "height": scene.height,
        "mm_per_pixel": scene.mm_per_pixel,
        "passes": cost.passes,
        "taps_per_pixel": cost.taps_per_pixel,
        "kernel_bytes": cost.kernel_bytes,
        "seconds_per_megapixel": cost.seconds_per_megapixel,
        "transmitted_maximum": None if through is None else through.max(axis=(0, 1)),
        "radial_asymmetry": result.asymmetry,
        "true_radial_asymmetry": result.true_asymmetry,
        **{key: getattr(result.score, key, None) for key in _SCORES},
    }


def text_of(figures: Mapping[str, Any]) -> str:
    """Write the figures for people."""
    how = f"{figures['border']} borders"
    if figures["follow"]:
        how = f"screen space, follow {figures['follow']}, {how}"
    lines = [
        f"{figures['irradiance']}: {figures['width']} x {figures['height']} pixels of "
        f"{figures['mm_per_pixel']:.4g} mm, {how}; {figures['kernel']}",
        f"cost: {figures['passes']} passes, {figures['taps_per_pixel']} weights a pixel, "
        f"{figures['kernel_bytes']:,} bytes, {figures['seconds_per_megapixel']:.2g} s a megapixel",
    ]
    if figures["transmitted_maximum"] is not None:
        most = zip(figures["channels"], figures["transmitted_maximum"], strict=True)
        words = ", ".join(f"{name} {value:.3g}" for name, value in most)
        lines.append(f"through the object at most: {words}, face on the key light is 1")
    if figures["rmse"] is not None:
        lines += _measured(figures)
    if figures["difference_gain"] is not None:
        lines.append(_difference(figures))
    return "\n".join([*lines, f"Wrote {', '.join(figures['output'])}"])


def _measured(figures: Mapping[str, Any]) -> list[str]:
    """Lines of what was lost against the truth."""
    lines = [
        f"against the 2D kernel of {figures['profile']}:",
        f"  {_colours(figures)}",
        f"  relative L2 {100.0 * figures['relative_l2']:.3g} %, RMSE {figures['rmse']:.3g}, "
        f"largest {figures['maximum']:.3g}, PSNR {figures['psnr_db']:.1f} dB",
    ]
    if figures["ssim"] is not None:
        lines.append(f"  SSIM {figures['ssim']:.4f}, FLIP {figures['flip']:.4f}")
    rows = [
        [name, percent(drift), *("-" if math.isnan(each) else f"{each:.3g}" for each in both)]
        for name, drift, *both in zip(
            figures["channels"],
            figures["energy_drift"],
            figures["radial_asymmetry"],
            figures["true_radial_asymmetry"],
            strict=True,
        )
    ]
    heads = ["channel", "energy drift", "radial asymmetry", "of the true kernel"]
    return [*lines, table(heads, rows)]


def _difference(figures: Mapping[str, Any]) -> str:
    """Say what the written difference shows."""
    kind, end = figures["difference_map"], f"{figures['difference_end'] or 0.0:.3g}"
    if kind is None:
        return f"difference: absolute, {figures['difference_gain']:.4g} times"
    if kind == "signed":
        return f"difference map: {figures['difference_of']}, blue -{end}, white 0, red {end}"
    return f"difference map: {figures['difference_of']}, violet 0, green to yellow {end}"


def _colours(figures: Mapping[str, Any]) -> str:
    """Say how far colours are off; only 1 and 3 channels have any."""
    if math.isnan(figures["delta_e_2000_mean"]):
        return f"no Delta E: {len(figures['channels'])} channels are no colour"
    return (
        f"Delta E 2000 mean {figures['delta_e_2000_mean']:.3g}, 95th percentile "
        f"{figures['delta_e_2000_p95']:.3g}, 99th {figures['delta_e_2000_p99']:.3g}, "
        f"{percent(figures['share_above_1'], '.2g')} of pixels above 1, at exposure "
        f"{figures['exposure']:.4g}"
    )
