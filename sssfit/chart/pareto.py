"""Speed against accuracy of kernels, as a figure: `pareto_figure`.

``sssfit.compare.pareto`` computes the record.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.path import Path
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullLocator
from matplotlib.transforms import Bbox

from sssfit.arrays import FloatArray
from sssfit.chart.looks import DASHED, METHODS, RULE, look
from sssfit.chart.page import (
    RC,
    Style,
    add_legend,
    check_drawn,
    drawable,
    lay_out,
    name_axes,
    new_page,
    short_number,
)
from sssfit.chart.text import kernel_subtitle, shortened, titled
from sssfit.messages import counted
from sssfit.methods import FITS

if TYPE_CHECKING:
    from sssfit.compare.comparison import Comparison, KernelRow, Picture

Point = tuple[float, float]

_HEAD_INCHES, _PANEL_INCHES = 1.9, 2.3  # heights of title, legend and notes; of a panel
_FAINT = 0.35
_MOST_TICKS = 8
_LANE = 0.014  # share of the panel's width between points of equal cost
# Labels: points from their markers, and between places down and along
_BESIDE, _LINE, _STEP = 5.5, 4.5, 2.0
_FARTHEST = 16  # most places down or up
_MARKER, _CLEAR_PIXELS = 0.045, 4.0  # half a marker in inches, and what labels keep clear of
_JUST_NOTICEABLE = 1.0  # Delta E
_NOTICED: Style = {"color": RULE, "lw": 0.8, "ls": DASHED}
_WORTH_A_NOTE = 1e-3  # share of the light
_LEAST = {"delta-e": 1e-3, "p99": 1e-3, "l2": 1e-5}  # smaller errors are drawn at this value
_ERRORS = {
    "delta-e": "mean ΔE 2000",
    "p99": "99th percentile of ΔE 2000",
    "l2": "relative L2 error",
}
_COSTS = {
    "fetches": "texture fetches a pixel; dense kernels: weights",
    "passes": "passes over the picture",
    "bytes": "bytes read and written a pixel, half floats",
    "seconds": "seconds per megapixel, measured",
}


def pareto_figure(
    comparison: Comparison, *, error: str = "delta-e", cost: str = "fetches"
) -> Figure:
    """Draw errors over costs, a panel for each picture, with the front as a step line.

    Parameters
    ----------
    comparison : Comparison
    error : str
        "delta-e", "p99" or "l2".
    cost : str
        "fetches", "passes", "bytes" or "seconds".

    Returns
    -------
    matplotlib.figure.Figure
        8 inches wide, 2.3 inches per picture; both axes logarithmic, the same in all panels.

    Raises
    ------
    ArgumentError
        ``comparison`` is another record.
    RenderError
        Delta E is requested for other than 1 or 3 channels.
    """
    check_drawn(comparison, "Comparison")
    from sssfit.compare.comparison import check_error

    check_error(error, comparison.profile.n_channels)
    many, notes = len(comparison.pictures), _notes(comparison, error, cost)
    where = kernel_subtitle(comparison.profile, comparison.pixels, comparison.mm_per_pixel)
    height = _HEAD_INCHES + _PANEL_INCHES * many
    with new_page(height, _title(comparison, error, cost), where, notes) as (figure, below):
        handles = _handles(comparison, error)
        below = add_legend(below, handles, [str(each.get_label()) for each in handles])
        panels = below.subplots(many, 1, sharex=True, sharey=True, squeeze=False)[:, 0]
        _limit(panels[-1], comparison, error, cost)
        for axes, picture in zip(panels, comparison.pictures, strict=True):
            _draw_panel(axes, comparison, picture, error, cost)
            name_axes(axes, _panel_title(picture), "", _ERRORS[error])
        panels[-1].set_xlabel(_COSTS[cost])
        lay_out(figure)
        for axes, picture in zip(panels, comparison.pictures, strict=True):
            front = comparison.front(picture.name, error, cost)
            points = [_point(row, error, cost) for row in front]
            level = _JUST_NOTICEABLE if error != "l2" else None
            place_labels(axes, points, [row.label for row in front], level=level)
    return figure


def _handles(comparison: Comparison, error: str) -> list[Line2D]:
    """Draw the legend of the methods and lines."""
    handles = [
        *_method_handles(comparison),
        Line2D([], [], color=RULE, lw=1.0, label="Pareto front"),
    ]
    if error != "l2":
        handles.append(Line2D([], [], label="ΔE 2000 of 1, just noticeable", **_NOTICED))
    return handles


def _method_handles(comparison: Comparison) -> list[Line2D]:
    """Return a marker for each method, and for kernels that keep the fit's energy."""
    drawn: dict[str, KernelRow] = {}
    for row in comparison.rows:  # of the size that a shader's kernels have, where there is one
        if row.method not in drawn or drawn[row.method].is_dense:
            drawn[row.method] = row
    kept = {row.method: row for row in reversed(comparison.rows) if _is_kept(row)}
    handles = []
    for method in sorted(drawn, key=lambda each: _kind(drawn[each])[0]):
        name = look(method).name
        handles.append(Line2D([], [], label=name, **_style(drawn[method], is_kept=False)))
        if method in kept:
            style = _style(kept[method], is_kept=True)
            handles.append(Line2D([], [], label=f"{name}, energy kept", **style))
    return handles


