"""Write the figures of docs/layers.md: errors over directions and time, and the walk's way there.

python docs/make_layers.py

Errors are the largest difference of F(r) at an edge of the paper's grid, as a share of the light
that leaves, from the answer with 28 directions. Seconds are processor time on one thread, of all
that is solved up to a number of directions.
"""

import time

import numpy as np
from matplotlib.lines import Line2D
from sections import DOCS, put_section

from sssfit.chart.page import add_legend, name_axes, new_page, save_figure
from sssfit.grid import make_grid
from sssfit.material import Layer, Material
from sssfit.process import one_blas_thread
from sssfit.simulate import simulate_exact, simulate_montecarlo
from sssfit.simulate.stack.quarter import quarter_of
from sssfit.simulate.stack.sampling import Family
from sssfit.simulate.stack.slabs import stacks_of
from sssfit.simulate.stack.solution import steps

COUNTS = (8, 12, 16, 20, 24, 28)
TOLERANCE = 1e-4
PHOTONS = (10_000, 100_000, 1_000_000, 4_000_000)
# Each layer: sigma_a, sigma_s [1/mm], g, eta, and thickness [mm] if it ends.
STACKS = {
    "half space, g 0": [(0.03, 0.74, 0.0, 1.3)],
    "half space, g .8": [(0.03, 3.7, 0.8, 1.3)],
    "half space, g .95": [(0.03, 14.8, 0.95, 1.3)],
    "skin, two layers, g .8": [(0.6, 22.0, 0.8, 1.45, 0.1), (0.12, 11.0, 0.8, 1.38)],
    "three layers, g .8 to .9": [
        (0.5, 20.0, 0.8, 1.45, 0.1),
        (0.1, 30.0, 0.9, 1.4, 1.0),
        (0.05, 8.0, 0.8, 1.44),
    ],
    "absorber on top": [(3.0, 0.0, 0.0, 1.5, 0.1), (0.05, 5.0, 0.7, 1.4)],
    "wax on paint, g .5": [(0.01, 1.5, 0.5, 1.43, 1.0), (0.5, 60.0, 0.5, 1.5)],
    "leaf, .25 mm, g .8": [(0.3, 40.0, 0.8, 1.42, 0.25)],
    "milk on glass, g .7": [(0.002, 8.0, 0.7, 1.35, 1.0), (0.0, 0.0, 0.0, 1.5, 1.0)],
    "thin slab, g .9": [(0.1, 10.0, 0.9, 1.4, 0.2)],
}
WALKED = "skin, two layers, g .8"
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#000000")

TEXT = """Ten stacks of one channel, whose coefficients are in the script: the largest error of F(r)
with N directions, as a share of the light that leaves above and below (from the answer with 28),
the directions in azimuth, a quarter, that a tolerance of 1e-4 asks for, and the processor seconds
up to the solution with 20 directions.

| stack | {heads} | azimuths | seconds |
|---|{rules}---|---|
{rows}

![Errors of ten stacks over the directions, and over the seconds](layers.png)

Dashed in the figure: the tolerance of 1e-4, the default of the solver.

The walk comes to the same answer. {walked}: the largest difference of F(r) between the
walk and the exact profile (tolerance 2e-5), beside the walk's own standard error:

| photons | largest difference, share of the light | largest standard error of F |
|---|---|---|
{walks}"""


def material_of(name):
    """Return a stack as a material of one channel."""
    layers = [
        Layer(eta, np.array([g]), np.array([absorbs]), np.array([scatters]), *end)
        for absorbs, scatters, g, eta, *end in STACKS[name]
    ]
    return Material("stack", ("c",), tuple(layers))


def rows_of(name):
    """Return errors and seconds by number of directions, and the directions in azimuth."""
    material = material_of(name)
    family = Family(tuple(stacks_of(material)))
    radii = [make_grid(material).r_edges_mm[1:]]
    found, seconds = {}, {}

    def each(sample, k):
        return np.stack([sample(float(one)) for one in k])

    begun = time.process_time()
    quarter = quarter_of(family, radii, TOLERANCE, each)
    specular = [material.specular_reflectance]
    for step in steps(family, radii, specular, COUNTS, quarter, TOLERANCE, each):
        found[step.count] = step.answers[0]
        seconds[step.count] = time.process_time() - begun
    finest = found.pop(COUNTS[-1])
    errors = {count: _apart(answer, finest) for count, answer in found.items()}
    return errors, seconds, quarter.count


def _apart(answer, finest):
    """Return the largest difference of F on either side, as a share of the light."""
    sides = [(answer.reflected, finest.reflected)]
    if finest.transmitted is not None:
        sides.append((answer.transmitted, finest.transmitted))
    return max(float(np.abs(a.edges - b.edges).max()) for a, b in sides) / finest.leaving


def walks():
    """Yield rows: photons, the largest difference of F, and the walk's own largest error."""
    material = material_of(WALKED)
    exact = simulate_exact(material, tolerance=2e-5)
    total = float(exact.diffuse_reflectance[0])
    for photons in PHOTONS:
        walk = simulate_montecarlo(material, photons=photons)
        apart = float(np.abs(walk.cumulative - exact.cumulative).max()) / total
        error = float(walk.cumulative_stderr.max()) / total
        yield f"| {photons:,} | {apart:.1e} | {error:.1e} |"


def draw(results):
    """Draw errors over directions and over seconds."""
    handles = [
        Line2D([], [], color=COLOURS[k % 5], ls="-" if k < 5 else (0, (4, 2)), marker="o", ms=4)
        for k in range(len(results))
    ]
    title = "Error of F(r): ten stacks by the layer solver"
    note = (
        "From the answer with 28 directions; processor time on one thread, from the beginning. "
        f"Dashed: the tolerance of {TOLERANCE:g}."
    )
    with new_page(5.4, title, "Largest error, as a share of the light that leaves", [note]) as page:
        figure, below = page
        left, right = add_legend(below, handles, list(results)).subplots(1, 2, sharey=True)
        for handle, (errors, seconds, _) in zip(handles, results.values(), strict=True):
            style = {"color": handle.get_color(), "ls": handle.get_linestyle(), "marker": "o"}
            values = list(errors.values())
            left.plot(list(errors), values, ms=4, **style)
            right.plot([seconds[each] for each in errors], values, ms=4, **style)
        for axes in (left, right):
            axes.set_yscale("log")
            axes.axhline(TOLERANCE, color="#666666", lw=0.8, ls=(0, (4, 2)), zorder=1)
        right.set_xscale("log")
        left.set_xticks(COUNTS[1:-1])
        name_axes(left, "", "directions on either side, N", "largest error of F")
        name_axes(right, "", "processor seconds", "")
    save_figure(figure, DOCS / "layers.png")


def main():
    """Solve, draw and write."""
    with one_blas_thread():
        results = {name: rows_of(name) for name in STACKS}
    draw(results)
    shown = COUNTS[1:-1]
    rows = "\n".join(
        f"| {name} | {' | '.join(f'{errors[n]:.1e}' for n in shown)} | {azimuths} "
        f"| {seconds[20]:.1f} |"
        for name, (errors, seconds, azimuths) in results.items()
    )
    text = TEXT.format(
        heads=" | ".join(f"N = {n}" for n in shown),
        rules="---|" * len(shown),
        rows=rows,
        walked=WALKED.capitalize(),
        walks="\n".join(walks()),
    )
    put_section("layers.md", "docs/make_layers.py", text)


if __name__ == "__main__":
    main()
