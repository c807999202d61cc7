"""``sssfit show`` of a kernel: provenance, pixels, energies, errors, terms, what the fit found."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from sssfit.messages import columns, table


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
    return columns(
        "channel",
        figures["channels"],
        ("energy", figures["energy"], ".6f"),
        ("scale", figures["scale"], ".6g"),
        ("Frobenius error", figures["relative_frobenius_error"], ".3g%|unknown"),
        ("energy error", figures["energy_error"], "+.2g%|unknown"),
    )


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
    return _name(value, "") if isinstance(value, str) else json.dumps(value)


def _name(value: object, unknown: str) -> str:
    from sssfit.messages import printable

    return unknown if value is None else printable(str(value))