def _draw_panel(
    axes: Axes, comparison: Comparison, picture: Picture, error: str, cost: str
) -> None:
    """Draw one picture's points: the front in full colour, the others faint."""
    rows, front = comparison.rows_of(picture.name), comparison.front(picture.name, error, cost)
    lanes = _lanes(rows, front, cost) if cost == "passes" else [0] * len(rows)
    low, high = axes.get_xlim()
    lane = (high / low) ** _LANE
    for row, number in zip(rows, lanes, strict=True):
        x, y = _point(row, error, cost)
        alpha = 1.0 if row in front else _FAINT
        axes.plot(x * lane**number, y, alpha=alpha, **_style(row, is_kept=_is_kept(row)))
    if error != "l2":
        axes.axhline(_JUST_NOTICEABLE, zorder=1, **_NOTICED)
    points = [_point(row, error, cost) for row in front]
    if not points:
        return
    x_front, y_front = (list(each) for each in zip(*points, strict=True))
    style: Style = {"where": "post", "color": RULE, "lw": 1.0, "zorder": 2}
    axes.step([*x_front, high], [*y_front, y_front[-1]], **style)


def place_labels(
    axes: Axes,
    points: Sequence[tuple[float, float]],
    labels: Sequence[str],
    *,
    level: float | None = None,
) -> None:
    """Write a label beside each point of a falling front, with a line to its point.

    A label is clear of all that the panel shows, and nearer to its own point than to another of
    the front; one without such a place is left out.

    Parameters
    ----------
    axes : Axes
        With its markers and limits.
    points : sequence of (x, y)
        Points in data coordinates, x rising and y falling.
    labels : sequence of str
    level : float, optional
        A horizontal line in data coordinates that labels avoid.
    """
    panel, dpi = axes.get_window_extent(), axes.figure.dpi
    front = [_pixel(axes, *point) for point in points]
    lines = _steps(front, panel)
    if level is not None and points:
        y = _pixel(axes, points[0][0], level)[1]
        lines.append(Path([(panel.x0, y), (panel.x1, y)]))
    taken = _Taken(panel, _markers(axes, front), _MARKER * dpi + _CLEAR_PIXELS, lines)
    style: Style = {"size": RC["xtick.labelsize"], "va": "bottom", "in_layout": False, "zorder": 4}
    for k, (point, label) in enumerate(zip(points, labels, strict=True)):
        text = axes.annotate(
            drawable(label), point, (0.0, 0.0), textcoords="offset points", **style
        )
        offsets, boxes = _boxes(text.get_window_extent(), dpi / 72.0)
        found = taken.first_free(boxes, front[k], [*front[:k], *front[k + 1 :]])
        if found is None:
            text.remove()
            continue
        box = Bbox(boxes[found])
        text.set_position(offsets[found])
        tie = [front[k], _nearest(box, front[k])]
        taken.labels.append(box)
        taken.lines.append(Path(tie))
        ends = axes.transData.inverted().transform(tie)
        axes.plot(*ends.T, color="#999999", lw=0.5, zorder=2)


@dataclass(frozen=True, slots=True)
class _Taken:
    """What a panel shows already, in pixels; ``reach`` is what a label keeps from markers."""

    panel: Bbox
    markers: FloatArray
    reach: float
    lines: list[Path]
    labels: list[Bbox] = field(default_factory=list)

    def first_free(self, boxes: FloatArray, own: Point, others: Sequence[Point]) -> int | None:
        """Return the first place of a label, of boxes (P, 2, 2), that `allows` it.

        Most are refused on arrays; one by one, 40 labels in a crowd took 2.5 s for .3.
        """
        rooms = _padded(boxes, _CLEAR_PIXELS)
        inside = (rooms[:, 0] >= self.panel.min) & (rooms[:, 1] <= self.panel.max)
        left = np.flatnonzero(inside.all(axis=1))
        left = left[~_holds_any(_padded(boxes[left], self.reach), self.markers)]
        nearest = _distances(boxes[left], others).min(axis=1, initial=np.inf)
        left = left[nearest > _distances(boxes[left], [own])[:, 0]]
        return next((int(k) for k in left if self.allows(Bbox(boxes[k]), own)), None)

    def allows(self, box: Bbox, own: Point) -> bool:
        """Return whether a label is clear of lines and labels there, and none is on its own tie."""
        room, tie = box.padded(_CLEAR_PIXELS), Path([own, _nearest(box, own)])
        return not (
            any(map(room.overlaps, self.labels))
            or any(each.intersects_bbox(room) for each in self.lines)
            or any(map(tie.intersects_bbox, self.labels))
        )


