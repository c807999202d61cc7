"""What the verbs print of their results: lines and tables by the keys of their JSON objects.

The figures that a record's ``to_dict`` returns fill them: for verbs in `page`, for charts in the
functions that ``sssfit.methods.VIEWS`` names.
"""

from collections.abc import Callable, Mapping
from typing import Any

from sssfit.messages import Columns, Part, by_channel, counted, report
from sssfit.methods import MEASURES

_FIGURES = {"p95": "95th percentile", "p99": "99th percentile", "mean": "mean"}

# fmt: off
_KERNEL: tuple[Part, ...] = (
    "{method}, rank {rank}, {pixels} x {pixels} pixels of {mm_per_pixel:.4g} mm; {against}",
    Columns("channel", "channels", (
        ("energy", "energy", ".6f"),
        ("energy error", "energy_error", "+.2g%|unknown"),
        ("Frobenius error", "relative_frobenius_error", ".3g%|unknown"),
        ("misplaced", "misplaced", ".3g%"),
    )),
)
_SPECTRUM: tuple[Part, ...] = (
    "Share of the first singular value; {pixels} x {pixels} pixels of {mm_per_pixel:.4g} mm",
    Columns("channel", "channels", (
        ("first, squared", "first_squared", ".2f%"),
        ("first, absolute", "first_absolute", ".2f%"),
        ("terms for an error of 1 %", "rank_for_1_percent", ""),
    )),
)
_FREQUENCY: tuple[Part, ...] = (
    "R(k) at {frequencies:,} frequencies, from 0 to {last:.3g} rad/mm",
    Columns("channel", "channels", (
        ("R(0)", "total", ".6f"),
        ("half at k, rad/mm", "half", ".3g|not reached"),
        ("a tenth at k, rad/mm", "tenth", ".3g|not reached"),
    )),
)
_ANGLES: tuple[Part, ...] = (
    "R_d in {bins} bins of the exit angle; misplaced: by angle, against cos times Fresnel",
    Columns("channel", "channels", (
        ("first bin, 1/sr", "first", ".5f"),
        ("misplaced", "misplaced", ".2g%|unknown"),
        ("by noise alone", "misplaced_stderr", ".2g%|unknown"),
    )),
)
_SWATCHES: tuple[Part, ...] = (
    "{material}: {swatches:#swatch} from {wavelengths:#wavelength}, CIE 1931 observer (2°), D65",
    ("outside_srgb", "{outside_srgb:,} outside sRGB"),
    ("missing", "{missing:,} not finished"),
)
_GUIDE: tuple[Part, ...] = (
    "Channel {channel}; {pixels} x {pixels} pixels of {mm_per_pixel:.4g} mm",
    Columns("k", "fits", (
        ("middle pixel", "centre_share", ".2f%"),
        ("misplaced", "misplaced", ".2f%"),
        ("Frobenius error", "relative_frobenius_error", ".2f%"),
        ("weighted misfit", "weighted_residual", ".2f%"),
    )),
)
_MODELS: tuple[Part, ...] = (
    "{material}: errors against the exact solution; {photons:,#photon} on {annuli:#annulus} of "
    "{dr_mm:.4g} mm",
    Columns("method, channel", "curves", (
        ("diffuse reflectance", "diffuse_reflectance", ".6f"),
        ("error", "total_error", ".3f%"),
        ("largest of F(r)", "cumulative_error", ".3f%"),
        ("L2 of R_d", "l2_error", ".3f%"),
    )),
)

_CHOSEN: tuple[Part, ...] = (
    "{material:s|unknown material} at {metres:g} m, {mm_per_pixel:.4g} mm per pixel, {asked}:",
    "{sentences}",
    "{wrote}",
)

_FITTED: tuple[Part, ...] = (
    "{material}: {method}, {rank:#term}, {pixels:#pixel} of {mm_per_pixel:.4g} "
    "mm, {seconds:.1f} s",
    Columns("channel", "channels", (
        ("Frobenius error", "relative_frobenius_error", ".3g%"),
        ("energy error", "energy_error", "+.2g%"),
        ("energy", "energy", ".6f"),
        ("ended", "stop_reason", ""),
    )),
)

_TAPS_FITTED: tuple[Part, ...] = (
    "{material}: {method} {structure}, {fetches:.4g#fetch} in {passes:#pass} on pixels of "
    "{mm_per_pixel:.4g} mm, {seconds:.1f} s",
    Columns("channel", "channels", (
        ("spectral error", "spectral_error", ".3g%"),
        ("energy error", "energy_error", "+.2g%"),
        ("energy", "energy", ".6f"),
    )),
)

