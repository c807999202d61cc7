"""What a simulation found, for people and for programs."""

from __future__ import annotations

import math
from typing import Any

from sssfit.messages import number, table

from ._options import Common
from ._output import finish

_NOTED_BEYOND = 1e-3  # share of a channel beyond the grid that is worth a remark
_SIGMAS = 4.5  # a deviation beyond so many standard errors is no accident
_ROUNDING = 1e-12  # below this an energy balance is rounding, not roulette


def report(rows: list[dict[str, Any]], *, several: bool, common: Common, interrupted: bool) -> None:
    """Print figures to stdout; to stderr where a profile itself went to stdout."""
    output = [row.pop("path") for row in rows]
    figures: dict[str, Any] = {"command": "simulate", "output": output}
    figures |= {"rows": rows} if several else rows[0]
    if interrupted:
        figures["interrupted"] = True
    lines = [
        _heading(rows, several),
        _table(rows),
        *_layers(rows),
        *_energy(rows),
        *_beyond(rows),
        *_target(rows),
    ]
    text = "\n".join([*lines, *_files(rows, output)])
    finish(common, figures, text, to_stderr=output == ["-"])


def _files(rows: list[dict[str, Any]], output: list[str]) -> list[str]:
    """Which profiles were written, and which had nothing left to do."""
    if output == ["-"]:
        return ["Wrote the profile to stdout"]
    lines = []
    for start, wanted in (("Wrote", False), ("Finished before, nothing to do:", True)):
        paths = [
            path for row, path in zip(rows, output, strict=True) if row["finished_before"] is wanted
        ]
        lines += [f"{start} {', '.join(paths)}"] if paths else []
    return lines


def _heading(rows: list[dict[str, Any]], several: bool) -> str:
    """Who, by what method, how fast, on which grid."""
    row = rows[0]
    if several:
        return f"{len(rows)} materials: {_how(rows)}"
    seconds, rate = row["seconds"], row["photons_per_second"]
    speed = "" if seconds is None else f", {seconds:.1f} s"
    speed += f" ({rate:,.0f} a second)" if rate else ""
    return (
        f"{row['material']}: {_how(rows)}{speed}; {row['annuli']} annuli of {row['dr_mm']:.4g} mm, "
        f"to {row['annuli'] * row['dr_mm']:.4g} mm"
    )


def _how(rows: list[dict[str, Any]]) -> str:
    """Say how many photons were traced, or what was computed."""
    row = rows[0]
    if row["photons"] is None:
        tolerance, mapping = row.get("tolerance"), row.get("mapping")
        reached = max(each["relative_error"] or 0.0 for each in rows)
        within = "" if tolerance is None else f" to {100.0 * reached:.1g} % of the total"
        if row.get("similarity"):
            within += ", for isotropic scattering of (1 - g) sigma_s"
        return f"{row['method']}{within}{f' ({mapping})' if mapping else ''}"
    counts = sorted({each["photons"] for each in rows})
    photons = " to ".join(f"{n:,}" for n in counts[:: len(counts) - 1 or 1])
    return f"{photons} photons, seed {row['seed']}"


def _table(rows: list[dict[str, Any]]) -> str:
    """One line a channel; the material's name where there are several."""
    slab = any(row["transmittance"] is not None for row in rows)
    error = "std. error" if rows[0]["photons"] else "est. error"
    heads = ["channel", "diffuse reflectance", error]
    heads += ["transmittance", error] if slab else []
    heads += ["absorbed", "beyond grid"]
    lines = [
        [
            name if len(rows) == 1 else f"{row['material']} {name}",
            f"{row['diffuse_reflectance'][c]:.6f}",
            _error(row, "diffuse_reflectance_stderr", c),
            *(_transmitted(row, c) if slab else []),
            "-" if row["absorbed"] is None else f"{row['absorbed'][c]:.6f}",
            f"{row['beyond_grid'][c]:.6f}",
        ]
        for row in rows
        for c, name in enumerate(row["channels"])
    ]
    return table(heads, lines)


