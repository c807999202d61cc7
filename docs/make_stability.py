"""Write docs/stability.md's sections: where every method is safe, by eleven stresses.

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
from sssfit.stability.page import chart_name, section

DOCS = Path(__file__).parent


def made(material):
    """Draw the figure of one material, and return its section."""
    found = stability(load_material(material))
    save_figure(figure_of(found), DOCS / chart_name(material))
    return section(found, chart_name(material))


def main():
    """Write the sections, again after each material: the last of eleven ends after an hour."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--paper", action="store_true")
    paper = parser.parse_args().paper
    sections, script = [], "docs/make_stability.py"
    for each in material_names(paper=True) if paper else ["skin1"]:
        sections.append(made(each))
        command = f"python {script}{' --paper' * paper}"
        put_section("stability.md", script, "\n".join(sections), command)


if __name__ == "__main__":
    main()