_TAPS: tuple[Part, ...] = (
    "{structure}, {fetches:.4g#fetch} in {passes:#pass}; share of the energy by stage:",
    Columns("stage", "stages", (("share", "shares", ""),)),
)

_RENDERED: tuple[Part, ...] = (
    "{irradiance}: {width} x {height} pixels of {mm_per_pixel:.4g} mm, {how}; {kernel}",
    "cost: {price} and {bytes_per_pixel:.4g} bytes moved a pixel in {passes:#pass}, "
    "{kernel_bytes:,} bytes stored, {seconds_per_megapixel:.2g} s a megapixel",
    ("transmitted_maximum", "through the object at most: {most}, face on the key light is 1"),
    ("rmse", "against the 2D kernel of {profile}:"),
    ("delta_e_2000_mean", "  Delta E 2000 mean {delta_e_2000_mean:.3g}, 95th percentile "
     "{delta_e_2000_p95:.3g}, 99th {delta_e_2000_p99:.3g}, {share_above_1:.2g%} of pixels above 1, "
     "at exposure {exposure:.4g}"),
    ("no_colour", "  no Delta E: {no_colour}"),
    ("rmse", "  relative L2 {relative_l2:.3g%|inf %}, RMSE {rmse:.3g}, largest {maximum:.3g}, PSNR "
     "{psnr_db:.1f|inf} dB"),
    (next(iter(MEASURES)), "  " + ", ".join(f"{each.summary} {{{name}:.4f}}" for name, each in
     MEASURES.items())),
    ("rmse", Columns("channel", "channels", (
        ("energy drift", "energy_drift", "+.2g%|inf %"),
        ("radial asymmetry", "radial_asymmetry", ".3g"),
        ("of the true kernel", "true_radial_asymmetry", ".3g"),
    ))),
    ("magnified", "difference: absolute, {magnified:.4g} times"),
    ("signed", "difference map: {difference_of}, blue -{signed:.3g}, white 0, red {signed:.3g}"),
    ("absolute", "difference map: {difference_of}, violet 0, green to yellow {absolute:.3g}"),
    "Wrote {wrote}",
)
# fmt: on


def _chosen_words(figures: Mapping[str, Any]) -> dict[str, Any]:
    """Say which figure the tolerance is of, how far away the camera is, and what was written."""
    written = figures["output"]
    return {
        "metres": figures["distance_mm"] / 1000.0,
        "asked": _asked_words(figures),
        "wrote": f"Wrote {', '.join(written)}" if written else "No kernel is written.",
    }


def _asked_words(figures: Mapping[str, Any]) -> str:
    """Say what was asked for: an error, the least of it, and within which budgets."""
    figure, tolerance = _FIGURES[figures["tolerance_of"]], figures["tolerance"]
    text = f"least {figure} of Delta E"
    if tolerance is not None:
        text = f"{figure} of Delta E within {tolerance:g}"
    for key, unit in (("most_fetches", "fetch"), ("most_passes", "pass")):
        if figures[key] is not None:
            text += f", at most {counted(figures[key], unit, 'g')}"
    return text


def taps_page(figures: Mapping[str, Any]) -> str:
    """Return the shares of the energy that the irradiance and each stage have, by channel."""
    energy, rows = figures["energy"], figures["stage_energy"]
    shares = [
        [each / total if total else 0.0 for each, total in zip(row, energy, strict=True)]
        for row in rows
    ]
    columns = {
        "stages": ["irradiance", *map(str, range(1, len(rows)))],
        "shares": [by_channel(figures["channels"], row, ".3g%") for row in shares],
    }
    return report(_TAPS, {**figures, **columns})


def _rendered_words(figures: Mapping[str, Any]) -> dict[str, Any]:
    """Say how it was rendered, and what the difference shows."""
    kind, most = figures["difference_map"], figures["transmitted_maximum"]
    screen = f"screen space, follow {figures['follow']}, " if figures["follow"] else ""
    stored = f", {figures['intermediate']} between passes" if figures["intermediate"] else ""
    is_grey = figures["rmse"] is not None and figures["delta_e_2000_mean"] is None
    return {
        "price": counted(figures["fetches"], "weight" if figures["rank"] else "fetch", ".4g"),
        "how": f"{screen}{figures['border']} borders{stored}",
        "most": by_channel(figures["channels"], most, ".3g") if most is not None else None,
        "no_colour": _no_colour(len(figures["channels"])) if is_grey else None,
        "magnified": figures["difference_gain"] if kind is None else None,
        "signed": figures["difference_end"] if kind == "signed" else None,
        "absolute": figures["difference_end"] if kind == "absolute" else None,
        "wrote": ", ".join(figures["output"]),
    }


