"""Comparisons in words and tables: rows as Markdown, CSV or JSON files, budgets, sheets."""

import csv
import io
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from sssfit.compare.comparison import Comparison, KernelRow, Picture, Verdict, verdicts
from sssfit.errors import FileError
from sssfit.files import has_mark
from sssfit.messages import counted, filled, number, table

FORMATS = (".md", ".csv", ".json")
HEADS = (
    *("kernel", "fetches", "passes", "bytes", "stored", "s/Mpixel"),
    *("Delta E", "95th", "99th", "above 1", "relative L2", "PSNR, dB"),
    *("energy drift", "asymmetry"),
)
_COST_WORDS = {
    "fetches": "fetches a pixel",
    "passes": "passes",
    "bytes": "bytes a pixel",
    "seconds": "s a megapixel",
}
_ERROR_WORDS = {
    "delta-e": "Mean Delta E",
    "p99": "99th percentile of Delta E",
    "l2": "Relative L2",
}
_FORMAT = "sssfit.table/1"
# What our files begin with, and are known by.
_MARKS = {
    ".md": f"<!-- {_FORMAT} -->\n",
    ".csv": f"# {_FORMAT}\n",
    ".json": f'{{"format": "{_FORMAT}"',
}


def check_table_name(path: Path) -> None:
    """Refuse a name whose ending is of no table.

    Raises
    ------
    FileError
    """
    if path.suffix.lower() not in FORMATS:
        raise FileError(f"{path}: tables are Markdown, CSV or JSON; end it in .md, .csv or .json.")


def kernels_text(comparison: Comparison, error: str, cost: str) -> str:
    """Write a table for each picture, sorted by cost and error, the front marked with a star."""
    parts = [setting_of(comparison)]
    for picture in comparison.pictures:
        rows = sorted_rows(comparison, picture, error, cost)
        cells = [cells_of(row, "* " if (error, cost) in row.fronts else "  ") for row in rows]
        parts.append(f"{picture_line(picture)}\n{table(['  kernel', *HEADS[1:]], cells)}")
    parts.append(f"* {front_words(error, cost)}")
    parts += left_out_lines(comparison)
    parts.append("\n".join(verdict_lines(comparison, error, cost)))
    return "\n\n".join(parts)


def fronts_text(done: Sequence[Comparison], error: str, cost: str) -> str:
    """Write the kernels that no other beats, a line a material and picture."""
    cells = []
    for comparison in done:
        name = comparison.profile.material_name or "profile"
        for picture in comparison.pictures:
            front = comparison.front(picture.name, error, cost)
            kernels = ", ".join(f"{row.label} {row.error(error):.2g}" for row in front)
            cells.append([name, picture.name, kernels])
    return table(["material", "picture", f"front of {error} by {cost}, cheapest first"], cells)


def left_out_lines(comparison: Comparison) -> list[str]:
    """Say which candidates could not be fitted, and why; a reason once."""
    labels = dict[str, list[str]]()
    for label, reason in comparison.left_out:
        labels.setdefault(reason, []).append(label)
    return [f"Left out {', '.join(those)}: {reason}" for reason, those in labels.items()]


def verdict_lines(comparison: Comparison, error: str, cost: str) -> list[str]:
    """Say in two lines which kernel to take for which budget, and how near that comes."""
    found = verdicts(comparison, error, cost)
    first, *others = found
    more = "".join(f", {each.label} from {each.cost:.4g}" for each in others)
    cheapest, closest = first, found[-1]
    far = f"{cheapest.label} {_error(cheapest.error, error)} ({cheapest.picture})"
    near = f"{closest.label} {_error(closest.error, error)} ({closest.picture})"
    both = f"the cheapest, {far}; the closest, {near}" if others else f"cheapest and closest, {far}"
    return [
        f"Take {first.label} for {first.cost:.4g} {_COST_WORDS[cost]}{more}: over the pictures, no "
        "other is as near for as little.",
        f"{_ERROR_WORDS[error]} on the worst picture: {both}{_unseen(found)}.",
    ]


