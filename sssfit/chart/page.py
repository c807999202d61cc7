"""The page a chart stands on: style, measured text, footnotes, axes with their names.

What every figure of ``sssfit.chart`` is drawn with; the words are in ``sssfit.chart.text``.
"""

import contextlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, BinaryIO, cast

import matplotlib as mpl
from matplotlib import font_manager
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ft2font import FT2Font
from matplotlib.ticker import MaxNLocator, StrMethodFormatter

from sssfit.chart.files import MAKER, chart_format, known_format
from sssfit.files import write_atomically

Style = dict[str, Any]

WIDTH_INCHES, HEIGHT_INCHES, DPI = 8.0, 6.0, 200  # 1600 x 1200 pixels
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
    "legend.frameon": False,
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


def new_figure(height_inches: float = HEIGHT_INCHES) -> Figure:
    """Make an empty page, 8 inches wide."""
    figure = Figure(figsize=(WIDTH_INCHES, height_inches), dpi=DPI)
    FigureCanvasAgg(figure)
    return figure


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
    figure.text(left, y, drawable(text), va="center", parse_math=False, **style)


def drawable(text: str) -> str:
    """Replace what the font has no glyph for."""
    font = _font()
    return "".join(c if font.get_char_index(ord(c)) else "?" for c in text)


def tick(axis: Axis) -> None:
    """Tick a linear axis at round numbers, written plainly."""
    axis.set_major_locator(MaxNLocator(7, steps=[1, 2, 2.5, 5, 10]))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))


def name_axes(axes: Axes, title: str, x_label: str, y_label: str) -> None:
    """Give a panel its title and labels; only the last may hold formulas."""
    axes.set_title(drawable(title), loc="left", parse_math=False)
    axes.set_xlabel(drawable(x_label), parse_math=False)
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
