"""Write the sections of docs/how-to-choose.md on choices by distance and on causes of error.

python docs/make_choices.py
"""

from sections import put_section

from sssfit.choose.choice import choose, mm_per_pixel_at
from sssfit.compare.budget import error_budget
from sssfit.errors import RenderError
from sssfit.material import load_material
from sssfit.scene.made import make_scene

DISTANCES_M = (0.3, 0.6, 1.5, 5.0, 20.0)
# What is asked for, with the head of its column.
ASKED = {
    "p95 ≤ 1": {"tolerance": 1.0},
    "p95 ≤ 0.3": {"tolerance": 0.3},
    "mean ≤ 1": {"tolerance": 1.0, "tolerance_of": "mean"},
    "p95 ≤ 1, at most 4 passes": {"tolerance": 1.0, "passes": 4},
}
MATERIALS = ("skin1", "marble", "ketchup")
BUDGETS = ("skin1", "wholemilk", "ketchup")

TEXT = """## No more than the scene needs

`sssfit choose skin1 --distance 0.6m --fov 30 --resolution 1920x1080` finds the table of taps with
the fewest fetches for which 95 % of the head's pixels stay within a Delta E of 1. Its choices at 30
degrees and 1080 rows, with fetches a pixel and the 95th percentile of Delta E (p95); the last
columns are what `--tolerance-of mean` and `--passes 4` would choose:

{choices}

Distance hardly matters for what a cascade costs, since fetches grow with the logarithm of the
kernel's width: 11 to 16 are enough from 0.3 m on, and beyond some metres fewer, or none. `choose`
also prints what the next cheaper and the next dearer table would give, and how few photons would
have been enough.

## Where the error comes from

`sssfit compare wholemilk --what budget` splits a kernel's error by cause (here 1e6 photons, the
paper's grid, `svd --rank 3`, half floats; head of 512 x 512 pixels of 0.3 mm). Mean Delta E,
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
        for asked in ASKED.values():
            view = {"mm_per_pixel": pitch, "distance_mm": 1000.0 * metres}
            cells.append(words(material, view, asked))
        yield f"| {name}, {metres:g} m | {pitch:.2f} | {' | '.join(cells)} |"


def words(material, view, asked):
    """Write a choice into a table's cell."""
    try:
        found = choose(material, **view, **asked)
    except RenderError:
        return "none"
    step = found.chosen
    if found.fit is None:
        return "no blur"
    structure = step.label.replace("cascade ", "").replace("|", "\\|")
    return f"{structure}: {step.fetches:.1f}, {step.error:.2f}"


def choices():
    """All choices as a table."""
    rows = [f"| | mm per pixel | {' | '.join(ASKED)} |", f"|---|---|{'---|' * len(ASKED)}"]
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
    return f"{cause.score.delta_e_2000_mean:.3f}, {100.0 * cause.score.relative_l2:.3f}"


def main():
    """Put the section in its place."""
    text = TEXT.format(choices=choices(), budgets=budgets())
    put_section("how-to-choose.md", "docs/make_choices.py", text)


if __name__ == "__main__":
    main()
