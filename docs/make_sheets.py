"""Draw the pictures of docs/how-to-choose.md: contact sheet, editing sheet and convergence.

python docs/make_sheets.py [sheet] [editing] [convergence]
"""

import sys
from pathlib import Path

from PIL import Image

from sssfit.chart import convergence_figure, editing_figure, save_figure, sheet_figure
from sssfit.compare.convergence import compute_convergence
from sssfit.compare.editing import compute_editing
from sssfit.compare.sheet import compute_sheet
from sssfit.material import load_material
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


PICTURES = {
    "skin1-sheet.png": sheet,
    "editing.png": editing,
    "skin1-convergence.png": convergence,
}


def draw(name):
    """Write a picture with 256 colours: a third of the bytes."""
    path = DOCS / name
    save_figure(PICTURES[name](), path)
    Image.open(path).convert("RGB").quantize(256, dither=0).save(path, optimize=True)


def main():
    """Draw those that are named, or all."""
    for name in PICTURES:
        if not sys.argv[1:] or any(word in name for word in sys.argv[1:]):
            draw(name)


if __name__ == "__main__":
    main()
