"""The figures of ``sssfit render``, for people and for programs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from sssfit.messages import columns, number

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from sssfit.compare.judge import Judgement
    from sssfit.kernel import SeparableKernel
    from sssfit.scene.record import Scene

    FloatArray = npt.NDArray[np.float64]


def figures_of(
    result: Judgement, scene: Scene, kernel: SeparableKernel, through: FloatArray | None
) -> dict[str, Any]:
    """Everything that is printed, as ``--json`` has it; null where nothing was measured.

    ``through`` (H, W, C) is what arrives through the object, where that was asked for.
    """
    return {
        "material": kernel.meta.get("material"),
        "method": kernel.method,
        "rank": kernel.rank,
        "channels": list(kernel.channels),
        "irradiance": scene.name,
        "width": scene.width,
        "height": scene.height,
        "mm_per_pixel": scene.mm_per_pixel,
        **asdict(result.cost),
        "transmitted_maximum": None if through is None else through.max(axis=(0, 1)),
        **result.to_dict(),
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
        f"  relative L2 {number(figures['relative_l2'], '.3g%|inf %')}, RMSE "
        f"{figures['rmse']:.3g}, largest {figures['maximum']:.3g}, PSNR "
        f"{number(figures['psnr_db'], '.1f|inf')} dB",
    ]
    if figures["ssim"] is not None:
        lines.append(f"  SSIM {figures['ssim']:.4f}, FLIP {figures['flip']:.4f}")
    drifts = columns(
        "channel",
        figures["channels"],
        ("energy drift", figures["energy_drift"], "+.2g%|inf %"),
        ("radial asymmetry", figures["radial_asymmetry"], ".3g"),
        ("of the true kernel", figures["true_radial_asymmetry"], ".3g"),
    )
    return [*lines, drifts]


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
    if figures["delta_e_2000_mean"] is None:
        return f"no Delta E: {len(figures['channels'])} channels are no colour"
    return (
        f"Delta E 2000 mean {figures['delta_e_2000_mean']:.3g}, 95th percentile "
        f"{figures['delta_e_2000_p95']:.3g}, 99th {figures['delta_e_2000_p99']:.3g}, "
        f"{number(figures['share_above_1'], '.2g%')} of pixels above 1, at exposure "
        f"{figures['exposure']:.4g}"
    )
