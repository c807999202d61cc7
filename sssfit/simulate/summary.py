"""The results of runs in words: the report that ``sssfit simulate`` prints."""

import math
from collections.abc import Sequence
from typing import Any

from sssfit.messages import SHARE, columns, counted
from sssfit.profile.checks import BALANCE_ROUNDING

_NOTED_BEYOND = 1e-3  # share of a channel beyond the grid that causes a remark
_SIGMAS = 4.5  # a deviation beyond this many standard errors is not random

Rows = Sequence[dict[str, Any]]


def summary(rows: Rows, *, several: bool) -> str:
    """Return a report on runs of one method.

    Parameters
    ----------
    rows : sequence of dict
        Figures from `sssfit.simulate.run_figures`.
    several : bool
        Whether there is more than one material; then the report begins with their number.
    """
    lines = [
        _heading(rows, several=several),
        _table(rows),
        *(
            f"absorbed by layer, {name}: {', '.join(f'{each[c]:.6f}' for each in layers)}"
            for name, row, c in _channels(rows)
            if (layers := row["absorbed_by_layer"]) is not None and len(layers) > 1
        ),
        *energy_lines(rows),
        *_beyond(rows),
        *_target(rows),
    ]
    return "\n".join(lines)


def _channels(rows: Rows) -> list[tuple[str, dict[str, Any], int]]:
    """Yield each channel of each row: its name with that of the material, the row, its index."""
    return [
        (f"{row['material']} {name}", row, c)
        for row in rows
        for c, name in enumerate(row["channels"])
    ]


def _heading(rows: Rows, *, several: bool) -> str:
    """Return lines with the material, the method, the speed and the grid."""
    row = rows[0]
    if several:
        return f"{counted(len(rows), 'material')}: {_how(rows)}{_under(row)}"
    seconds, rate, annuli = row["seconds"], row["photons_per_second"], row["annuli"]
    speed = "" if seconds is None else f", {seconds:.1f} s"
    speed += f" ({rate:,.0f} a second)" if rate else ""
    return (
        f"{row['material']}: {_how(rows)}{_under(row)}{speed}; {counted(annuli, 'annulus')} of "
        f"{row['dr_mm']:.4g} mm, "
        f"to {annuli * row['dr_mm']:.4g} mm"
    )


def _under(row: dict[str, Any]) -> str:
    """Return text on a beam that is not a pencil, on an aperture, and on exit angles."""
    beam = f", under the beam {row['beam']} mm" if "beam" in row else ""
    aperture = row.get("numerical_aperture")
    beam += f", within a numerical aperture of {aperture:g}" if aperture is not None else ""
    return beam + (f", {counted(row['angles'], 'exit angle')}" if "angles" in row else "")


def _how(rows: Rows) -> str:
    """Return text on the number of photons, or on the computation."""
    row = rows[0]
    if row["photons"] is not None:
        counts = sorted({each["photons"] for each in rows})
        photons = " to ".join(f"{n:,}" for n in counts[:: len(counts) - 1 or 1])
        return f"{photons} photons, seed {row['seed']}"
    words = str(row["method"]) + _solvers(rows)
    if row.get("tolerance") is not None:
        reached = max(each["relative_error"] or 0.0 for each in rows)
        words += f" to {100.0 * reached:.1g} % of the total"
    words += ", for isotropic scattering of (1 - g) sigma_s" if row.get("similarity") else ""
    return words + (f" ({row['mapping']})" if row.get("mapping") else "")


def _solvers(rows: Rows) -> str:
    """Return which of the exact solvers was chosen, and how many directions it took."""
    names = sorted({each["solver"] for each in rows if each.get("solver")})
    most = max(each.get("directions") or 0 for each in rows)
    directions = f", {most} directions" if most else ""
    return f" ({' and '.join(names)} solver{directions})" if names else ""


