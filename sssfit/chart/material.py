"""A material's coefficients as a figure: `material_figure`."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogFormatterSciNotation, LogLocator

from sssfit.chart.page import (
    COLOURS,
    LEFT,
    LINE_STYLES,
    RC,
    RIGHT,
    TEXT_INCHES,
    Style,
    chart_style,
    draw_footnotes,
    draw_text,
    drawable,
    inches,
    name_axes,
    new_figure,
)
from sssfit.chart.text import shortened, spread
from sssfit.material import Layer, Material

_PANEL_INCHES, _GAP = 2.0, 0.38  # the gap as a share of a panel's width
_WIDTH_INCHES = TEXT_INCHES / (3 + 2 * _GAP)
_LEGEND_INCHES = 0.18
_MOST_LAYERS = 6
_FEW_CHANNELS = 4  # that many are points, more are lines through them
_MARKERS = "os^Dv<"
_SHADES = (*COLOURS, "#cc79a7", "#444444", "#e69f00")


def material_figure(material: Material) -> Figure:
    """Draw a material's coefficients, mean free paths and albedos over its channels.

    Parameters
    ----------
    material : Material
        Of more than six layers the first, the last and some between are drawn; clear ones, which
        have nothing to draw, are left out.

    Returns
    -------
    matplotlib.figure.Figure
        8 inches wide, a point a channel and layer, on logarithmic scales: sigma_a and the reduced
        sigma_s [1/mm], the reduced mean free path [mm], and 1 - albedo, the share that a collision
        absorbs: albedos near 1 differ much in what they do, and little in themselves.
    """
    matter = [k for k, layer in enumerate(material.layers) if not layer.is_clear]
    shown = [matter[k] for k in spread(len(matter), _MOST_LAYERS)]
    handles = _handles(material, shown)
    columns = _columns([str(each.get_label()) for each in handles])
    notes = _notes(material, shown)
    head = 0.88 + _LEGEND_INCHES * math.ceil(len(handles) / columns)
    with chart_style():
        figure = new_figure(head + _PANEL_INCHES + 0.62 + 0.145 * len(notes))
        height = figure.get_figheight()
        _draw_head(figure, material, handles, columns)
        bottom = draw_footnotes(figure, notes)
        panels = figure.subplots(1, 3)
        figure.subplots_adjust(LEFT, bottom, RIGHT, 1 - head / height, wspace=_GAP)
        for axes in panels:
            axes.set_yscale("log")
        for k, layer in enumerate(shown):
            _draw_layer(panels, material.layers[layer], k)
        titles = ("(a) sigma_s' and, hollow, sigma_a", "(b) mean free path", "(c) 1 - albedo")
        names = ("1/mm", "mm", "1 - albedo")
        for axes, title, name in zip(panels, titles, names, strict=True):
            name_axes(axes, title, "channel", name)
            _name_channels(axes, material.channels)
            _limit(axes)
    return figure


def _draw_head(figure: Figure, material: Material, handles: Sequence[Line2D], columns: int) -> None:
    """Title, what the material is, and the legend."""
    draw_text(figure, 0.16, f"{shortened(material.name, 24)}: material", size=12, weight="bold")
    count = len(material.layers)
    is_deep = math.isinf(material.layers[-1].thickness_mm)
    end = "half space" if is_deep and count == 1 else "half space below" if is_deep else "slab"
    parts = [f"{count} layer{'s' * (count > 1)}, {end}"]
    if material.source:
        parts.append(shortened(material.source, 40))
    parts.append(f"specular reflectance {material.specular_reflectance:.4g}")
    draw_text(figure, 0.41, " · ".join(parts))
    legend = figure.legend(
        handles=list(handles),
        ncols=columns,
        loc="upper left",
        bbox_to_anchor=(LEFT, 1 - 0.56 / figure.get_figheight()),
        borderaxespad=0,
        borderpad=0.2,
        handlelength=2.8,
        columnspacing=1.5,
    )


def _columns(labels: Sequence[str]) -> int:
    # 0.6 inches for the line and the gap between columns.
    widest = 0.6 + max(inches(each, RC["font.size"]) for each in labels)
    rows = math.ceil(len(labels) / max(int(TEXT_INCHES / widest), 1))
    return math.ceil(len(labels) / rows)


def _handles(material: Material, shown: Sequence[int]) -> list[Line2D]:
    """Explain the layers."""
    return [
        Line2D([], [], label=drawable(_label(material, each)), **_style(k))
        for k, each in enumerate(shown)
    ]


def _label(material: Material, index: int) -> str:
    """Name a layer by its place, thickness and refractive index."""
    layer = material.layers[index]
    thickness = "semi-infinite" if math.isinf(layer.thickness_mm) else f"{layer.thickness_mm:g} mm"
    return f"layer {index + 1}: {thickness}, eta {layer.eta:g}"


def _style(place: int) -> Style:
    """Colour, marker and dashes of a layer: told apart without colour as well."""
    return {
        "color": _SHADES[place],
        "marker": _MARKERS[place],
        "markersize": 4.5,
        "linestyle": LINE_STYLES[place % len(LINE_STYLES)],
        "lw": 0.9,
    }


def _draw_layer(panels: Sequence[Axes], layer: Layer, place: int) -> None:
    """Draw a layer's points into the three panels."""
    coefficients, path, absorption = panels
    for axes, values, is_hollow in (
        (coefficients, layer.reduced_sigma_s_per_mm, False),
        (coefficients, layer.sigma_a_per_mm, True),
        (path, layer.mean_free_path_mm, False),
        (absorption, 1.0 - layer.albedo, False),
    ):
        style = _style(place)
        if len(values) <= _FEW_CHANNELS:
            style["lw"] = 0
        elif len(values) > 2 * _FEW_CHANNELS:
            style["markersize"] = 2.0
        if is_hollow:
            style["mfc"] = "white"
        is_drawn = (values > 0.0) & np.isfinite(values) & (layer.sigma_t_per_mm > 0.0)
        axes.plot(np.arange(len(values)), np.where(is_drawn, values, np.nan), **style)


