"""A material's coefficients as a figure: `material_figure`."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sssfit.chart.page import (
    LINE_STYLES,
    SHADES,
    Style,
    add_legend,
    check_drawn,
    drawable,
    name_axes,
    new_page,
    short_number,
    tick_decades,
)
from sssfit.chart.text import short_names, shortened, spread
from sssfit.material import Layer, Material
from sssfit.messages import counted

HEIGHT_INCHES = 3.9
_LETTERS = 20  # letters of channel names that fit side by side under a panel
_MOST_NAMES = 12  # number of names that fit there upright
_MOST_LAYERS = 7
_RING = 2.5  # points by which a hollow marker is wider than a filled one
_FEW_CHANNELS = 4  # up to this many channels are points, more are lines
_MARKERS = "os^Dv<>"
# Layers lie side by side in a channel, so that equal ones can be seen: distance between two of
# them, and the most that all of them take, in channels.
_APART, _MOST_APART = 0.2, 0.6


def material_figure(material: Material) -> Figure:
    """Draw a material's coefficients, mean free paths and albedos over its channels.

    Parameters
    ----------
    material : Material
        If it has more than seven layers, the first, the last and some between are drawn; clear ones
        are omitted.

    Returns
    -------
    matplotlib.figure.Figure
        8 inches wide, with a point per channel and layer, on logarithmic scales: sigma_a and the
        reduced sigma_s [1/mm], the reduced mean free path [mm], and 1 - albedo, the share that a
        collision absorbs, because albedos near 1 look alike and differ much in effect.

    Raises
    ------
    ArgumentError
        ``material`` is another record.
    """
    check_drawn(material, "Material")
    matter = [k for k, layer in enumerate(material.layers) if not layer.is_clear]
    shown = [matter[k] for k in spread(len(matter), _MOST_LAYERS)]
    title = f"{shortened(material.name, 24)}: material"
    notes = _notes(material, shown)
    names = short_names(material.channels)
    height = HEIGHT_INCHES + (0.07 * max(map(len, names)) if _are_upright(names) else 0.0)
    with new_page(height, title, _subtitle(material), notes) as (figure, below):
        count = len(names)
        handles = [Line2D([], [], **_style(k, count)) for k in range(len(shown))]
        below = add_legend(below, handles, [_label(material, each) for each in shown])
        panels = below.subplots(1, 3)
        for axes in panels:
            axes.set_yscale("log")
        for k, (layer, shift) in enumerate(zip(shown, _shifts(len(shown), count), strict=True)):
            _draw_layer(panels, material.layers[layer], k, shift)
        filled_or_hollow = "(a) scattering σₛ' (filled)\nand absorption σₐ (hollow)"
        titles = (filled_or_hollow, "(b) mean free path", "(c) 1 - albedo")
        units = ("1/mm", "mm", "1 - albedo")
        for axes, title, unit in zip(panels, titles, units, strict=True):
            name_axes(axes, title, "channel", unit)
            _name_channels(axes, names)
            _limit(axes)
    return figure


def _subtitle(material: Material) -> str:
    """Return text about the material."""
    count = len(material.layers)
    is_deep = math.isinf(material.layers[-1].thickness_mm)
    end = "half space" if is_deep and count == 1 else "half space below" if is_deep else "slab"
    parts = [f"{counted(count, 'layer')}, {end}"]
    if material.source:
        parts.append(shortened(material.source, 40))
    return " · ".join([*parts, f"specular reflectance {material.specular_reflectance:.4g}"])


def _label(material: Material, index: int) -> str:
    """Name a layer by its index, thickness and refractive index."""
    layer = material.layers[index]
    thickness = "semi-infinite" if math.isinf(layer.thickness_mm) else f"{layer.thickness_mm:g} mm"
    return f"layer {index + 1}: {thickness}, eta {layer.eta:g}"


def _style(place: int, channels: int) -> Style:
    """Return colour, marker and dashes of a layer, distinguishable without colour too."""
    is_line = channels > _FEW_CHANNELS
    return {
        "color": SHADES[place],
        "marker": _MARKERS[place],
        "markersize": 4.5 if _has_room(channels) else 2.0,
        "linestyle": LINE_STYLES[place % len(LINE_STYLES)] if is_line else "",
        "lw": 0.9,
    }


def _has_room(channels: int) -> bool:
    """Return whether there is room between channels for large markers and for shifts."""
    return channels <= 2 * _FEW_CHANNELS


def _shifts(layers: int, channels: int) -> list[float]:
    """Return how far to the right of a channel each layer is drawn, in channels."""
    apart = min(_APART, _MOST_APART / max(layers - 1, 1)) if _has_room(channels) else 0.0
    return [apart * (k - 0.5 * (layers - 1)) for k in range(layers)]


def _draw_layer(panels: Sequence[Axes], layer: Layer, place: int, shift: float) -> None:
    """Draw a layer's points into the three panels."""
    coefficients, path, absorption = panels
    for axes, values, is_hollow in (
        (coefficients, layer.reduced_sigma_s_per_mm, False),
        (coefficients, layer.sigma_a_per_mm, True),
        (path, layer.mean_free_path_mm, False),
        (absorption, 1.0 - layer.albedo, False),
    ):
        style = _style(place, len(values))
        if is_hollow:  # a ring, so that an equal filled point is seen in it
            style |= {"mfc": "none", "markersize": style["markersize"] + _RING}
        is_drawn = (values > 0.0) & np.isfinite(values) & (layer.sigma_t_per_mm > 0.0)
        axes.plot(np.arange(len(values)) + shift, np.where(is_drawn, values, np.nan), **style)


