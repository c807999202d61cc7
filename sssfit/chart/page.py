"""The page a chart stands on: style, measured text, footnotes, axes with their names.

What every figure of ``sssfit.chart`` is drawn with; the words are in ``sssfit.chart.text``.
"""

import contextlib
import io
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, BinaryIO, cast

import matplotlib as mpl
from matplotlib import font_manager
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure, SubFigure
from matplotlib.ft2font import FT2Font
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.legend import Legend
from matplotlib.legend_handler import HandlerBase
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator, StrMethodFormatter

from sssfit.chart.files import MAKER, chart_format, known_format
from sssfit.files import write_atomically

Style = dict[str, Any]
Handle = Artist | tuple[Artist, ...]  # what stands in a legend: drawn over each other, if several

WIDTH_INCHES, HEIGHT_INCHES, DPI = 8.0, 6.0, 200  # 1600 x 1200 pixels
MARGIN_INCHES = 0.1
LEFT, RIGHT = 0.092, 0.982  # of the width
ROW_GAP_INCHES = 0.66
FONT = "DejaVu Sans"  # comes with matplotlib: the same glyphs on every machine
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
LINE_STYLES: tuple[Any, ...] = ("-", (0, (4, 1.6)), (0, (6, 1.6, 1.2, 1.6)), (0, (1.2, 1.4)))


TEXT_INCHES = (RIGHT - LEFT) * WIDTH_INCHES
NOTE_SIZE, NOTE_COLOUR = 7.5, "#444444"


class _Page(Figure):
    """A figure that a notebook shows as it is written, without a backend of matplotlib's."""

    def _repr_png_(self) -> bytes:
        stream = io.BytesIO()
        save_figure(self, stream, format="png")
        return stream.getvalue()


def new_figure(height_inches: float = HEIGHT_INCHES) -> Figure:
    """Make an empty page, 8 inches wide."""
    figure = _Page(figsize=(WIDTH_INCHES, height_inches), dpi=DPI)
    FigureCanvasAgg(figure)
    return figure


def new_page(
    height_inches: float, title: str, subtitle: str, notes: Sequence[str] = ()
) -> tuple[Figure, SubFigure]:
    """Make a page, 8 inches wide, with its title and provenance at the head and notes at the foot.

    Returns the figure, and what is left of it for `add_legend`, `add_table` and panels. Each takes
    the head of a subfigure and leaves the rest: matplotlib lets nothing else share that place.
    """
    margins = MARGIN_INCHES / WIDTH_INCHES, MARGIN_INCHES / height_inches
    layout = ConstrainedLayoutEngine(
        rect=(*margins, 1 - 2 * margins[0], 1 - 2 * margins[1]), w_pad=0.05, h_pad=0.045
    )
    figure = _Page(figsize=(WIDTH_INCHES, height_inches), dpi=DPI, layout=layout)
    FigureCanvasAgg(figure)
    page = _rest(figure)
    left: Style = {"x": 0.0, "ha": "left", "wrap": True}
    page.suptitle(drawable(title), fontsize=12, fontweight="bold", **left)
    foot = "\n".join(drawable(each) for each in notes)
    page.supxlabel(foot, fontsize=NOTE_SIZE, color=NOTE_COLOUR, **left)
    below = _rest(page)
    below.suptitle(drawable(subtitle), fontsize=RC["font.size"], **left)
    return figure, _rest(below)


def _rest(figure: Figure | SubFigure) -> SubFigure:
    """Return what the title, notes and legends of a figure leave of it."""
    return cast(SubFigure, figure.subfigures())


def add_legend(
    below: SubFigure, handles: Sequence[Handle], labels: Sequence[str], *, title: str = ""
) -> SubFigure:
    """Explain handles at the head of a subfigure, in as many columns as fit; return the rest."""
    room = (WIDTH_INCHES - 2 * MARGIN_INCHES) * DPI
    for columns in range(min(4, len(handles)), 0, -1):
        legend = _draw_legend(below, handles, labels, columns, title)
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
    """Tabulate rows of a name and figures at the head of a subfigure; return the rest.

    A row's handle stands before its name; ``heads`` begin with that of the names.
    """
    blank = _Blank()
    cells = list(zip(heads, *([name, *figures] for name, figures in rows), strict=True))
    names = [blank, *(handles or [blank] * len(rows))]
    every = [*names, *[blank] * (len(names) * (len(cells) - 1))]
    legend = _draw_legend(below, every, [each for column in cells for each in column], len(cells))
    for head in legend.get_texts()[:: len(names)]:
        head.set_color(NOTE_COLOUR)
    return _rest(below)


class _Blank(Line2D):
    """The handle of a cell that has none."""

    def __init__(self) -> None:
        super().__init__([], [])


class _NoRoom(HandlerBase):
    """Gives a blank handle no room."""

    def legend_artist(self, *given: Any) -> Artist:
        """Set the width of the handle's box, which comes last, to 0."""
        _, orig_handle, _, handlebox = given
        handlebox.width = 0.0
        return cast(Artist, orig_handle)


