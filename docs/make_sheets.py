"""Draw the pictures of docs/how-to-choose.md.

python docs/make_sheets.py [sheet] [editing] [convergence] [pareto] [budget]
"""

import sys
from pathlib import Path

from PIL import Image

from sssfit.chart import (
    budget_figure,
    convergence_figure,
    editing_figure,
    pareto_figure,
    save_figure,
    sheet_figure,
)
from sssfit.compare.budget import error_budgets
from sssfit.compare.convergence import compute_convergence
from sssfit.compare.editing import compute_editing
from sssfit.compare.pareto import compare_kernels
from sssfit.compare.sheet import compute_sheet
from sssfit.material import load_material
from sssfit.render.irradiance import make_scene
from sssfit.simulate import simulate_exact

DOCS = Path(__file__).parent


def sheet():
    """skin1's contact sheet."""
    return sheet_figure(compute_sheet(simulate_exact(load_material("skin1"))))


def editing():
    """Edits of the 2012 model."""
    return editing_figure(compute_editing())


def convergence():
    """skin1's error over photons and seconds."""
    return convergence_figure(compute_convergence(load_material("skin1")))


def scenes():
    """Return the pictures of ``sssfit compare``."""
    size = {"height": 512, "width": 512, "mm_per_pixel": 0.3}
    return [make_scene(name, **size) for name in ("disk", "edge", "head")]


def pareto():
    """skin1's kernels by error and weights."""
    profile = simulate_exact(load_material("skin1"))
    return pareto_figure(compare_kernels(profile, scenes(), mm_per_pixel=0.3))


def budget():
    """Why a kernel of wholemilk is off."""
    return budget_figure(error_budgets(load_material("wholemilk"), scenes()))


PICTURES = {
    "skin1-sheet.png": sheet,
    "editing.png": editing,
    "skin1-convergence.png": convergence,
    "skin1-pareto.png": pareto,
    "wholemilk-budget.png": budget,
}


def draw(name):
    """Write a picture; the contact sheet with 256 colours, a third of its 3 MB."""
    path = DOCS / name
    save_figure(PICTURES[name](), path)
    if name == "skin1-sheet.png":
        Image.open(path).convert("RGB").quantize(256, dither=0).save(path, optimize=True)


def main():
    """Draw those that are named, or all."""
    for name in PICTURES:
        if not sys.argv[1:] or any(word in name for word in sys.argv[1:]):
            draw(name)


if __name__ == "__main__":
    main()
