"""Write the figures of docs/how-to-choose.md on error over fetches, and draw its first chart.

python docs/make_fetches.py
"""

import functools
import itertools
import math
import warnings

import numpy as np
from make_cascades import MATERIALS, scenes, whole_profile
from make_relatives import RELATIVES
from make_relatives import best as best_of_searches
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullFormatter, NullLocator
from sections import DOCS, put_section

from sssfit.chart.page import COLOURS, add_legend, name_axes, new_page, save_figure
from sssfit.compare.engines import engines
from sssfit.errors import FitError, SssfitWarning
from sssfit.fit import fit_result
from sssfit.fit.on_taps import on_taps
from sssfit.fit.structures import STRUCTURES
from sssfit.measure.score import measure
from sssfit.render import render
from sssfit.render.reference import render_reference

BUDGETS = (14, 17, 20, 24, 28, 36, 50, 75, 100)
CASCADES = (7, 10, 11, 12, 14, 17, 20, 24, 28, 36)
TAPS = (3, 5, 7, 9, 11, 13, 17, 21, 25, 33, 41, 49)
MOST = 100  # fetches a pixel
MARK_POINTS = 11.0  # between the middles of two marks of engines' samplers
# Name, colour and marker in the chart; the method; the settings of its kernels, and their terms.
PUBLISHED = {
    "pre-integrated": (COLOURS[1], "^", "preintegrated", [({}, 1)]),
    "artist": ("#e69f00", "v", "artist", [({}, 1), ({"target": "kernel"}, 1)]),
    "falloff": ("#56b4e9", "P", "falloff", [({}, 1)]),
    "guided": ("#cc79a7", "D", "guided", [({"k": k}, 1) for k in (0.0, 1.55, 4.0)]),
    "SVD": (COLOURS[2], "o", "svd", [({"rank": n}, n) for n in (1, 2, 3, 4)]),
    "sum of Gaussians": (COLOURS[0], "s", "gaussians", [({"terms": n}, n) for n in (2, 3, 4)]),
}
OURS = {
    "weighted terms": ("#882255", "<", "weighted", [({"rank": n}, n) for n in (1, 2, 3)]),
}
# Marks of the relatives of cascades in the chart, by method.
MARKS = {
    "gaussian-chain": ("chain of Gaussians", {"color": "#661100", "marker": "d", "ls": "none"}),
    "pyramid": ("convolution pyramid", {"color": "#44aa99", "marker": "h", "ls": "none"}),
    "rotated": ("3 or 4 directions", {"color": "#aa4499", "marker": "8", "ls": "none"}),
}
ROTATED = [("", "rotated", {"directions": n, "taps": taps}) for n, taps in ((3, 11), (4, 9))]
PLACES = ("quadratic", "cumulative")


@functools.cache
def truths(name):
    """Return the pictures of the page with the exact profile's own, once a material."""
    profile = whole_profile(name)
    return [(each, render_reference(each, profile)) for each in scenes(0.3)]


def p99(picture_of, name):
    """Return the mean over the pictures of the 99th percentile of Delta E."""
    scores = [measure(picture_of(each), truth, mask=each.mask) for each, truth in truths(name)]
    return float(np.mean([each.delta_e_2000_p99 for each in scores]))


def seen(kernel, name):
    """Return the same of a kernel."""
    return p99(lambda scene: render(scene, kernel), name)


def on_taps_rows(name, groups, places):
    """Yield group, fetches, passes and error of every kernel at every number of taps."""
    profile = whole_profile(name)
    for group, (_, _, method, kernels) in groups.items():
        for settings, terms in kernels:
            dense = fit_result(profile, method, **settings).kernel
            for taps, place in itertools.product(TAPS, places):
                if (terms + 1) * taps > MOST:
                    continue
                try:
                    kernel = on_taps(dense, taps, place=place, profile=profile)
                except FitError:
                    continue
                yield group, kernel.fetches, kernel.passes, seen(kernel, name)