def _padded(boxes: FloatArray, pixels: float) -> FloatArray:
    """Return boxes (P, 2, 2), lower left and upper right, with so much on every side."""
    padded: FloatArray = boxes + np.array([[-pixels], [pixels]])
    return padded


def _holds_any(boxes: FloatArray, points: FloatArray) -> npt.NDArray[np.bool_]:
    """Return which boxes (P, 2, 2) have a point inside."""
    inside = (points > boxes[:, None, 0]) & (points < boxes[:, None, 1])
    found: npt.NDArray[np.bool_] = np.any(np.all(inside, axis=2), axis=1)
    return found


def _distances(boxes: FloatArray, points: Sequence[Point]) -> FloatArray:
    """Return the distance of every point (N) from every box (P, 2, 2), as (P, N)."""
    at = np.reshape(points, (-1, 2))
    apart = np.clip(at, boxes[:, None, 0], boxes[:, None, 1]) - at
    found: FloatArray = np.hypot(apart[..., 0], apart[..., 1])
    return found


def _pixel(axes: Axes, x: float, y: float) -> Point:
    """Return where a point in data coordinates lies."""
    found = axes.transData.transform((x, y))
    return float(found[0]), float(found[1])


def _markers(axes: Axes, front: Sequence[Point]) -> FloatArray:
    """Return where a panel has markers (N, 2), those of its front among them."""
    drawn = [each for each in axes.lines if each.get_marker() not in (None, "None", "")]
    points = [axes.transData.transform(each.get_path().vertices) for each in drawn]
    found: FloatArray = np.concatenate([np.reshape(front, (-1, 2)), *points])
    return found[np.isfinite(found).all(axis=1)]


def _steps(front: Sequence[Point], panel: Bbox) -> list[Path]:
    """Return the lines of a front, which goes on to the panel's right side."""
    if not front:
        return []
    lines = [Path([(x, y), (x_next, y)]) for (x, y), (x_next, _) in itertools.pairwise(front)]
    lines += [Path([(x, y), (x, y_next)]) for (_, y), (x, y_next) in itertools.pairwise(front)]
    return [*lines, Path([front[-1], (panel.x1, front[-1][1])])]


def _boxes(own: Bbox, pixels: float) -> tuple[FloatArray, FloatArray]:
    """Return offsets of a label in points (P, 2), and its boxes (P, 2, 2), by preference.

    To the left, below, above. ``pixels`` are those of a point.
    """
    offsets = np.array(list(_places(own.width / pixels, own.height / pixels)))
    return offsets, own.get_points() + offsets[:, None] * pixels


def _places(width: float, height: float) -> Iterator[Point]:
    """Yield lower left corners of a label, in points from its own point."""
    yield -_BESIDE - width, -0.5 * height
    for side, line in itertools.product((-1.0, 1.0), range(_FARTHEST)):
        y = side * (_BESIDE + _LINE * line) - height * (side < 0.0)
        yield from ((float(x), y) for x in np.arange(-2.0 - width, 2.0, _STEP))


def _nearest(box: Bbox, point: Point) -> Point:
    """Return the place of a box that is nearest to a point."""
    x, y = point
    return min(max(x, box.x0), box.x1), min(max(y, box.y0), box.y1)


def _lanes(rows: Sequence[KernelRow], front: Sequence[KernelRow], cost: str) -> list[int]:
    """Return how far each row is drawn to the right of its cost, to separate equal costs.

    The front is drawn at its cost; of the others, each method has its own offset.
    """
    lanes = []
    for row in rows:
        beside = [each for each in rows if each.cost(cost) == row.cost(cost) and each not in front]
        kinds = sorted({_kind(each) for each in beside})
        lanes.append(0 if row in front else 1 + kinds.index(_kind(row)))
    return lanes


def _kind(row: KernelRow) -> tuple[int, bool]:
    """Return the position of a row's method in the legend."""
    known = [*METHODS, *(each for each in FITS if each not in METHODS)]
    return known.index(row.method) if row.method in known else len(known), _is_kept(row)