def _no_colour(channels: int) -> str:
    """Say why there is no Delta E."""
    return f"{counted(channels, 'channel')} {'is' if channels == 1 else 'are'} no colour"


def kernel_page(figures: Mapping[str, Any]) -> str:
    """Return a kernel's errors, and what they are against."""
    profile = figures["profile"]
    against = f"against {profile}" if profile else "errors as the fit recorded them"
    return report(_KERNEL, {**figures, "against": against})


def spectrum_page(figures: Mapping[str, Any]) -> str:
    """Return the shares of a kernel's first term, and how many terms an error of 1 % takes."""
    first = {f"first_{key}": figures[f"{key}_share"][0] for key in ("squared", "absolute")}
    return report(_SPECTRUM, {**figures, **first})


def frequency_page(figures: Mapping[str, Any]) -> str:
    """Return the total of a response, and where it is a half and a tenth of it."""
    rows = figures["rows"]
    totals = rows[0]["response"]

    def where(share: float) -> list[float | None]:
        return [_fallen(rows, c, share * total) for c, total in enumerate(totals)]

    found = {"total": totals, "half": where(0.5), "tenth": where(0.1)}
    found |= {"frequencies": len(rows), "last": rows[-1]["k_per_mm"]}
    return report(_FREQUENCY, {**figures, **found})


def swatches_page(figures: Mapping[str, Any]) -> str:
    """Return the number of swatches, and of those that are no colour of a screen or missing."""
    swatches = 1
    for values in figures["axes"].values():
        swatches *= len(values)
    told = {key: figures[key] or None for key in ("outside_srgb", "missing")}
    told |= {"swatches": swatches, "wavelengths": len(figures["wavelengths_nm"])}
    return report(_SWATCHES, {**figures, **told})


def angles_page(figures: Mapping[str, Any]) -> str:
    """Return the number of bins, the light of the first, next to the normal, and what differs."""
    rows = figures["rows"]
    return report(_ANGLES, {**figures, "bins": len(rows), "first": rows[0]["per_sr"]})


def _fallen(rows: list[dict[str, Any]], channel: int, least: float) -> float | None:
    """Return the first frequency from which a channel's response is below a value."""
    below = (row["k_per_mm"] for row in rows if row["response"][channel] < least)
    return next(below, None)


def guide_page(figures: Mapping[str, Any]) -> str:
    """Return what guided fits leave, the pre-integrated one last."""
    last = {
        "centre_share": "preintegrated_centre_share",
        "misplaced": "preintegrated_misplaced",
        "relative_frobenius_error": "preintegrated_frobenius_error",
        "weighted_residual": "preintegrated_weighted_residual",
    }
    names = [*(f"{k:g}" for k in figures["k"]), "pre-integrated"]
    columns = {key: [*figures[key], figures[own]] for key, own in last.items()}
    return report(_GUIDE, {**figures, "fits": names, **columns})


def models_page(figures: Mapping[str, Any]) -> str:
    """Return the methods' errors, a row a method and channel; the exact one has none."""
    rows = [(row, c) for row in figures["rows"] for c in range(len(figures["channels"]))]
    found = {
        key: [None if row["method"] == "exact" else row[key][c] for row, c in rows]
        for key in ("total_error", "cumulative_error", "l2_error")
    }
    found["diffuse_reflectance"] = [row["diffuse_reflectance"][c] for row, c in rows]
    found["curves"] = [f"{row['method']} {figures['channels'][c]}" for row, c in rows]
    return report(_MODELS, {**figures, **found})


# By what is told, and what the words of its lines add to the figures.
_PAGES: dict[str, tuple[tuple[Part, ...], Callable[[Mapping[str, Any]], dict[str, Any]]]] = {
    "choose": (_CHOSEN, _chosen_words),
    "fit": (_FITTED, dict),
    "render": (_RENDERED, _rendered_words),
    "fit-taps": (_TAPS_FITTED, dict),
}


def page(kind: str, figures: Mapping[str, Any]) -> str:
    """Return figures as a report.

    Parameters
    ----------
    kind : str
        "choose", "fit", "fit-taps" or "render".
    figures : mapping
        The JSON object.
    """
    parts, words = _PAGES[kind]
    return report(parts, {**figures, **words(figures)})
