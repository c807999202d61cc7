"""Write sections of docs/stability.md: where every method is safe, by eleven stresses.

python docs/make_stability.py skin1 apple    a section and a figure of each; 4 to 20 minutes
python docs/make_stability.py --paper        the supplement's eleven materials, two hours
python docs/make_stability.py --again skin1  the same from the figures that are kept, in seconds

The figures of every material are kept in docs/stability/NAME.json, which `--again` reads: a change
of the chart or of the table needs no fit.
"""

import argparse
import json
from pathlib import Path

from PIL import Image
from sections import put_section

from sssfit.chart import figure_of
from sssfit.chart.page import save_figure
from sssfit.material import load_material, material_names
from sssfit.stability import Stability, stability
from sssfit.stability.page import chart_name, section

DOCS, SCRIPT = Path(__file__).parent, "docs/make_stability.py"


def in_few_colours(path):
    """Store a figure in 64 colours: .4 MB in place of 1.6, and there are eleven.

    An octree keeps the lines' colours to 2 codes of 255; a median cut gave orange vermillion's.
    """
    with Image.open(path) as whole:
        small = whole.convert("RGB").quantize(
            64, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE
        )
    small.save(path, optimize=True)


def kept(material):
    """Return where the figures of a material lie."""
    return DOCS / "stability" / f"{material}.json"


def computed(material):
    """Stress a material, and keep what was found."""
    found = stability(load_material(material))
    kept(material).parent.mkdir(exist_ok=True)
    told = json.dumps(found.to_dict(), allow_nan=False, separators=(",", ":"))
    kept(material).write_text(f"{told}\n", encoding="utf-8")
    return found


def make(material, *, again):
    """Draw the figure of one material, and write its section."""
    if again:
        found = Stability.from_dict(json.loads(kept(material).read_text(encoding="utf-8")))
    else:
        found = computed(material)
    save_figure(figure_of(found), DOCS / chart_name(material))
    in_few_colours(DOCS / chart_name(material))
    script = f"{SCRIPT} {material}"
    put_section("stability.md", script, section(found, chart_name(material)), f"python {script}")


def main():
    """Write the sections of the materials that are named."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("materials", nargs="*", default=["skin1"])
    parser.add_argument("--paper", action="store_true")
    parser.add_argument("--again", action="store_true")
    given = parser.parse_args()
    materials = material_names(paper=True) if given.paper else given.materials
    missing = [each for each in materials if given.again and not kept(each).exists()]
    if missing:
        parser.error(f"no figures are kept of {', '.join(missing)}: run it once without --again.")
    for each in materials:
        make(each, again=given.again)


if __name__ == "__main__":
    main()