def _is_kept(row: KernelRow) -> bool:
    """Return whether the energy is the fit's and not the profile's."""
    return row.settings.get("energy") == "keep"


def _style(row: KernelRow, *, is_kept: bool) -> Style:
    """Return colour and marker of a row's method: small if dense, hollow if with a fit's energy."""
    own = look(row.method)
    return {
        "color": own.colour,
        "marker": own.marker,
        "ms": 4 if row.is_dense else 7 if row.structure else 5.5,
        "mew": 0.9,
        "ls": "none",
        "zorder": 3,
        "markerfacecolor": "white" if is_kept else own.colour,
    }


def _point(row: KernelRow, error: str, cost: str) -> tuple[float, float]:
    """Return the position of a row; errors too small for the axis are at its bottom."""
    return row.cost(cost), max(row.error(error), _LEAST[error])


def _limit(axes: Axes, comparison: Comparison, error: str, cost: str) -> None:
    """Set the shared axes of all panels, with room for labels at the left and below."""
    points = [_point(row, error, cost) for row in comparison.rows]
    costs = [x for x, _ in points]
    errors = [y for _, y in points if math.isfinite(y)] or [1.0]
    axes.set_xscale("log")
    axes.set_yscale("log")
    most = max(max(costs), 1.5 * min(costs))
    axes.set_xlim(min(costs) * (min(costs) / most) ** 0.24, most * (most / min(costs)) ** 0.08)
    top = max(*errors, 1.3 * _JUST_NOTICEABLE) if error != "l2" else max(errors)
    least = min(*errors, top / 10.0)
    axes.set_ylim(least * (least / top) ** 0.16, top * (top / least) ** 0.06)
    axes.yaxis.set_major_locator(LogLocator(numticks=6))
    axes.yaxis.set_major_formatter(FuncFormatter(short_number))
    axes.yaxis.set_minor_locator(NullLocator())
    if cost == "seconds" or len(set(costs)) > _MOST_TICKS:
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5), numticks=12))
    else:
        axes.xaxis.set_major_locator(FixedLocator(sorted(set(costs))))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(FuncFormatter(short_number))


def _title(comparison: Comparison, error: str, cost: str) -> str:
    """Return the title with material and axes."""
    what = f"{_ERRORS[error]} against {'time' if cost == 'seconds' else cost}"
    return titled(comparison.profile, what)


def _panel_title(picture: Picture) -> str:
    """Return the picture's name, size and exposure."""
    size = f"{picture.width} × {picture.height} pixels"  # noqa: RUF001 (a product)
    return f"{shortened(picture.name, 24)}, {size}, exposure {picture.exposure:.3g}"


def _notes(comparison: Comparison, error: str, cost: str) -> list[str]:
    """Return the notes on errors, costs and omitted kernels."""
    first = (
        "Relative L2 of linear light against the picture by the profile's whole 2D kernel."
        if error == "l2"
        else "ΔE 2000 of the picture by the kernel against that by the profile's whole 2D kernel, "
        "in sRGB at the exposure."
    )
    second = {
        "fetches": "One fetch serves all channels. Terms on taps share their first pass. Small: "
        f"dense kernels of {counted(comparison.pixels, 'pixel')} at their weights, which no "
        "shader applies.",
        "passes": "Passes: two a term, one along x and one along y, one a star of nine fetches; "
        "without those that change the picture's size.",
        "bytes": "Bytes: each picture that a pass reads, once, and what it writes, in half floats.",
        "seconds": f"Seconds: wall time on {counted(comparison.threads, 'thread')} of this "
        "machine, float64, all "
        "channels, the least of several. The front is of two digits; zeros at a pass's "
        "ends cost nothing.",
    }[cost]
    third = "Faint: another kernel is no worse in both."
    if cost == "passes":
        third += " Of one cost they stand side by side, to the right of it."
    notes = [f"{first} {second} {third}"]
    if any(picture.name in ("disk", "edge") for picture in comparison.pictures):
        notes.append(
            f"Of disk and edge, what is within {comparison.support_mm:.3g} mm of light or border "
            "counts: the reach of 99.9 % of the profile."
        )
    if comparison.missing_share.max() >= _WORTH_A_NOTE:
        notes.append(
            f"Beyond the profile's grid lies up to {100.0 * comparison.missing_share.max():.2g} % "
            "of a channel's light: true pictures have it spread evenly, around a disk not at all; "
            "kernels but those with energy kept have it near the beam."
        )
    if comparison.left_out:
        notes.append(f"Could not be fitted: {', '.join(name for name, _ in comparison.left_out)}.")
    return notes
