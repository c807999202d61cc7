"""Write the figures of docs/cascades.md: budgets, materials, pixel sizes; one point of light.

python docs/make_cascades.py
python docs/make_cascades.py full
python docs/make_cascades.py structures '1|1-2|2-2' '*|*|*'

The second writes what cascades leave without halvings. The third prints lines for the table of
``sssfit/fit/structures.py``: of structures that are named, or of all that it knows.
"""

import sys
from dataclasses import replace

import numpy as np
from sections import DOCS, put_section

from sssfit.chart import figure_of
from sssfit.chart.page import save_figure
from sssfit.compare import view_taps
from sssfit.fit import fit_artist, fit_preintegrated, fit_svd, fit_taps, fit_weighted
from sssfit.fit.structures import STRUCTURES
from sssfit.grid import paper_grid
from sssfit.kernel import Taps
from sssfit.material import load_material
from sssfit.measure.score import measure
from sssfit.render import render
from sssfit.render.reference import render_reference
from sssfit.scene.made import make_scene
from sssfit.simulate import simulate_exact
from sssfit.simulate.truth import exact_with_all_light

PICTURES = (
    ("disk", {"radius_mm": 19.2}),
    *(("edge", {"angle_degrees": angle}) for angle in (0, 15, 30, 45)),
    ("head", {}),
    ("points", {}),
    ("highlights", {}),
)
MATERIALS = ("skin1", "marble", "ketchup", "chicken1", "skimmilk")
BUDGETS = (7, 10, 12, 14, 17, 20, 24, 28)
PITCHES_MM = (0.1, 0.15, 0.2, 0.3, 0.4, 0.6)

TEXT = """Mean over a disk of 19.2 mm, edges at 0, 15, 30 and 45 degrees, the head, points and
highlights of the 99th percentile of Delta E 2000 against the exact profile on a grid that holds all
of its light, 256 x 256 pixels of 0.3 mm; the structure is that of skin1:

| fetches at most | structure | fetches | passes | {heads} |
|---|---|---|---|{rules}|
{budgets}

The same pictures by dense kernels of {pixels} pixels a pass, with their weights in place of
fetches (skin1):

| kernel | weights | passes | mean of the 99th percentiles |
|---|---|---|---|
{dense}

Each picture by the cascade of 24 fetches, mean / 95th / 99th percentile (skin1):

| {names} |
|{name_rules}|
| {each} |

The table of 24 fetches for pixels of 0.3 mm, on pixels of other sizes (skin1, mean of the 99th
percentiles):

| mm per pixel | {pitches} |
|---|{pitch_rules}|
| Delta E | {other} |
"""

FULL_FETCHES = 36
FULL = """The same means with nothing halved (the structure is that of skin1):

| fetches at most | structure | fetches | passes | {heads} |
|---|---|---|---|{rules}|
{budget}

Each picture of marble for two profiles: the one with all of its light, and the one that is cut at
{edge_mm:.1f} mm, where the paper's grid ends, and scaled to the same energy. In each row the same
profile is fitted and gives the true picture:

| profile | structure | {names} | mean |
|---|---|{name_rules}|---|
{each}
"""


def whole_profile(name):
    """Return the exact profile on a grid that holds all but .01 % of the light.

    The paper's grid lacks 2 % of marble's red, of which neither the fit nor the truth knows where
    it leaves.
    """
    material = load_material(name)
    return exact_with_all_light(material, paper_grid(material), 150.0)


def cut_profile(name):
    """Return the exact profile on the paper's grid, scaled to all of the light."""
    exact = simulate_exact(load_material(name))
    scale = exact.diffuse_reflectance / exact.total_on_grid
    return replace(
        exact, annulus_energy=scale * exact.annulus_energy, beyond_grid=0.0 * exact.beyond_grid
    )


def scenes(mm_per_pixel, rows=256):
    """Return the eight pictures."""
    pixels = {"height": rows, "width": rows, "mm_per_pixel": mm_per_pixel}
    return [make_scene(name, **pixels, **own) for name, own in PICTURES]


def scores(kernel, profile, mm_per_pixel=0.3):
    """Return the score of each picture."""
    return [
        measure(render(each, kernel), render_reference(each, profile), mask=each.mask)
        for each in scenes(mm_per_pixel)
    ]


def p99(kernel, profile, mm_per_pixel=0.3):
    """Return the mean over the pictures of the 99th percentile of Delta E."""
    return float(np.mean([each.delta_e_2000_p99 for each in scores(kernel, profile, mm_per_pixel)]))


