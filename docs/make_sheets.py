"""Draw the pictures of docs/how-to-choose.md and write the tables beside them.

python docs/make_sheets.py [sheet] [editing] [pareto] [budget]

A picture and its table come from one computation.
"""

import sys

from edited_skin import compute_editing, editing_figure
from PIL import Image
from sections import DOCS, put_section

from sssfit.chart.budget import budget_figure
from sssfit.chart.page import save_figure
from sssfit.chart.pareto import pareto_figure
from sssfit.chart.sheet import sheet_figure
from sssfit.compare.budget import error_budgets
from sssfit.compare.comparison import verdicts
from sssfit.compare.pareto import compare_kernels
from sssfit.compare.sheet import compute_sheet
from sssfit.material import load_material
from sssfit.scene.made import make_scene
from sssfit.simulate import simulate_exact

PAGE = "how-to-choose.md"


def scenes():
    """Return the pictures of ``sssfit compare``."""
    size = {"height": 512, "width": 512, "mm_per_pixel": 0.3}
    own = {"edge": {"angle_degrees": 30.0}}
    names = ("disk", "edge", "points", "head")
    return [make_scene(name, **size, **own.get(name, {})) for name in names]


def sheet():
    """Draw skin1's contact sheet, and tabulate it."""
    found = compute_sheet(simulate_exact(load_material("skin1")))
    draw("skin1-sheet.png", sheet_figure(found))
    rows = sheet_rows(found)
    write("sheet", SHEET.format(pitch=found.mm_per_pixel, pixels=found.pixels, rows=rows))


def sheet_rows(found):
    """Tabulate mean and 95th percentile of every kernel on every picture."""
    heads = ["kernel", "passes", *found.scenes]
    lines = [heads, ["---"] * len(heads)]
    for row in found.rows[:-1]:
        cells = [
            f"{each.score.delta_e_2000_mean:.2f}, {each.score.delta_e_2000_p95:.2f}"
            for each in row.panels
        ]
        lines.append([row.label, str(row.passes or 0), *cells])
    return table(lines)


def editing():
    """Draw edits of the 2012 model, and tabulate them."""
    found = compute_editing()
    draw("editing.png", editing_figure(found))
    own = found.original_score
    write(
        "editing",
        EDITING.format(
            pitch=found.mm_per_pixel,
            rows=editing_rows(found),
            own=f"{own.delta_e_2000_mean:.2f}, {own.delta_e_2000_p95:.2f}",
        ),
    )


def editing_rows(found):
    """Tabulate mean and percentiles of every edit."""
    lines = [["edit", "mean", "95th percentile", "99th percentile"], ["---"] * 4]
    for each in found.edits[1:]:
        score = each.panel.score
        figures = (score.delta_e_2000_mean, score.delta_e_2000_p95, score.delta_e_2000_p99)
        lines.append([each.label, *(f"{value:.2f}" for value in figures)])
    return table(lines)


def pareto():
    """Draw skin1's kernels by error and fetches, and write the fronts."""
    profile = simulate_exact(load_material("skin1"))
    found = compare_kernels(profile, scenes())
    draw("skin1-pareto.png", pareto_figure(found))
    rows = front_rows(found)
    write("pareto", PARETO.format(pixels=found.pixels, pitch=found.mm_per_pixel, rows=rows))


def front_rows(found):
    """Tabulate the front of every picture, and of all together."""
    lines = [["picture", "kernels that no other beats: mean Delta E (fetches)"], ["---"] * 2]
    for picture in found.pictures:
        front = found.front(picture.name, "delta-e", "fetches")
        words = (f"{row.label} {row.delta_e_2000_mean:.3f} ({row.fetches:.4g})" for row in front)
        lines.append([picture.name, ", ".join(words)])
    together = (
        f"{each.label} {each.typical_error:.3f} ({each.cost:.4g})"
        for each in verdicts(found, "delta-e", "fetches")
    )
    lines.append(["all, geometric mean", ", ".join(together)])
    return table(lines)


def budget():
    """Draw why a kernel of wholemilk is off."""
    draw("wholemilk-budget.png", budget_figure(error_budgets(load_material("wholemilk"), scenes())))


def table(lines):
    """Return rows of cells as Markdown."""
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def draw(name, figure):
    """Write a picture in all its colours: 256 of them would show as bands on skin."""
    path = DOCS / name
    save_figure(figure, path)
    with Image.open(path) as whole:
        opaque = whole.convert("RGB")
    opaque.save(path, optimize=True)


def write(word, text):
    """Put a section in its place."""
    put_section(PAGE, f"docs/make_sheets.py {word}", text, f"python docs/make_sheets.py {word}")


WORK = {
    "sheet": sheet,
    "editing": editing,
    "pareto": pareto,
    "budget": budget,
}

SHEET = """`sssfit compare skin1 --what sheet --chart skin1-sheet.png` draws the rows of figure S.3
(Jimenez et al. 2015, supplement), preceded by the input times the albedo, which is the picture
without blur. The edge is upright, as in that figure, a case in which the pre-integrated kernel is
exact. skin1, {pixels} x {pixels} pixels of {pitch:g} mm, mean and 95th percentile of Delta E:

{rows}"""

EDITING = """`python docs/make_sheets.py editing` draws the edits of figure 6 of RR-02-12 on
the six-Gaussian skin, with pixels of {pitch:g} mm ([fits.md](fits.md) says why). Delta E to the
original:

{rows}

The original compared with the 2D kernel of the six Gaussians, mean and 95th percentile: {own}."""

PARETO = """`sssfit compare skin1 --chart skin1-pareto.png` fits cascades and every method, rank and
number of Gaussians, dense and on taps, and plots their error against fetches a pixel. The line is
the Pareto front; kernels that another one beats are faint, dense ones small. skin1 at {pitch:g} mm
({pixels} pixels a pass, pictures of 512 x 512 pixels):

{rows}"""


def main():
    """Do what is named, or all."""
    for name in sys.argv[1:] or WORK:
        WORK[name]()


if __name__ == "__main__":
    main()
