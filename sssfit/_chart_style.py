"""How charts look: sizes, fonts, colours and dashes."""

from typing import Any

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