def _unseen(found: Sequence[Verdict]) -> str:
    """Name the cheapest whose error 95 % of the pixels of every picture do not show.

    Nothing where the channels are no colour.
    """
    for each in found:
        if each.delta_e_2000_p95 <= 1.0:
            return f"; from {each.label} on, 95 % of every picture are within a Delta E of 1"
    if math.isnan(found[0].delta_e_2000_p95):
        return ""
    return "; none has 95 % of every picture within a Delta E of 1"


def _error(value: float, error: str) -> str:
    return f"{100.0 * value:.3g} %" if error == "l2" else f"{value:.3g}"


def table_text(comparison: Comparison, ending: str, error: str, cost: str) -> str:
    """Return the content of a table file."""
    if ending == ".md":
        return _MARKS[ending] + _markdown(comparison, error, cost)
    if ending == ".csv":
        return _MARKS[ending] + _csv(comparison)
    whole = {"format": _FORMAT, "command": "compare", **comparison.to_dict()}
    return json.dumps(whole, allow_nan=False) + "\n"


def is_table_file(path: Path) -> bool:
    """Tell whether a file is a table that we wrote."""
    return has_mark(path, {mark.encode(): b"" for mark in _MARKS.values()})


def _markdown(comparison: Comparison, error: str, cost: str) -> str:
    """Write a table for each picture; the front in bold."""
    name = comparison.profile.material_name or "profile"
    parts = [f"# {name}: kernels by error and cost", setting_of(comparison)]
    head = f"| {' | '.join(HEADS)} |\n|---|{(len(HEADS) - 1) * '---:|'}"
    for picture in comparison.pictures:
        rows = sorted_rows(comparison, picture, error, cost)
        lines = [_markdown_row(row, (error, cost) in row.fronts) for row in rows]
        parts.append(f"## {picture_line(picture)}\n\n" + "\n".join([head, *lines]))
    parts.append(f"Bold: {front_words(error, cost)}.")
    parts += left_out_lines(comparison)
    parts.append("\n".join(verdict_lines(comparison, error, cost)))
    return "\n\n".join(parts) + "\n"


def _markdown_row(row: KernelRow, is_on_front: bool) -> str:
    label, *cells = cells_of(row, "")
    return f"| {f'**{label}**' if is_on_front else label} | {' | '.join(cells)} |"


