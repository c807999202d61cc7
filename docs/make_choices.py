"""Write the sections of docs/how-to-choose.md on choices by distance and on causes of error.

python docs/make_choices.py
"""

from sections import put_section

from sssfit.choose.choice import choose, mm_per_pixel_at
from sssfit.compare.budget import error_budget
from sssfit.material import load_material
from sssfit.scene.made import make_scene

DISTANCES_M = (0.3, 0.6, 1.5, 5.0, 20.0)
TOLERANCES = (("p95", 1.0), ("p95", 0.3), ("mean", 1.0))
MATERIALS = ("skin1", "marble", "ketchup")
BUDGETS = ("skin1", "wholemilk", "ketchup")

TEXT = """## No more than the scene needs

`sssfit choose skin1 --distance 0.6m --fov 30 --resolution 1920x1080 --tolerance 1.0` finds the
kernel (method, rank and support) with the fewest weights for which 95 % of the head's pixels stay
within the tolerance. Its choices at 30 degrees and 1080 rows, with weights per pixel and the 95th
percentile of Delta E; the last column is what `--tolerance-of mean` would choose, with the share
of pixels above 1:

{choices}

The cost depends on what the pixels show. Beyond a few metres a few weights are enough, or none;
close up, single scattering needs rank. `choose` also prints what the next cheaper and the next
more expensive step would give, and how few photons would have been enough.

## Where the error comes from

`sssfit compare wholemilk --what budget` splits a kernel's error by cause (here 1e6 photons, the
paper's grid, `svd --rank 3`, half floats; head of 512 x 512 pixels of .3 mm). Mean Delta E,
relative L2 in percent; causes in brackets are not part of this kernel:

{budgets}

![Error budget of wholemilk on disk, edge, points and head](wholemilk-budget.png)

Act on the causes in this order. For skin1 and ketchup the only one that matters is rank: 1e6
photons and half floats do not show. For wholemilk it is the grid, from which 2.7 % of red is
missing: give `sssfit simulate` a larger `--radius`. For skin1 and ketchup, 8-bit weights or any
diffusion model cost more than stopping at three terms; for wholemilk, which scatters most,
Grosjean's dipole costs next to nothing.
"""


def choice_rows(name):
    """Yield a line for each distance: what is chosen at each tolerance."""
    material = load_material(name)
    for metres in DISTANCES_M:
        pitch = mm_per_pixel_at(1000.0 * metres, 30.0, 1080)
        cells = []
        for of, tolerance in TOLERANCES:
            found = choose(
                material,
                mm_per_pixel=pitch,
                distance_mm=1000.0 * metres,
                tolerance=tolerance,
                tolerance_of=of,
            )
            cells.append(words(found))
        yield f"| {name}, {metres:g} m | {pitch:.2f} | {' | '.join(cells)} |"


def words(found):
    """Write a choice into a table's cell."""
    step = found.chosen
    if found.fit is None:
        above = "" if step is None else f", {100.0 * step.share_above_1:.0f} % above 1"
        return f"no blur{above if found.tolerance_of == 'mean' else ''}"
    pixels = found.fit.kernel.pixels
    loss = f"{step.error:.2f}"
    if found.tolerance_of == "mean":
        loss = f"{100.0 * step.share_above_1:.0f} % above 1"
    return f"{step.label}, {pixels} px: {step.taps_per_pixel}, {loss}"


def choices():
    """All choices as a table."""
    heads = " | ".join(f"{'mean ' * (of == 'mean')}within {each:g}" for of, each in TOLERANCES)
    rows = [f"| | mm per pixel | {heads} |", f"|---|---|{'---|' * len(TOLERANCES)}"]
    return "\n".join([*rows, *(row for name in MATERIALS for row in choice_rows(name))])


def budgets():
    """Causes by material as a table."""
    scene = make_scene("head", height=512, width=512, mm_per_pixel=0.3)
    found = [error_budget(load_material(name), scene) for name in BUDGETS]
    cells = {}
    for budget in found:
        for cause in (*budget.causes, budget.interaction, budget.whole):
            name = cause.name if cause.is_in_whole else f"({cause.name})"
            cells.setdefault(name, []).append(figures(cause))
    rows = [f"| | {' | '.join(BUDGETS)} |", f"|---|{'---|' * len(BUDGETS)}"]
    return "\n".join([*rows, *(f"| {name} | {' | '.join(row)} |" for name, row in cells.items())])


def figures(cause):
    """Write Delta E and relative L2 of a cause."""
    if cause.score is None:
        return "not made yet"
    return f"{cause.score.delta_e_2000_mean:.3f}, {100.0 * cause.score.relative_l2:.3f}"


def main():
    """Put the section in its place."""
    text = TEXT.format(choices=choices(), budgets=budgets())
    put_section("how-to-choose.md", "docs/make_choices.py", text)


if __name__ == "__main__":
    main()