def cascade_rows(name, budgets=CASCADES):
    """Yield fetches, passes, error and structure of the cascade of each budget."""
    profile = whole_profile(name)
    for budget in budgets:
        kernel = fit_result(profile, "cascade", fetches=budget).kernel
        yield kernel.fetches, kernel.passes, seen(kernel, name), kernel.structure


def relative_rows(name):
    """Yield method, fetches and error of the relatives of cascades."""
    profile = whole_profile(name)
    for _, method, settings in (*RELATIVES, *ROTATED):
        kernel = best_of_searches(profile, method, settings)
        yield method, kernel.fetches, seen(kernel, name)


def engine_rows(name):
    """Yield name, fetches, passes and error of the samplers that engines ship."""
    profile = whole_profile(name)
    for each in engines():
        shown = functools.partial(each.render, profile=profile)
        yield each.label, each.fetches, each.passes, p99(shown, name)


def envelope(points):
    """Return the points that none of fewer fetches beats, the cheapest first."""
    kept = []
    for fetches, error in sorted(points):
        if not kept or error < kept[-1][1]:
            kept.append((fetches, error))
    return kept


def best(points, budget):
    """Return the least error within a budget."""
    return min((error for fetches, error in points if fetches <= budget), default=np.nan)


def chart(rows, cascades, ours, shipped, relatives):
    """Draw error over fetches: a line a method, each the best within its fetches."""
    note = (
        "Mean over a disk, edges at 0, 15, 30 and 45 degrees, a head, points and highlights of the "
        "99th percentile of Delta E 2000 against the exact profile's 2D kernel; 256 x 256 pixels "
        "of 0.3 mm. A method's line is the best of its kernels on quadratic or cumulative taps "
        "within the fetches; terms share their first pass. Dotted: the error of the last "
        "cascade, at larger budgets."
    )
    letters = dict(zip("abcdefghijklmnopqrstuvwxyz", (each[0] for each in shipped), strict=False))
    key = ", ".join(f"{letter} {label}" for letter, label in letters.items())
    engines_note = (
        f"Letters: samplers of engines as they ship, one frame: {key}. A letter that would cover "
        "another is moved up."
    )
    title = "skin1: what a budget of fetches shows"
    with new_page(5.6, title, "Exact profile, 0.3 mm a pixel", [note, engines_note]) as (
        figure,
        below,
    ):
        groups = {**PUBLISHED, **OURS}
        styles = {"cascade": {"color": "black", "marker": "*", "ms": 8, "lw": 1.4}}
        for group, (colour, marker, *_) in groups.items():
            styles[group] = {"color": colour, "marker": marker, "ms": 4, "lw": 1.0}
        styles["weighted terms"]["ls"] = (0, (4, 2))
        for words, style in MARKS.values():
            styles[words] = {**style, "ms": 5}
        styles["engines"] = {"color": "#444444", "marker": "$a$", "ms": 5, "ls": "none"}
        handles = [Line2D([], [], **each) for each in styles.values()]
        axes = add_legend(below, handles, list(styles)).subplots()
        for group in groups:
            own = envelope([(f, e) for g, f, _, e in (*rows, *ours) if g == group])
            axes.plot(*zip(*own, strict=True), **styles[group])
        for method, fetches, error in relatives:
            axes.plot([fetches], [error], **styles[MARKS[method][0]])
        own = envelope([(f, e) for f, _, e, _ in cascades])
        axes.plot(*zip(*own, strict=True), **styles["cascade"])
        axes.plot([own[-1][0], 110], [own[-1][1]] * 2, color="black", lw=0.8, ls=(0, (1, 2)))
        marks = [mark(axes, *each) for each in zip(letters, shipped, strict=True)]
        axes.axhline(1.0, color="#666666", lw=0.8, ls=(0, (4, 2)), zorder=1)
        axes.annotate("just noticeable side by side", (105, 1.0), (0, 3), ha="right",
                      textcoords="offset points", size=7.5, color="#444444")  # fmt: skip
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlim(5.4, 240.0)
        axes.set_xticks([6, 8, 10, 14, 20, 30, 50, 70, 100, 200])
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.yaxis.set_minor_formatter(NullFormatter())
        name_axes(axes, "", "texture fetches a pixel", "99th percentile of ΔE 2000, mean")
    set_apart(marks)
    save_figure(figure, DOCS / "skin1-fetches.png")


