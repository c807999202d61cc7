"""The page of a chart: style, title, legend or table, notes, axes, panels with colour scales.

All figures of ``sssfit.chart`` use this module; ``sssfit.chart.text`` has the words.
"""

import contextlib
import io
import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, BinaryIO, cast

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib import font_manager
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis, XAxis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.colors import Normalize, SymLogNorm
from matplotlib.figure import Figure, FigureBase, SubFigure
from matplotlib.ft2font import FT2Font
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.legend import Legend
from matplotlib.legend_handler import HandlerBase
from matplotlib.lines import Line2D
from matplotlib.patches import StepPatch
from matplotlib.ticker import (
    FuncFormatter,
    LogLocator,
    MaxNLocator,
    NullFormatter,
    NullLocator,
    ScalarFormatter,
)
from matplotlib.transforms import Bbox

from sssfit.arrays import FloatArray
from sssfit.chart.files import MAKER, chart_format, known_format
from sssfit.errors import ArgumentError
from sssfit.files import check_target, write_atomically
from sssfit.messages import shown
from sssfit.profile import full_kernel

Style = dict[str, Any]
Handle = Artist | tuple[Artist, ...]  # a legend's handle; several are drawn over each other

WIDTH_INCHES, MARGIN_INCHES, DPI = 8.0, 0.1, 200  # 1600 pixels wide
FONT = "DejaVu Sans"  # ships with matplotlib, so the glyphs are the same on every machine
LINE_WIDTH = 1.1  # points
RC: Style = {
    "font.family": [FONT],
    "font.size": 8.5,
    "axes.axisbelow": True,
    "axes.grid": True,
    "axes.labelsize": 8.5,
    "axes.linewidth": 0.6,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": 8.5,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.4,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "legend.title_fontsize": 8,
    "lines.linewidth": LINE_WIDTH,
    "pdf.fonttype": 42,
    "svg.hashsalt": "sssfit",
    "xtick.labelsize": 7.5,
    "xtick.major.width": 0.6,
    "ytick.labelsize": 7.5,
    "ytick.major.width": 0.6,
    "ytick.minor.size": 0,
}
# Vermillion, bluish green and blue of Okabe and Ito 2008, "Color Universal Design".
COLOURS = ("#d55e00", "#009e73", "#0072b2")
# For more than three: their reddish purple, orange and sky blue too, and a dark grey.
SHADES = (*COLOURS, "#cc79a7", "#444444", "#e69f00", "#56b4e9")
LINE_STYLES: tuple[Any, ...] = ("-", (0, (4, 1.6)), (0, (6, 1.6, 1.2, 1.6)), (0, (1.2, 1.4)))


NOTE_SIZE, NOTE_COLOUR = 7.5, "#444444"
# Hebrew, Arabic and the other right-to-left letters that the font may have; a name's words too.
_LETTERS = r"[\u0590-\u08ff\ufb1d-\ufdff\ufe70-\ufefc]+"
_RIGHT_TO_LEFT = re.compile(rf"{_LETTERS}(?:[ _-]{_LETTERS})*")


def channel_style(channel: int, n_channels: int) -> Style:
    """Return colour and dashes of a channel's curve, distinguishable without colour too."""
    dashes = LINE_STYLES[channel % (3 if n_channels <= 3 else len(LINE_STYLES))]
    # The last tenth of viridis is too light on white.
    colour = (
        COLOURS[channel]
        if n_channels <= len(COLOURS)
        else mpl.colormaps["viridis"](0.9 * channel / (n_channels - 1))
    )
    return {"color": colour, "linestyle": dashes, "lw": LINE_WIDTH}


@contextlib.contextmanager
def chart_style() -> Iterator[None]:
    """Use matplotlib's defaults with ours on top, independent of the user's matplotlibrc."""
    kept = {"backend", "backend_fallback", "interactive", "toolbar", "timezone"}
    defaults = {key: value for key, value in mpl.rcParamsDefault.items() if key not in kept}
    with mpl.rc_context(cast(Any, defaults | RC)):
        yield


