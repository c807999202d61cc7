"""The page a chart stands on: style, measured text, footnotes, axes with their names.

What every figure of ``sssfit.chart`` is drawn with; the words are in ``sssfit._chart_text``.
"""

import contextlib
from collections.abc import Iterator, Sequence
from typing import Any, cast

import matplotlib as mpl
from matplotlib import font_manager
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ft2font import FT2Font
from matplotlib.ticker import MaxNLocator, StrMethodFormatter

from sssfit._chart_style import DPI, FONT, HEIGHT_INCHES, LEFT, RC, RIGHT, WIDTH_INCHES

TEXT_INCHES = (RIGHT - LEFT) * WIDTH_INCHES
NOTE_SIZE, NOTE_COLOUR = 7.5, "#444444"


def new_figure(height_inches: float = HEIGHT_INCHES) -> Figure:
    """Make an empty page, 8 inches wide."""
    figure = Figure(figsize=(WIDTH_INCHES, height_inches), dpi=DPI)
    FigureCanvasAgg(figure)
    return figure


@contextlib.contextmanager
def chart_style() -> Iterator[None]:
    """Matplotlib's defaults and ours on top, whatever the user's matplotlibrc says."""
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