def mark(axes, letter, sampler):
    """Draw the letter of an engine's sampler, tied to its place by a line."""
    _, fetches, _, error = sampler
    circle = {"boxstyle": "circle,pad=0.15", "fc": "white", "ec": "#666666", "lw": 0.6}
    line = {"arrowstyle": "-", "color": "#666666", "lw": 0.6, "shrinkA": 0.0, "shrinkB": 0.0}
    return axes.annotate(letter, (fetches, error), (0, 0), textcoords="offset points", size=7.5,
                         weight="bold", ha="center", va="center", color="#222222", zorder=6,
                         bbox=circle, arrowprops=line)  # fmt: skip


def set_apart(marks):
    """Move marks that would cover others upwards, in the order of their errors."""
    placed = []
    for each in sorted(marks, key=lambda each: each.xy[1]):
        x, y = each.axes.transData.transform(each.xy) * 72.0 / each.figure.dpi  # points
        up = 0.0
        while any(math.hypot(x - other[0], y + up - other[1]) < MARK_POINTS for other in placed):
            up += 0.5
        each.set_position((0.0, up))
        placed.append((x, y + up))


def row(cells):
    """Return a row of a table."""
    return f"| {' | '.join(cells)} |"


def budget_rows(rows, ours, cascades):
    """Yield a line for each budget: cascade, the best published kernel and ours on taps.

    ``rows`` are the published methods' and the engines'.
    """
    published = [(f, e) for _, f, _, e in rows]
    own = [(f, e) for _, f, _, e in ours]
    chains = [(f, e) for f, _, e, _ in cascades]
    for budget in BUDGETS:
        ours_best, theirs = best(chains, budget), best(published, budget)
        group = min((e, g) for g, f, _, e in rows if f <= budget)[1]
        yield row(
            [
                str(budget),
                f"{ours_best:.2f}",
                f"{theirs:.2f} ({group})",
                f"{best(own, budget):.2f}",
                f"{theirs / ours_best:.0f}",
            ]
        )


def material_rows():
    """Yield a line for each of the other materials: the smallest ratio over the budgets."""
    for name in MATERIALS:
        rows = [*on_taps_rows(name, PUBLISHED, ("cumulative",)), *engine_rows(name)]
        published = [(f, e) for _, f, _, e in rows]
        chains = [(f, e) for f, _, e, _ in cascade_rows(name, (14, 17, 24))]
        ratios = {b: best(published, b) / best(chains, b) for b in BUDGETS}
        worst = min(ratios, key=ratios.get)
        cells = [f"{best(chains, b):.2f} / {best(published, b):.2f}" for b in (14, 24, 50, 100)]
        yield row([name, *cells, f"{ratios[worst]:.1f} at {worst}"])


def short(rows, shipped, cascades, relatives):
    """Return the page's first advice, with its figures; the first relative is as published."""
    chains = [(f, e) for f, _, e, _ in cascades]
    published = [(f, e) for _, f, _, e in (*rows, *shipped)]
    two = min((e, g, f) for g, f, passes, e in rows if passes == 2)
    near = {name: best([(f, e) for n, f, e in relatives if n == name], 22.0) for name in MARKS}
    figures = {
        "eleven": best([*published, *chains], 11.0),
        "fourteen": best(chains, 14.0),
        "twenty_four": best(chains, 24.0),
        "hundred": best(published, 100.0),
        "luebke": relatives[0][2],
        "luebke_fetches": relatives[0][1],
        "chain": near["gaussian-chain"],
        "pyramid": near["pyramid"],
        "two_error": two[0],
        "two": two[1],
        "two_fetches": two[2],
        "stars": STRUCTURES["*|*|*|*"][0],
    }
    return SHORT.format(**figures)