def _are_upright(names: Sequence[str]) -> bool:
    """Return whether names do not fit side by side under a panel."""
    return sum(map(len, names)) > _LETTERS


def _name_channels(axes: Axes, names: Sequence[str]) -> None:
    """Label the channels side by side, or up to twelve of them upright."""
    is_upright = _are_upright(names)
    shown = spread(len(names), _MOST_NAMES) if is_upright else range(len(names))
    rotation = 90 if is_upright else 0
    axes.set_xticks(shown, [drawable(names[k]) for k in shown], rotation=rotation)
    beside = max(0.5, 0.04 * len(names))
    axes.set_xlim(-beside, len(names) - 1.0 + beside)


def _limit(axes: Axes) -> None:
    """Set the limits of a logarithmic axis, at least a decade apart."""
    values = np.concatenate([np.asarray(line.get_ydata()) for line in axes.lines])
    values = values[np.isfinite(values)]
    low, high = (float(values.min()), float(values.max())) if values.size else (0.1, 1.0)
    middle = math.sqrt(low * high)
    axes.set_ylim(min(low / 1.5, middle / 3.2), max(high * 1.5, middle * 3.2))
    tick_decades(axes.yaxis, 6)
    axes.yaxis.set_major_formatter(short_number)


def _notes(material: Material, shown: Sequence[int]) -> list[str]:
    """Return the notes on the panels and on omitted layers."""
    notes = [
        "σₛ' = (1 - g) σₛ. Mean free path: 1 / (σₐ + σₛ'). Albedo: σₛ / (σₐ + σₛ). Values "
        "of 0 have no point."
    ]
    clear = [k for k, layer in enumerate(material.layers) if layer.is_clear]
    left_out = sorted({*range(len(material.layers))} - {*clear, *shown})
    if clear:
        notes.append(f"{counted(len(clear), 'clear layer')} without absorption or scattering.")
    if left_out:
        notes.append(f"Not drawn: {counted(len(left_out), 'layer')} ({_ranges(left_out)}).")
    return notes


def _ranges(indices: Sequence[int]) -> str:
    """Return ascending indices as numbers from 1, those that follow each other as one range."""
    starts = [k for k in indices if k - 1 not in indices]
    ends = [k for k in indices if k + 1 not in indices]
    return ", ".join(
        f"{first + 1}" if first == last else f"{first + 1} to {last + 1}"
        for first, last in zip(starts, ends, strict=True)
    )