def _transmitted(row: dict[str, Any], channel: int) -> list[str]:
    """Transmittance and its error; dashes for a half space among slabs."""
    if row["transmittance"] is None:
        return ["-", "-"]
    return [f"{row['transmittance'][channel]:.6f}", _error(row, "transmittance_stderr", channel)]


def _error(row: dict[str, Any], key: str, channel: int) -> str:
    """Write a walk's error in its figure's decimals, that of a computation, far smaller, alone."""
    return (
        "-" if row[key] is None else number(row[key][channel], ".6f" if row["photons"] else ".1e")
    )


def _layers(rows: list[dict[str, Any]]) -> list[str]:
    """Energy absorbed in each layer, where there are several."""
    return [
        f"absorbed by layer, {row['material']} {name}: "
        + ", ".join(f"{each[c]:.6f}" for each in row["absorbed_by_layer"])
        for row in rows
        for c, name in enumerate(row["channels"])
        if row["absorbed_by_layer"] is not None and len(row["absorbed_by_layer"]) > 1
    ]


def _energy(rows: list[dict[str, Any]]) -> list[str]:
    """Say whether specular + diffuse + absorbed = 1 within the runs' own error, where known."""
    lines = [] if len(rows) > 1 else [f"specular reflectance {rows[0]['specular_reflectance']:.6f}"]
    if any(row["energy_balance_stderr"] is None for row in rows):
        return lines
    balance, stderr, name = max(
        (
            (float(balance), float(stderr), f"{row['material']} {name}")
            for row in rows
            for balance, stderr, name in zip(
                row["energy_balance"], row["energy_balance_stderr"], row["channels"], strict=True
            )
        ),
        key=lambda each: abs(each[0]) / (_SIGMAS * each[1] + _ROUNDING),
    )
    unfinished = max(float(each) for row in rows for each in row["unfinished"])
    parts = "specular + diffuse + absorbed"
    parts += " + transmitted" if any(row["transmittance"] is not None for row in rows) else ""
    parts += " + unfinished" if unfinished > 0.0 else ""
    if not rows[0]["photons"]:
        return [*lines, f"energy: {parts} = 1 to {abs(balance):.0e} (worst channel, {name})"]
    within = abs(balance) <= _SIGMAS * stderr + _ROUNDING
    lines.append(
        f"energy: {parts} = 1 {'within' if within else 'NOT WITHIN'} the run's own error: "
        f"{balance:+.1e}, standard error {max(stderr, _ROUNDING):.0e} (worst channel, {name})"
    )
    if unfinished > 0.0:
        lines.append(f"unfinished, at most: {unfinished:.6f}")
    return lines


def _beyond(rows: list[dict[str, Any]]) -> list[str]:
    """Remark on channels that lose a noticeable share beyond the grid."""
    lost = [
        f"{row['material']} {name} {100.0 * share:.1f} %"
        for row in rows
        for name, beyond, total in zip(
            row["channels"], row["beyond_grid"], row["diffuse_reflectance"], strict=True
        )
        if total > 0.0 and (share := beyond / total) > _NOTED_BEYOND
    ]
    if not lost:
        return []
    remedy = " (--radius auto)" if rows[0]["photons"] else " (--radius)"
    return ["beyond the grid, as a share of diffuse: " + ", ".join(lost) + remedy]


def _target(rows: list[dict[str, Any]]) -> list[str]:
    """Say whether the target error was met, and how many photons that took."""
    target = rows[0]["target_error"]
    if target is None:
        return []
    reached = [math.inf if row["relative_error"] is None else row["relative_error"] for row in rows]
    error, photons = max(reached), " and ".join(dict.fromkeys(f"{r['photons']:,}" for r in rows))
    return [
        f"target error {100.0 * target:g} % of F at the last edge: "
        f"{'met' if error < target else 'NOT MET'} with {photons} photons, "
        f"{100.0 * error:.3g} % reached"
    ]
