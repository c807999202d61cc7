"""Write the table of docs/theory.md on the multipole, and its figure, multipole.png.

    python docs/make_multipole.py              1e7 photons a case, a minute on two cores
    python docs/make_multipole.py 1e5 FILE     the figure alone, smaller, elsewhere

The cases are those of tests/checks_models.py; the figure has those whose totals are to agree within
5 %, at every radius.
"""

import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.lines import Line2D
from sections import put_section

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))

import checks_models  # noqa: E402

from sssfit.chart.looks import BLUE, GREY, RULE, VERMILLION  # noqa: E402
from sssfit.chart.page import (  # noqa: E402
    LINE_STYLES,
    LINE_WIDTH,
    NOTE_SIZE,
    add_legend,
    name_axes,
    new_page,
    save_figure,
)
from sssfit.chart.text import count  # noqa: E402

FULL = 10_000_000
MINUS = "\N{MINUS SIGN}"
NAMES = {"R_d": "reflected", "T": "transmitted"}
STYLES = {
    name: {"color": colour, "linestyle": dashes, "lw": LINE_WIDTH}
    for name, colour, dashes in zip(NAMES, (VERMILLION, BLUE), LINE_STYLES, strict=False)
}
MOST_MM, LEAST_PERCENT, MOST_PERCENT = 25.0, -100.0, 80.0
NOTE = (
    "Difference of the energy in annuli, the multipole's less the walk's, over the walk's; annuli "
    "of .25 mm, wider where the walk has too few photons. Bands: ±1 standard error of the walk. In "
    "the panels: the difference of the totals."
)
BANDS_MM = (0.0, 0.25, 1.0, 2.0, 5.0, 10.0, 20.0)
TABLE = """\
The walk has {photons:,} photons in each case. One standard error of its totals is at most
{noise:.2f} % of them, except for the faint T of the layer of albedo .7, where it is {faint:.2f} %.

| case | | walk | multipole | total | misplaced | {bands} |
|{rules}
"""


def percent(share):
    """Return a signed percentage, with a digit after the point below 10."""
    return f"{100.0 * share:+.{1 if abs(share) < 0.1 else 0}f} %"


def row(difference):
    """Return a line of the table; a bin belongs to the band in which it begins."""
    bands = np.searchsorted(BANDS_MM, difference.r_mm + 1e-9) - 1
    apart = [
        difference.energy[bands == k].sum() / difference.walk_energy[bands == k].sum() - 1.0
        for k in range(len(BANDS_MM) - 1)
    ]
    what, kind = difference.what.rsplit(": ", 1)
    cells = [
        what if kind == "R_d" else "",
        kind[0],
        f"{difference.walk_total:.5f}",
        f"{difference.total:.5f}",
        percent(difference.relative),
        f"{100.0 * difference.misplaced:.0f} %",
        *(f"{100.0 * each:+.0f} %" for each in apart),
    ]
    return f"| {' | '.join(cells)} |"


def table(photons, cases):
    """Return the table of all cases, and what stands above it."""
    found = [
        difference
        for what, material in cases.items()
        for difference in checks_models.multipole_against_walk(material, what, photons)
    ]
    *_, noise, faint = sorted(100.0 * each.noise for each in found)
    bands = [f"{a:g}-{b:g}" for a, b in pairwise(BANDS_MM)]
    head = TABLE.format(
        photons=photons,
        noise=noise,
        faint=faint,
        bands=" | ".join([f"r < {BANDS_MM[1]:g}", *bands[1:]]),
        rules="---|" * (6 + len(bands)),
    )
    return head + "\n".join(map(row, found))


def draw(axes, what, found):
    """Draw one case: relative difference of R and T by radius, the walk's noise as bands."""
    totals = []
    for difference in found:
        name = difference.what.rsplit(": ", 1)[1]
        style = STYLES[name]
        # The last bin has no outer edge; curves hold each value across its bin.
        r_mm = np.append(difference.r_mm, difference.r_mm[-1] + 0.25)
        apart = 100.0 * np.append(difference.relative_by_radius, difference.relative_by_radius[-1])
        noise = 100.0 * difference.walk_stderr * difference.energy / difference.walk_energy**2
        noise = np.append(noise, noise[-1])
        totals.append(f"{NAMES[name]} {100.0 * difference.relative:+.1f} %".replace("-", MINUS))
        axes.step(r_mm, apart, where="post", **style)
        band = {"step": "post", "color": style["color"], "alpha": 0.25, "linewidth": 0}
        axes.fill_between(r_mm, apart - noise, apart + noise, **band)
    axes.axhline(0.0, color=RULE, lw=0.8, zorder=1)
    axes.set_xlim(0.0, MOST_MM)
    axes.set_ylim(LEAST_PERCENT, MOST_PERCENT)
    text = f"totals: {', '.join(totals)}"
    axes.text(0.97, 0.06, text, transform=axes.transAxes, ha="right", size=NOTE_SIZE, color=GREY)
    name_axes(axes, what, "", "")


def figure(photons, cases):
    """Draw all cases."""
    title, where = "Multipole against the layered walk", f"{count(photons)} photons a case, seed 1"
    with new_page(5.6, title, where, [NOTE]) as (page, below):
        handles = [Line2D([], [], **each) for each in STYLES.values()]
        panels = add_legend(below, handles, list(NAMES.values())).subplots(
            2, 2, sharex=True, sharey=True
        )
        for axes, (what, material) in zip(panels.flat, cases.items(), strict=False):
            draw(axes, what, checks_models.multipole_against_walk(material, what, photons))
        for axes in panels[:, 0]:
            axes.set_ylabel("difference of energy (%)")
        for axes in panels[1]:
            axes.set_xlabel("r (mm)")
    return page


def main():
    """Write the figure, and the table unless the figure goes elsewhere."""
    photons = int(float(sys.argv[1])) if len(sys.argv) > 1 else FULL
    path = Path(sys.argv[2]) if len(sys.argv) > 2 else ROOT / "docs" / "multipole.png"
    save_figure(figure(photons, checks_models.DIFFUSE), path)
    if len(sys.argv) == 1:
        cases = {**checks_models.DIFFUSE, **checks_models.BEYOND}
        put_section("theory.md", "docs/make_multipole.py", table(photons, cases))


if __name__ == "__main__":
    main()
