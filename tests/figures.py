"""What every figure is held to: nothing cut off, no text on another."""

import itertools
import warnings

import numpy as np
from matplotlib.legend import Legend
from matplotlib.text import Text


def assert_legible(draw):
    """Draw without a warning; every text lies inside the page and clear of the others.

    Returns the figure.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure = draw()
        texts = drawn_texts(figure)
    width, height = figure.bbox.size
    for text, box in texts:
        inside = box.x0 >= 0 and box.y0 >= 0 and box.x1 <= width and box.y1 <= height
        assert inside, (text, box)
    assert not overlapping(texts)
    return figure


def overlapping(texts):
    """The pairs of texts that share two pixels or more; a page has some 10 000 pairs."""
    low = np.array([(box.x0, box.y0) for _, box in texts]).reshape(-1, 2) + 1.0
    high = np.array([(box.x1, box.y1) for _, box in texts]).reshape(-1, 2) - 1.0
    shared = ((low[:, None] <= high) & (low <= high[:, None])).all(axis=2)
    pairs = np.argwhere(np.triu(shared, 1))
    return [(texts[i][0], texts[j][0]) for i, j in pairs]


def drawn_texts(figure):
    """Every text that is drawn, with its extent in pixels."""
    figure.draw_without_rendering()
    renderer = figure.canvas.get_renderer()
    hidden = set()
    for axes, name in itertools.product(figure.findobj(match=is_axes), ("x", "y")):
        axis = getattr(axes, f"{name}axis")
        low, high = sorted(axis.get_view_interval())
        ticks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
        shown = [low <= each.get_loc() <= high for each in ticks]
        pairs = zip(ticks, shown, strict=True)
        hidden |= {label for tick, seen in pairs for label in labels_of(tick, seen)}
    texts = [
        each
        for each in figure.findobj(Text)
        if each.get_visible() and each.get_text().strip() and each not in hidden
    ]
    return [(each.get_text(), each.get_window_extent(renderer)) for each in texts]


def words_of(figure):
    """All text from the top down, so that notes read as they were written."""
    texts = sorted(drawn_texts(figure), key=lambda each: -each[1].y1)
    return " ".join(text for text, _ in texts)


def legends_of(figure):
    """The legends of the page, which stand over its panels."""
    inside = {axes.get_legend() for axes in figure.axes}
    return [each for each in figure.findobj(Legend) if each not in inside]


def is_axes(artist):
    return hasattr(artist, "get_xaxis")


def labels_of(tick, seen):
    """The labels of a tick that are not drawn."""
    return [label for label in (tick.label1, tick.label2) if not (seen and label.get_visible())]
