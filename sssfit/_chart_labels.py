"""Labels beside points, none on another, on a point or over the panel's rim."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from matplotlib.axes import Axes
from matplotlib.transforms import Bbox

from sssfit._chart_page import drawable, inches

_SIZE = 7.5  # points
_LINE_INCHES = 0.125
_GAP_INCHES = 0.06  # from the middle of a marker
_ASIDE_INCHES = 0.03  # from the upright through a point, where lines of other labels are
_MARKER_INCHES = 0.045  # its half width
_FARTHEST = 8  # lines down that a label is moved at most


def place_labels(
    axes: Axes,
    points: Sequence[tuple[float, float]],
    labels: Sequence[str],
    *,
    level: float | None = None,
) -> None:
    """Write a label below and left of each point of a falling front, where nothing else can be.

    A label that would meet another goes further down, with a line to its point. Limits and place of
    the axes have to be final.

    Parameters
    ----------
    axes : Axes
    points : sequence of (x, y)
        In data, x rising and y falling.
    labels : sequence of str
    level : float, optional
        A horizontal line in data that labels stay off.
    """
    dpi = axes.figure.dpi
    pixels = [axes.transData.transform(point) / dpi for point in points]
    taken = [_marker(x, y) for x, y in pixels]
    panel = axes.get_window_extent()
    rim = Bbox.from_extents(*(each / dpi for each in panel.extents))
    if level is not None:
        height = axes.transData.transform((points[0][0], level))[1] / dpi
        taken.append(Bbox.from_extents(rim.x0, height - 0.01, rim.x1, height + 0.01))
    for (x, y), label in zip(pixels, labels, strict=True):
        box = _free(x, y, inches(label, _SIZE), taken, rim)
        if box is None:
            continue  # the table has it
        taken.append(box)
        _write(axes, (x, y), box, label)


def _free(x: float, y: float, width: float, taken: Sequence[Bbox], rim: Bbox) -> Bbox | None:
    """Return the first place in inches that is inside the rim and meets nothing."""
    for box in _places(x, y, width):
        inside = box.x0 >= rim.x0 and box.x1 <= rim.x1 and box.y0 >= rim.y0 and box.y1 <= rim.y1
        if inside and not any(box.overlaps(other) for other in taken):
            return box
    return None


def _places(x: float, y: float, width: float) -> Iterator[Bbox]:
    """Yield places by preference: below, ending or beginning at the point, then further down."""
    for line in range(_FARTHEST):
        top = y - _GAP_INCHES - line * _LINE_INCHES
        for left in (x - width - _ASIDE_INCHES, x - 0.5 * width, x + _ASIDE_INCHES):
            yield Bbox.from_bounds(left, top - _LINE_INCHES, width, _LINE_INCHES)


def _marker(x: float, y: float) -> Bbox:
    half = _MARKER_INCHES
    return Bbox.from_bounds(x - half, y - half, 2 * half, 2 * half)


def _write(axes: Axes, point: tuple[float, float], box: Bbox, label: str) -> None:
    """Write a label into its box, in inches, and tie it to a point that is not next to it."""
    figure = axes.figure
    to_data = figure.dpi_scale_trans
    middle = 0.5 * (box.y0 + box.y1)
    axes.text(
        box.x0,
        middle,
        drawable(label),
        size=_SIZE,
        va="center_baseline",
        transform=to_data,
        parse_math=False,
        zorder=4,
    )
    if point[1] - box.y1 > _LINE_INCHES:
        ends = [point[0], min(max(point[0], box.x0), box.x1)], [point[1], box.y1]
        axes.plot(*ends, color="#999999", lw=0.5, transform=to_data, zorder=2)
