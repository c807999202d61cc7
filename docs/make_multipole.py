"""Draw docs/multipole.png: the multipole against the layered walk, at every radius.

    python docs/make_multipole.py              1e7 photons, a minute on two cores
    python docs/make_multipole.py 1e5 FILE     smaller, elsewhere

The cases are those of tests/checks_models.py whose totals are to agree within 5 %.
"""

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))

import checks_models  # noqa: E402

from sssfit.chart.page import COLOURS, RC  # noqa: E402

FULL = 10_000_000
NAMES = {"R_d": "reflected", "T": "transmitted"}


def draw(axes, what, found):
    """One case: relative difference of R and T by radius, the walk's noise as bands."""
    for difference, colour, style in zip(found, COLOURS[::2], ("-", "--"), strict=True):
        name = difference.what.rsplit(": ", 1)[1]
        # The last bin has no outer edge; curves hold each value across its bin.
        r_mm = np.append(difference.r_mm, difference.r_mm[-1] + 0.25)
        apart = 100.0 * np.append(difference.relative_by_radius, difference.relative_by_radius[-1])
        noise = 100.0 * difference.walk_stderr * difference.energy / difference.walk_energy**2
        noise = np.append(noise, noise[-1])
        label = f"{NAMES[name]}: total {100.0 * difference.relative:+.1f} %"
        axes.step(r_mm, apart, where="post", color=colour, linestyle=style, label=label)
        axes.fill_between(
            r_mm, apart - noise, apart + noise, step="post", color=colour, alpha=0.2, linewidth=0
        )
    axes.axhline(0.0, color="black", linewidth=0.6)
    axes.set_title(what, loc="left")
    axes.set_xlim(0.0, 25.0)
    axes.set_ylim(-100.0, 80.0)
    axes.legend(loc="lower right")


def figure(photons, cases):
    """All cases."""
    with mpl.rc_context(RC):
        page = Figure(figsize=(8.0, 5.2), dpi=150, layout="constrained")
        for axes, (what, material) in zip(
            page.subplots(2, 2, sharex=True, sharey=True).flat, cases.items(), strict=False
        ):
            draw(axes, what, checks_models.multipole_against_walk(material, what, photons))
        page.suptitle(
            f"Multipole against the layered walk: {photons:,} photons, bands ±1 standard error",
            x=0.01,
            ha="left",
            weight="bold",
        )
        page.supxlabel("r (mm)", size=8.5)
        page.supylabel("relative difference of energy in annuli (%)", size=8.5)
        return page


def main():
    """Write the figure."""
    photons = int(float(sys.argv[1])) if len(sys.argv) > 1 else FULL
    path = Path(sys.argv[2]) if len(sys.argv) > 2 else ROOT / "docs" / "multipole.png"
    figure(photons, checks_models.DIFFUSE).savefig(path, metadata={"Software": None})


if __name__ == "__main__":
    main()