def _table(rows: Rows) -> str:
    """Return a line per channel, with the material's name if there are several."""
    walked = rows[0]["photons"]
    # The error of a walk has its figure's decimals; that of a computation is far smaller.
    error, form = ("std. error", ".6f") if walked else ("est. error", ".1e")
    channels = _channels(rows)
    names = [name for name, _, _ in channels] if len(rows) > 1 else rows[0]["channels"]
    is_slab = any(row["transmittance"] is not None for row in rows)

    def values(key: str, *, shown: bool = True) -> list[Any] | None:
        each = [None if row[key] is None else row[key][c] for _, row, c in channels]
        return each if shown else None

    return columns(
        "channel",
        names,
        ("diffuse reflectance", values("diffuse_reflectance"), SHARE),
        (error, values("diffuse_reflectance_stderr"), form),
        ("transmittance", values("transmittance", shown=is_slab), SHARE),
        (error, values("transmittance_stderr", shown=is_slab), form),
        ("absorbed", values("absorbed"), ".6f"),
        ("beyond grid", values("beyond_grid"), ".6f"),
    )


def energy_lines(rows: Rows) -> list[str]:
    """Return whether specular + diffuse + absorbed = 1 within the runs' own errors, as text."""
    lines = [] if len(rows) > 1 else [f"specular reflectance {rows[0]['specular_reflectance']:.6f}"]
    if any(row["energy_balance_stderr"] is None for row in rows):
        return lines
    balance, stderr, name = max(
        (
            (float(row["energy_balance"][c]), float(row["energy_balance_stderr"][c]), name)
            for name, row, c in _channels(rows)
        ),
        key=lambda each: (
            max(abs(each[0]) - BALANCE_ROUNDING, 0.0) / (_SIGMAS * each[1] + BALANCE_ROUNDING)
        ),
    )
    unfinished = max(float(each) for row in rows for each in row["unfinished"])
    parts = "specular + diffuse + absorbed"
    parts += " + transmitted" if any(row["transmittance"] is not None for row in rows) else ""
    parts += " + outside the aperture" if "outside_aperture" in rows[0] else ""
    parts += " + unfinished" if unfinished > 0.0 else ""
    if not rows[0]["photons"]:
        return [*lines, f"energy: {parts} = 1 to {abs(balance):.0e} (worst channel, {name})"]
    within = abs(balance) <= _SIGMAS * stderr + BALANCE_ROUNDING
    lines.append(
        f"energy: {parts} = 1 {'within' if within else 'NOT WITHIN'} the run's own error: "
        f"{balance:+.1e}, standard error {max(stderr, BALANCE_ROUNDING):.0e} "
        f"(worst channel, {name})"
    )
    return [*lines, *([f"unfinished, at most: {unfinished:.6f}"] if unfinished > 0.0 else [])]


def _beyond(rows: Rows) -> list[str]:
    """Return a remark on channels with a noticeable share beyond the grid."""
    lost = [
        f"{name} {100.0 * share:.1f} %"
        for name, row, c in _channels(rows)
        if (total := row["diffuse_reflectance"][c]) > 0.0
        and (share := row["beyond_grid"][c] / total) > _NOTED_BEYOND
    ]
    remedy = '`radius_mm = "auto"`' if rows[0]["photons"] else "`radius_mm`"
    shares = ", ".join(lost)
    return [f"beyond the grid, as a share of diffuse: {shares} ({remedy})"] if lost else []


def _target(rows: Rows) -> list[str]:
    """Return text on the target error and the photons it took."""
    target = rows[0]["target_error"]
    if target is None:
        return []
    error = max(
        math.inf if row["relative_error"] is None else row["relative_error"] for row in rows
    )
    photons = " and ".join(dict.fromkeys(f"{row['photons']:,}" for row in rows))
    return [
        f"target error {100.0 * target:g} % of F at the last edge: "
        f"{'met' if error < target else 'NOT MET'} with {photons} photons, "
        f"{100.0 * error:.3g} % reached"
    ]