class _Page(Figure):
    """A figure that a notebook shows as it is written, without a backend of matplotlib."""

    def _repr_png_(self) -> bytes:
        stream = io.BytesIO()
        save_figure(self, stream, format="png")
        return stream.getvalue()


def check_drawn(record: object, kind: str) -> None:
    """Raise ArgumentError unless a figure is asked for the record that it draws.

    ``kind`` is the name of the record's class: the rooms of most records are not imported here.
    """
    if kind not in {each.__name__ for each in type(record).__mro__}:
        raise ArgumentError(f"{shown(record)} is not drawn here; expected the record {kind}.")


@contextlib.contextmanager
def new_page(
    height_inches: float,
    title: str,
    subtitle: str,
    notes: Sequence[str] = (),
    *,
    width_inches: float = WIDTH_INCHES,
) -> Iterator[tuple[Figure, SubFigure]]:
    """Make a page with title and provenance at the top and notes at the bottom.

    Yields the figure, and the remaining subfigure for `add_legend`, `add_table` and panels. Each
    takes the top of a subfigure and returns the rest, because matplotlib lets nothing else share
    that area. After drawing, `lay_out` computes the layout.
    """
    with chart_style():
        figure = _empty_page(width_inches, height_inches)
        page = _rest(figure)
        left: Style = {"x": 0.0, "ha": "left", "wrap": True}
        page.suptitle(drawable(title), fontsize=12, fontweight="bold", **left)
        foot = "\n".join(drawable(each) for each in notes)
        page.supxlabel(foot, fontsize=NOTE_SIZE, color=NOTE_COLOUR, **left)
        below = _rest(page)
        below.suptitle(drawable(subtitle), fontsize=RC["font.size"], **left)
        yield figure, _rest(below)
        lay_out(figure)


def _empty_page(width_inches: float, height_inches: float) -> Figure:
    margins = MARGIN_INCHES / width_inches, MARGIN_INCHES / height_inches
    layout = ConstrainedLayoutEngine(
        rect=(*margins, 1 - 2 * margins[0], 1 - 2 * margins[1]), w_pad=0.05, h_pad=0.06
    )
    figure = _Page(figsize=(width_inches, height_inches), dpi=DPI, layout=layout)
    FigureCanvasAgg(figure)
    return figure


def _rest(figure: Figure | SubFigure) -> SubFigure:
    """Return the part of a figure without title, notes and legends."""
    return cast(SubFigure, figure.subfigures())


def add_legend(
    below: SubFigure, handles: Sequence[Handle], labels: Sequence[str], *, title: str = ""
) -> SubFigure:
    """Draw a legend at the top of a subfigure, in as many columns as fit; return the rest."""
    room = below.figure.bbox.width - 2 * MARGIN_INCHES * DPI
    for columns in range(min(5, len(handles)), 0, -1):
        legend = _draw_legend(below, handles, labels, columns, title=title or None)
        if columns == 1 or legend.get_window_extent().width <= room:
            break
        legend.remove()
    return _rest(below)


def add_table(
    below: SubFigure,
    heads: Sequence[str],
    rows: Sequence[tuple[str, Sequence[str]]],
    handles: Sequence[Handle] = (),
) -> SubFigure:
    """Draw a table of names and figures at the top of a subfigure; return the rest.

    A row's handle precedes its name; ``heads`` begin with that of the names.
    """
    blank = _Blank()
    cells = list(zip(heads, *([name, *figures] for name, figures in rows), strict=True))
    names = [blank, *(handles or [blank] * len(rows))]
    every = [*names, *[blank] * (len(names) * (len(cells) - 1))]
    words = [each for column in cells for each in column]
    apart = 0.8 if handles else 0.0
    legend = _draw_legend(below, every, words, len(cells), handletextpad=apart)
    for head in legend.get_texts()[:: len(names)]:
        head.set_color(NOTE_COLOUR)
    return _rest(below)


