"""Write docs/stability.md: where every method is safe, by eleven stresses.

python docs/make_stability.py            skin1, some minutes
python docs/make_stability.py --paper    the supplement's eleven materials, an hour
"""

import argparse
from pathlib import Path

from sections import put_section

from sssfit.chart import figure_of
from sssfit.chart.page import save_figure
from sssfit.material import load_material, material_names
from sssfit.stability import stability

DOCS = Path(__file__).parent

TEXT = """## {material}

Pixels of {pitch:g} mm, exact profile, seed {seed}. A place is followed by its uncertainty.

{table}

![Where fits of {material} are safe]({material}-stability.png)
"""


def section(material, *, is_whole):
    """Return the table of one material, and draw its figure."""
    found = stability(load_material(material), is_whole=is_whole)
    save_figure(figure_of(found), DOCS / f"{material}-stability.png")
    table = found.table().partition("\n\n")[2].strip()
    notes = "\n".join(found.notes)
    text = TEXT.format(material=material, pitch=found.mm_per_pixel, seed=found.seed, table=table)
    return text + f"\n{notes}\n" * bool(notes)


def main():
    """Write the sections."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--paper", action="store_true")
    paper = parser.parse_args().paper
    names = material_names(paper=True) if paper else ["skin1"]
    text = "\n".join(section(each, is_whole=paper) for each in names)
    put_section("stability.md", "docs/make_stability.py", text)


if __name__ == "__main__":
    main()
