"""``sssfit show`` of a kernel: provenance, pixels, energies, errors, terms, what the fit found."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ._report import percent, plain, table

if TYPE_CHECKING:
    from sssfit.kernel import SeparableKernel

_PROVENANCE = ("material", "profile_method", "photons", "seed", "version", "profile_sha256")


def kernel_figures(kernel: SeparableKernel) -> dict[str, Any]:
    """Everything that is printed, as ``--json`` has it; null where a kernel does not say.

    Terms have their signs, energies (sign times the squared sum of the pass) and the weights of the
    middle pixel, (terms, channels).
    """
    from sssfit.kernel import FORMAT

    return {
        "kind": "kernel",
        "format": FORMAT,
        **{name: kernel.meta.get(name) for name in _PROVENANCE},
        "settings": dict(kernel.meta.get("settings") or {}),
        "method": kernel.method,
        "rank": kernel.rank,
        "pixels": kernel.pixels,
        "mm_per_pixel": kernel.mm_per_pixel,
        "support_mm": kernel.support_mm,
        "channels": kernel.channels,
        "energy": kernel.energy,
        "scale": kernel.scale,
        "relative_frobenius_error": kernel.relative_frobenius_error,
        "energy_error": kernel.energy_error,
        "sign": kernel.signs,
        "term_energy": kernel.signs * kernel.weights.sum(axis=1) ** 2,
        "middle_weight": kernel.weights[:, kernel.half_pixels],
        "parameters": dict(kernel.parameters),
    }


def kernel_text(figures: Mapping[str, Any]) -> str:
    """Write the same for people."""
    parts = [_head(figures), _channels(figures), _terms(figures), _found(figures)]
    return "\n\n".join(filter(None, parts))


def _head(figures: Mapping[str, Any]) -> str:
    """Provenance and pixels."""
    photons, seed = figures["photons"], figures["seed"]
    walks = "no photons" if photons is None else f"{photons:,} photons, seed {seed}"
    sha = figures["profile_sha256"]
    rank, pixels = figures["rank"], figures["pixels"]
    return (
        f"material  {_name(figures['material'], 'unknown material')}\n"
        f"profile   {_name(figures['profile_method'], 'unknown')}, {walks}"
        f"{f', sha256 {sha[:16]}' if sha else ''}\n"
        f"fit       {_name(figures['method'], '')}, {rank} term{'s' if rank > 1 else ''}"
        f"{_pairs(figures['settings'], ', ')}, "
        f"sssfit {_name(figures['version'], 'version unknown')}\n"
        f"pixels    {pixels} x {pixels} of {figures['mm_per_pixel']:.6g} mm, the outermost "
        f"{figures['support_mm']:.6g} mm from the axis"
    )


def _channels(figures: Mapping[str, Any]) -> str:
    """One line a channel: energies and errors."""
    rows = [
        [
            name,
            f"{figures['energy'][c]:.6f}",
            f"{figures['scale'][c]:.6g}",
            _share(figures["relative_frobenius_error"][c], ".3g"),
            _share(figures["energy_error"][c], "+.2g"),
        ]
        for c, name in enumerate(figures["channels"])
    ]
    return table(["channel", "energy", "scale", "Frobenius error", "energy error"], rows)


def _terms(figures: Mapping[str, Any]) -> str:
    """One line a channel and term."""
    rows = [
        [
            f"{name} {t + 1}",
            "+" if figures["sign"][t][c] > 0 else "-",
            f"{figures['term_energy'][t][c]:.6f}",
            f"{figures['middle_weight'][t][c]:.6f}",
        ]
        for c, name in enumerate(figures["channels"])
        for t in range(figures["rank"])
    ]
    return table(["channel, term", "sign", "energy", "middle pixel of the pass"], rows)


def _found(figures: Mapping[str, Any]) -> str:
    """One line a channel: what the fit found."""
    lines = [
        f"{_name(name, '')}:{_pairs(found, '  ') if isinstance(found, Mapping) else f' {found}'}"
        for name, found in figures["parameters"].items()
    ]
    return "\n".join(["the fit found", *lines]) if lines else ""


def _pairs(values: Mapping[str, Any], separator: str) -> str:
    """Write names and values, each after the separator."""
    return "".join(f"{separator}{_name(key, '')} {_value(each)}" for key, each in values.items())


def _value(value: Any) -> str:
    """Write numbers with six digits, lists of them in brackets, anything else as JSON has it."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(_value(each) for each in value)}]"
    return _name(value, "") if isinstance(value, str) else json.dumps(plain(value))


def _name(value: object, unknown: str) -> str:
    from sssfit.messages import printable

    return unknown if value is None else printable(str(value))


def _share(value: float, digits: str) -> str:
    return "unknown" if value != value else percent(value, digits)  # NaN: not recorded