class _Blank(Line2D):
    """The handle of a cell without one."""

    def __init__(self) -> None:
        super().__init__([], [])


class _NoRoom(HandlerBase):
    """Gives a blank handle no width."""

    def legend_artist(self, *given: Any) -> Artist:
        """Set the width of the handle's box, the last one, to 0."""
        _, orig_handle, _, handlebox = given
        handlebox.width = 0.0
        return cast(Artist, orig_handle)


def _draw_legend(
    below: SubFigure,
    handles: Sequence[Handle],
    labels: Sequence[str],
    columns: int,
    **style: Any,
) -> Legend:
    legend = below.legend(
        cast(Sequence[Artist], handles),  # matplotlib's stubs do not know tuples
        [drawable(each) for each in labels],
        ncols=columns,
        loc="outside upper left",
        alignment="left",
        borderaxespad=0,
        borderpad=0.2,
        labelspacing=0.35,
        handlelength=2.8,
        columnspacing=1.5,
        handler_map={_Blank: _NoRoom()},
        **style,
    )
    legend.get_title().set_color(NOTE_COLOUR)
    return legend


def _font() -> FT2Font:
    return font_manager.get_font(font_manager.findfont(FONT))


def drawable(text: str) -> str:
    """Replace characters that the font lacks, and escape dollars, which would start a formula.

    Right-to-left letters stand between left-to-right marks: they would turn the figures behind
    them around, "name 0.4 ± 0.1" into "0.1 ± 0.4 name".
    """
    font = _font()
    known = "".join(c if c == "\n" or font.get_char_index(ord(c)) else "?" for c in text)
    return _RIGHT_TO_LEFT.sub("\u200e\\g<0>\u200e", known).replace("$", r"\$")


def has_letters_of(text: str) -> bool:
    """Return whether the font has any of a text's letters."""
    font = _font()
    return any(font.get_char_index(ord(c)) for c in text if not c.isspace())


def tick(axis: Axis) -> None:
    """Tick a linear axis at round numbers, in plain notation."""
    axis.set_major_locator(MaxNLocator(7, steps=[1, 2, 2.5, 5, 10]))
    axis.set_major_formatter(FuncFormatter(short_number))


def short_number(value: float, _: object = None) -> str:
    """Return a tick's label: 0.002, and 2·10⁻⁶ where plain text would have 2e-06."""
    plain = f"{value:g}"
    if "e" not in plain:
        return plain.replace("-", "\N{MINUS SIGN}")
    digits, power = plain.split("e")
    factor = "" if digits == "1" else rf"{digits}\cdot "
    return f"${factor}10^{{{int(power)}}}$"


def tick_decades(axis: Axis, most: int) -> None:
    """Tick powers of ten, and label 2 and 5 too if an axis with limits is short.

    Smaller ticks along y cannot be seen; matplotlib would place them all the same, a third of a
    chart's layout.
    """
    axis.set_major_locator(LogLocator(numticks=most))
    low, high = axis.get_view_interval()
    is_short = math.log10(high / low) < 1.3
    is_seen = is_short or isinstance(axis, XAxis)
    axis.set_minor_locator(LogLocator(subs=(2, 5)) if is_seen else NullLocator())
    label_minor(axis, is_short)


def draw_curve(
    axes: Axes, x: FloatArray, mean: FloatArray, error: FloatArray, style: Style
) -> None:
    """Draw a curve, and a band of its errors where all are known."""
    axes.plot(x, mean, **style)
    if np.isfinite(error).all():
        axes.fill_between(x, mean - error, mean + error, lw=0, alpha=0.3, color=style["color"])


