"""Write the figures of docs/how-to-choose.md on error over fetches, and draw its first chart.

python docs/make_fetches.py
"""

import functools
import itertools
import warnings

import numpy as np
from make_cascades import MATERIALS, scenes, whole_profile
from make_relatives import RELATIVES
from make_relatives import best as best_of_searches
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullFormatter, NullLocator
from sections import DOCS, put_section

from sssfit.chart.looks import DASHED, GREY, RULE, look
from sssfit.chart.page import NOTE_SIZE, add_legend, name_axes, new_page, save_figure
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
MARK_POINTS = 12.0  # between the middles of two letters of engines' samplers
LETTERS_AT = 75.0  # their height, in the chart's ΔE
# Method, settings of its kernels, and their terms; by the names in the chart.
PUBLISHED = {
    look(method).name: (method, kernels)
    for method, kernels in {
        "preintegrated": [({}, 1)],
        "artist": [({}, 1), ({"target": "kernel"}, 1)],
        "falloff": [({}, 1)],
        "guided": [({"k": k}, 1) for k in (0.0, 1.55, 4.0)],
        "svd": [({"rank": n}, n) for n in (1, 2, 3, 4)],
        "gaussians": [({"terms": n}, n) for n in (2, 3, 4)],
    }.items()
}
OURS = {look("weighted").name: ("weighted", [({"rank": n}, n) for n in (1, 2, 3)])}
NEAR = ("gaussian-chain", "pyramid", "rotated")  # relatives of cascades, points in the chart
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
    for group, (method, kernels) in groups.items():
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
        "99th percentile of ΔE 2000 against the exact profile's 2D kernel; 256 x 256 pixels "
        "of 0.3 mm. A method's line is the best of its kernels on quadratic or cumulative taps "
        "within the fetches; terms share their first pass. Dotted: the error of the last "
        "cascade, at larger budgets."
    )
    letters = dict(zip("abcdefghijklmnopqrstuvwxyz", (each[0] for each in shipped), strict=False))
    key = ", ".join(f"{letter} {label}" for letter, label in letters.items())
    engines_note = (
        f"Letters: samplers of engines as they ship, one frame, each tied to its place: {key}."
    )
    title = "skin1: what a budget of fetches shows"
    with new_page(5.6, title, "Exact profile, 0.3 mm a pixel", [note, engines_note]) as (
        figure,
        below,
    ):
        groups = {**PUBLISHED, **OURS}
        styles = {"cascade": {**look("cascade").line(5.4), "lw": 1.4}}
        for group, (method, _) in groups.items():
            styles[group] = {**look(method).line(), "lw": 1.0}
        near = {method: {**look(method).points(5.0), "ls": "none"} for method in NEAR}
        styles |= {look(method).name: style for method, style in near.items()}
        styles["engines"] = {"color": GREY, "marker": ".", "ms": 5, "ls": "none"}
        handles = [Line2D([], [], **each) for each in styles.values()]
        axes = add_legend(below, handles, list(styles)).subplots()
        for group in groups:
            own = envelope([(f, e) for g, f, _, e in (*rows, *ours) if g == group])
            axes.plot(*zip(*own, strict=True), **styles[group])
        for method, fetches, error in relatives:
            axes.plot([fetches], [error], **near[method])
        own = envelope([(f, e) for f, _, e, _ in cascades])
        axes.plot(*zip(*own, strict=True), **styles["cascade"])
        axes.plot(
            [own[-1][0], 110],
            [own[-1][1]] * 2,
            color=look("cascade").colour,
            lw=0.8,
            ls=(0, (1, 2)),
        )
        axes.axhline(1.0, color=RULE, lw=0.8, ls=DASHED, zorder=1)
        axes.annotate("just noticeable side by side", (105, 1.0), (0, 3), ha="right",
                      textcoords="offset points", size=NOTE_SIZE, color=GREY)  # fmt: skip
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlim(5.4, 240.0)
        axes.set_xticks([6, 8, 10, 14, 20, 30, 50, 70, 100, 200])
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.set_ylim(0.07, 130.0)
        mean = "99th percentile of ΔE 2000,\nmean over eight pictures"
        name_axes(axes, "", "texture fetches a pixel", mean)
    tie(axes, letters, shipped)
    save_figure(figure, DOCS / "skin1-fetches.png")


def tie(axes, letters, shipped):
    """Draw a dot for each engine's sampler on a page with its layout, tied to its letter."""
    order = sorted(zip(letters, shipped, strict=True), key=lambda each: (each[1][1], -each[1][3]))
    places = axes.transData.transform([(f, e) for _, (_, f, _, e) in order])
    circle = {"boxstyle": "circle,pad=0.15", "fc": "white", "ec": RULE, "lw": 0.6}
    words = {"size": NOTE_SIZE, "weight": "bold", "ha": "center", "va": "center", "color": GREY}
    line = {"arrowstyle": "-", "color": RULE, "lw": 0.6, "shrinkA": 0.0, "shrinkB": 0.0}
    points = 72.0 / axes.get_figure(root=True).dpi
    for (letter, (_, fetches, _, error)), x in zip(
        order, apart(points * places[:, 0]), strict=True
    ):
        at = axes.transData.inverted().transform((x / points, 0.0))[0]
        axes.plot([fetches], [error], marker=".", ms=5, color=GREY, ls="none", zorder=5)
        axes.annotate(letter, (fetches, error), (at, LETTERS_AT), zorder=6,
                      bbox=circle, arrowprops=line, **words)  # fmt: skip


def apart(places):
    """Return rising places in points, moved until they are `MARK_POINTS` from one another."""
    moved = np.array(places, dtype=float)
    for _ in range(1000):
        short = MARK_POINTS - np.diff(moved)
        if (short <= 1e-3).all():
            break
        k = int(short.argmax())
        moved[k : k + 2] += np.array([-0.5, 0.5]) * short[k]
    return moved


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
    near = {name: best([(f, e) for n, f, e in relatives if n == name], 22.0) for name in NEAR}
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
