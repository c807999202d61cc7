"""What a photon walk found, for people and for programs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from ._options import Common
from ._report import finish, table

if TYPE_CHECKING:
    from sssfit.profile import Profile

_NOTED_BEYOND = 1e-3  # share of a channel beyond the grid that is worth a remark
_SIGMAS = 4.5  # a deviation beyond so many standard errors is no accident
_ROUNDING = 1e-12  # below this an energy balance is rounding, not roulette


def figures_of(profile: Profile, seconds: float | None) -> dict[str, Any]:
    """Figures of one run, as ``--json`` prints them; no seconds where it was finished before."""
    return {
        "material": profile.meta["material"]["name"],
        "method": profile.meta["method"],
        "channels": list(profile.channels),
        "diffuse_reflectance": profile.diffuse_reflectance,
        "diffuse_reflectance_stderr": profile.diffuse_reflectance_stderr,
        "specular_reflectance": profile.specular_reflectance,
        "transmittance": profile.transmittance,
        "transmittance_stderr": profile.transmittance_stderr,
        "absorbed": profile.absorbed.sum(axis=0),
        "absorbed_by_layer": profile.absorbed,
        "beyond_grid": profile.beyond_grid,
        "unfinished": profile.unfinished,
        "energy_balance": profile.energy_balance,
        "energy_balance_stderr": profile.meta["energy_balance_stderr"],
        "dr_mm": float(profile.r_edges_mm[1]),
        "annuli": profile.n_annuli,
        "photons": profile.photons,
        "seed": profile.meta["seed"],
        "seconds": seconds,
        "photons_per_second": (profile.photons or 0) / seconds if seconds else None,
        "target_error": profile.meta["settings"]["target_error"],
        "relative_error": profile.meta["relative_error"],
        "finished_before": seconds is None,
    }


def report(rows: list[dict[str, Any]], *, every: bool, common: Common, interrupted: bool) -> None:
    """Print figures to stdout; to stderr where a profile itself went to stdout."""
    output = [row.pop("path") for row in rows]
    figures: dict[str, Any] = {"command": "simulate", "output": output}
    figures |= {"rows": rows} if every else rows[0]
    if interrupted:
        figures["interrupted"] = True
    lines = [
        _heading(rows, every),
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


def _heading(rows: list[dict[str, Any]], every: bool) -> str:
    """Who, how many photons, how fast, on which grid."""
    row = rows[0]
    counts = sorted({each["photons"] for each in rows})
    walks = f"{' to '.join(f'{n:,}' for n in counts[:: len(counts) - 1 or 1])} photons, "
    walks += f"seed {row['seed']}"
    if every:
        return f"{len(rows)} materials: {walks}"
    seconds, rate = row["seconds"], row["photons_per_second"]
    speed = "" if seconds is None else f", {seconds:.1f} s ({rate:,.0f} a second)"
    return (
        f"{row['material']}: {walks}{speed}; {row['annuli']} annuli of {row['dr_mm']:.4g} mm, "
        f"to {row['annuli'] * row['dr_mm']:.4g} mm"
    )


def _table(rows: list[dict[str, Any]]) -> str:
    """One line a channel; the material's name where there are several."""
    slab = any(row["transmittance"] is not None for row in rows)
    heads = ["channel", "diffuse reflectance", "std. error"]
    heads += ["transmittance", "std. error"] if slab else []
    heads += ["absorbed", "beyond grid"]
    lines = [
        [
            name if len(rows) == 1 else f"{row['material']} {name}",
            f"{row['diffuse_reflectance'][c]:.6f}",
            f"{row['diffuse_reflectance_stderr'][c]:.6f}",
            *(_transmitted(row, c) if slab else []),
            f"{row['absorbed'][c]:.6f}",
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
    return [f"{row[key][channel]:.6f}" for key in ("transmittance", "transmittance_stderr")]


def _layers(rows: list[dict[str, Any]]) -> list[str]:
    """Energy absorbed in each layer, where there are several."""
    return [
        f"absorbed by layer, {row['material']} {name}: "
        + ", ".join(f"{each[c]:.6f}" for each in row["absorbed_by_layer"])
        for row in rows
        for c, name in enumerate(row["channels"])
        if len(row["absorbed_by_layer"]) > 1
    ]


def _energy(rows: list[dict[str, Any]]) -> list[str]:
    """Say whether specular + diffuse + absorbed = 1 within the runs' own error."""
    lines = [] if len(rows) > 1 else [f"specular reflectance {rows[0]['specular_reflectance']:.6f}"]
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
    return ["beyond the grid, as a share of diffuse: " + ", ".join(lost) + " (--radius auto)"]


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