def label_minor(axis: Axis, is_labelled: bool) -> None:
    """Label minor ticks, or none; labels need marks, and line up with those of the major ones."""
    axis.set_minor_formatter(FuncFormatter(short_number) if is_labelled else NullFormatter())
    if is_labelled:
        axis.set_tick_params(which="minor", length=2.0, width=0.6, pad=5.0)


def name_axes(axes: Axes, title: str, x_label: str, y_label: str) -> None:
    """Give a panel its title and labels; only the last may hold formulas.

    Where no power of ten can stand over the y axis the title's height is given: matplotlib measures
    all labels again to find the same one, a tenth of a chart.
    """
    may_move = isinstance(axes.yaxis.get_major_formatter(), ScalarFormatter)
    axes.set_title(drawable(title), loc="left", y=None if may_move else 1.0)
    axes.set_xlabel(drawable(x_label))
    axes.set_ylabel(y_label)


def say_nothing_is_drawn(axes: Axes, why: str) -> None:
    """Write into the middle of an empty panel why it is empty."""
    style: Style = {"ha": "center", "va": "center", "color": NOTE_COLOUR}
    axes.text(0.5, 0.5, why, transform=axes.transAxes, **style)


def draw_steps(
    axes: Axes,
    values: npt.NDArray[np.floating],
    edges: npt.NDArray[np.floating],
    *,
    color: object,
    baseline: npt.NDArray[np.floating] | None = None,
    **style: Any,
) -> None:
    """Step from bin to bin, as ``Axes.stairs`` does, on axes that are given their limits.

    To find limits matplotlib goes over the steps one by one: 2.5 of 4 s for the chart of skin1.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    values, edges : array (n,), (n+1,)
    color : matplotlib colour
    baseline : array (n,), optional
        Baseline of a filled band; without one a line is drawn.
    **style
        Further properties of a patch.
    """
    side = "edgecolor" if baseline is None else "facecolor"
    own: Style = {"baseline": baseline, "fill": baseline is not None, side: color}
    axes.add_artist(StepPatch(values, edges, **own, **style))


def lay_out(figure: Figure) -> None:
    """Compute the layout once, so that the same figure has the same bytes.

    Positions differ by rounding (2e-16) from run to run, and SVG names clips by a hash of them.
    """
    engine = figure.get_layout_engine()
    if not isinstance(engine, ConstrainedLayoutEngine):
        return
    engine.execute(figure)
    figure.set_layout_engine(None)  # "none" leaves an engine, for which every figure is drawn twice
    for each in _subfigures(figure):
        each.bbox_relative.set_points(np.round(each.bbox_relative.get_points(), 9))
    for axes in figure.axes:
        points = axes.get_position(original=True).get_points()
        axes.set_position(Bbox(np.round(points, 9)))


def _subfigures(figure: FigureBase) -> Iterator[SubFigure]:
    """Go through all figures within a figure; ``findobj`` would place every tick to look at it."""
    for each in figure.subfigs:
        yield each
        yield from _subfigures(each)


def save_figure(
    figure: Figure, target: str | Path | BinaryIO, *, format: str | None = None
) -> None:
    """Write a figure as PNG, SVG or PDF, completely or not at all; same figure, same bytes.

    Parameters
    ----------
    figure : Figure
    target : path or binary stream
    format : str, optional
        "png", "svg" or "pdf"; by default from the path's ending.

    Raises
    ------
    FileError
        The format is unknown, or the file cannot be written.
    """
    check_target(target)
    chosen = chart_format(target) if format is None else known_format(format, f"format {format!r}")
    if isinstance(target, str | Path):
        write_atomically(target, lambda stream: _print(figure, stream, chosen))
    else:
        _print(figure, target, chosen)


def _print(figure: Figure, stream: BinaryIO, chosen: str) -> None:
    settings: dict[str, Style] = {
        "png": {"metadata": {"Software": MAKER}},
        "svg": {"metadata": {"Creator": MAKER, "Date": None}},
        "pdf": {"metadata": {"Creator": MAKER, "CreationDate": None}},
    }
    with chart_style():
        figure.savefig(stream, format=chosen, dpi=DPI, **settings[chosen])