SHORT = """In short (skin1 on pixels of 0.3 mm; figures are the mean over eight pictures of the 99th
percentile of Delta E):

- **From 12 fetches a pixel on, take a cascade.** With 14 fetches it leaves {fourteen:.2f}, with 24
  it leaves {twenty_four:.2f}. `sssfit fit` makes one of 24 fetches, `sssfit fit --fetches 14` the
  cheaper one.
- **Separable kernels stay far behind:** the best published one, or engine's sampler, leaves
  {hundred:.1f} within 100 fetches. [Relatives of cascades](cascades.md#beside-its-relatives)
  come nearer: a chain of six Gaussians as d'Eon and Luebke published it leaves {luebke:.1f} with
  {luebke_fetches:.0f} fetches; within 22 fetches a chain that we fit leaves {chain:.2f}, and a
  convolution pyramid that we fit {pyramid:.2f}.
- **Let the scene say how few will do:** `sssfit choose skin1 --distance 0.6m`. It also knows when
  no blur is needed.
- **Under 12 fetches nothing comes close:** the best kernel within 11 fetches leaves {eleven:.0f}.
- **Where two passes are all there is**, {two} on {two_fetches:.0f} fetches leaves {two_error:.1f};
  four passes of stars (`--passes 4`) leave {stars:.1f} at 16 fetches.
- **Use the exact method** wherever it applies: everywhere except thin slabs with strong forward
  scattering. For those, 1e6 photons are enough."""

TEXT = """\
![Error over fetches: cascades, relatives, separable kernels on taps, engines](skin1-fetches.png)

Dotted in the figure: the error of the last cascade, at larger budgets.

Mean over a disk of 19.2 mm, edges at 0, 15, 30 and 45 degrees, the head, points and highlights of
the 99th percentile of Delta E 2000, the best of each kind within a budget of fetches (skin1, pixels
of 0.3 mm). Published are the separable kernels on taps and the samplers of engines; the relatives
of cascades, also in the figure, have [their own table](cascades.md#beside-its-relatives):

| fetches at most | cascade | best published on taps | weighted on taps | published / cascade |
|---|---|---|---|---|
{budgets}

The samplers of engines, in one frame as they ship (sources in `sssfit/compare/engines.py`):

| engine | fetches | passes | mean of the 99th percentiles |
|---|---|---|---|
{engines}

The same for five materials, but with cascades of 14, 17 and 24 fetches only and published kernels
on cumulative taps only, so that skin1's figures differ from those above. Each pair is cascade /
best published on taps; the last column is the smallest ratio of the two over all budgets from 14 to
100 fetches:

| material | 14 fetches | 24 | 50 | 100 | smallest ratio |
|---|---|---|---|---|---|
{materials}
"""


def main():
    """Write the section and the chart."""
    rows = list(on_taps_rows("skin1", PUBLISHED, PLACES))
    ours = list(on_taps_rows("skin1", OURS, PLACES))
    cascades, shipped = list(cascade_rows("skin1")), list(engine_rows("skin1"))
    relatives = list(relative_rows("skin1"))
    chart(rows, cascades, ours, shipped, relatives)
    words = short(rows, shipped, cascades, relatives)
    command = "python docs/make_fetches.py"
    put_section("how-to-choose.md", "docs/make_fetches.py short", words, command)
    text = TEXT.format(
        budgets="\n".join(budget_rows([*rows, *shipped], ours, cascades)),
        engines="\n".join(row([n, f"{f:g}", str(p), f"{e:.2f}"]) for n, f, p, e in shipped),
        materials="\n".join(material_rows()),
    )
    put_section("how-to-choose.md", "docs/make_fetches.py", text)


if __name__ == "__main__":
    with warnings.catch_warnings():  # of misfits, which the tables show
        warnings.simplefilter("ignore", SssfitWarning)
        main()
