"""Write what the slab algebra of sums of Gaussians leaves out: its error against the exact stack.

python docs/make_slab_algebra.py

Two slabs of equal optical depth, each solved alone between clear media of its own index, are fitted
with Gaussians and put on one another (`sssfit.simulate.slabs`); the exact solver has both at once.
"""

from itertools import pairwise

import numpy as np
from matplotlib.lines import Line2D
from sections import DOCS, put_section

from sssfit.chart.page import add_legend, name_axes, new_page, save_figure
from sssfit.material import Layer, Material
from sssfit.simulate import simulate_exact
from sssfit.simulate.slabs import GaussianSlab, GaussianSum, combined

DEPTHS = (0.5, 1.0, 2.0, 5.0)  # optical depth of each slab, and its thickness in mm
UPPER, LOWER = (0.02, 0.98), (0.05, 0.95)  # sigma_a, sigma_s [1/mm]; g = 0, index 1
GRID = {"dr_mm": 0.1, "radius_mm": 40.0, "tolerance": 1e-4}
SHOWN_MM = (0.2, 30.0)
CERTAIN = 0.02  # largest error of the exact light in an annulus that is drawn, of the light
COLOURS = (
    "#000000",
    "#d55e00",
    "#009e73",
    "#0072b2",
)  # Okabe and Ito 2008, "Color Universal Design"
DASHES = ("-", (0, (4, 1.6)), (0, (6, 1.6, 1.2, 1.6)), (0, (1.2, 1.4)))

TEXT = """Two slabs on one another, both of the same optical depth, isotropic, index 1, albedo .98
on .95, by products of sums of Gaussians (`sssfit.simulate.slabs`) and by the exact solver; errors
as shares of the exact R and T, and the largest difference of F(r) above as a share of R:

| optical depth of each | R, exact | error of R | T, exact | error of T | F(r), largest |
|---|---|---|---|---|---|
{rows}

![Errors of R_d(r) and T(r) by the algebra of slabs, over the radius](slab-algebra.png)

The algebra treats light between two slabs as a beam along the normal. It comes in at all angles, so
less of it crosses than the algebra lets through, and what crosses thin slabs goes further aside."""


def layers_of(*slabs):
    """Return slabs, pairs of coefficients and thickness, as a material."""
    one = np.zeros(1)
    made = [
        Layer(1.0, one, np.array([absorbs]), np.array([scatters]), thickness)
        for (absorbs, scatters), thickness in slabs
    ]
    return Material("slabs", ("c",), tuple(made))


def gaussian_slab(profile):
    """Fit what a slab does with Gaussians."""
    reflected = profile.annulus_energy[:, 0], profile.beyond_grid[0]
    transmitted = profile.annulus_transmittance[:, 0], profile.beyond_grid_transmittance[0]
    sums = (GaussianSum.fitted(profile.r_edges_mm, *each) for each in (reflected, transmitted))
    return GaussianSlab.symmetric(*sums)


def pair_of(depth):
    """Return both slabs by the algebra, and exactly."""
    slabs = (UPPER, depth), (LOWER, depth)
    one, two, both = (simulate_exact(layers_of(*each), **GRID) for each in (*zip(slabs), slabs))
    return combined(gaussian_slab(one), gaussian_slab(two)), both


def row_of(depth, found, exact):
    """Write a row of the table."""
    r, t = float(exact.diffuse_reflectance[0]), float(exact.transmittance[0])
    apart = found.reflected.cumulative(exact.r_edges_mm[1:]) - exact.cumulative[1:, 0]
    errors = (found.reflected.total / r - 1.0), (found.transmitted.total / t - 1.0)
    largest = float(np.abs(apart).max()) / r
    return (
        f"| {depth:g} | {r:.4f} | {100.0 * errors[0]:+.1f} % | {t:.4f} | {100.0 * errors[1]:+.1f} %"
        f" | {100.0 * largest:.1f} % |"
    )


def errors_of(found, exact):
    """Yield the errors in percent of the light in annuli of growing width, above and below."""
    edges = exact.r_edges_mm
    places = np.unique(np.searchsorted(edges, np.geomspace(*SHOWN_MM, 25)))
    middle = np.sqrt(edges[places[1:]] * edges[places[:-1]])
    sides = (
        (found.reflected, exact.annulus_energy, exact.annulus_energy_stderr),
        (found.transmitted, exact.annulus_transmittance, exact.annulus_transmittance_stderr),
    )
    for sums, energy, stderr in sides:
        true, uncertain = (
            np.array([np.sum(each[a:b, 0]) for a, b in pairwise(places)])
            for each in (energy, stderr)
        )
        is_certain = uncertain < CERTAIN * true
        ours = np.diff(sums.cumulative(edges[places]))[is_certain]
        yield middle[is_certain], 100.0 * (ours / true[is_certain] - 1.0)


def draw(pairs):
    """Draw the errors of R_d(r) and T(r), a line a depth."""
    styles = [
        {"color": colour, "ls": dashes} for colour, dashes in zip(COLOURS, DASHES, strict=True)
    ]
    handles = [Line2D([], [], **style) for style in styles]
    names = [f"optical depth {depth:g} each" for depth in pairs]
    title = "Two slabs as sums of Gaussians"
    about = "Error of the algebra against the exact stack; albedo .98 on .95, isotropic, index 1"
    note = "A mean free path is 1 mm. Annuli whose exact light is known to 2 % or better."
    with new_page(3.6, title, about, [note]) as (figure, below):
        sides = add_legend(below, handles, names).subplots(1, 2, sharey=True)
        for style, pair in zip(styles, pairs.values(), strict=True):
            for axes, line in zip(sides, errors_of(*pair), strict=True):
                axes.plot(*line, **style)
        for axes, name, label in zip(
            sides, ("reflected, R_d(r)", "transmitted, T(r)"), ("error, percent", ""), strict=True
        ):
            axes.set_xscale("log")
            axes.axhline(0.0, color="#666666", lw=0.8, zorder=1)
            name_axes(axes, name, "radius, mm", label)
    save_figure(figure, DOCS / "slab-algebra.png")


def main():
    """Solve, draw and write."""
    pairs = {depth: pair_of(depth) for depth in DEPTHS}
    draw(pairs)
    rows = "\n".join(row_of(depth, *pair) for depth, pair in pairs.items())
    put_section("layers.md", "docs/make_slab_algebra.py", TEXT.format(rows=rows))


if __name__ == "__main__":
    main()