def _csv(comparison: Comparison) -> str:
    """All rows, what there is by channel in columns of its own."""
    lines = [_flat(row, comparison.profile.channels) for row in comparison.to_dict()["rows"]]
    stream = io.StringIO()
    writer = csv.DictWriter(stream, list(lines[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(lines)
    return stream.getvalue()


def _flat(figures: dict[str, Any], channels: Sequence[str]) -> dict[str, Any]:
    """One value a column: NAME_CHANNEL, on_front_ERROR_COST; settings as JSON."""
    flat: dict[str, Any] = {}
    for key, value in figures.items():
        if isinstance(value, list):
            own = value or [None] * len(channels)  # tables of taps have no stop reasons
            flat |= {f"{key}_{name}": each for name, each in zip(channels, own, strict=True)}
        elif key == "on_front":
            flat |= {f"{key}_{e}_{c}": int(is_on) for e in value for c, is_on in value[e].items()}
        else:
            flat[key] = json.dumps(value) if isinstance(value, dict) else value
    return flat


def sorted_rows(comparison: Comparison, picture: Picture, error: str, cost: str) -> list[KernelRow]:
    """Rows of a picture by cost, then by error."""
    rows = comparison.rows_of(picture.name)
    return sorted(rows, key=lambda row: (row.rounded_cost(cost), row.error(error)))


def cells_of(row: KernelRow, mark: str) -> list[str]:
    """Figures of a row for people; drift and asymmetry of the worst channel."""
    drift = max(row.energy_drift.tolist(), key=abs)
    return [
        f"{mark}{row.label}",
        f"{row.fetches:.4g}",
        f"{row.passes}",
        f"{row.bytes_per_pixel:.4g}",
        f"{row.kernel_bytes}",
        f"{row.seconds_per_megapixel:.2g}",
        number(row.delta_e_2000_mean, ".3f"),
        number(row.delta_e_2000_p95, ".2f"),
        number(row.delta_e_2000_p99, ".2f"),
        number(row.share_above_1, ".3g%"),
        f"{100.0 * row.relative_l2:.3g} %",
        f"{row.psnr_db:.1f}",
        number(drift, "+.2g%"),
        number(float(row.radial_asymmetry.max()), ".2g"),
    ]


def setting_of(comparison: Comparison) -> str:
    """Say what was compared, on which pixels."""
    profile = comparison.profile
    threads = counted(comparison.threads, "thread")
    pixels = counted(comparison.pixels, "pixel")
    missing = comparison.missing_share.max()
    return (
        f"{profile.material_name or 'profile'}, {profile.meta.get('method') or 'no method'}: "
        f"kernels of {pixels} of {comparison.mm_per_pixel:.4g} mm against the "
        f"whole 2D kernel, which lacks up to {number(missing, '.2g%')} of a channel's light beyond "
        f"the grid; seconds on {threads}, float64"
    )


def front_words(error: str, cost: str) -> str:
    """Say what is special about the rows that are marked."""
    return f"no other kernel of the picture has as small an error ({error}) at the cost ({cost})"


def picture_line(picture: Picture) -> str:
    """Name a picture with its size and exposure."""
    size = f"{picture.width} x {picture.height} pixels"
    return f"{picture.name}, {size}, exposure {picture.exposure:.4g}"


_CAUSES = ("", "Delta E mean", "p95", "p99", "relative L2", "largest drift", "of the whole")


def budget_text(figures: Mapping[str, Any]) -> str:
    """Write the budget of a picture, and what to do about its two largest causes.

    What is not in the whole comes last, in brackets: it has no share in it.
    """
    *causes, interaction, whole = figures["rows"]
    inside = [each for each in causes if each["in_whole"]]
    others = [each for each in causes if not each["in_whole"]]
    simulated = figures["model"] or counted(figures["photons"], "photon", ",")
    made = figures["structure"] or counted(figures["rank"], "term")
    head = filled(
        "{material} on {picture}, {width} x {height} pixels of {mm_per_pixel:.4g} mm: {simulated} "
        "to {radius_mm:.4g} mm, {method}, {made}",
        {**figures, **whole, "simulated": simulated, "made": made},
    )
    rows = [_cause(each) for each in (*inside, interaction, whole, *others)]
    first, second = inside[:2]
    advice = (
        f"First: {first['cause']} ({first['hint']}). Then: {second['cause']} ({second['hint']})."
    )
    return "\n".join([head, table(_CAUSES, rows), advice])


def _cause(row: Mapping[str, Any]) -> list[str]:
    """Write the figures of one cause."""
    name = row["cause"] if row["in_whole"] else f"({row['cause']})"
    return [
        name,
        number(row["delta_e_2000_mean"], ".4f"),
        number(row["delta_e_2000_p95"], ".3f"),
        number(row["delta_e_2000_p99"], ".3f"),
        f"{100.0 * row['relative_l2']:.4f} %",
        number(max(row["energy_drift"], key=abs), "+.3f%"),
        number(row["share_of_whole"], "+.1f%|nan %") if row["in_whole"] else "",
    ]


def sheet_text(figures: Mapping[str, Any]) -> str:
    """Write mean Delta E of every kernel on every picture."""
    head = (
        "{material:s|unknown material}: mean Delta E 2000 on {pixels} x {pixels} pixels of "
        "{mm_per_pixel:.4g} mm"
    )
    rows = [
        [
            each["label"],
            str(each["passes"] or "-"),
            *(f"{value:#.3g}".rstrip(".") for value in each["delta_e_2000_mean"]),
        ]
        for each in figures["rows"]
    ]
    return f"{filled(head, figures)}\n{table(['kernel', 'passes', *figures['scenes']], rows)}"