def _draw_legend(
    below: SubFigure,
    handles: Sequence[Handle],
    labels: Sequence[str],
    columns: int,
    title: str = "",
) -> Legend:
    legend = below.legend(
        cast(Sequence[Artist], handles),  # matplotlib's stubs know of no tuples
        [drawable(each) for each in labels],
        ncols=columns,
        loc="outside upper left",
        title=title or None,
        alignment="left",
        borderaxespad=0,
        borderpad=0.2,
        labelspacing=0.35,
        handlelength=2.8,
        columnspacing=1.5,
        handler_map={_Blank: _NoRoom()},
    )
    legend.get_title().set_color(NOTE_COLOUR)
    return legend


@contextlib.contextmanager
def chart_style() -> Iterator[None]:
    """Matplotlib's defaults and ours on top, independent of the user's matplotlibrc."""
    kept = {"backend", "backend_fallback", "interactive", "toolbar", "timezone"}
    defaults = {key: value for key, value in mpl.rcParamsDefault.items() if key not in kept}
    with mpl.rc_context(cast(Any, defaults | RC)):
        yield


def draw_footnotes(figure: Figure, notes: Sequence[str]) -> float:
    """Caption at the foot; the height where the panels may begin, as a fraction."""
    height = figure.get_figheight()
    lines = [line for note in notes for line in _wrapped(note, NOTE_SIZE)]
    for k, line in enumerate(reversed(lines)):
        draw_text(figure, height - 0.12 - 0.145 * k, line, size=NOTE_SIZE, color=NOTE_COLOUR)
    return (0.6 + 0.145 * len(lines)) / height


def _wrapped(text: str, size: float) -> list[str]:
    """Break a text into lines of the figure's width."""
    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".lstrip()
        if inches(longer, size) <= TEXT_INCHES:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines


def inches(text: str, size: float) -> float:
    """Width of a line of text at a font size in points."""
    font = _font()
    font.set_size(size, 720)  # at 72 dpi hinting widens a line by 3 %
    font.set_text(drawable(text))
    return float(font.get_width_height()[0] / 64 / 720)  # 26.6 fixed-point pixels


def fitting(choices: Sequence[str], size: float, width_inches: float) -> str:
    """Return the first text that is no wider, or the last where none fits."""
    fits = (each for each in choices if inches(each, size) <= width_inches)
    return next(fits, choices[-1])


def _font() -> FT2Font:
    return font_manager.get_font(font_manager.findfont(FONT))


def draw_text(
    figure: Figure, inches_down: float, text: str, *, left: float = LEFT, **style: Any
) -> None:
    """Put a line at the left margin, or so far right of it as a share of the width."""
    y = 1 - inches_down / figure.get_figheight()
    figure.text(left, y, drawable(text), va="center", **style)


def drawable(text: str) -> str:
    """Replace what the font has no glyph for, and keep dollars from opening a formula."""
    font = _font()
    known = "".join(c if c == "\n" or font.get_char_index(ord(c)) else "?" for c in text)
    return known.replace("$", r"\$")


def tick(axis: Axis) -> None:
    """Tick a linear axis at round numbers, written plainly."""
    axis.set_major_locator(MaxNLocator(7, steps=[1, 2, 2.5, 5, 10]))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))


def name_axes(axes: Axes, title: str, x_label: str, y_label: str) -> None:
    """Give a panel its title and labels; only the last may hold formulas."""
    axes.set_title(drawable(title), loc="left")
    axes.set_xlabel(drawable(x_label))
    axes.set_ylabel(y_label)


def save_figure(
    figure: Figure, target: str | Path | BinaryIO, *, format: str | None = None
) -> None:
    """Write a figure as PNG, SVG or PDF, whole or not at all; same figure, same bytes.

    Parameters
    ----------
    figure : Figure
    target : path or binary stream
    format : str, optional
        "png", "svg" or "pdf"; by default what the path's ending says.

    Raises
    ------
    FileError
        Another format, or the file cannot be written.
    """
    chosen = chart_format(target) if format is None else known_format(format, f"format {format!r}")
    if isinstance(target, str | Path):
        write_atomically(Path(target), lambda stream: _print(figure, stream, chosen))
    else:
        _print(figure, target, chosen)


def _print(figure: Figure, stream: BinaryIO, chosen: str) -> None:
    # Level 8 takes 0.2 s more than the default and 5 % off a PNG's 310 kB.
    settings: dict[str, Style] = {
        "png": {"pil_kwargs": {"compress_level": 8}, "metadata": {"Software": MAKER}},
        "svg": {"metadata": {"Creator": MAKER, "Date": None}},
        "pdf": {"metadata": {"Creator": MAKER, "CreationDate": None}},
    }
    with chart_style():
        figure.savefig(stream, format=chosen, dpi=DPI, **settings[chosen])