def _name_channels(axes: Axes, channels: Sequence[str]) -> None:
    """Name as many channels as have room."""
    names = [shortened(each) for each in channels]
    widest = 0.12 + max(inches(each, RC["xtick.labelsize"]) for each in names)
    shown = spread(len(names), max(int(_WIDTH_INCHES / widest), 1))
    axes.set_xticks(shown, [drawable(names[k]) for k in shown])
    most = len(names) - 1
    beside = max(0.5, most * 0.5 * widest / (_WIDTH_INCHES - widest))  # half of the outer names
    axes.set_xlim(-beside, most + beside)


def _limit(axes: Axes) -> None:
    """Set the limits of a logarithmic axis, a decade apart at least."""
    values = np.concatenate([np.asarray(line.get_ydata()) for line in axes.lines])
    values = values[np.isfinite(values)]
    low, high = (float(values.min()), float(values.max())) if values.size else (0.1, 1.0)
    middle = math.sqrt(low * high)
    axes.set_ylim(min(low / 1.5, middle / 3.2), max(high * 1.5, middle * 3.2))
    axes.yaxis.set_major_locator(LogLocator(numticks=6))
    axes.yaxis.set_minor_locator(LogLocator(subs=(2, 5)))
    axes.yaxis.set_minor_formatter(LogFormatterSciNotation(minor_thresholds=(1.3, 1.3)))


def _notes(material: Material, shown: Sequence[int]) -> list[str]:
    """Say what the panels mean and what is not in them."""
    notes = [
        "sigma_s' = (1 - g) sigma_s. Mean free path: 1 / (sigma_a + sigma_s'). Albedo: sigma_s / "
        "(sigma_a + sigma_s). What is 0 has no point."
    ]
    clear = sum(layer.is_clear for layer in material.layers)
    left_out = len(material.layers) - clear - len(shown)
    if clear:
        notes.append(f"{clear} clear layer{'s' * (clear > 1)} without absorption or scattering.")
    if left_out:
        notes.append(f"{left_out} more layers are not drawn.")
    return notes