def row(cells):
    """Return a row of a table."""
    return f"| {' | '.join(cells)} |"


def budget_rows(profiles, budgets, **settings):
    """Return a row for each budget."""
    for budget in budgets:
        found = [fit_taps(each, fetches=budget, **settings).kernel for each in profiles.values()]
        first = found[0]
        shown = [p99(*each) for each in zip(found, profiles.values(), strict=True)]
        structure = first.structure.replace("|", "\\|")
        head = [str(budget), structure, f"{first.fetches:.1f}", str(first.passes)]
        yield row([*head, *(f"{each:.2f}" for each in shown)])


def dense_rows(profile):
    """Return a row for each dense kernel."""
    for fitted in (
        fit_preintegrated(profile),
        fit_artist(profile),
        *(fit_svd(profile, rank=rank) for rank in (2, 3, 4, 5)),
        *(fit_weighted(profile, rank=rank) for rank in (1, 2, 3)),
    ):
        kernel = fitted.kernel
        weights, passes = 2 * kernel.rank * kernel.pixels, 2 * kernel.rank
        label = f"{kernel.method} {kernel.rank}" if kernel.rank > 1 else kernel.method
        yield row([label, str(weights), str(passes), f"{p99(kernel, profile):.2f}"])


def print_structures(texts):
    """Print what each structure leaves of the table's two kernels."""
    profiles = [whole_profile(name) for name in ("skin1", "chicken1")]
    for text in texts or STRUCTURES:
        shown = (p99(fit_taps(each, stages=text).kernel, each) for each in profiles)
        print(f'    "{text}": ({", ".join(f"{each:.3g}" for each in shown)}),', flush=True)


def picture_names():
    """Return the names of the eight pictures."""
    return [f"{name} {own.get('angle_degrees', '')}".strip() for name, own in PICTURES]


def full_rows(profiles):
    """Return a row for each profile and structure: what is left of each picture, and the mean."""
    for name, profile in profiles.items():
        for text in ("1-1-2-2", "1-2-1-2"):
            found = scores(fit_taps(profile, stages=text).kernel, profile)
            shown = [each.delta_e_2000_p99 for each in found]
            yield row([name, text, *(f"{each:.2f}" for each in (*shown, np.mean(shown)))])


def put_full_resolution():
    """Write what cascades leave without halvings."""
    profiles = {name: whole_profile(name) for name in MATERIALS}
    cut = cut_profile("marble")
    text = FULL.format(
        heads=" | ".join(MATERIALS),
        rules="---|" * (len(MATERIALS) - 1) + "---",
        budget="\n".join(budget_rows(profiles, [FULL_FETCHES], full_resolution=True)),
        edge_mm=cut.r_edges_mm[-1],
        names=" | ".join(picture_names()),
        name_rules="---|" * (len(PICTURES) - 1) + "---",
        each="\n".join(full_rows({"all light": profiles["marble"], "cut": cut})),
    )
    put_section("cascades.md", "docs/make_cascades.py full", text)


def main():
    """Write the page's figures and the picture."""
    if sys.argv[1:2] == ["structures"]:
        print_structures(sys.argv[2:])
        return
    if sys.argv[1:] == ["full"]:
        put_full_resolution()
        return
    profiles = {name: whole_profile(name) for name in MATERIALS}
    skin1 = profiles["skin1"]
    taps: Taps = fit_taps(skin1, fetches=24).kernel
    each = scores(taps, skin1)
    figures = ("delta_e_2000_mean", "delta_e_2000_p95", "delta_e_2000_p99")
    names = picture_names()
    text = TEXT.format(
        heads=" | ".join(MATERIALS),
        rules="---|" * (len(MATERIALS) - 1) + "---",
        budgets="\n".join(budget_rows(profiles, BUDGETS)),
        pixels=fit_svd(skin1).kernel.pixels,
        dense="\n".join(dense_rows(skin1)),
        names=" | ".join(names),
        name_rules="---|" * (len(names) - 1) + "---",
        each=" | ".join(" / ".join(f"{getattr(s, key):.2f}" for key in figures) for s in each),
        pitches=" | ".join(f"{pitch:g}" for pitch in PITCHES_MM),
        pitch_rules="---|" * (len(PITCHES_MM) - 1) + "---",
        other=" | ".join(f"{p99(taps, skin1, pitch):.2f}" for pitch in PITCHES_MM),
    )
    put_section("cascades.md", "docs/make_cascades.py", text)
    save_figure(figure_of(view_taps(taps, skin1)), DOCS / "skin1-cascade.png")


if __name__ == "__main__":
    main()
