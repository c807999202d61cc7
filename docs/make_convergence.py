"""Draw what accuracy costs a simulation: error of F(r) over photons and seconds; print the runs.

python docs/make_convergence.py [MATERIAL [PHOTONS [FILE]]]

By default skin1, walks of up to 1e7 photons, and docs/skin1-convergence.png.
"""

import sys
from pathlib import Path

from sections import DOCS
from walk_convergence import convergence_figure

from sssfit.chart.files import chart_format
from sssfit.chart.page import save_figure
from sssfit.compare.convergence import compute_convergence, photon_numbers
from sssfit.errors import SssfitError
from sssfit.material import load_material
from sssfit.messages import number, table


def convergence(name="skin1", photons="1e7", path=None):
    """Walk, solve, draw, and return the record."""
    path = DOCS / f"{name}-convergence.png" if path is None else Path(path)
    chart_format(path)  # before anything is walked
    numbers = photon_numbers(round(float(photons)))
    found = compute_convergence(load_material(name), photons=numbers)
    save_figure(convergence_figure(found), path)
    return found


def text_of(found):
    """Write slope and runs, a line a run."""
    told = found.to_dict()
    rows = [
        [f"{row['photons']:,} photons", f"{row['seconds']:.3f}", f"{row['error']:.2g}", "-"]
        for row in told["rows"]
    ]
    rows += [
        [
            f"exact, tolerance {row['tolerance']:g}",
            f"{row['seconds']:.3f}",
            number(row["error"], ".2g"),
            f"{row['estimate']:.2g}",
        ]
        for row in told["exact"]
    ]
    return (
        f"{told['material']}: error of F(r) as a share of the total; slope "
        f"{told['slope']:.3f} +- {told['slope_stderr']:.3f}, theory -0.5\n"
        f"{table(['run', 'seconds', 'error', 'own estimate'], rows)}"
    )


def main():
    """Do what is asked; an error is one line."""
    try:
        print(text_of(convergence(*sys.argv[1:])))
    except SssfitError as error:
        sys.exit(f"Error: {error}")


if __name__ == "__main__":
    main()
