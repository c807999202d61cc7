"""A matplotlib figure in words: what is written in it and what is drawn, not the pixels."""

from collections.abc import Iterator
from typing import Any

import matplotlib.ticker
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.patches import StepPatch

_GENERAL = (matplotlib.ticker.ScalarFormatter, matplotlib.ticker.LogFormatter)


def figure_lines(figure: Figure, settings: dict[str, Any]) -> list[str]:
    """Size, texts, and each axes with what it shows; ``settings`` are those of savefig."""
    width, height = figure.get_size_inches()
    told = ", ".join(f"{key} {value}" for key, value in settings.items())
    lines = [f"chart of {number(width)} x {number(height)} inches, {told}"]
    suptitle = figure.get_suptitle()
    lines += [f"title {suptitle!r}"] if suptitle else []
    lines += [f"text {each.get_text()!r}" for each in figure.texts if each.get_text() != suptitle]
    lines += [line for each in figure.legends for line in _legend(each)]
    for k, axes in enumerate(figure.axes, 1):
        lines += [f"axes {k}", *(f"  {line}" for line in _axes(axes))]
    return lines


def _axes(axes: Axes) -> Iterator[str]:
    for side in ("left", "center", "right"):
        if title := axes.get_title(loc=side):
            yield f"title {side} {title!r}"
    for name, axis, limits in (
        ("x", axes.xaxis, axes.get_xlim()),
        ("y", axes.yaxis, axes.get_ylim()),
    ):
        if axis.get_visible() and axes.axison:
            ends = " to ".join(map(number, limits))
            yield f"{name} {axis.get_scale()} {axis.get_label_text()!r} {ends}{_ticks(axis)}"
    for line in axes.lines:
        yield f"line {line.get_label()!r} {_style(line)}: {_points(line.get_xydata())}"
    for each in axes.images:
        yield f"image {_image(each)}"
    for each in axes.collections:
        yield f"{type(each).__name__} {each.get_label()!r}: {_collection(each)}"
    for each in axes.patches:
        yield f"patch {_patch(each)}"
    for each in axes.texts:
        place = ", ".join(map(number, each.get_position()))
        yield f"text {each.get_text()!r} at {place}, {each.get_ha()} {each.get_va()}"
    if (legend := axes.get_legend()) is not None:
        yield from _legend(legend)


def _ticks(axis: Any) -> str:
    """Labels that were chosen by us."""
    if isinstance(axis.get_major_formatter(), _GENERAL):
        return ""
    return f", ticks {[each.get_text() for each in axis.get_ticklabels()]}"


def _style(line: Any) -> str:
    return f"{line.get_color()} {line.get_linestyle()} {line.get_marker()}"


def _points(points: Any) -> str:
    """How many, the first, the last, and the extent of y."""
    found = np.asarray(points, dtype=np.float64)
    if not len(found):
        return "no points"
    ends = " to ".join(f"({number(x)}, {number(y)})" for x, y in (found[0], found[-1]))
    y = found[:, 1]
    if np.isnan(y).all():
        return f"{len(found)} points, {ends}, none of them drawn"
    return f"{len(found)} points, {ends}, y {number(np.nanmin(y))} to {number(np.nanmax(y))}"


def _image(image: Any) -> str:
    data = np.ma.filled(np.ma.asarray(image.get_array(), dtype=np.float64), np.nan)
    shape = " x ".join(map(str, data.shape))
    values = [data.flat[0], data.flat[data.size // 3], np.nanmin(data), np.nanmax(data)]
    norm = type(image.norm).__name__
    clim = " to ".join(number(each) for each in image.get_clim())
    extent = [number(each) for each in image.get_extent()]
    return (
        f"{shape}, {image.get_cmap().name} {norm} {clim}, extent {' '.join(extent)}, first, third, "
        f"least, most {' '.join(map(number, values))}, mean {number(np.nanmean(data))}"
    )


def _collection(collection: Any) -> str:
    paths = [each.vertices for each in collection.get_paths()]
    offsets = np.asarray(collection.get_offsets(), dtype=np.float64)
    drawn = _points(np.concatenate(paths)) if paths else "nothing"
    return drawn + (f", at {_points(offsets)}" if len(offsets) > 1 else "")


def _patch(patch: Any) -> str:
    style = f"{_colour(patch.get_edgecolor())} {_colour(patch.get_facecolor())}"
    style += f" {patch.get_linestyle()} {number(patch.get_linewidth())}"
    if isinstance(patch, StepPatch):
        values, edges, base = patch.get_data()
        ends = f"edges {number(edges[0])} {number(edges[1])} to {number(edges[-1])}"
        least = "" if base is None else f", base {_values(np.broadcast_to(base, values.shape))}"
        return f"StepPatch {patch.get_label()!r} {style}: {ends}, values {_values(values)}{least}"
    box = patch.get_path().transformed(patch.get_patch_transform()).get_extents()
    place = " ".join(number(each) for each in box.extents)
    return f"{type(patch).__name__} {patch.get_label()!r} {style}: {place}"


def _colour(colour: Any) -> str:
    return to_hex(colour, keep_alpha=True)


def _values(values: Any) -> str:
    """How many, the first two, the last, and the sum."""
    found = np.asarray(values, dtype=np.float64)
    shown = " ".join(number(each) for each in (*found[:2], found[-1]))
    return f"{found.size}: {shown}, sum {number(np.nansum(found))}"


def _legend(legend: Any) -> Iterator[str]:
    title = legend.get_title().get_text()
    yield f"legend {title!r} {[each.get_text() for each in legend.get_texts()]}"


def number(value: Any) -> str:
    """Six digits: curves come from sums over pixels."""
    return "-" if value is None else f"{float(value) + 0.0:.6g}"