# Red where there is too much light, blue where too little, safe for colour blindness.
_SHADES = "RdBu_r"
_LIGHTEST = 100.0  # range of CIE L*: an amplified difference of this size goes from black to white
_DECADES = 5  # decades of energies per pixel, on either side of the linear part


def new_mosaic(below: SubFigure, width: float, height: float) -> Axes:
    """Make a plane for pictures: lengths are in widths of one, y points down, ticks only name."""
    axes = below.subplots()
    axes.set(xlim=(0.0, width), ylim=(height, 0.0), aspect="equal")
    axes.set(xticks=[], yticks=[])
    axes.tick_params(length=0, top=True, labeltop=True, labelbottom=False)
    axes.spines[:].set_visible(False)
    axes.grid(visible=False)
    return axes


def put_picture(axes: Axes, x: float, y: float, picture: FloatArray) -> None:
    """Draw sRGB codes (H, W, 3) with the upper left corner at (x, y)."""
    _put(axes, x, y, np.clip(picture, 0.0, 1.0))


def put_difference(
    axes: Axes, x: float, y: float, difference: FloatArray, amplified: float
) -> None:
    """Draw a difference (H, W) of lightness, white where it is 0."""
    _put(axes, x, y, difference, norm=_norm(amplified), cmap=_SHADES)


def draw_bar(below: SubFigure, axes: Axes, amplified: float, label: str) -> None:
    """Draw the colour bar of differences, under a mosaic."""
    most = _LIGHTEST / amplified
    below.colorbar(
        ScalarMappable(_norm(amplified), _SHADES),
        ax=axes,
        location="bottom",
        label=label,
        ticks=[-most, -0.5 * most, 0.0, 0.5 * most, most],
        format="{x:g}",
        shrink=0.4,
        aspect=35,
        pad=0.1 / axes.get_ylim()[0],  # share of the mosaic's height: a tenth of a picture
    )


def _put(axes: Axes, x: float, y: float, image: FloatArray, **style: Any) -> None:
    extent = (x, x + 1.0, y + image.shape[0] / image.shape[1], y)
    axes.imshow(image, extent=extent, interpolation="nearest", **style)


def _norm(amplified: float) -> Normalize:
    return Normalize(-_LIGHTEST / amplified, _LIGHTEST / amplified)


def draw_plane(
    axes: Axes, quadrant: FloatArray, half_mm: float, norm: Normalize, shades: str
) -> None:
    """Draw the whole plane of a quadrant with this half width."""
    extent = (-half_mm, half_mm, -half_mm, half_mm)
    axes.imshow(
        full_kernel(quadrant), norm=norm, cmap=shades, extent=extent, interpolation="nearest"
    )
    axes.grid(visible=False)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))


def signed_norm(values: FloatArray, decades: int = _DECADES) -> SymLogNorm:
    """Return a scale for signed values: linear around 0, then decades up to the largest."""
    most = float(np.abs(values).max()) or 1.0
    linear = 10.0 ** (math.floor(math.log10(most)) - decades)
    return SymLogNorm(linear, vmin=-most, vmax=most, base=10)


def tick_powers(bar: Colorbar, norm: SymLogNorm) -> None:
    """Label 0 and powers of ten: the largest on either side, one more above 0."""
    linear, most = round(math.log10(norm.linthresh)), math.floor(math.log10(norm.vmax or 1.0))
    middle = linear + (most - linear) // 2
    bar.set_ticks([-(10.0**most), 0.0, 10.0**middle, 10.0**most])
    bar.set_ticklabels([f"$-10^{{{most}}}$", "0", f"$10^{{{middle}}}$", f"$10^{{{most}}}$"])
    bar.ax.minorticks_off()
